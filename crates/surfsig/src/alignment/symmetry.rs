//! Rotations that a surface may look the same after: of right angles, of thirds, fifths and sixths about its axes.

use super::faces::axes_of_faces;
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::random::some_of;
use crate::statistics::quantile;
use nalgebra::{Matrix3, Rotation3, Unit, Vector3};

/// Rotations about an axis: into two, three, four, five and six equal parts.
const PARTS: [usize; 5] = [2, 3, 4, 5, 6];
/// Share of the points beyond a bound of the surface, on either side: outliers do not shift its middle.
const BEYOND: f64 = 0.01;
/// Radians within which two rotations are the same.
const SAME: f64 = 0.05;
/// Points of the source that tell whether a rotation leads onto the target at all.
const TRIED_POINTS: usize = 150;
/// Distance to the target, in radii of a patch, within which a point lies on it before a rotation is fitted.
const NEAR: f64 = 0.4;
/// Share of such points, over that of the best transform, without which a rotation is not fitted.
const LEAST_SHARE: f64 = 0.7;
/// Rotations that are fitted at most; a box has 3, a cube 23.
const MOST: usize = 24;

/// Motions of a source that lies on a target (`moved`) after which it may lie on it as well, those first after which
/// most of it is near the target; `normals` are those of the target where the source meets it.
///
/// Axes are those of the largest three faces at right angles, as rooms and boxes have; each rotation takes the middle of
/// the source to that of the target, and is tried about that of the target, too, as the source may be a part.
pub(crate) fn symmetries(
    target: &[[f64; 3]],
    normals: &[[f64; 3]],
    moved: &[[f64; 3]],
    radius: f64,
) -> Vec<RigidTransform> {
    partial_symmetries(target, normals, moved, radius, LEAST_SHARE)
}

/// The same of a surface of which a part may not have been seen, so that a motion brings less of the source near it:
/// `least_share` of what is near without, at least.
pub(crate) fn partial_symmetries(
    target: &[[f64; 3]],
    normals: &[[f64; 3]],
    moved: &[[f64; 3]],
    radius: f64,
    least_share: f64,
) -> Vec<RigidTransform> {
    let Some(axes) = axes_of_faces(normals) else { return Vec::new() };
    let [from, to] = [moved, target].map(|points| middle(points, &axes));
    let some: Vec<[f64; 3]> =
        some_of(moved.len(), TRIED_POINTS).into_iter().map(|number| moved[number]).collect();
    let tree = KdTree::new(target);
    let share = |motion: &RigidTransform| {
        let is_near =
            |point: &&[f64; 3]| tree.nearest(motion.transform_point(**point), NEAR * radius).is_some();
        some.iter().filter(is_near).count()
    };
    let least = least_share * share(&RigidTransform::identity()) as f64;
    let about = |rotation: &Rotation3<f64>, from: &Vector3<f64>| RigidTransform {
        rotation: rotation.into_inner(),
        translation: to - rotation * from,
    };
    let better = |rotation: &Rotation3<f64>| {
        let [one, other] =
            [from, to].map(|from| about(rotation, &from)).map(|motion| (share(&motion), motion));
        if other.0 > one.0 { other } else { one }
    };
    let mut found: Vec<(usize, RigidTransform)> =
        rotations(&axes).iter().map(better).filter(|(count, _)| *count as f64 >= least).collect();
    found.sort_by_key(|(count, _)| std::cmp::Reverse(*count));
    found.into_iter().take(MOST).map(|(_, motion)| motion).collect()
}

/// The middle of what points cover along axes.
fn middle(points: &[[f64; 3]], axes: &Matrix3<f64>) -> Vector3<f64> {
    let along = |k: usize| {
        let mut values: Vec<f64> =
            points.iter().map(|point| axes.column(k).dot(&Vector3::from(*point))).collect();
        0.5 * (quantile(&mut values, BEYOND) + quantile(&mut values, 1.0 - BEYOND))
    };
    axes * Vector3::new(along(0), along(1), along(2))
}

