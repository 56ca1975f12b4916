//! What a pose may be off by: parts that add up in different ways.

use crate::RigidTransform;
use nalgebra::Matrix6;

/// What a pose may be off by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Covariance {
    /// By chance, in each scan anew.
    pub random: Matrix6<f64>,
    /// Alike in all scans.
    pub systematic: Matrix6<f64>,
    /// Along motions that nothing determines, in the unknown variance of such a motion: they stay apart from the
    /// others, so that the small angles between those of several scans do not count.
    pub open: Matrix6<f64>,
}

impl Covariance {
    pub fn zeros() -> Self {
        Self { random: Matrix6::zeros(), systematic: Matrix6::zeros(), open: Matrix6::zeros() }
    }

    /// With translations in another unit, of which the present one has `factor`.
    pub fn scaled(&self, factor: f64) -> Self {
        let unit = |k: usize| if k < 3 { 1.0 } else { factor };
        let scaled = |covariance: &Matrix6<f64>| {
            Matrix6::from_fn(|row, column| unit(row) * covariance[(row, column)] * unit(column))
        };
        Self { random: scaled(&self.random), systematic: scaled(&self.systematic), open: scaled(&self.open) }
    }

    /// With an error that is independent of it.
    pub fn and(&self, other: &Self) -> Self {
        Self {
            random: self.random + other.random,
            systematic: self.systematic + other.systematic,
            open: self.open + other.open,
        }
    }

    /// In other axes.
    pub fn carried(&self, transform: &RigidTransform) -> Self {
        let adjoint = transform.adjoint();
        let adjoint = Matrix6::from_fn(|row, column| adjoint[row][column]);
        let carried = |covariance: &Matrix6<f64>| adjoint * covariance * adjoint.transpose();
        Self {
            random: carried(&self.random),
            systematic: carried(&self.systematic),
            open: carried(&self.open),
        }
    }
}

/// The covariance of a sum whose parts may err alike: the least one that none of their correlations exceeds in trace, with
/// rotations in units of `unit`.
pub(super) fn sum_of_alike(one: &Matrix6<f64>, other: &Matrix6<f64>, unit: f64) -> Matrix6<f64> {
    let size = |covariance: &Matrix6<f64>| {
        (0..6).map(|k| covariance[(k, k)] * if k < 3 { unit * unit } else { 1.0 }).sum::<f64>().sqrt()
    };
    let (of_one, of_other) = (size(one), size(other));
    if of_one == 0.0 || of_other == 0.0 {
        return one + other;
    }
    one * (1.0 + of_other / of_one) + other * (1.0 + of_one / of_other)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_err_alike_add_up_before_they_are_squared() {
        let one = Matrix6::identity() * 0.04;
        let sum = sum_of_alike(&one, &(one * 9.0), 5.0);
        assert!((sum - Matrix6::identity() * 0.64).amax() < 1e-12, "0.2 + 0.6, squared");
        assert_eq!(sum_of_alike(&one, &Matrix6::zeros(), 5.0), one);
    }
}
