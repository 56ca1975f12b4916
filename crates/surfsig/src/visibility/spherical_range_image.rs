//! A range image about the sensor, by azimuth and elevation.

use std::f64::consts::{PI, TAU};

/// How a [`SphericalRangeImage`] is made and read.
///
/// ```
/// let settings = surfsig::RangeImageSettings::default();
/// assert!((settings.pixel.to_degrees() - 3.0).abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RangeImageSettings {
    /// Width and height of a pixel, in radians, from a tenth of a degree to a quarter turn. Three degrees by default:
    /// wider than the gaps between the rings of a lidar with 16 rings over 40 degrees, so that a pixel that nothing
    /// was measured in is one that the sensor did not look at.
    pub pixel: f64,
    /// Length before and behind what was measured within which a point is on it, in the points' unit.
    pub margin: f64,
    /// The same, as a share of the point's range: the errors of a pose's rotation grow with the range.
    pub relative_margin: f64,
}

impl Default for RangeImageSettings {
    fn default() -> Self {
        Self { pixel: 3.0_f64.to_radians(), margin: 2.0, relative_margin: 0.05 }
    }
}

impl RangeImageSettings {
    /// Pixels along the elevation, and along the azimuth.
    fn shape(&self) -> [usize; 2] {
        // A size without a meaning gives the nearest one that has one.
        let pixel = self.pixel.max(0.1_f64.to_radians()).min(0.5 * PI);
        [PI / pixel, TAU / pixel].map(|pixels| pixels.round() as usize)
    }
}

/// What a sensor can say of a point at which it may have looked.
///
/// ```
/// use surfsig::Visibility;
/// assert!(Visibility::FreeSpace.is_in_sight() && !Visibility::Hidden.is_in_sight());
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Visibility {
    /// Where something was measured.
    Confirmed,
    /// On the line of sight to what was measured: a surface there would have been measured in its stead.
    FreeSpace,
    /// Behind what was measured.
    Hidden,
    /// In a direction in which nothing was measured.
    Unmeasured,
}

impl Visibility {
    /// Whether the sensor would have measured a surface there.
    ///
    /// ```
    /// assert!(surfsig::Visibility::Confirmed.is_in_sight());
    /// ```
    pub fn is_in_sight(self) -> bool {
        matches!(self, Self::Confirmed | Self::FreeSpace)
    }
}

/// The nearest and the farthest range that was measured in each direction and the directions next to it.
///
/// A surface that is seen at a low angle is at many ranges within a pixel; so a point is in free space only where it
/// is nearer than all that was measured in the 3 x 3 pixels around, and hidden only where it is farther than all.
///
/// ```
/// use surfsig::{RangeImageSettings, SphericalRangeImage, Visibility};
///
/// // A wall ten away, three wide and high.
/// let wall: Vec<[f64; 3]> = (0..961)
///     .map(|i| [10.0, f64::from(i % 31) * 0.1 - 1.5, f64::from(i / 31) * 0.1 - 1.5])
///     .collect();
/// let image = SphericalRangeImage::new(&wall, RangeImageSettings { margin: 0.5, ..Default::default() });
/// assert_eq!(image.visibility([10.2, 0.0, 0.0]), Visibility::Confirmed);
/// assert_eq!(image.visibility([5.0, 0.0, 0.0]), Visibility::FreeSpace);
/// assert_eq!(image.visibility([20.0, 0.0, 0.0]), Visibility::Hidden);
/// assert_eq!(image.visibility([-10.0, 0.0, 0.0]), Visibility::Unmeasured);
/// ```
#[derive(Debug, Clone)]
pub struct SphericalRangeImage {
    settings: RangeImageSettings,
    shape: [usize; 2],
    pixels: Vec<Pixel>,
}

/// Ranges in float32: they are compared with a margin.
#[derive(Debug, Clone, Copy)]
struct Pixel {
    /// Nearest range in the 3 x 3 pixels around; infinite where nothing was measured in the pixel itself.
    nearest: f32,
    /// Farthest range in the 3 x 3 pixels around; 0 where nothing was measured in the pixel itself.
    farthest: f32,
}

