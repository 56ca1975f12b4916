//! A sensor that moves while it scans: points are taken to where they would have been measured at one time of the scan.

use crate::RigidTransform;
use nalgebra::{SMatrix, SVector, Vector3, Vector6};

/// Transforms over the duration of a scan; from the nearest of them a point goes by the first order of its twist.
const TRANSFORMS: usize = 64;
/// Of the mean of the normal matrix's diagonal, which is added to it: steps leave out what nothing determines.
const DAMPING: f64 = 1e-9;

/// Points that were measured one after the other.
#[derive(Debug, Clone)]
pub(super) struct MeasuredScan {
    /// About the sensor at the time of each.
    pub points: Vec<[f64; 3]>,
    /// Of each point, in intervals from scan to scan, from the scan's reference on; `None` where all are measured at once.
    pub times: Option<Vec<f64>>,
}

/// How a sensor moves within a scan.
#[derive(Debug, Clone)]
pub(super) struct MotionWithin {
    /// Of each point, in intervals from scan to scan.
    pub times: Vec<f64>,
    /// In the sensor's axes, from scan to scan, by which the points are deskewed.
    pub twist: Vector6<f64>,
    /// The last scan's pose, and the twist from the one before it to it, if this scan follows it at once.
    pub since: Option<(RigidTransform, Option<Vector6<f64>>)>,
    /// Distance at the range by which a twist may differ from the expected one; otherwise the pose is not one that the
    /// sensor has moved to since the last scan.
    pub farthest: f64,
    /// What the twist that poses tell is off by: its translation, and the distance by which its rotation moves a point
    /// at the range.
    pub deviation: f64,
    /// The distance of that point.
    pub range: f64,
}

impl MotionWithin {
    /// The twist at the reference of a scan that has a pose. With m and m' the twists from the last scan to this one and
    /// to the last one, which are those at the middles between them, it is (3 m - m') / 2.
    ///
    /// The map alone does not tell it: where all scans are bent alike, they fit to each other.
    pub fn at_pose(&self, pose: &RigidTransform) -> Vector6<f64> {
        let Some((last, before)) = &self.since else { return self.twist };
        let twist = Vector6::from((last.inverse() * *pose).log());
        let expected = before.map_or(twist, |before| 1.5 * twist - 0.5 * before);
        let off = expected - self.twist;
        let distance = self.range * off.fixed_rows::<3>(0).norm() + off.fixed_rows::<3>(3).norm();
        if distance <= self.farthest { expected } else { self.twist }
    }
}

/// Points about the sensor at the reference: p = exp(t m) q, with the twist m and each point's time t.
pub(super) fn deskewed(points: &[[f64; 3]], times: &[f64], twist: &Vector6<f64>) -> Vec<[f64; 3]> {
    let (first, last) = times
        .iter()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), time| (low.min(*time), high.max(*time)));
    let step = (last - first) / TRANSFORMS as f64;
    let at = |number: usize| first + step * number as f64;
    let transforms: Vec<RigidTransform> =
        (0..=TRANSFORMS).map(|number| RigidTransform::exp((twist * at(number)).into())).collect();
    let nearest = |time: f64| if step > 0.0 { ((time - first) / step).round() as usize } else { 0 };
    let moved = |(point, time): (&[f64; 3], &f64)| {
        let number = nearest(*time).min(TRANSFORMS);
        moved_slightly(transforms[number].transform_point(*point), &(twist * (time - at(number))))
    };
    points.iter().zip(times).map(moved).collect()
}

/// A point moved by a small twist, to the first order.
pub(super) fn moved_slightly(point: [f64; 3], twist: &Vector6<f64>) -> [f64; 3] {
    let p = Vector3::from(point);
    let (w, v) = (twist.fixed_rows::<3>(0), twist.fixed_rows::<3>(3));
    (p + w.cross(&p) + v).into()
}

