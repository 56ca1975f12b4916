//! Poses that bring one piece onto another, proposed by pairs of oriented points with similar features.
//!
//! Drost, Ulrich, Navab, Ilic: Model globally, match locally (CVPR 2010).

use super::RecurrenceSettings;
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::random::Generator;
use nalgebra::{Matrix3, Vector3};

/// Sine of the angle between the line from point to point and the first normal, below which the frame of a pair is not
/// determined: here the error of normals in single precision turns it by 1e-4 radians.
const MIN_SINE: f64 = 1e-3;

/// A point and its unit normal.
type OrientedPoint = ([f64; 3], [f64; 3]);

/// All ordered pairs of some oriented points that are not too near each other, with a search tree of their features.
#[derive(Debug, Clone)]
pub(super) struct PointPairs {
    points: Vec<OrientedPoint>,
    /// The numbers of both points of each pair.
    pairs: Vec<[u32; 2]>,
    features: Vec<[f64; 4]>,
    tree: KdTree<4>,
}

impl PointPairs {
    /// Pairs points, some hundred; `unit` is the distance that counts as much as a radian.
    pub fn new(points: Vec<OrientedPoint>, unit: f64, settings: &RecurrenceSettings) -> Self {
        let shortest = settings.min_pair_distance * unit;
        let (mut pairs, mut features) = (Vec::new(), Vec::new());
        for (i, first) in (0..).zip(&points) {
            for (k, second) in (0..).zip(&points) {
                let line = Vector3::from(second.0) - Vector3::from(first.0);
                let distance = line.norm();
                if i != k && distance > 0.0 && distance >= shortest {
                    pairs.push([i, k]);
                    features.push(pair_features(first, second, unit));
                }
            }
        }
        let tree = KdTree::new(&features);
        Self { points, pairs, features, tree }
    }

    /// Those of the mirror image, x to -x: their features are the same.
    pub fn mirrored(&self) -> Self {
        let mirror = |[x, y, z]: [f64; 3]| [-x, y, z];
        let points = self.points.iter().map(|&(point, normal)| (mirror(point), mirror(normal))).collect();
        Self { points, ..self.clone() }
    }

    fn frame(&self, pair: usize) -> RigidTransform {
        let [first, second] = self.pairs[pair].map(|number| &self.points[number as usize]);
        pair_frame(first, second)
    }

    /// Of the angle between the first normal and the line.
    fn sine(&self, pair: usize) -> f64 {
        self.features[pair][1].sin()
    }
}

/// The features of a pair: its distance over `unit`, the angles of both normals to the line between the points, and the
/// angle between the normals (eq. (1) of Drost et al.).
fn pair_features(first: &OrientedPoint, second: &OrientedPoint, unit: f64) -> [f64; 4] {
    let line = Vector3::from(second.0) - Vector3::from(first.0);
    let distance = line.norm();
    let [line, one, other] = [line / distance, first.1.into(), second.1.into()];
    let angle = |a: &Vector3<f64>, b: &Vector3<f64>| a.dot(b).clamp(-1.0, 1.0).acos();
    [distance / unit, angle(&one, &line), angle(&other, &line), angle(&one, &other)]
}

/// The pair's own frame, T_piece_pair: z along the first normal, x towards the second point, which is not on the line
/// of the normal; the origin is the first point.
fn pair_frame(first: &OrientedPoint, second: &OrientedPoint) -> RigidTransform {
    let (origin, z) = (Vector3::from(first.0), Vector3::from(first.1).normalize());
    let line = Vector3::from(second.0) - origin;
    let x = (line - z * line.dot(&z)).normalize();
    RigidTransform { rotation: Matrix3::from_columns(&[x, z.cross(&x), z]), translation: origin }
}