const EMPTY: Pixel = Pixel { nearest: f32::INFINITY, farthest: 0.0 };

impl SphericalRangeImage {
    /// Takes the image of points about the sensor, which is at 0. Points that are not finite are left out.
    pub fn new(points: &[[f64; 3]], settings: RangeImageSettings) -> Self {
        let shape = settings.shape();
        let [rows, columns] = shape;
        let mut measured = vec![EMPTY; rows * columns];
        for point in points {
            let (pixel, range) = locate(shape, *point);
            if range > 0.0 && range.is_finite() {
                let Pixel { nearest, farthest } = &mut measured[pixel];
                *nearest = nearest.min(range as f32);
                *farthest = farthest.max(range as f32);
            }
        }
        let spread = |index: usize| {
            let (row, column) = (index / columns, index % columns);
            if measured[index].farthest == 0.0 {
                return EMPTY;
            }
            let mut around = EMPTY;
            for row in row.saturating_sub(1)..(row + 2).min(rows) {
                for step in [columns - 1, 0, 1] {
                    let other = measured[row * columns + (column + step) % columns];
                    around.nearest = around.nearest.min(other.nearest);
                    around.farthest = around.farthest.max(other.farthest);
                }
            }
            around
        };
        let pixels = (0..measured.len()).map(spread).collect();
        Self { settings, shape, pixels }
    }

    /// What the sensor can say of a point, in the axes in which it is at 0.
    pub fn visibility(&self, point: [f64; 3]) -> Visibility {
        let (pixel, range) = locate(self.shape, point);
        let Pixel { nearest, farthest } = self.pixels[pixel];
        if farthest == 0.0 {
            return Visibility::Unmeasured;
        }
        let margin = self.settings.margin + self.settings.relative_margin * range;
        if range < f64::from(nearest) - margin {
            Visibility::FreeSpace
        } else if range < f64::from(farthest) + margin {
            Visibility::Confirmed
        } else {
            Visibility::Hidden
        }
    }

    /// The share of points in free space, of those that the sensor would have measured; 0 where there is none.
    ///
    /// ```
    /// use surfsig::{RangeImageSettings, SphericalRangeImage};
    /// let image = SphericalRangeImage::new(&[[10.0, 0.0, 0.0]], RangeImageSettings::default());
    /// let share = image.free_space_share([[10.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]]);
    /// assert_eq!(share, 0.5);
    /// ```
    pub fn free_space_share(&self, points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
        let (free, in_sight) = self.free_space_counts(points);
        free as f64 / in_sight.max(1) as f64
    }

    /// How many points are in free space, and how many the sensor would have measured.
    pub(crate) fn free_space_counts(&self, points: impl IntoIterator<Item = [f64; 3]>) -> (usize, usize) {
        let (mut free, mut in_sight) = (0, 0);
        for point in points {
            let visibility = self.visibility(point);
            free += usize::from(visibility == Visibility::FreeSpace);
            in_sight += usize::from(visibility.is_in_sight());
        }
        (free, in_sight)
    }
}

