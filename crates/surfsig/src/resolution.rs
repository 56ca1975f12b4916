//! How finely a cloud's coordinates are stored, and what that means for a surface that is fitted to them.

use crate::PointCloud;

/// Largest step between coordinates, in radii of the neighbourhood, with which a curvature still means something.
///
/// Chosen by `scripts/coarse_coordinates.py`: on simulated spheres the error of mean curvature stays within its
/// standard error up to a sixth of the radius, and from a quarter on a fifth of all points err by more than four.
pub const COARSEST_STEP: f64 = 0.2;

/// Points that are looked at for a lattice: neighbouring steps are then among them in all but the widest scans.
pub const RESOLUTION_SAMPLES: usize = 4096;

/// Different values along an axis from which on equal distances between them are a lattice, and not a few faces.
const FEWEST_LEVELS: usize = 8;

/// Deviation from a whole number of steps, in steps, with which a distance counts as one.
const TOLERANCE: f64 = 0.02;

/// Cosine between a normal and an axis from which on the axis is the surface's height: its steps are then steps
/// of the surface, and not the distance of scan lines or of a raster's columns.
const ALONG_NORMAL: f64 = 0.9;

/// The steps in which a cloud's coordinates are stored.
///
/// Float32 keeps seven digits: at a UTM northing of 5,800,000 m its steps are half a metre. Other files store
/// whole numbers of a step, or were rounded.
///
/// ```
/// use surfsig::{PointCloud, Resolution};
/// let points: Vec<[f32; 3]> = (0..100).map(|i| [389_000.0, 5_819_000.0 + 0.01 * i as f32, 40.0]).collect();
/// let resolution = Resolution::of(&PointCloud::new(&points));
/// assert!(resolution.single_precision);
/// assert_eq!(resolution.number_step([389_000.0, 5_819_000.0, 40.0]), 0.5);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Resolution {
    /// Whether all coordinates are float32 numbers, however they are stored now.
    pub single_precision: bool,
    /// Step along each axis where coordinates are whole numbers of one; 0 where they are not.
    pub lattice: [f64; 3],
    origin: [f64; 3],
}

impl Resolution {
    /// Finds the steps, from a sample of the points.
    pub fn of(cloud: &PointCloud<'_>) -> Self {
        let stride = cloud.len().div_ceil(RESOLUTION_SAMPLES).max(1);
        let sample: Vec<[f64; 3]> =
            (0..cloud.len()).step_by(stride).filter_map(|i| cloud.position(i)).collect();
        let offset = |p: &[f64; 3]| [0, 1, 2].map(|axis| p[axis] - cloud.origin[axis]);
        let single_precision = !sample.is_empty()
            && sample.iter().map(offset).all(|p| p.iter().all(|&c| f64::from(c as f32) == c));
        let lattice = [0, 1, 2].map(|axis| {
            let mut values: Vec<f64> = sample.iter().map(|p| p[axis]).collect();
            lattice_step(&mut values)
        });
        Self { single_precision, lattice, origin: cloud.origin }
    }

    /// As it was found before, for a cloud with this origin.
    ///
    /// ```
    /// use surfsig::{PointCloud, Resolution};
    /// let points: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.1]).collect();
    /// let found = Resolution::of(&PointCloud::new_f64(&points));
    /// assert_eq!(Resolution::known(found.single_precision, found.lattice, [0.0; 3]), found);
    /// ```
    pub fn known(single_precision: bool, lattice: [f64; 3], origin: [f64; 3]) -> Self {
        Self { single_precision, lattice, origin }
    }

    /// Distance between neighbouring float32 numbers at a position, the largest of the three axes; 0 for a cloud
    /// whose coordinates are finer.
    ///
    /// ```
    /// use surfsig::{PointCloud, Resolution};
    /// let resolution = Resolution::of(&PointCloud::new_f64(&[[0.1, 0.2, 0.3]]));
    /// assert_eq!(resolution.number_step([5_819_000.0, 0.0, 0.0]), 0.0);
    /// ```
    pub fn number_step(&self, position: [f64; 3]) -> f64 {
        if !self.single_precision {
            return 0.0;
        }
        let step = |axis: usize| {
            let value = ((position[axis] - self.origin[axis]).abs() as f32).min(f32::MAX / 2.0);
            f64::from(value.next_up()) - f64::from(value)
        };
        step(0).max(step(1)).max(step(2))
    }