/// The changes of a pose and of the twist within the scan that make residuals r + d (x + t y) least, where d are their
/// derivatives by the pose, and the twist is expected to be nearly `expected`.
pub(super) fn joint_step(
    design: &[[f64; 6]],
    residuals: &[f64],
    times: impl Iterator<Item = f64>,
    motion: &MotionWithin,
    expected: &Vector6<f64>,
) -> Option<(Vector6<f64>, Vector6<f64>)> {
    let mut normal = SMatrix::<f64, 12, 12>::zeros();
    let mut gradient = SVector::<f64, 12>::zeros();
    for ((row, residual), time) in design.iter().zip(residuals).zip(times) {
        for i in 0..6 {
            for j in 0..6 {
                let product = row[i] * row[j];
                normal[(i, j)] += product;
                normal[(i, j + 6)] += time * product;
                normal[(i + 6, j + 6)] += time * time * product;
            }
            gradient[i] += row[i] * residual;
            gradient[i + 6] += time * row[i] * residual;
        }
    }
    for i in 0..6 {
        for j in 0..6 {
            normal[(j + 6, i)] = normal[(i, j + 6)];
        }
    }
    let variance = residuals.iter().map(|r| r * r).sum::<f64>() / residuals.len().max(1) as f64;
    for k in 0..6 {
        let deviation = if k < 3 { motion.deviation / motion.range } else { motion.deviation };
        let weight = variance / (deviation * deviation);
        normal[(k + 6, k + 6)] += weight;
        gradient[k + 6] += weight * (motion.twist[k] - expected[k]);
    }
    // Rotations and translations differ in their unit, so each has its own damping.
    for k in 0..12 {
        normal[(k, k)] += DAMPING * normal[(k, k)].max(f64::MIN_POSITIVE);
    }
    let step = -normal.cholesky()?.solve(&gradient);
    step.iter()
        .all(|x| x.is_finite())
        .then(|| (step.fixed_rows::<6>(0).into(), step.fixed_rows::<6>(6).into()))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    #[test]
    fn points_are_where_the_sensor_would_have_measured_them_at_the_reference() {
        let twist = Vector6::new(0.02, -0.03, 0.16, 4.0, -0.5, 0.2);
        let points: Vec<[f64; 3]> =
            (0..2000).map(|i| [0, 1, 2].map(|k| 80.0 * uniform(i, k) - 40.0)).collect();
        let times: Vec<f64> = (0..2000).map(|i| uniform(i, 3) - 0.5).collect();
        for ((found, point), time) in deskewed(&points, &times, &twist).iter().zip(&points).zip(&times) {
            let exact = RigidTransform::exp((twist * *time).into()).transform_point(*point);
            assert!((0..3).all(|k| (found[k] - exact[k]).abs() < 1e-3), "{found:?} {exact:?}");
        }
        assert_eq!(deskewed(&points[..1], &[0.0], &twist), points[..1]);
    }

    #[test]
    fn a_joint_step_finds_pose_and_twist() {
        let (x, y) = (
            Vector6::new(0.01, -0.02, 0.005, 0.1, 0.2, -0.1),
            Vector6::new(-0.03, 0.01, 0.02, 0.3, -0.1, 0.2),
        );
        let draw = |i: usize, k: u64| 2.0 * uniform(i, k) - 1.0;
        let design: Vec<[f64; 6]> = (0..500).map(|i| std::array::from_fn(|k| draw(i, k as u64))).collect();
        let times: Vec<f64> = (0..500).map(|i| draw(i, 7) / 2.0).collect();
        let residual = |(row, time): (&[f64; 6], &f64)| -Vector6::from(*row).dot(&(x + y * *time));
        let residuals: Vec<f64> = design.iter().zip(&times).map(residual).collect();
        let motion = MotionWithin {
            times: times.clone(),
            twist: Vector6::zeros(),
            since: None,
            farthest: 1.0,
            deviation: 1e3,
            range: 1.0,
        };
        let (pose, twist) =
            joint_step(&design, &residuals, times.iter().copied(), &motion, &Vector6::zeros()).unwrap();
        assert!((pose - x).amax() < 1e-6 && (twist - y).amax() < 1e-6);
        // A motion that is surely known stays.
        let motion = MotionWithin { deviation: 1e-6, ..motion };
        let (_, twist) =
            joint_step(&design, &residuals, times.iter().copied(), &motion, &Vector6::zeros()).unwrap();
        assert!(twist.amax() < 1e-6);
    }

    #[test]
    fn the_twist_of_a_motion_that_changes_evenly_is_that_at_the_reference() {
        // Along x by t^2: 1 from 0 to 1, 3 from 1 to 2, and at 2 a velocity of 4.
        let at = |x: f64| RigidTransform::from_rotation_vector([0.0; 3], [x, 0.0, 0.0]);
        let along = |x: f64| Vector6::new(0.0, 0.0, 0.0, x, 0.0, 0.0);
        let mut motion = MotionWithin {
            times: Vec::new(),
            twist: along(3.0),
            since: Some((at(1.0), Some(along(1.0)))),
            farthest: 2.0,
            deviation: 0.01,
            range: 1.0,
        };
        assert_eq!(motion.at_pose(&at(4.0)), along(4.0));
        assert_eq!(motion.at_pose(&at(40.0)), along(3.0));
        motion.since = None;
        assert_eq!(motion.at_pose(&at(4.0)), along(3.0));
    }
}
