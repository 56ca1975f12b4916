//! What is left of a transform beside motions that are free, and the free motions of transforms that follow each other.

use super::observability::{FreeDirection, named};
use super::open_covariance::{lengths, orthonormal, unscaled};
use crate::geometry::RigidTransform;
use nalgebra::{Vector3, Vector6};

/// Steps that take free motions out of a transform: the logarithm of a product is not the sum of the logarithms, and
/// after three steps what is left changes by less than a thousandth of a radian.
const STEPS: usize = 4;
/// Length of a unit motion after those before it are taken from it, below which it is one of them: directions of two
/// overlaps with noise differ by some hundredths, those of other axes by more than a half.
const SAME_MOTION: f64 = 0.3;

/// The transform without its motion along free directions: the rest that differs from them most.
///
/// `center` is the middle of what moves, and `unit` the length by which a rotation moves it, per radian.
pub(crate) fn without_free_motion(
    transform: &RigidTransform,
    free: &[FreeDirection],
    center: [f64; 3],
    unit: f64,
) -> RigidTransform {
    let twists: Vec<Vector6<f64>> = free.iter().flat_map(|direction| direction.twists(center)).collect();
    let basis = orthonormal(&twists, unit);
    let to_center = RigidTransform::from_rotation_vector([0.0; 3], center);
    let mut rest = to_center.inverse() * *transform * to_center;
    for _ in 0..STEPS {
        let twist = lengths(unit) * Vector6::from(rest.log());
        let along: Vector6<f64> = basis.iter().map(|motion| motion * motion.dot(&twist)).sum();
        rest = RigidTransform::exp((-unscaled(&along, unit)).into()) * rest;
    }
    to_center * rest * to_center.inverse()
}

/// The free directions of a transform that follows another one: those of both, each once.
///
/// Both are given in the coordinates of the last target; `center` and `unit` are as in [`without_free_motion`].
pub(crate) fn joined_directions(
    one: &[FreeDirection],
    other: &[FreeDirection],
    center: [f64; 3],
    unit: f64,
) -> Vec<FreeDirection> {
    if one.is_empty() || other.is_empty() {
        return [one, other].concat();
    }
    let mut motions: Vec<Vector6<f64>> = Vec::new();
    for direction in one.iter().chain(other) {
        for twist in direction.twists(center) {
            let scaled = lengths(unit) * twist;
            let rest = motions.iter().fold(scaled, |rest, known| rest - known * known.dot(&rest));
            if rest.norm() > SAME_MOTION * scaled.norm() {
                motions.push(rest.normalize());
            }
        }
    }
    named(&motions, Vector3::from(center), unit)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn axis_of_can(tilt: f64) -> Vec<FreeDirection> {
        let axis = [tilt.sin(), 0.0, tilt.cos()];
        vec![FreeDirection::Rotation { axis, point: [1.0, 2.0, 0.0] }, FreeDirection::Translation { axis }]
    }

    #[test]
    fn what_is_left_beside_a_cans_motion_is_what_moves_its_axis() {
        let center = [1.2, 2.1, 0.4];
        let free = axis_of_can(0.0);
        let screw = RigidTransform::about([1.0, 2.0, 0.0], [0.0, 0.0, 3.1], [0.0, 0.0, 0.7]);
        let left = |transform: &RigidTransform| {
            let rest = without_free_motion(transform, &free, center, 1.0);
            rest.displacement_from(&RigidTransform::identity(), [center, [0.0, 2.0, 3.0]])
        };
        assert!(left(&screw) < 1e-9);
        let off = RigidTransform::from_rotation_vector([0.0; 3], [0.3, 0.0, 0.0]);
        assert!((left(&(off * screw)) - 0.3).abs() < 0.05);
        let flip = RigidTransform::about(center, [std::f64::consts::PI, 0.0, 0.0], [0.0; 3]);
        assert!(left(&(flip * screw)) > 1.0, "end over end is no motion about the axis");
        let nothing_free = without_free_motion(&screw, &[], center, 1.0);
        assert!(nothing_free.displacement_from(&screw, [center, [9.0, 1.0, 2.0]]) < 1e-12);
    }

    #[test]
    fn two_overlaps_with_a_can_leave_what_one_does_and_two_cans_leave_more() {
        let (center, first) = ([1.0, 2.0, 0.5], axis_of_can(0.0));
        let same = joined_directions(&first, &axis_of_can(0.05), center, 1.0);
        let [FreeDirection::Rotation { axis, .. }, FreeDirection::Translation { .. }] = same[..] else {
            panic!("{same:?}")
        };
        assert!(axis[2].abs() > 0.999);
        let [rotation, sliding] = [first[..1].to_vec(), first[1..].to_vec()];
        assert_eq!(joined_directions(&rotation, &sliding, center, 1.0).len(), 2);
        assert_eq!(joined_directions(&rotation, &[], center, 1.0), rotation);
        let across = joined_directions(&first, &axis_of_can(1.5), center, 1.0);
        assert_eq!(across.len(), 4);
        let ball = [FreeDirection::RotationAboutPoint { point: [1.0, 2.0, 0.0] }];
        let joined = joined_directions(&rotation, &ball, center, 1.0);
        let [FreeDirection::RotationAboutPoint { point }] = joined[..] else { panic!("{joined:?}") };
        assert!((Vector3::from(point) - Vector3::new(1.0, 2.0, 0.0)).norm() < 1e-9);
    }
}
