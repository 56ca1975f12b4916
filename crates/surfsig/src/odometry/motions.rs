//! How large motions are, and which of several poses are others.

use crate::RigidTransform;

/// The motion of several steps.
pub(super) fn power(motion: RigidTransform, steps: usize) -> RigidTransform {
    RigidTransform::exp(motion.log().map(|component| component * steps as f64))
}

/// The angle of a motion's rotation, 0 to pi.
pub(super) fn rotation_angle(motion: &RigidTransform) -> f64 {
    let [x, y, z, ..] = motion.log();
    (x * x + y * y + z * z).sqrt()
}

/// How far a motion carries a point at a range, at most.
pub(super) fn distance_at_range(range: f64, motion: &RigidTransform) -> f64 {
    2.0 * range * (0.5 * rotation_angle(motion)).sin() + motion.translation.norm()
}

/// The first poses that are farther than a distance, at a range, from those before; `most` of them at most.
pub(super) fn different_poses(
    poses: impl IntoIterator<Item = RigidTransform>,
    range: f64,
    distance: f64,
    most: usize,
) -> Vec<RigidTransform> {
    let mut chosen: Vec<RigidTransform> = Vec::new();
    for pose in poses {
        if chosen.len() == most {
            break;
        }
        if chosen.iter().all(|other| distance_at_range(range, &(other.inverse() * pose)) > distance) {
            chosen.push(pose);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_motion_that_goes_on_is_repeated() {
        let motion = RigidTransform::from_rotation_vector([0.1, -0.2, 0.4], [1.0, 2.0, -0.5]);
        let difference = (motion * motion * motion).inverse() * power(motion, 3);
        assert!(difference.log().iter().all(|component| component.abs() < 1e-13));
        assert_eq!(power(motion, 0), RigidTransform::identity());
        assert!((rotation_angle(&motion) - 0.21_f64.sqrt()).abs() < 1e-15);
    }

    #[test]
    fn poses_are_different_by_what_a_point_at_the_range_moves() {
        let at = |x: f64, angle: f64| RigidTransform::from_rotation_vector([0.0, 0.0, angle], [x, 0.0, 0.0]);
        let all = [at(0.0, 0.0), at(0.5, 0.0), at(0.0, 0.2), at(2.0, 0.0), at(4.0, 0.0)];
        assert!((distance_at_range(10.0, &all[2]) - 20.0 * 0.1_f64.sin()).abs() < 1e-12);
        assert_eq!(different_poses(all, 10.0, 1.0, 9), [all[0], all[2], all[3], all[4]]);
        assert_eq!(different_poses(all, 1.0, 1.0, 2), [all[0], all[3]]);
    }
}