/// Proposes poses T_target_source by pairs that are chosen at random.
pub(super) fn proposed_poses(
    source: &PointPairs,
    target: &PointPairs,
    settings: &RecurrenceSettings,
    random: &mut Generator,
) -> Vec<RigidTransform> {
    let mut chosen: Vec<usize> = (0..source.pairs.len()).collect();
    let most = settings.proposals.div_ceil(settings.poses_per_pair.max(1));
    let chosen = random.shuffled(&mut chosen, most);
    let (mut poses, mut found) = (Vec::new(), Vec::new());
    for &ours in chosen.iter() {
        let (features, reach) = (source.features[ours], settings.feature_tolerance);
        target.tree.nearest_k_within(features, settings.similar_pairs, reach, &mut found);
        for &mut (_, theirs) in random.shuffled(&mut found, settings.poses_per_pair) {
            let theirs = theirs as usize;
            if source.sine(ours).min(target.sine(theirs)) > MIN_SINE {
                poses.push(target.frame(theirs) * source.frame(ours).inverse());
            }
        }
    }
    poses
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    fn vector(number: usize, stream: u64) -> Vector3<f64> {
        Vector3::from([0, 1, 2].map(|k| 2.0 * uniform(3 * number + k, stream) - 1.0))
    }

    fn random_points(count: usize) -> Vec<OrientedPoint> {
        (0..count).map(|i| (vector(i, 1).into(), vector(i, 2).normalize().into())).collect()
    }

    fn moved(points: &[OrientedPoint], transform: &RigidTransform) -> Vec<OrientedPoint> {
        points.iter().map(|(p, n)| (transform.transform_point(*p), transform.transform_vector(*n))).collect()
    }

    #[test]
    fn features_are_distance_and_angles() {
        // Two units along x; the first normal is 60 degrees from the line, the second square to it, in another plane.
        let (sine, cosine) = std::f64::consts::FRAC_PI_3.sin_cos();
        let (first, second) = (([1.0, 0.0, 0.0], [cosine, sine, 0.0]), ([3.0, 0.0, 0.0], [0.0, 0.0, -1.0]));
        let found = pair_features(&first, &second, 0.5);
        let expected = [4.0, 60_f64.to_radians(), 90_f64.to_radians(), 90_f64.to_radians()];
        assert!(found.iter().zip(expected).all(|(a, b)| (a - b).abs() < 1e-12), "{found:?}");
    }

    #[test]
    fn features_do_not_change_with_a_motion_and_frames_move_with_it() {
        let transform = RigidTransform::from_rotation_vector([0.4, -1.1, 2.0], [3.0, -2.0, 7.0]);
        let points = random_points(30);
        let others = moved(&points, &transform);
        for i in 1..points.len() {
            let [a, b] = [&points, &others].map(|points| pair_features(&points[0], &points[i], 0.3));
            assert!(a.iter().zip(b).all(|(a, b)| (a - b).abs() < 1e-9), "{i}: {a:?} {b:?}");
            let expected = transform * pair_frame(&points[0], &points[i]);
            let off = (expected.inverse() * pair_frame(&others[0], &others[i])).log();
            assert!(off.iter().all(|component| component.abs() < 1e-9), "{i}: {off:?}");
        }
    }

    #[test]
    fn a_frame_has_the_normal_along_z_and_the_second_point_in_its_xz_half_plane() {
        let points = random_points(40);
        for pair in points.windows(2) {
            let frame = pair_frame(&pair[0], &pair[1]);
            let second = frame.inverse().transform_point(pair[1].0);
            assert!(second[0] > 0.0 && second[1].abs() < 1e-12);
            let normal = frame.inverse().transform_vector(pair[0].1);
            assert!((normal[2] - 1.0).abs() < 1e-12);
            assert_eq!(frame.translation, Vector3::from(pair[0].0));
            assert!((frame.rotation.determinant() - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn pairs_are_all_ordered_ones_that_are_not_too_near() {
        let points = random_points(25);
        let settings = RecurrenceSettings::default();
        let found = PointPairs::new(points.clone(), 0.3, &settings);
        let slow = (0..25_u32).flat_map(|i| (0..25_u32).map(move |k| [i, k])).filter(|[i, k]| {
            let gap = Vector3::from(points[*i as usize].0) - Vector3::from(points[*k as usize].0);
            gap.norm() >= 0.6
        });
        assert_eq!(found.pairs, slow.collect::<Vec<_>>());
        assert!(PointPairs::new(vec![([1.0; 3], [0.0, 0.0, 1.0]); 3], 0.0, &settings).pairs.is_empty());
    }

    #[test]
    fn the_true_pose_is_among_those_proposed() {
        let truth = RigidTransform::from_rotation_vector([0.4, -1.1, 2.0], [3.0, -2.0, 7.0]);
        let settings = RecurrenceSettings { proposals: 200, similar_pairs: 1, ..Default::default() };
        let points = random_points(40);
        let [source, target] =
            [points.clone(), moved(&points, &truth)].map(|points| PointPairs::new(points, 0.1, &settings));
        let poses = proposed_poses(&source, &target, &settings, &mut Generator::new(&[1]));
        assert_eq!(poses.len(), 50);
        let is_right =
            |pose: &RigidTransform| (truth.inverse() * *pose).log().iter().all(|part| part.abs() < 1e-6);
        assert!(poses.iter().all(is_right));
        let nothing = PointPairs::new(Vec::new(), 0.1, &settings);
        for (one, other) in [(&nothing, &target), (&source, &nothing)] {
            assert!(proposed_poses(one, other, &settings, &mut Generator::new(&[1])).is_empty());
        }
    }

    #[test]
    fn pairs_along_a_normal_propose_no_pose() {
        // Of two parallel plates, points above each other leave the rotation about the normal open.
        let plate =
            |z: f64, up: f64| (0..16).map(move |i| ([f64::from(i % 4), f64::from(i / 4), z], [0.0, 0.0, up]));
        let points: Vec<OrientedPoint> = plate(0.0, -1.0).chain(plate(3.0, 1.0)).collect();
        let settings = RecurrenceSettings { proposals: 4000, ..Default::default() };
        let pairs = PointPairs::new(points, 1.0, &settings);
        let poses = proposed_poses(&pairs, &pairs, &settings, &mut Generator::new(&[1]));
        assert!(poses.len() > 100);
        for pose in poses {
            let deviation = (pose.rotation.transpose() * pose.rotation - Matrix3::identity()).amax();
            assert!(deviation < 1e-12, "{deviation}");
        }
    }
}
