//! The general quadric Q = 0 with Taubin's normalisation, read off the moments, for eight points at once.
//!
//! Unlike a paraboloid it contains spheres, cylinders, cones and ellipsoids, and so is unbiased on them
//! however large the patch is. It needs a surface that stands out of its noise: where the smallest
//! eigenvalue is not far below the next one ([`Quadrics::gap`]), as on planes, on shallow patches and
//! on narrow ones, a pair of planes about the points fits as well, and the paraboloid is the better answer.

use super::covariance::spread;
use super::eigen::{Pencil, Smallest, Terms, dot_terms, hessian};
use super::paraboloid::Task;
use super::taubin::TERMS;
use crate::curvature::Principal;
use crate::simd::for_each_instruction_set;
use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::{Vector, add_scaled, chosen, cross, dot, inverted, normalised};

/// Unknowns with the constant and without the scale, hence the least number of points.
pub(crate) const UNKNOWNS: usize = 9;

/// Steps to the surface, each of which divides the error by the radius of curvature over the distance.
const FOOT_STEPS: usize = 8;

/// Distance of a foot from the surface that counts as none.
const ON_SURFACE: f64 = 1e-7;

/// Added to the smallest eigenvalue before the next is divided by it: float32 offsets make as much.
const FLOOR: f64 = 1e-15;

/// A gap from which the quadric is not that of the noise: on planes it is 2, on half a disc and where the
/// surface rises by less than about 15 times the noise it is below 4.
const TRUSTED_GAP: f64 = 4.0;

/// A paraboloid's curvature k is too large by about this times k^3, in units of the ball's radius.
const PARABOLOID_BIAS: f64 = 0.25;

/// The fits of a batch, lengths in units of the radius.
pub(crate) struct Quadrics {
    /// At the foot of the query, its projection onto the surface.
    pub principal: Principal,
    #[cfg_attr(not(test), expect(dead_code, reason = "what the tests compare with the surface"))]
    pub foot: Vector,
    /// Of 1, x, y, z, xx, xy, xz, yy, yz, zz; the mean square of the gradient is 1.
    pub coefficients: [Lanes; TERMS + 1],
    /// Root mean square of the distance, to first order.
    pub residual: Lanes,
    /// Next eigenvalue over the smallest, lower the fewer points are left over by the unknowns: few
    /// points lie near some quadric by chance.
    pub gap: Lanes,
    /// Standard errors of k1, k2 and the mean curvature, from the residual and the points' arrangement.
    pub errors: [Lanes; 3],
    /// Enough points, and an eigenvector that no longer changes.
    pub solved: Mask,
    /// Settled, and with a foot inside the ball.
    #[cfg_attr(not(test), expect(dead_code, reason = "what the tests ask where nothing is trusted"))]
    pub converged: Mask,
    /// Converged, and with a gap that makes the standard errors those of many draws.
    pub trusted: Mask,
    /// Trusted, and less wrong than a paraboloid, whose spread is smaller and whose bias is larger.
    pub preferred: Mask,
}

for_each_instruction_set! {
    /// Fits a batch. The task's axes only say where a sensor is that nobody knows.
    #[inline]
    pub(crate) fn fit_quadrics(task: &Task<'_>) -> Quadrics {
        plain: fit,
        wide: fit,
        widest: fit,
    }
}

