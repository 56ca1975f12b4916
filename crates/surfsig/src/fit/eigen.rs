//! The two smallest eigenvalues of Taubin's problem, for eight points at once, by inverse iteration.

use super::covariance::rotation;
use super::taubin::{PRODUCT, TERMS};
use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::MomentBatch;

/// One number for each of the nine monomials.
pub(super) type Terms = [Lanes; TERMS];

/// Iterations after which a fit has not converged. The error falls by the third over the first
/// eigenvalue each time: by 4 at least where the quadric can be used at all.
const MAX_ITERATIONS: usize = 10;

/// Change of the smallest eigenvalue, relative to it, that ends the iteration: the vector is then
/// right to its root.
const CONVERGED: f64 = 1e-11;

/// What rounding makes of an eigenvalue 0, in squares of the radius.
const ROUNDING: f64 = 1e-17;

/// Pivots below this share of their diagonal are rounding, as on points without noise.
const PIVOT: f64 = 1e-15;

/// The variance of Q over the points, factored, and the mean square of its gradient.
pub(super) struct Pencil<'a> {
    moments: &'a MomentBatch,
    variance: [Terms; TERMS],
    /// L of L D L^T below the diagonal; the rest is not read.
    lower: [Terms; TERMS],
    inverse_pivot: Terms,
}

/// The smallest eigenvalue with its vector, and the next one.
pub(super) struct Smallest {
    pub value: Lanes,
    /// From above: converged only as far as `value` needed iterations, so the less the wider the gap is.
    pub next: Lanes,
    pub vector: Terms,
    /// The gradient's form times the vector.
    pub dual: Terms,
    pub converged: Mask,
}

impl<'a> Pencil<'a> {
    #[inline(always)]
    pub fn new(moments: &'a MomentBatch) -> Self {
        let mut variance = [[Lanes::ZERO; TERMS]; TERMS];
        for i in 0..TERMS {
            for j in 0..=i {
                let value = (-moments.monomial(i + 1))
                    .mul_add(moments.monomial(j + 1), moments.monomial(PRODUCT[i][j]));
                variance[i][j] = value;
                variance[j][i] = value;
            }
        }
        let mut lower = variance;
        let mut inverse_pivot = [Lanes::ONE; TERMS];
        for i in 0..TERMS {
            for j in 0..i {
                // This row is L D, up to j.
                let mut value = lower[i][j];
                for k in 0..j {
                    value = (-lower[i][k]).mul_add(lower[j][k], value);
                }
                lower[i][j] = value;
            }
            let mut pivot = lower[i][i];
            for j in 0..i {
                let scaled = lower[i][j] * inverse_pivot[j];
                pivot = (-lower[i][j]).mul_add(scaled, pivot);
                lower[i][j] = scaled;
            }
            let least = variance[i][i].mul_add(Lanes::splat(PIVOT), Lanes::splat(PIVOT * PIVOT));
            inverse_pivot[i] = Lanes::ONE / pivot.max(least);
        }
        Self { moments, variance, lower, inverse_pivot }
    }

    /// The gradient's form times a vector, read off the moments up to order 2.
    #[inline(always)]
    fn gradient_form(&self, x: &Terms) -> Terms {
        let m = self.moments.mean();
        let [xx, xy, xz, yy, yz, zz] = *self.moments.second();
        let second = [[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]];
        let hessian = hessian(x);
        let mut mean = [Lanes::ZERO; 3];
        // The mean of the gradient times the position.
        let mut moment = [[Lanes::ZERO; 3]; 3];
        for i in 0..3 {
            mean[i] = x[i];
            for k in 0..3 {
                mean[i] = hessian[i][k].mul_add(m[k], mean[i]);
            }
            for j in 0..3 {
                moment[i][j] = x[i] * m[j];
                for k in 0..3 {
                    moment[i][j] = hessian[i][k].mul_add(second[k][j], moment[i][j]);
                }
            }
        }
        let mut product = [
            mean[0],
            mean[1],
            mean[2],
            moment[0][0],
            moment[0][1],
            moment[0][2],
            moment[1][1],
            moment[1][2],
            moment[2][2],
        ];
        for (term, j, i) in [(3, 0, 0), (4, 1, 0), (5, 2, 0), (6, 1, 1), (7, 2, 1), (8, 2, 2)] {
            product[term] = product[term] + moment[j][i];
        }
        product
    }

    #[inline(always)]
    fn variance_form(&self, x: &Terms) -> Terms {
        let mut product = [Lanes::ZERO; TERMS];
        for i in 0..TERMS {
            product[i] = dot_terms(&self.variance[i], x);
        }
        product
    }

    #[inline(always)]
    fn forward(&self, x: &Terms) -> Terms {
        let mut y = *x;
        for i in 1..TERMS {
            let mut value = y[i];
            for k in 0..i {
                value = (-self.lower[i][k]).mul_add(y[k], value);
            }
            y[i] = value;
        }
        y
    }

    #[inline(always)]
    fn solve(&self, x: &Terms) -> Terms {
        let mut y = self.forward(x);
        for i in (0..TERMS).rev() {
            let mut value = y[i] * self.inverse_pivot[i];
            for k in i + 1..TERMS {
                value = (-self.lower[k][i]).mul_add(y[k], value);
            }
            y[i] = value;
        }
        y
    }

