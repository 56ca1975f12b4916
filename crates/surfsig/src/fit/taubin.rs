//! Taubin's normalisation, which the implicit fits share: the least mean square of Q where its gradient has
//! the mean square 1, so that Q is to first order the distance from the surface.
//!
//! The constant of Q is free, which makes it minus the mean of the rest. Nine monomials remain: x, y,
//! z, xx, xy, xz, yy, yz, zz, in the slots 1 to 9 of the moments.

use crate::moments::{EXPONENTS, Moments, slot};
use nalgebra::{Const, Dyn, OMatrix, SMatrix, SVector, SymmetricEigen};

/// Coefficients beside the constant.
pub(super) const TERMS: usize = 9;

/// Which moment is the product of two of the nine monomials.
pub(super) const PRODUCT: [[usize; TERMS]; TERMS] = {
    let mut table = [[0; TERMS]; TERMS];
    let mut i = 0;
    while i < TERMS {
        let mut j = 0;
        while j < TERMS {
            let (a, b) = (EXPONENTS[i + 1], EXPONENTS[j + 1]);
            table[i][j] = slot((a[0] + b[0]) as usize, (a[1] + b[1]) as usize, (a[2] + b[2]) as usize);
            j += 1;
        }
        i += 1;
    }
    table
};

/// The two quadratic forms of one set of points, for surfaces that are fitted per object.
pub(super) struct Pencil {
    /// Variance of Q.
    variance: SMatrix<f64, TERMS, TERMS>,
    /// Mean square of the gradient of Q.
    gradient: SMatrix<f64, TERMS, TERMS>,
    mean: SVector<f64, TERMS>,
}

/// The best of a family of surfaces.
pub(super) struct Best {
    /// The constant, then the nine others.
    pub coefficients: [f64; TERMS + 1],
    /// Mean square of Q, hence of the distance.
    pub mean_square: f64,
}

/// A family of quadrics: a linear space, whose basis stands in the columns.
pub(super) type Family = OMatrix<f64, Const<TERMS>, Dyn>;

impl Pencil {
    /// Of the moments about a place near the points, in units of about their extent.
    pub fn new(moments: &Moments<f64>) -> Self {
        let average = |slot: usize| moments.sums[slot] / moments.sums[0];
        let mean = SVector::from_fn(|i, _| average(i + 1));
        let variance = SMatrix::from_fn(|i, j| average(PRODUCT[i][j]) - mean[i] * mean[j]);
        let gradient = SMatrix::from_fn(|i, j| {
            let (a, b) = (EXPONENTS[i + 1], EXPONENTS[j + 1]);
            // The mean of the product of both derivatives, axis by axis.
            (0..3)
                .filter(|&axis| a[axis] > 0 && b[axis] > 0)
                .map(|axis| {
                    let mut e = [0, 1, 2].map(|k| usize::from(a[k] + b[k]));
                    e[axis] -= 2;
                    f64::from(a[axis] * b[axis]) * average(slot(e[0], e[1], e[2]))
                })
                .sum()
        });
        Self { variance, gradient, mean }
    }

    /// The best surface of a family; `None` where the points do not tell its members apart.
    pub fn best(&self, family: &Family) -> Option<Best> {
        let variance = family.transpose() * self.variance * family;
        let lower = (family.transpose() * self.gradient * family).cholesky()?.l();
        let half = lower.solve_lower_triangular(&variance)?;
        let whole = lower.solve_lower_triangular(&half.transpose())?;
        let eigen = SymmetricEigen::new(whole);
        let least = eigen.eigenvalues.imin();
        let in_family = lower.tr_solve_lower_triangular(&eigen.eigenvectors.column(least))?;
        let others = family * in_family;
        let mut coefficients = [0.0; TERMS + 1];
        coefficients[0] = -self.mean.dot(&others);
        coefficients[1..].copy_from_slice(others.as_slice());
        Some(Best { coefficients, mean_square: eigen.eigenvalues[least].max(0.0) })
    }
}

/// Where moments are taken about to be fitted, and the unit of length.
pub(super) struct Placement {
    pub centre: [f64; 3],
    pub unit: f64,
}

impl Placement {
    /// About the mean, in units of the points' root mean square distance from it; `None` for fewer
    /// than `least` points, for points that are all one, or not finite.
    pub fn of(moments: &Moments<f64>, least: usize) -> Option<(Self, Moments<f64>)> {
        let count = moments.sums[0];
        if count < least as f64 || !moments.sums.iter().all(|s| s.is_finite()) {
            return None;
        }
        let centre = [1, 2, 3].map(|k| moments.sums[k] / count);
        let central = moments.shifted(centre.map(|c| -c));
        let unit = ((central.get(2, 0, 0) + central.get(0, 2, 0) + central.get(0, 0, 2)) / count).sqrt();
        (unit > 0.0).then(|| (Self { centre, unit }, central.scaled(1.0 / unit)))
    }

    /// A place in these units, in the points' own coordinates.
    pub fn place(&self, q: [f64; 3]) -> [f64; 3] {
        [0, 1, 2].map(|axis| self.centre[axis] + self.unit * q[axis])
    }
}
