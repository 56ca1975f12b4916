//! Least squares over the points that two pieces have in common, there and back.

use super::agreement::PiecePair;
use crate::alignment::LinearisedDistances;
use crate::depth_image::SurfacePlace;
use crate::geometry::RigidTransform;
use nalgebra::Vector3;

/// Correspondences without which a pose stays as it is: as many as unknowns.
const MIN_CORRESPONDENCES: usize = 6;

/// A point, a unit normal, and the point's distance along it; see [`LinearisedDistances`].
pub(super) type Row = (Vector3<f64>, Vector3<f64>, f64);

impl PiecePair<'_> {
    /// A pose after some steps of point to plane, by the first points of each piece on the surface of the other.
    ///
    /// Correspondences are those of the depth images. Where they leave a motion unobservable (along a cylinder, in a
    /// plane), it is not made.
    pub fn fitted(&self, pose: &RigidTransform, points: usize) -> RigidTransform {
        let mut pose = *pose;
        for _ in 0..self.settings.fit_steps {
            let rows = self.residuals(&pose, points);
            if rows.len() < MIN_CORRESPONDENCES {
                break;
            }
            let (step, _) = LinearisedDistances::new(&rows).step(self.settings.unobservable_share);
            pose = step * pose;
        }
        pose
    }

    /// Of points of both pieces, the distances to the surface of the other, in the target's axes.
    pub fn residuals(&self, pose: &RigidTransform, points: usize) -> Vec<Row> {
        let (source, target) = (self.source, self.target);
        let ours = &source.points[..points.min(source.points.len())];
        let theirs = &target.points[..points.min(target.points.len())];
        let on_target = target.image.correspondences(pose, ours, target.tolerance);
        let on_source = source.image.correspondences(&pose.inverse(), theirs, source.tolerance);
        let forth =
            ours.iter().zip(on_target).filter_map(|(point, at)| Some(source_residual(pose, point, &at?)));
        let back =
            theirs.iter().zip(on_source).filter_map(|(point, at)| Some(target_residual(pose, point, &at?)));
        forth.chain(back).collect()
    }
}

/// The distance of a point of the source, which the pose moves, from the target's surface, which stays.
fn source_residual(pose: &RigidTransform, point: &SurfacePlace, surface: &SurfacePlace) -> Row {
    let point = pose.rotation * vector(point.place) + pose.translation;
    let normal = vector(surface.normal);
    (point, normal, normal.dot(&(point - vector(surface.place))))
}

/// The distance of the source's surface, which the pose moves with its normal, from a point of the target, which stays.
///
/// Its derivative by the rotation is that of a distance at the point: the rotation of the normal adds the rest.
fn target_residual(pose: &RigidTransform, point: &SurfacePlace, surface: &SurfacePlace) -> Row {
    let normal = pose.rotation * vector(surface.normal);
    let foot = pose.rotation * vector(surface.place) + pose.translation;
    let point = vector(point.place);
    (point, normal, normal.dot(&(foot - point)))
}

fn vector(v: [f32; 3]) -> Vector3<f64> {
    Vector3::from(v.map(f64::from))
}

#[cfg(test)]
mod tests {
    use super::super::RecurrenceSettings;
    use super::super::tests::{FLAT, SHEET, apart, sheet};
    use super::*;

    #[test]
    fn residuals_change_with_a_twist_as_they_are_linearised() {
        let pose = RigidTransform::from_rotation_vector([0.4, -1.1, 2.0], [0.3, -0.2, 0.7]);
        let normal = |v: [f32; 3]| <[f32; 3]>::from(Vector3::from(v).normalize());
        let point = SurfacePlace { place: [0.5, -0.25, 1.0], normal: normal([1.0, 2.0, -1.0]) };
        let surface = SurfacePlace { place: [0.75, 0.5, -0.5], normal: normal([-2.0, 0.5, 1.0]) };
        for residual in [source_residual, target_residual] {
            let (at, along, _) = residual(&pose, &point, &surface);
            let rotational = at.cross(&along);
            let expected = [rotational.x, rotational.y, rotational.z, along.x, along.y, along.z];
            for (component, expected) in expected.into_iter().enumerate() {
                let step = 1e-5;
                let changed = |sign: f64| {
                    let mut twist = [0.0; 6];
                    twist[component] = sign * step;
                    residual(&(RigidTransform::exp(twist) * pose), &point, &surface).2
                };
                let difference = (changed(1.0) - changed(-1.0)) / (2.0 * step);
                assert!((difference - expected).abs() < 1e-9, "{component}: {difference} {expected}");
            }
        }
    }

    #[test]
    fn a_fit_brings_a_pose_to_the_truth_and_slides_no_plane() {
        let settings = RecurrenceSettings::default();
        let identity = RigidTransform::identity();
        let near = RigidTransform::from_rotation_vector([0.01, -0.015, 0.01], [0.4, -0.3, 0.3]);
        let bent = sheet(SHEET, &identity);
        let pair = PiecePair { source: &bent, target: &bent, settings: &settings };
        let [angle, distance] = apart(&pair.fitted(&near, usize::MAX), &identity);
        // Points have no correspondence between those of the target: planes there are off by its curvature.
        assert!(angle < 5e-3 && distance < 0.15, "{angle} {distance}");

        let flat = sheet(FLAT, &identity);
        let pair = PiecePair { source: &flat, target: &flat, settings: &settings };
        let slid = RigidTransform::from_rotation_vector([0.0, 0.0, 0.02], [0.4, -0.3, 0.3]);
        let wanted = RigidTransform::from_rotation_vector([0.0, 0.0, 0.02], [0.4, -0.3, 0.0]);
        let [angle, distance] = apart(&pair.fitted(&slid, usize::MAX), &wanted);
        assert!(angle < 1e-6 && distance < 1e-5, "{angle} {distance}");

        let far = RigidTransform::from_rotation_vector([0.0; 3], [500.0, 0.0, 0.0]);
        assert_eq!(pair.fitted(&far, usize::MAX), far);
    }
}