    /// Whether the steps are too large for a surface with this normal that is fitted within a radius.
    ///
    /// Steps of a lattice count along the normal only: across it they may be a raster's columns or a profile
    /// scanner's lines, which are no error. Where all three axes have too large steps, they always count.
    ///
    /// ```
    /// use surfsig::{PointCloud, Resolution};
    /// // A raster of height values: columns 1 apart, heights in full precision.
    /// let points: Vec<[f64; 3]> =
    ///     (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), (0.1 * f64::from(i)).sin()]).collect();
    /// let resolution = Resolution::of(&PointCloud::new_f64(&points));
    /// assert_eq!(resolution.lattice, [1.0, 1.0, 0.0]);
    /// assert!(!resolution.is_too_coarse([0.0; 3], [0.0, 0.0, 1.0], 3.0));
    /// assert!(resolution.is_too_coarse([0.0; 3], [1.0, 0.0, 0.0], 3.0));
    /// ```
    pub fn is_too_coarse(&self, position: [f64; 3], normal: [f32; 3], radius: f64) -> bool {
        let most = COARSEST_STEP * radius;
        if self.number_step(position) > most {
            return true;
        }
        let coarse = self.lattice.map(|step| step > most);
        let along = |axis: usize| f64::from(normal[axis].abs()) > ALONG_NORMAL;
        coarse.iter().all(|&is| is) || (0..3).any(|axis| coarse[axis] && along(axis))
    }
}

/// The step of which all distances between these values are multiples; 0 where there is none.
fn lattice_step(values: &mut [f64]) -> f64 {
    values.sort_unstable_by(f64::total_cmp);
    let (Some(&first), Some(&last)) = (values.first(), values.last()) else { return 0.0 };
    // What addition of an origin, or multiplication by a scale, has rounded.
    let rounding = 8.0 * f64::EPSILON * first.abs().max(last.abs());
    let mut distances: Vec<f64> =
        values.windows(2).map(|pair| pair[1] - pair[0]).filter(|&d| d > rounding).collect();
    if distances.len() + 1 < FEWEST_LEVELS {
        return 0.0;
    }
    distances.sort_unstable_by(f64::total_cmp);
    let step = distances[0];
    let whole = |&d: &f64| (d / step - (d / step).round()).abs() <= TOLERANCE + rounding / step;
    if distances.iter().all(whole) { step } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_lattice_is_found_with_its_step_and_no_other() {
        let of = |points: &[[f64; 3]]| Resolution::of(&PointCloud::new_f64(points)).lattice;
        let wave = |i: usize| (0.37 * i as f64).sin();
        let continuous: Vec<[f64; 3]> = (0..9000).map(|i| [wave(i), wave(7 * i), wave(3 * i + 1)]).collect();
        assert_eq!(of(&continuous), [0.0; 3]);
        let rounded: Vec<[f64; 3]> =
            continuous.iter().map(|p| p.map(|c| 500_000.0 + 0.01 * (c / 0.01).round())).collect();
        for step in of(&rounded) {
            assert!((step - 0.01).abs() < 1e-8, "{step}");
        }
        // Some faces of a part are no lattice.
        let faces: Vec<[f64; 3]> = continuous.iter().map(|p| [p[0], p[1], (3.0 * p[2]).round()]).collect();
        assert_eq!(of(&faces), [0.0; 3]);
    }

    #[test]
    fn float32_is_recognised_in_float64_too() {
        let points: Vec<[f64; 3]> =
            (0..100).map(|i| [0, 1, 2].map(|axis| f64::from(0.1_f32 * (i + axis) as f32))).collect();
        assert!(Resolution::of(&PointCloud::new_f64(&points)).single_precision);
        let finer: Vec<[f64; 3]> = points.iter().map(|p| p.map(|c| c + 1e-12)).collect();
        assert!(!Resolution::of(&PointCloud::new_f64(&finer)).single_precision);
        assert!(!Resolution::of(&PointCloud::new(&[])).single_precision);
    }

    #[test]
    fn offsets_in_float32_from_a_far_origin_are_fine() {
        let points: Vec<[f32; 3]> = (0..100).map(|i| [0.01 * i as f32, 0.5, 0.25]).collect();
        let origin = [389_000.0, 5_819_000.0, 40.0];
        let resolution = Resolution::of(&PointCloud::new(&points).with_origin(origin));
        assert!(resolution.number_step([389_000.5, 5_819_000.5, 40.25]) < 1e-7);
    }
}
