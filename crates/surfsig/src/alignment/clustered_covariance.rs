//! Covariances of transforms whose residuals err alike near each other: cluster-robust, by blocks.

use super::least_squares::pseudo_inverse;
use nalgebra::{Matrix6, Vector6};
use rustc_hash::FxHashMap;

/// Blocks along the overlap: what errs alike within one counts once.
const BLOCKS: f64 = 8.0;
/// Blocks without which there are too few to tell whether errors are alike.
const FEWEST: usize = 20;
/// Of the largest eigenvalue, below which a direction is not observable and has no variance here.
const UNOBSERVABLE: f64 = 1e-12;

/// The number of the block of each point, from 0; `None` where blocks are too few.
pub(crate) fn blocks(points: &[[f64; 3]]) -> Option<Vec<u32>> {
    let found = block_numbers(points);
    (block_count(&found) > FEWEST).then_some(found)
}

/// How many blocks there are.
pub(crate) fn block_count(numbers: &[u32]) -> usize {
    numbers.iter().max().map_or(0, |&last| last as usize + 1)
}

/// The number of the block of each point, from 0.
pub(crate) fn block_numbers(points: &[[f64; 3]]) -> Vec<u32> {
    let fold = |of: fn(f64, f64) -> f64, start: f64| {
        points.iter().fold([start; 3], |bound, point| [0, 1, 2].map(|k| of(bound[k], point[k])))
    };
    let (low, high) = (fold(f64::min, f64::INFINITY), fold(f64::max, f64::NEG_INFINITY));
    let edge = (0..3).map(|k| high[k] - low[k]).fold(0.0, f64::max) / BLOCKS;
    let mut numbers: FxHashMap<[u8; 3], u32> = FxHashMap::default();
    let number = |point: &[f64; 3]| {
        let next = numbers.len() as u32;
        // The farthest point belongs to the last block.
        let block = [0, 1, 2].map(|k| ((point[k] - low[k]) / edge).min(BLOCKS - 1.0) as u8);
        *numbers.entry(block).or_insert(next)
    };
    points.iter().map(number).collect()
}

/// The covariance of a least-squares solution of which only sums over whole blocks are independent.
///
/// `design` says how each residual changes with the six unknowns. The sandwich of Liang and Zeger (Longitudinal data
/// analysis using generalized linear models, 1986), times blocks over blocks less unknowns.
pub(crate) fn clustered_covariance(design: &[[f64; 6]], residuals: &[f64], block: &[u32]) -> Matrix6<f64> {
    let count = block_count(block);
    let mut gradients = vec![Vector6::zeros(); count];
    let mut information = Matrix6::zeros();
    for ((row, residual), &block) in design.iter().zip(residuals).zip(block) {
        let row = Vector6::from(*row);
        gradients[block as usize] += row * *residual;
        information += row * row.transpose();
    }
    let spread = gradients.iter().map(|gradient| gradient * gradient.transpose()).sum::<Matrix6<f64>>();
    let inverse = pseudo_inverse(information, UNOBSERVABLE);
    inverse * spread * inverse * (count as f64 / (count as f64 - 6.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn number(i: usize, k: usize) -> f64 {
        ((i * 6 + k) as f64 * 12.9898).sin() * 43_758.545_3 % 1.0
    }

    #[test]
    fn with_a_block_for_each_residual_it_is_the_heteroscedastic_covariance() {
        let design: Vec<[f64; 6]> = (0..60).map(|i| std::array::from_fn(|k| number(i, k))).collect();
        let residuals: Vec<f64> = (0..60).map(|i| number(i, 17)).collect();
        let each: Vec<u32> = (0..60).collect();
        let found = clustered_covariance(&design, &residuals, &each);
        let x = nalgebra::DMatrix::from_fn(60, 6, |i, k| design[i][k]);
        let inverse = (x.transpose() * &x).try_inverse().unwrap();
        let weights = nalgebra::DMatrix::from_diagonal(&nalgebra::DVector::from_iterator(
            60,
            residuals.iter().map(|r| r * r),
        ));
        let expected = &inverse * x.transpose() * weights * &x * &inverse * (60.0 / 54.0);
        assert!((found - expected).amax() < 1e-10);
        // Every residual twice, in the same block: nothing more is known.
        let twice = |count: usize| (0..2 * count).map(|i| i / 2).collect::<Vec<_>>();
        let doubled: Vec<[f64; 6]> = twice(60).iter().map(|&i| design[i]).collect();
        let (again, block): (Vec<f64>, Vec<u32>) =
            twice(60).iter().map(|&i| (residuals[i], i as u32)).unzip();
        assert!((clustered_covariance(&doubled, &again, &block) - found).amax() < 1e-12);
    }

    #[test]
    fn blocks_are_an_eighth_of_the_overlap() {
        let square: Vec<[f64; 3]> = (0..1600).map(|i| [(i % 40) as f64, (i / 40) as f64, 0.0]).collect();
        let found = blocks(&square).unwrap();
        assert_eq!(found.iter().max(), Some(&63));
        assert!(found[0] == found[1] && found[0] != found[20]);
        assert_eq!(blocks(&square[..40]), None, "a line has eight");
        assert_eq!(blocks(&[[1.0; 3]; 30]), None);
        assert_eq!(blocks(&[]), None);
    }
}
