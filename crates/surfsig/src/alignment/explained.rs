//! How much of a source a target's surface explains, and whether two transforms explain the same.

use super::clustered_covariance::{block_count, block_numbers};
use super::point_to_surface::{PointToSurfaceSettings, TargetSurface};
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};

/// Blocks without which no standard error is known.
const FEWEST_BLOCKS: usize = 5;

/// For each point of a source how near it lies to the target's surface: 1 on it, 0 from the largest distance on and
/// where there is no surface.
#[derive(Debug, Clone)]
pub(crate) struct Explained {
    closeness: Vec<f64>,
    /// The block of each point.
    block: Vec<u32>,
}

impl TargetSurface {
    /// Of points in the target's coordinates; residuals count up to `farthest`, in the points' unit.
    pub fn explained(
        &self,
        points: &[[f64; 3]],
        farthest: f64,
        settings: &PointToSurfaceSettings,
    ) -> Vec<f64> {
        let distances = self.distances(points, settings);
        let closeness = |distance: Option<f64>| {
            distance.map_or(0.0, |distance| (1.0 - (distance / farthest).powi(2)).max(0.0))
        };
        distances.into_iter().map(closeness).collect()
    }
}

impl Explained {
    /// Takes how near each point of a source lies, and where it is in the source.
    pub fn new(closeness: Vec<f64>, source: &[[f64; 3]]) -> Self {
        Self { closeness, block: block_numbers(source) }
    }

    /// The share of the source that is explained, 0 to 1.
    pub fn share(&self) -> f64 {
        self.closeness.iter().sum::<f64>() / self.closeness.len().max(1) as f64
    }

    /// By how much another transform explains less of the same points, as a share of what this one explains, and its
    /// standard error, which noise alone would give.
    ///
    /// The error comes from what blocks differ by in the median, so that a part of the source that only one of both
    /// explains does not count as noise. It is 0 where blocks are too few to differ.
    pub fn deficit_of(&self, other: &[f64]) -> (f64, f64) {
        let count = block_count(&self.block);
        let mut sums = vec![0.0; count];
        for ((mine, theirs), &block) in self.closeness.iter().zip(other).zip(&self.block) {
            sums[block as usize] += mine - theirs;
        }
        let whole = self.closeness.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let deficit = sums.iter().sum::<f64>() / whole;
        if count < FEWEST_BLOCKS {
            return (deficit, 0.0);
        }
        let middle = median(sums.clone()).unwrap_or(0.0);
        let deviation = DEVIATIONS_PER_MEDIAN
            * median(sums.iter().map(|sum| (sum - middle).abs()).collect()).unwrap_or(0.0);
        (deficit, deviation * (count as f64).sqrt() / whole)
    }
}
