//! How alike neighbouring points err, learnt from surfaces that grow on trial.
//!
//! The nearest points of a place show only what errors differ by among themselves. What they have in common (steps of
//! a sensor's depth, a lens, smoothing in the camera) bends a surface instead, and would make two of one.

use super::growth::Region;
use super::scene::Scene;
use crate::primitive::{Vector, design_effect};
use crate::statistics::{quantile, upper_median};

/// Surfaces that are grown on trial, from seeds spread evenly over those whose noise is from a tenth to six tenths.
const TRIALS: usize = 48;
const SMOOTHEST: f64 = 0.1;
const ROUGHEST: f64 = 0.6;

/// Fewest of them that tell something.
const FEWEST: usize = 8;

/// Points at which a trial ends, and which it must have.
const ENOUGH: usize = 2000;
const LEAST: usize = 60;

/// Points in a block of neighbours.
const BLOCK: usize = 50;

/// Fewest points that err as one from which they count as alike at all.
const ALIKE: f64 = 2.0;

/// Points of a trial that tells how large noise is.
const LARGE: usize = 300;

/// Ratio of the deviations that three quarters and a tenth of the large trials stay below, up to which noise is the same everywhere.
const HOMOGENEOUS: f64 = 1.3;

/// Fewest large trials that tell so.
const FEWEST_LARGE: usize = 5;

/// Rounds, and the ratio at which they end.
const ROUNDS: usize = 5;
const CONVERGED: f64 = 1.08;

/// How far points lie from their surface, in units of the noise that their nearest points show; and how many points
/// have one error in common.
#[derive(Clone, Copy)]
pub(super) struct Likeness {
    pub spread: f64,
    pub alike: f64,
}

impl Likeness {
    /// Points that err each for itself.
    pub const NONE: Self = Self { spread: 1.0, alike: 1.0 };
}

/// Measures how far points lie from surfaces that are grown on trial, with the tolerance that the last round measured,
/// until it does not rise any more. Tells whether there was anything to learn from.
pub(super) fn learn(
    scene: &mut Scene,
    seeds: &[u32],
    mut grower: impl FnMut(&Scene, u32, usize) -> Option<Region>,
) -> bool {
    let (first, last) = ((SMOOTHEST * seeds.len() as f64) as usize, (ROUGHEST * seeds.len() as f64) as usize);
    let step = ((last - first) / TRIALS).max(1);
    for round in 0..ROUNDS {
        let mut deviations = Vec::new();
        let mut alike = Vec::new();
        let mut large = Vec::new();
        for &seed in seeds[first..last].iter().step_by(step) {
            let Some(region) = grower(scene, seed, ENOUGH) else { continue };
            if region.members.len() >= LEAST && !scene.is_noiseless(region.noise) {
                deviations.push(region.deviation / region.noise);
                alike.push(points_as_one(scene, &region));
                if region.members.len() >= LARGE {
                    large.push(region.deviation);
                }
            }
        }
        if deviations.len() < FEWEST {
            return round > 0;
        }
        let (deviation, alike) =
            (upper_median(deviations).unwrap_or(1.0), upper_median(alike).unwrap_or(1.0));
        if alike < ALIKE {
            scene.common_noise = common_noise(large);
            return true;
        }
        scene.likeness.alike = alike;
        if deviation < CONVERGED {
            return true;
        }
        scene.likeness.spread *= deviation;
    }
    true
}

/// The noise that large surfaces have in common, if they have; infinite where it differs.
fn common_noise(mut deviations: Vec<f64>) -> f64 {
    if deviations.len() < FEWEST_LARGE {
        return f64::INFINITY;
    }
    let [low, middle, high] = [0.1, 0.5, 0.75].map(|share| quantile(&mut deviations, share));
    if high <= HOMOGENEOUS * low { middle } else { f64::INFINITY }
}

/// How many points of a surface count as one.
fn points_as_one(scene: &Scene, region: &Region) -> f64 {
    let points: Vec<Vector> = region.members.iter().map(|&member| scene.points[member as usize]).collect();
    let chart = region.primitive.chart();
    let residuals: Vec<f64> = points.iter().map(|point| chart.distance(point)).collect();
    design_effect(&points, &residuals, points.len().div_ceil(BLOCK))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_is_common_where_it_hardly_differs() {
        assert_eq!(common_noise(vec![1.0, 1.1, 1.2, 1.05, 1.1]), 1.1);
        assert_eq!(common_noise(vec![1.0, 1.1, 2.0, 3.0, 1.1]), f64::INFINITY);
        assert_eq!(common_noise(vec![1.0; 4]), f64::INFINITY);
    }
}