/// The pixel of a direction, row by row from straight down and column by column from -x, and the range.
fn locate([rows, columns]: [usize; 2], [x, y, z]: [f64; 3]) -> (usize, f64) {
    let flat = (x * x + y * y).sqrt();
    let elevation = z.atan2(flat) + 0.5 * PI;
    let azimuth = y.atan2(x) + PI;
    let row = ((elevation / PI * rows as f64) as usize).min(rows - 1);
    // Straight along -x the azimuth may be a whole turn.
    let column = (azimuth / TAU * columns as f64) as usize % columns;
    (row * columns + column, (flat * flat + z * z).sqrt())
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    /// The same by looking at all measured points, without an image.
    fn by_brute_force(points: &[[f64; 3]], settings: RangeImageSettings, point: [f64; 3]) -> Visibility {
        let pixel = |[x, y, z]: [f64; 3]| {
            let range = (x * x + y * y + z * z).sqrt();
            let turned = (y.atan2(x) + PI) / settings.pixel;
            let raised = ((z / range).asin() + 0.5 * PI) / settings.pixel;
            (raised.floor() as i64, turned.floor() as i64, range)
        };
        let columns = (TAU / settings.pixel).round() as i64;
        let (row, column, range) = pixel(point);
        let (mut own, mut nearest, mut farthest) = (false, f64::INFINITY, 0.0_f64);
        for (other_row, other_column, other) in points.iter().map(|point| pixel(*point)) {
            let (up, aside) = (other_row - row, (other_column - column).rem_euclid(columns));
            if up.abs() <= 1 && [0, 1, columns - 1].contains(&aside) {
                nearest = nearest.min(other);
                farthest = farthest.max(other);
                own |= up == 0 && aside == 0;
            }
        }
        let margin = settings.margin + settings.relative_margin * range;
        match () {
            () if !own => Visibility::Unmeasured,
            () if range < nearest - margin => Visibility::FreeSpace,
            () if range < farthest + margin => Visibility::Confirmed,
            () => Visibility::Hidden,
        }
    }

    /// Directions that are in no two pixels by rounding.
    fn points() -> impl Strategy<Value = Vec<[f64; 3]>> {
        let point =
            (-1.49_f64..1.49, -3.1_f64..3.1, 5.0_f64..40.0).prop_map(|(elevation, azimuth, range)| {
                let flat = range * elevation.cos();
                [flat * azimuth.cos(), flat * azimuth.sin(), range * elevation.sin()]
            });
        prop::collection::vec(point, 1..200)
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(11), ..Default::default() })]

        #[test]
        fn every_point_is_judged_as_by_all_measured_ones(measured in points(), asked in points()) {
            let settings = RangeImageSettings { pixel: PI / 9.0, ..Default::default() };
            let image = SphericalRangeImage::new(&measured, settings);
            for point in asked {
                prop_assert_eq!(image.visibility(point), by_brute_force(&measured, settings, point));
            }
        }

        #[test]
        fn a_common_scale_changes_nothing(measured in points(), asked in points()) {
            let settings = RangeImageSettings::default();
            let larger = RangeImageSettings { margin: 1024.0 * settings.margin, ..settings };
            let scaled = |points: &[[f64; 3]]| -> Vec<[f64; 3]> {
                points.iter().map(|point| point.map(|c| 1024.0 * c)).collect()
            };
            let image = SphericalRangeImage::new(&measured, settings);
            let of_scaled = SphericalRangeImage::new(&scaled(&measured), larger);
            for (point, moved) in asked.iter().zip(scaled(&asked)) {
                prop_assert_eq!(image.visibility(*point), of_scaled.visibility(moved));
            }
        }
    }

    #[test]
    fn points_without_a_direction_are_no_error() {
        let odd = [[0.0; 3], [f64::NAN; 3], [f64::INFINITY, 0.0, 0.0], [0.0, 0.0, -0.0]];
        let image =
            SphericalRangeImage::new(&odd, RangeImageSettings { pixel: f64::NAN, ..Default::default() });
        assert!(odd.iter().all(|point| image.visibility(*point) == Visibility::Unmeasured));
        assert_eq!(image.free_space_share(odd), 0.0);
    }

    #[test]
    fn the_poles_and_the_seam_are_in_the_image() {
        let all = [[0.0, 0.0, 9.0], [0.0, 0.0, -9.0], [-9.0, 0.0, 0.0], [-9.0, -0.0, 0.0]];
        for point in all {
            let image = SphericalRangeImage::new(&[point], RangeImageSettings::default());
            assert_eq!(image.visibility(point), Visibility::Confirmed);
            assert_eq!(image.visibility(point.map(|c| 0.5 * c)), Visibility::FreeSpace);
            assert_eq!(image.visibility(point.map(|c| 2.0 * c)), Visibility::Hidden);
        }
    }
}
