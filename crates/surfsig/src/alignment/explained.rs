//! How much of a source a target's surface explains, and whether two transforms explain the same.

use super::clustered_covariance::{block_count, block_numbers};
use super::point_to_surface::PointToSurfaceSettings;
use super::target_surface::TargetSurface;
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};

/// Blocks without which no standard error is known.
const FEWEST_BLOCKS: usize = 5;
/// Of the points that meet a surface with one transform, those that must with another, to be compared.
const LEAST_KNOWN: f64 = 0.75;

/// How near points lie to a surface: 1 on it, 0 from the largest distance on; `None` where the target has no surface,
/// as between its scan lines: such points speak neither for a transform nor against it.
pub(crate) type Closeness = Vec<Option<f64>>;

/// Instead of a closeness where the target's sensor cannot have seen the point: it speaks neither for a transform nor
/// against it, but the transform does not lead off the target there.
pub(crate) const HIDDEN: f64 = f64::NAN;

/// What a transform explains of a source.
#[derive(Debug, Clone)]
pub(crate) struct Explained {
    closeness: Closeness,
    /// The block of each point.
    block: Vec<u32>,
}

impl TargetSurface {
    /// Of points in the target's coordinates; residuals count up to `farthest`, in the points' unit.
    pub fn closeness(
        &self,
        points: &[[f64; 3]],
        farthest: f64,
        settings: &PointToSurfaceSettings,
    ) -> Closeness {
        let closeness = |distance: f64| (1.0 - (distance / farthest).powi(2)).max(0.0);
        self.distances(points, settings).into_iter().map(|distance| distance.map(closeness)).collect()
    }
}

/// The share of all points that is explained, 0 to 1.
pub(crate) fn explained_share(closeness: &[Option<f64>]) -> f64 {
    closeness.iter().flatten().filter(|share| !share.is_nan()).sum::<f64>() / closeness.len().max(1) as f64
}

impl Explained {
    /// Takes how near each point of a source lies, and where it is in the source.
    pub fn new(closeness: Closeness, source: &[[f64; 3]]) -> Self {
        Self { closeness, block: block_numbers(source) }
    }

    pub fn share(&self) -> f64 {
        explained_share(&self.closeness)
    }

    /// By how much another transform explains less of the points that meet the surface with both, as a share of what
    /// this one explains of them, and its standard error; `None` where the other one meets far less of it.
    ///
    /// The error is what noise alone would give: the smaller one of what blocks of neighbours differ by in the mean,
    /// and in the median, by which few blocks that only one of both explains are no noise.
    pub fn deficit_of(&self, other: &[Option<f64>]) -> Option<(f64, f64)> {
        let known = |closeness: &[Option<f64>]| closeness.iter().flatten().count() as f64;
        if known(other) < LEAST_KNOWN * known(&self.closeness) {
            return None;
        }
        let count = block_count(&self.block);
        let (mut sums, mut whole) = (vec![0.0; count], 0.0);
        for ((mine, theirs), &block) in self.closeness.iter().zip(other).zip(&self.block) {
            let (Some(mine), Some(theirs)) = (mine, theirs) else { continue };
            if !mine.is_nan() && !theirs.is_nan() {
                sums[block as usize] += mine - theirs;
                whole += mine;
            }
        }
        let whole = whole.max(f64::MIN_POSITIVE);
        let sum = sums.iter().sum::<f64>();
        if count < FEWEST_BLOCKS {
            return Some((sum / whole, 0.0));
        }
        let mean = sum / count as f64;
        let square = sums.iter().map(|sum| (sum - mean).powi(2)).sum::<f64>() / (count - 1) as f64;
        let middle = median(sums.clone()).unwrap_or(0.0);
        let off = sums.iter().map(|sum| (sum - middle).abs()).collect();
        let deviation = square.sqrt().min(DEVIATIONS_PER_MEDIAN * median(off).unwrap_or(0.0));
        Some((sum / whole, deviation * (count as f64).sqrt() / whole))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// A line of 64 points in 8 blocks.
    fn line() -> Vec<[f64; 3]> {
        (0..64).map(|i| [f64::from(i), 0.0, 0.0]).collect()
    }

    #[test]
    fn what_only_a_part_loses_is_no_noise() {
        let best: Closeness = (0..64).map(|i| Some(0.8 + 0.1 * uniform(i, 1))).collect();
        let noisy: Closeness = (0..64).map(|i| Some(0.8 + 0.1 * uniform(i, 2))).collect();
        let explained = Explained::new(best.clone(), &line());
        let (deficit, error) = explained.deficit_of(&noisy).unwrap();
        assert!(deficit.abs() < 3.0 * error && error < 0.01, "{deficit} {error}");
        // One block of eight is lost, or all but one are.
        for lost in [0..8, 8..64] {
            let part: Closeness =
                (0..64).map(|i| if lost.contains(&i) { Some(0.0) } else { noisy[i] }).collect();
            let (deficit, error) = explained.deficit_of(&part).unwrap();
            assert!(deficit > 0.1 && deficit > 3.0 * error, "{deficit} {error}");
        }
        assert_eq!(explained.deficit_of(&best), Some((0.0, 0.0)));
    }

    #[test]
    fn points_that_meet_no_surface_say_nothing_unless_they_are_many() {
        let best: Closeness = vec![Some(0.9); 64];
        let explained = Explained::new(best, &line());
        let some: Closeness = (0..64).map(|i| (i % 8 > 0).then_some(0.9)).collect();
        let hidden: Closeness = (0..64).map(|i| Some(if i % 2 > 0 { 0.9 } else { HIDDEN })).collect();
        assert_eq!(explained.deficit_of(&hidden).unwrap().0, 0.0);
        assert!((explained_share(&hidden) - 0.45).abs() < 1e-12);
        let half: Closeness = (0..64).map(|i| (i % 2 > 0).then_some(0.9)).collect();
        assert_eq!(explained.deficit_of(&some).unwrap().0, 0.0);
        assert_eq!(explained.deficit_of(&half), None);
        assert!((explained_share(&half) - 0.45).abs() < 1e-12);
        assert_eq!(explained_share(&[]), 0.0);
    }
}