    /// L^-1 x over the roots of the pivots: its square is x times the inverse of the variance times x.
    #[inline(always)]
    pub fn whitened(&self, x: &Terms) -> Terms {
        let mut y = self.forward(x);
        for i in 0..TERMS {
            y[i] = y[i] * self.inverse_pivot[i].sqrt();
        }
        y
    }

    /// Subspace iteration on two vectors: at first a plane along the normal, and a quadric without any
    /// symmetry, which so has a part of every eigenvector.
    #[inline(always)]
    pub fn smallest(&self, normal: &[Lanes; 3]) -> Smallest {
        let zero = Lanes::ZERO;
        let mut first = [normal[0], normal[1], normal[2], zero, zero, zero, zero, zero, zero];
        let second = [0.0, 0.0, 0.0, 1.0, 0.3, -0.4, 0.8, 0.5, 1.2].map(Lanes::splat);
        let (mut first_dual, mut second_dual) = (self.gradient_form(&first), self.gradient_form(&second));
        let (mut value, mut next) = (Lanes::splat(f64::MAX), Lanes::splat(f64::MAX));
        let mut active = Mask::ALL;
        for _ in 0..MAX_ITERATIONS {
            if !active.any() {
                break;
            }
            // An orthonormal basis, in the gradient's sense, of the subspace that C^-1 N makes.
            let a = self.solve(&first_dual);
            let (a, a_dual) = self.normalised(&a);
            let mut b = self.solve(&second_dual);
            let overlap = dot_terms(&b, &a_dual);
            b = combined(Lanes::ONE, &b, -overlap, &a);
            let (b, b_dual) = self.normalised(&b);
            // Rayleigh and Ritz: the best of the subspace first.
            let image = self.variance_form(&a);
            let (aa, ab) = (dot_terms(&a, &image), dot_terms(&b, &image));
            let bb = dot_terms(&b, &self.variance_form(&b));
            let (cosine, sine, tangent) = rotation(aa, bb, ab, Mask::ALL);
            let shift = tangent * ab;
            let (aa, bb) = (aa - shift, bb + shift);
            let swap = bb.lt(aa);
            let (of_a, of_b) = (swap.select(sine, cosine), swap.select(cosine, -sine));
            // A lane that has converged keeps its answer, whatever its neighbours in the batch need.
            first = chosen_terms(active, &combined(of_a, &a, of_b, &b), &first);
            first_dual = chosen_terms(active, &combined(of_a, &a_dual, of_b, &b_dual), &first_dual);
            let (of_a, of_b) = (swap.select(cosine, sine), swap.select(-sine, cosine));
            second_dual = combined(of_a, &a_dual, of_b, &b_dual);
            let change = (value - aa.min(bb)).abs();
            value = active.select(aa.min(bb), value);
            next = active.select(aa.max(bb), next);
            active = active & !change.le(value.mul_add(Lanes::splat(CONVERGED), Lanes::splat(ROUNDING)));
        }
        Smallest {
            value: value.max(zero),
            next: next.max(zero),
            vector: first,
            dual: first_dual,
            converged: !active,
        }
    }

    /// A vector over its length in the gradient's sense, and the gradient's form times it.
    #[inline(always)]
    fn normalised(&self, x: &Terms) -> (Terms, Terms) {
        let (mut x, mut dual) = (*x, self.gradient_form(x));
        // The tiny number keeps a vector without length, as the square of a plane's height is one.
        let inverse = Lanes::ONE / dot_terms(&x, &dual).max(Lanes::splat(1e-100)).sqrt();
        for i in 0..TERMS {
            x[i] = x[i] * inverse;
            dual[i] = dual[i] * inverse;
        }
        (x, dual)
    }
}

#[inline(always)]
pub(super) fn dot_terms(x: &Terms, y: &Terms) -> Lanes {
    let mut sum = x[0] * y[0];
    for i in 1..TERMS {
        sum = x[i].mul_add(y[i], sum);
    }
    sum
}

/// Second derivatives of the quadric with these coefficients.
#[inline(always)]
pub(super) fn hessian(x: &Terms) -> [[Lanes; 3]; 3] {
    [[x[3] + x[3], x[4], x[5]], [x[4], x[6] + x[6], x[7]], [x[5], x[7], x[8] + x[8]]]
}

/// `p x + q y`
#[inline(always)]
pub(super) fn combined(p: Lanes, x: &Terms, q: Lanes, y: &Terms) -> Terms {
    let mut sum = [Lanes::ZERO; TERMS];
    for i in 0..TERMS {
        sum[i] = p.mul_add(x[i], q * y[i]);
    }
    sum
}

/// `x` where the mask is set, `y` elsewhere.
#[inline(always)]
fn chosen_terms(mask: Mask, x: &Terms, y: &Terms) -> Terms {
    let mut chosen = [Lanes::ZERO; TERMS];
    for i in 0..TERMS {
        chosen[i] = mask.select(x[i], y[i]);
    }
    chosen
}
