//! Covariances of transforms that are not determined in some directions: their variance is infinite there.

use super::least_squares::pseudo_inverse;
use nalgebra::{Matrix6, Vector6};

/// Part of a unit motion along an axis, squared, below which the axis is not one of those that it moves along: what noise
/// of the named direction leaves.
const NO_PART: f64 = 0.0025;
/// Length of a motion after those before it are taken from it, of its own, below which it is one of them.
const DEPENDENT: f64 = 1e-3;
/// Of the largest eigenvalue of a covariance, below which it is rounding.
const UNDETERMINED: f64 = 1e-12;

/// The covariance with an infinite variance along motions: the limit of C + s^2 F F^T as s grows. Entries that the
/// motions have no part in stay as they are without them.
///
/// `unit` is the length by which a rotation moves points, per radian.
pub(crate) fn infinite_along(covariance: &Matrix6<f64>, motions: &[Vector6<f64>], unit: f64) -> Matrix6<f64> {
    if motions.is_empty() {
        return *covariance;
    }
    let (finite, open) = separated(covariance, motions, unit);
    let lengths = lengths(unit);
    Matrix6::from_fn(|i, j| {
        if open[(i, j)].abs() < NO_PART {
            finite[(i, j)] / (lengths[(i, i)] * lengths[(j, j)])
        } else {
            f64::INFINITY.copysign(open[(i, j)])
        }
    })
}

/// The inverse of that covariance, which is 0 along the motions.
pub(crate) fn information_without(
    covariance: &Matrix6<f64>,
    motions: &[Vector6<f64>],
    unit: f64,
) -> Matrix6<f64> {
    let (finite, _) = separated(covariance, motions, unit);
    lengths(unit) * pseudo_inverse(finite, UNDETERMINED) * lengths(unit)
}

/// A covariance without motions, and what projects onto these, both with rotations as lengths.
fn separated(covariance: &Matrix6<f64>, motions: &[Vector6<f64>], unit: f64) -> (Matrix6<f64>, Matrix6<f64>) {
    let open: Matrix6<f64> =
        orthonormal(motions, unit).iter().map(|motion| motion * motion.transpose()).sum();
    let kept = Matrix6::identity() - open;
    (kept * lengths(unit) * covariance * lengths(unit) * kept, open)
}

/// The motions, with rotations in units of `unit`, along which a covariance is larger than the square of a length.
pub(crate) fn motions_beyond(covariance: &Matrix6<f64>, length: f64, unit: f64) -> Vec<Vector6<f64>> {
    let lengths = lengths(unit);
    if !covariance.iter().all(|entry| entry.is_finite()) {
        return Vec::new();
    }
    let eigen = (lengths * covariance * lengths).symmetric_eigen();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    let large = pairs.filter(|(value, _)| **value > length * length);
    large.map(|(_, motion)| unscaled(&motion.into_owned(), unit)).collect()
}

/// Unit motions, with rotations as lengths, that span the given ones.
pub(crate) fn orthonormal(motions: &[Vector6<f64>], unit: f64) -> Vec<Vector6<f64>> {
    let mut basis: Vec<Vector6<f64>> = Vec::new();
    for motion in motions {
        let scaled = lengths(unit) * motion;
        let rest = basis.iter().fold(scaled, |rest, known| rest - known * known.dot(&rest));
        if rest.norm() > DEPENDENT * scaled.norm() {
            basis.push(rest.normalize());
        }
    }
    basis
}

/// The twist of a motion whose rotation is given as a length.
pub(crate) fn unscaled(motion: &Vector6<f64>, unit: f64) -> Vector6<f64> {
    Vector6::from_fn(|k, _| if k < 3 { motion[k] / unit } else { motion[k] })
}

/// What gives rotations as lengths.
pub(crate) fn lengths(unit: f64) -> Matrix6<f64> {
    Matrix6::from_diagonal(&Vector6::from_fn(|k, _| if k < 3 { unit } else { 1.0 }))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A covariance whose entries all differ.
    fn covariance() -> Matrix6<f64> {
        let root = Matrix6::from_fn(|i, j| {
            1e-3 * ((1 + i * 7 + j * 3) % 11) as f64 + if i == j { 0.02 } else { 0.0 }
        });
        root * root.transpose()
    }

    #[test]
    fn what_is_finite_is_the_limit_without_the_open_direction() {
        let along = Vector6::new(0.0, 0.0, 0.0, 0.6, 0.8, 0.0);
        let found = infinite_along(&covariance(), &[along, along], 2.0);
        let infinite = |i: usize, j: usize| found[(i, j)].is_infinite();
        assert!(infinite(3, 3) && infinite(4, 4) && infinite(3, 4) && found[(3, 4)] > 0.0);
        assert!((0..6).all(|k| k == 3 || k == 4 || found[(k, k)].is_finite() && found[(k, k)] > 0.0));
        // The same as with a very large variance, but for rounding.
        let large = covariance() + along * along.transpose() * 1e6;
        let across = Vector6::new(0.0, 0.0, 0.0, 0.8, -0.6, 0.0);
        assert!((across.dot(&(large * across)) - across.dot(&(covariance() * across))).abs() < 1e-9);
        assert!((found[(5, 5)] - covariance()[(5, 5)]).abs() < 1e-12);
        assert_eq!(infinite_along(&covariance(), &[], 1.0), covariance());
        let information = information_without(&covariance(), &[along], 2.0);
        assert!((information * along).amax() < 1e-6 * information.amax());
        let whole = information_without(&covariance(), &[], 2.0) * covariance();
        assert!((whole - Matrix6::identity()).amax() < 1e-6);
    }

    #[test]
    fn motions_of_large_variance_are_found_again() {
        let motion = Vector6::new(0.0, 0.3, 0.0, 0.0, 0.0, 0.8);
        let large = covariance() + motion * motion.transpose() * 1e6;
        let [found] = motions_beyond(&large, 100.0, 2.0)[..] else { panic!() };
        let (a, b) = (orthonormal(&[found], 2.0)[0], orthonormal(&[motion], 2.0)[0]);
        assert!(a.dot(&b).abs() > 1.0 - 1e-6);
        assert!(motions_beyond(&covariance(), 100.0, 2.0).is_empty());
        assert!(motions_beyond(&Matrix6::repeat(f64::NAN), 1.0, 1.0).is_empty());
    }
}
