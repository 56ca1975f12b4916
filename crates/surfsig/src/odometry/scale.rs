//! Lengths that a sequence is worked with, taken from its first scan.

use super::settings::ScaleSettings;
use crate::statistics::median;
use crate::statistics::quantile;
use rustc_hash::FxHashSet;

/// Halvings of the interval in which the voxel is looked for: 1e-6 to 1 of the scan's extent, to one part in a million.
const HALVINGS: usize = 24;

/// Lengths in the scans' unit.
#[derive(Debug, Clone, Copy)]
pub(super) struct Scale {
    /// Edge of the voxels in which scans and map are thinned; all else is counted in it.
    pub voxel: f64,
    /// Median distance from the sensor.
    pub median_range: f64,
    /// Radius of the patches of signatures.
    pub patch_radius: f64,
}

impl Scale {
    /// Takes the lengths from a scan about its sensor.
    pub fn new(points: &[[f64; 3]], voxel: Option<f64>, settings: &ScaleSettings) -> Self {
        let middle = median_point(points);
        let spread = distances(points, middle);
        let largest = quantile(&mut spread.clone(), settings.central_share);
        let central: Vec<[f64; 3]> = points
            .iter()
            .zip(&spread)
            .filter(|(_, distance)| **distance <= largest)
            .map(|(point, _)| *point)
            .collect();
        Self {
            voxel: voxel.unwrap_or_else(|| edge_of_voxels(&central, settings)),
            median_range: median(distances(points, [0.0; 3])).unwrap_or(0.0),
            patch_radius: settings.patch_radius * median(spread).unwrap_or(0.0),
        }
    }
}

/// The median of each coordinate.
pub(super) fn median_point(points: &[[f64; 3]]) -> [f64; 3] {
    [0, 1, 2].map(|k| median(points.iter().map(|point| point[k]).collect()).unwrap_or(0.0))
}

pub(super) fn distances(points: &[[f64; 3]], from: [f64; 3]) -> Vec<f64> {
    let distance = |point: &[f64; 3]| {
        let [x, y, z] = [0, 1, 2].map(|k| point[k] - from[k]);
        (x * x + y * y + z * z).sqrt()
    };
    points.iter().map(distance).collect()
}

/// The edge of which the points fill as many voxels as are wanted, by halving the interval of its logarithm.
fn edge_of_voxels(points: &[[f64; 3]], settings: &ScaleSettings) -> f64 {
    let wanted = settings.wanted(points.len());
    let extent = |k: usize| {
        let coordinates = points.iter().map(|point| point[k]);
        coordinates.clone().fold(f64::NEG_INFINITY, f64::max) - coordinates.fold(f64::INFINITY, f64::min)
    };
    let largest = (0..3).map(extent).fold(0.0, f64::max);
    let (mut low, mut high) = ((largest * 1e-6).ln(), largest.ln());
    let mut filled = FxHashSet::default();
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let edge = middle.exp();
        filled.clear();
        filled.extend(points.iter().map(|point| point.map(|c| (c / edge).floor() as i64)));
        if filled.len() as f64 > wanted {
            low = middle;
        } else {
            high = middle;
        }
    }
    high.exp()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::voxels::voxel_means;

    #[test]
    fn a_scan_fills_as_many_voxels_as_were_asked_for() {
        let number = |i: u64, k: u64| {
            ((i * 3 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let points: Vec<[f64; 3]> =
            (0..50_000).map(|i| [10.0 * number(i, 0), 7.0 * number(i, 1), 0.0]).collect();
        let settings = ScaleSettings::default();
        for (count, expected) in [(points.len(), 4000.0), (1000, 800.0)] {
            let scale = Scale::new(&points[..count], None, &settings);
            let filled = voxel_means(&points[..count], scale.voxel).len() as f64;
            assert!((filled - expected).abs() < 0.02 * expected, "{filled}");
        }
    }

    #[test]
    fn lengths_are_medians_and_an_outlier_does_not_move_them() {
        let mut points: Vec<[f64; 3]> = (0..201).map(|i| [10.0 + f64::from(i) * 0.01, 0.0, 0.0]).collect();
        points.push([1e9, 0.0, 0.0]);
        let scale = Scale::new(&points, Some(0.5), &ScaleSettings::default());
        assert_eq!(scale.voxel, 0.5);
        assert!((scale.median_range - 11.005).abs() < 1e-9);
        assert!((scale.patch_radius - 0.35 * 0.505).abs() < 1e-9);
        let by_points = Scale::new(&points, None, &ScaleSettings::default()).voxel;
        assert!(by_points < 0.1);
    }
}