#[inline(always)]
fn fit(task: &Task<'_>) -> Quadrics {
    let moments = task.moments;
    let pencil = Pencil::new(moments);
    let smallest = pencil.smallest(&spread(moments.covariance()).normal);
    let terms = &smallest.vector;
    let mut constant = Lanes::ZERO;
    for i in 0..TERMS {
        constant = (-terms[i]).mul_add(moments.monomial(i + 1), constant);
    }
    let local = Local::at_foot(constant, terms);
    let away_from_sensor = dot(&local.normal, &task.towards_sensor(&local.normal)).lt(Lanes::ZERO);
    let principal = local.principal(away_from_sensor);
    let in_ball = dot(&local.foot, &local.foot).le(Lanes::ONE);
    let unknowns = Lanes::splat(UNKNOWNS as f64);
    let solved = smallest.converged & unknowns.le(moments.count);
    let converged = solved & local.on_surface & in_ball;
    let left_over = ((moments.count - unknowns) / moments.count).max(Lanes::ZERO);
    let gap = left_over * left_over * smallest.next / (smallest.value + Lanes::splat(FLOOR));
    let trusted = converged & Lanes::splat(TRUSTED_GAP).le(gap);
    let errors = standard_errors(task, &pencil, &smallest, &local, &principal);
    let (size1, size2) = (principal.k1.abs(), principal.k2.abs());
    let larger = size1.max(size2);
    let error = size1.lt(size2).select(errors[1], errors[0]);
    let bias = larger * larger * larger * Lanes::splat(PARABOLOID_BIAS);
    let [x, y, z, xx, xy, xz, yy, yz, zz] = *terms;
    Quadrics {
        principal,
        foot: local.foot,
        coefficients: [constant, x, y, z, xx, xy, xz, yy, yz, zz],
        residual: smallest.value.sqrt(),
        gap,
        solved,
        converged,
        errors,
        trusted,
        preferred: trusted & error.le(bias),
    }
}

/// What a quadric is at the projection of the origin onto it.
pub(super) struct Local {
    pub foot: Vector,
    /// Unit, along the gradient.
    normal: Vector,
    inverse_gradient: Lanes,
    hessian: [Vector; 3],
    pub on_surface: Mask,
}

impl Local {
    #[inline(always)]
    pub fn at_foot(constant: Lanes, terms: &Terms) -> Self {
        let hessian = hessian(terms);
        let linear = [terms[0], terms[1], terms[2]];
        let half = Lanes::splat(0.5);
        let mut foot = [Lanes::ZERO; 3];
        let mut gradient = linear;
        let mut step = Lanes::ZERO;
        for _ in 0..FOOT_STEPS {
            // The origin's projection onto the tangent plane of the level set through the last foot.
            let both = add_scaled(&gradient, Lanes::ONE, &linear);
            let value = dot(&both, &foot).mul_add(half, constant);
            let inverse_square = Lanes::ONE / dot(&gradient, &gradient);
            let along = (dot(&gradient, &foot) - value) * inverse_square;
            let next = [along * gradient[0], along * gradient[1], along * gradient[2]];
            let moved = add_scaled(&next, -Lanes::ONE, &foot);
            step = dot(&moved, &moved);
            foot = next;
            gradient = add_scaled(&linear, Lanes::ONE, &times(&hessian, &foot));
        }
        let inverse_gradient = Lanes::ONE / dot(&gradient, &gradient).sqrt();
        let normal =
            [gradient[0] * inverse_gradient, gradient[1] * inverse_gradient, gradient[2] * inverse_gradient];
        let on_surface = step.le(Lanes::splat(ON_SURFACE * ON_SURFACE));
        Self { foot, normal, inverse_gradient, hessian, on_surface }
    }

    /// Principal curvatures, with the normal along the gradient or against it.
    #[inline(always)]
    pub fn principal(&self, against_gradient: Mask) -> Principal {
        let normal = inverted(&self.normal, against_gradient);
        // Tangents along whichever of x and y is further from the normal.
        let (zero, one) = (Lanes::ZERO, Lanes::ONE);
        let along_y = normal[1].abs().lt(normal[0].abs());
        let t1 = normalised(&cross(&chosen(along_y, &[zero, one, zero], &[one, zero, zero]), &normal));
        let t2 = cross(&normal, &t1);
        // The gradient grows along a tangent where the surface falls away from it.
        let scale = against_gradient.select(-self.inverse_gradient, self.inverse_gradient);
        let (bent1, bent2) = (times(&self.hessian, &t1), times(&self.hessian, &t2));
        let shape = [scale * dot(&t1, &bent1), scale * dot(&t1, &bent2), scale * dot(&t2, &bent2)];
        Principal::of_shape_operator(shape, &t1, &t2, normal)
    }

