//! How far a scan sees: what tells, whatever way it is turned, where it cannot have been taken.

use super::super::thinned_scan::ThinnedScan;

/// Quantiles that are compared.
const QUANTILES: usize = 16;

/// Quantiles of the distances of a scan's points from its sensor, in voxels.
#[derive(Debug, Clone, Copy)]
pub(super) struct Ranges([f64; QUANTILES]);

impl Ranges {
    pub fn new(scan: &ThinnedScan) -> Self {
        let length = |point: &[f64; 3]| point.iter().map(|c| c * c).sum::<f64>().sqrt();
        // One for each of the coarse voxels: what is dense has no weight.
        let mut lengths: Vec<f64> = scan.coarse.points().iter().map(length).collect();
        lengths.sort_by(f64::total_cmp);
        let at = |k: usize| lengths.get((2 * k + 1) * lengths.len() / (2 * QUANTILES)).copied();
        Self(std::array::from_fn(|k| at(k).unwrap_or(0.0)))
    }

    /// The mean difference to those of another scan, as a part of its ranges.
    pub fn difference(&self, other: &Self) -> f64 {
        let part = |(a, b): (&f64, &f64)| (a - b).abs() / a.max(*b).max(f64::MIN_POSITIVE);
        self.0.iter().zip(&other.0).map(part).sum::<f64>() / QUANTILES as f64
    }
}
