//! When each point of a scan was measured, and where it would have been at one time.

use crate::{Error, PointCloud, RigidTransform};
use rayon::prelude::*;
use std::collections::BTreeSet;
use std::f64::consts::TAU;

/// Points that one thread takes at a time.
const PART: usize = 4096;

/// Takes the points of a scan to where they would have been measured at the time of its pose: p = exp(t m) q, with the
/// sensor's twist m (rotation vector in radians, translation) in a unit of time, and each point's time t in that unit.
/// What is given are offsets from the cloud's origin. A point whose time is not finite stays, and one without a position
/// is NaN.
///
/// # Errors
/// [`Error::TimesMismatch`] if there are not as many times as points.
///
/// ```
/// use surfsig::{PointCloud, deskew};
/// let cloud = PointCloud::new_f64(&[[1.0, 0.0, 0.0], [1.0, 0.0, 0.0]]);
/// // A quarter of a turn about z for each unit of time.
/// let twist = [0.0, 0.0, std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0];
/// let found = deskew(&cloud, &[0.0, 1.0], twist)?;
/// assert_eq!(found[0], [1.0, 0.0, 0.0]);
/// assert!(found[1][0].abs() < 1e-12 && (found[1][1] - 1.0).abs() < 1e-12);
/// assert!(deskew(&cloud, &[0.0], twist).is_err());
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn deskew(cloud: &PointCloud<'_>, times: &[f64], twist: [f64; 6]) -> Result<Vec<[f64; 3]>, Error> {
    if times.len() != cloud.len() {
        return Err(Error::TimesMismatch { times: times.len(), points: cloud.len() });
    }
    let moved = |(number, time): (usize, &f64)| {
        let Some(point) = cloud.position(number) else { return [f64::NAN; 3] };
        let time = if time.is_finite() { *time } else { 0.0 };
        let there = RigidTransform::exp(twist.map(|component| time * component)).transform_point(point);
        [0, 1, 2].map(|k| there[k] - cloud.origin[k])
    };
    Ok(times.par_iter().enumerate().with_min_len(PART).map(|(number, time)| moved((number, time))).collect())
}

/// When a spinning lidar measured each point, from the scan's middle on, in the unit of time of its rate: rotations about
/// z, counter-clockwise, or clockwise where that is negative. A scan begins and ends behind the sensor, at -x.
///
/// ```
/// use surfsig::{PointCloud, spin_times};
/// let cloud = PointCloud::new_f64(&[[2.0, 0.0, 0.5], [0.0, 3.0, 0.0], [0.0, -3.0, 0.0]]);
/// assert_eq!(spin_times(&cloud, [0.0; 3], 10.0), [0.0, 0.025, -0.025]);
/// ```
pub fn spin_times(cloud: &PointCloud<'_>, sensor: [f64; 3], spin_rate: f64) -> Vec<f64> {
    let time = |number: usize| {
        let [x, y, _] = cloud.position(number)?;
        Some((y - sensor[1]).atan2(x - sensor[0]) / TAU / spin_rate)
    };
    let numbers = (0..cloud.len()).into_par_iter().with_min_len(PART);
    numbers.map(|number| time(number).unwrap_or(f64::NAN)).collect()
}

/// The first and the last of the finite times, if at least `fewest` of them are different.
///
/// ```
/// assert_eq!(surfsig::time_range(&[0.5, f64::NAN, 0.25, 0.5], 2), Some([0.25, 0.5]));
/// assert_eq!(surfsig::time_range(&[0.5, f64::NAN, 0.25, 0.5], 3), None);
/// ```
pub fn time_range(times: &[f64], fewest: usize) -> Option<[f64; 2]> {
    let finite = || times.iter().copied().filter(|time| time.is_finite());
    let mut different = BTreeSet::new();
    // -0 is no other time than 0.
    let is_enough = fewest == 0
        || finite().any(|time| {
            different.insert((time + 0.0).to_bits());
            different.len() >= fewest
        });
    let (first, last) = finite()
        .fold((f64::INFINITY, f64::NEG_INFINITY), |(first, last), time| (first.min(time), last.max(time)));
    (is_enough && first <= last).then_some([first, last])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    #[test]
    fn points_at_a_far_origin_move_as_those_at_0_do() {
        let points: Vec<[f64; 3]> = (0..50).map(|i| [0, 1, 2].map(|k| 20.0 * uniform(i, k) - 10.0)).collect();
        let times: Vec<f64> = (0..50).map(|i| uniform(i, 3) - 0.5).collect();
        let (twist, origin) = ([0.0, 0.0, 0.0, 3.0, -1.0, 0.5], [5e5, 5e6, 100.0]);
        let cloud = PointCloud::new_f64(&points);
        let here = deskew(&cloud, &times, twist).unwrap();
        let far = deskew(&cloud.with_origin(origin), &times, twist).unwrap();
        for (a, b) in here.iter().zip(&far) {
            assert!((0..3).all(|k| (a[k] - b[k]).abs() < 1e-8), "{a:?} {b:?}");
        }
    }

    #[test]
    fn points_without_a_time_or_a_position_are_no_error() {
        let cloud = PointCloud::new_f64(&[[1.0, 2.0, 3.0], [f64::NAN, 0.0, 0.0]]);
        let found = deskew(&cloud, &[f64::NAN, 0.5], [1.0; 6]).unwrap();
        assert_eq!(found[0], [1.0, 2.0, 3.0]);
        assert!(found[1][0].is_nan());
        assert!(spin_times(&cloud, [0.0; 3], 1.0)[1].is_nan());
        assert_eq!(time_range(&[f64::NAN], 0), None);
        assert_eq!(time_range(&[0.0, -0.0], 2), None);
    }
}