/// All rotations but none, each once: those of a cube, and of equal parts about each axis.
fn rotations(axes: &Matrix3<f64>) -> Vec<Rotation3<f64>> {
    let mut found: Vec<Rotation3<f64>> = vec![Rotation3::identity()];
    let mut add = |rotation: Rotation3<f64>| {
        // The difference of two rotations by a small angle; nalgebra's angle is not a number near half a turn.
        let differs =
            |other: &Rotation3<f64>| (other.matrix() - rotation.matrix()).norm() > SAME * 2.0_f64.sqrt();
        if found.iter().all(differs) {
            found.push(rotation);
        }
    };
    let about = |axis: Vector3<f64>, parts: usize, number: usize| {
        let angle = std::f64::consts::TAU * number as f64 / parts as f64;
        Rotation3::from_axis_angle(&Unit::new_normalize(axes * axis), angle)
    };
    for axis in [Vector3::x(), Vector3::y(), Vector3::z()] {
        for parts in PARTS {
            (1..parts).for_each(|number| add(about(axis, parts, number)));
        }
    }
    // Of a cube: half turns about the diagonals of two axes, thirds about those of three.
    for (x, y, z) in [(1, 1, 0), (1, -1, 0), (1, 0, 1), (1, 0, -1), (0, 1, 1), (0, 1, -1)] {
        add(about(Vector3::new(f64::from(x), f64::from(y), f64::from(z)), 2, 1));
    }
    for (x, y) in [(1.0, 1.0), (1.0, -1.0), (-1.0, 1.0), (-1.0, -1.0)] {
        (1..3).for_each(|number| add(about(Vector3::new(x, y, 1.0), 3, number)));
    }
    found.split_off(1)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// Points and normals of a box about a centre, turned and moved.
    fn sides(size: [f64; 3], pose: &RigidTransform, seed: u64) -> (Vec<[f64; 3]>, Vec<[f64; 3]>) {
        (0..1800)
            .map(|i| {
                let axis = i % 3;
                let side = if uniform(i, seed) < 0.5 { -0.5 } else { 0.5 };
                let mut point = [0, 1, 2].map(|k| size[k] * (uniform(i, seed + 1 + k as u64) - 0.5));
                point[axis] = side * size[axis];
                let mut normal = [0.0; 3];
                normal[axis] = 2.0 * side;
                (pose.transform_point(point), pose.transform_vector(normal))
            })
            .unzip()
    }

    #[test]
    fn a_box_has_three_rotations_and_a_cube_all_of_its_own() {
        let pose = RigidTransform::from_rotation_vector([0.4, -0.9, 0.3], [3.0, -1.0, 2.0]);
        for (size, expected) in [([3.0, 2.0, 1.2], 3), ([2.0, 2.0, 2.0], 23), ([3.0, 2.0, 2.0], 7)] {
            let (target, normals) = sides(size, &pose, 5);
            let (source, _) = sides(size, &pose, 17);
            let found = symmetries(&target, &normals, &source, 0.4);
            // What comes first maps the box onto itself.
            let corner = |signs: [f64; 3]| pose.transform_point([0, 1, 2].map(|k| 0.5 * signs[k] * size[k]));
            let is_symmetry = |motion: &RigidTransform| {
                let image = pose.inverse().transform_point(motion.transform_point(corner([1.0; 3])));
                (0..3).all(|k| (image[k].abs() - 0.5 * size[k]).abs() < 0.05)
            };
            assert_eq!(found.iter().filter(|motion| is_symmetry(motion)).count(), expected, "{size:?}");
        }
    }

    #[test]
    fn nothing_has_no_symmetries() {
        assert_eq!(symmetries(&[], &[], &[], 1.0), []);
        assert_eq!(symmetries(&[[0.0; 3]], &[[0.0; 3]], &[[0.0; 3]], 1.0), []);
    }
}
