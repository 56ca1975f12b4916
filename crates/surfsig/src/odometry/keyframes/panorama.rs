//! How far a scan sees all around its sensor: what tells where it was taken and how it was turned about its z axis, as
//! robots turn. (Kim and Kim, Scan Context, 2018, compare heights so.)

use std::f64::consts::{PI, TAU};

/// Directions around the z axis: steps of 6 degrees carry a point at the median range, of some 30 voxels, by three.
const AROUND: usize = 60;
/// Directions from below to above: as high as two are wide, for sensors see less far up and down than around.
const ABOVE: usize = 15;
/// Difference of directions of which only one scan has points: as much as that of ranges of which one is 1.6 times the
/// other. Less would make scans alike that hardly meet.
const MISSING: f32 = 0.5;
/// Largest difference of two ranges that counts, as a logarithm: what stands before one sensor may be anywhere.
const LARGEST: f32 = 1.0;

/// Logarithms of the mean range in each direction, from turn to turn; NaN where there is no point.
#[derive(Debug, Clone)]
pub(super) struct Panorama(Vec<[f32; ABOVE]>);

impl Panorama {
    /// Of points about the sensor.
    pub fn new(points: &[[f64; 3]]) -> Self {
        let mut sums = vec![[(0.0_f64, 0_u32); ABOVE]; AROUND];
        for [x, y, z] in points {
            let range = (x * x + y * y + z * z).sqrt();
            if !(range > 0.0 && range.is_finite()) {
                continue;
            }
            let around = ((y.atan2(*x) + PI) / TAU * AROUND as f64) as usize;
            let above = (((z / range).clamp(-1.0, 1.0).asin() / PI + 0.5) * ABOVE as f64) as usize;
            let (sum, count) = &mut sums[around.min(AROUND - 1)][above.min(ABOVE - 1)];
            (*sum, *count) = (*sum + range.ln(), *count + 1);
        }
        let mean =
            |(sum, count): (f64, u32)| if count > 0 { (sum / f64::from(count)) as f32 } else { f32::NAN };
        Self(sums.into_iter().map(|turn| turn.map(mean)).collect())
    }

    /// The rotation about z, in radians, that takes another scan to where it is most like this one, and how much it then
    /// differs: 0 where all ranges are the same, 1 where none is.
    pub fn compared(&self, other: &Self) -> (f32, f64) {
        let differences = (0..AROUND).map(|turn| (self.difference(other, turn), turn));
        let (least, turn) = differences.min_by(|a, b| a.0.total_cmp(&b.0)).unwrap_or((LARGEST, 0));
        (least, TAU * turn as f64 / AROUND as f64)
    }

    fn difference(&self, other: &Self, turn: usize) -> f32 {
        let (mut sum, mut seen) = (0.0_f32, 0_u32);
        for (number, theirs) in other.0.iter().enumerate() {
            for (a, b) in self.0[(number + turn) % AROUND].iter().zip(theirs) {
                let difference = match (a.is_nan(), b.is_nan()) {
                    (true, true) => continue,
                    (false, false) => (a - b).abs().min(LARGEST),
                    _ => MISSING,
                };
                (sum, seen) = (sum + difference, seen + 1);
            }
        }
        if seen > 0 { sum / seen as f32 } else { LARGEST }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RigidTransform;

    /// The walls of a room about a sensor.
    fn room(half: [f64; 2], at: [f64; 2]) -> Vec<[f64; 3]> {
        let along = (-40..=40).map(|k| f64::from(k) / 40.0);
        let wall = |k: f64| {
            let [x, y] = half;
            [[k * x, y], [k * x, -y], [x, k * y], [-x, k * y]]
        };
        let up = |[x, y]: [f64; 2]| (-4..=4).map(move |z| [x - at[0], y - at[1], f64::from(z)]);
        along.flat_map(wall).flat_map(up).collect()
    }

    #[test]
    fn a_scan_of_the_same_place_is_alike_however_the_sensor_is_turned() {
        let place = Panorama::new(&room([20.0, 8.0], [5.0, 2.0]));
        for degrees in [0.0_f64, 48.0, 186.0] {
            let turn = RigidTransform::from_rotation_vector([0.0, 0.0, degrees.to_radians()], [0.0; 3]);
            let scan = Panorama::new(&turn.inverse().transform_points(&room([20.0, 8.0], [5.3, 1.8])));
            let (difference, angle) = place.compared(&scan);
            let off = RigidTransform::from_rotation_vector([0.0, 0.0, angle], [0.0; 3]).inverse() * turn;
            assert!(difference < 0.1, "{difference}");
            assert!(off.log()[2].abs() <= TAU / AROUND as f64 + 1e-9, "{degrees}: {angle}");
            assert!(Panorama::new(&room([14.0, 11.0], [5.0, 2.0])).compared(&scan).0 > 1.5 * difference);
        }
    }

    #[test]
    fn a_scan_without_points_is_like_none() {
        let nothing = Panorama::new(&[[0.0; 3]]);
        assert_eq!(nothing.compared(&nothing), (LARGEST, 0.0));
        assert_eq!(Panorama::new(&room([9.0, 7.0], [0.0; 2])).compared(&nothing).0, MISSING);
    }
}