    /// How the curvature along a tangent grows with each coefficient, the foot moving with the surface.
    #[inline(always)]
    fn sensitivity(&self, t: &Vector, mean: &Terms) -> Terms {
        let (n, h) = (&self.normal, self.inverse_gradient);
        let bent = times(&self.hessian, t);
        // By how much a change of the gradient, and a shift of the foot along it, lower the curvature.
        let tilt = (dot(&bent, n) + dot(&bent, n)) * h * h;
        let stretch = dot(&bent, t) * h * h;
        let lowered = [
            tilt.mul_add(t[0], stretch * n[0]),
            tilt.mul_add(t[1], stretch * n[1]),
            tilt.mul_add(t[2], stretch * n[2]),
        ];
        let shift = dot(&lowered, &times(&self.hessian, n)) * h;
        let p = &self.foot;
        let mut grown = [
            shift * (p[0] - mean[0]) - lowered[0],
            shift * (p[1] - mean[1]) - lowered[1],
            shift * (p[2] - mean[2]) - lowered[2],
            Lanes::ZERO,
            Lanes::ZERO,
            Lanes::ZERO,
            Lanes::ZERO,
            Lanes::ZERO,
            Lanes::ZERO,
        ];
        for (term, i, j) in [(3, 0, 0), (4, 0, 1), (5, 0, 2), (6, 1, 1), (7, 1, 2), (8, 2, 2)] {
            // Also where i = j: the monomial's derivatives are then twice as large.
            let bend = h * t[i] * t[j];
            let slope = lowered[i] * p[j] + lowered[j] * p[i];
            grown[term] = bend + bend - slope + shift * (p[i] * p[j] - mean[term]);
        }
        grown
    }
}

/// Standard errors of k1, k2 and their mean.
///
/// To first order, noise moves the solution by (C - value N)^-1 times the noise of its equations,
/// whose covariance is value C over the number of points.
#[inline(always)]
fn standard_errors(
    task: &Task<'_>,
    pencil: &Pencil<'_>,
    smallest: &Smallest,
    local: &Local,
    principal: &Principal,
) -> [Lanes; 3] {
    let mut mean = [Lanes::ZERO; TERMS];
    for i in 0..TERMS {
        mean[i] = task.moments.monomial(i + 1);
    }
    let along_k2 = cross(&principal.normal, &principal.direction);
    let of_k1 = spread_of(pencil, smallest, &local.sensitivity(&principal.direction, &mean));
    let of_k2 = spread_of(pencil, smallest, &local.sensitivity(&along_k2, &mean));
    // The inverse of C - value N is at most this much larger than that of C, beside the solution.
    let (value, next) = (smallest.value, smallest.next);
    let larger = next / (next - value);
    let freedom = (task.moments.count - Lanes::splat(UNKNOWNS as f64)).max(Lanes::ONE);
    let variance = value / freedom * larger * larger;
    let (mut k1, mut k2, mut both) = (Lanes::ZERO, Lanes::ZERO, Lanes::ZERO);
    for i in 0..TERMS {
        let sum = of_k1[i] + of_k2[i];
        k1 = of_k1[i].mul_add(of_k1[i], k1);
        k2 = of_k2[i].mul_add(of_k2[i], k2);
        both = sum.mul_add(sum, both);
    }
    [(variance * k1).sqrt(), (variance * k2).sqrt(), Lanes::splat(0.5) * (variance * both).sqrt()]
}

/// What the other eigenvectors contribute to a linear function of the coefficients.
#[inline(always)]
fn spread_of(pencil: &Pencil<'_>, smallest: &Smallest, function: &Terms) -> Terms {
    let own = dot_terms(function, &smallest.vector);
    let mut others = *function;
    for i in 0..TERMS {
        others[i] = (-own).mul_add(smallest.dual[i], others[i]);
    }
    pencil.whitened(&others)
}

#[inline(always)]
fn times(matrix: &[Vector; 3], v: &Vector) -> Vector {
    [dot(&matrix[0], v), dot(&matrix[1], v), dot(&matrix[2], v)]
}

#[cfg(test)]
mod tests;
