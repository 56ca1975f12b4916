//! The least-squares paraboloid of eq. (5), read off the moments, for eight points at once.
//!
//! In the sensor's axes it is the paper's fit, linear in its six unknowns. In the surface's own axes
//! the height runs along the fitted normal: the axes are turned until the slope at the patch's
//! centre is zero, and each turn costs a contraction of the moments and no look at the points.

use super::covariance::{Spread, spread};
use super::shape_error::{ShapeFactor, shape_covariance};
use crate::curvature::{Principal, principal_curvatures};
use crate::simd::for_each_instruction_set;
use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::{
    Axes, MomentBatch, PatchMoments, Vector, add_scaled, chosen, cross, dot, inverted, normalised,
};

/// In which axes the paraboloid's height is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub enum FitAxes {
    /// The surface's own: results turn with the object, and do not depend on where the sensor stood.
    #[default]
    Surface,
    /// The cloud's, as the paper fits: z runs away from the sensor.
    Sensor,
}

/// Unknowns of eq. (5), hence the least number of points.
pub(crate) const UNKNOWNS: usize = 6;

/// A slope at the patch's centre that counts as none.
const FLAT: f64 = 1e-6;

/// Turns of the axes after which a patch has `not_converged`.
const MAX_TURNS: usize = 25;

/// Axes are a start where their normal is near to the points' own: a cosine.
const NEAR: f64 = 0.99;

/// Points whose second spread is below this share of the first lie on a line (variances): a strip 30
/// times as long as wide, such as a single line of a lidar. Across it, float32 offsets alone would make
/// curvatures of a thousandth of the inverse radius, and noise any curvature.
const LINE: f64 = 1e-3;

/// A pivot of the normal equations, relative to its diagonal, below which they count as singular. The
/// standard error of some coefficient is then a thousand times what the same points could give, and
/// float32 offsets alone would show.
const SINGULAR: f64 = 1e-6;

/// Offset of the points' mean from the query, in radii, beyond which the patch is one-sided: 0.42 on half
/// a disc, and chance does not reach it on a full one that has 20 points.
const ONE_SIDED: f64 = 0.3;

/// Sums in f32 are trusted where the residual is above this share of the radius, ...
const ROUGH_ENOUGH: f64 = 2e-3;

/// ... where the points are this far from a line (variances), ...
const WIDE_ENOUGH: f64 = 2.5e-3;

/// ... where the normal equations are this far from singular, ...
const REGULAR_ENOUGH: f64 = 2e-2;

/// ... and where curvature is not more than this over the radius.
const BLUNT_ENOUGH: f64 = 4.0;

/// What is fitted, and what is known about the sensor.
pub(crate) struct Task<'a> {
    pub moments: &'a MomentBatch,
    pub axes: FitAxes,
    /// From each point towards the sensor; `None` where nobody knows.
    pub to_sensor: Option<Vector>,
    /// Axes that are nearly the surface's own, and for which points.
    pub start: Option<(Axes, Mask)>,
}

/// The fits of a batch, lengths in units of the radius.
pub(crate) struct Paraboloids {
    pub principal: Principal,
    pub spread: [Lanes; 3],
    pub axes: Axes,
    /// a, b, c, d, e, f of eq. (5) over these axes.
    pub coefficients: [Lanes; 6],
    pub residual: Lanes,
    pub condition: Lanes,
    /// Of the shape tensor, see [`shape_covariance`]; not a number in the sensor's axes, and where there
    /// are no more points than unknowns.
    pub covariance: [Lanes; 6],
    /// The points lie mostly on one side of the query.
    pub one_sided: Mask,
    /// Fewer than three points, or all of them on a line: not even a normal.
    pub no_plane: Mask,
    pub too_few: Mask,
    pub singular: Mask,
    pub converged: Mask,
    /// Sums in f32 do not carry this fit: take them again in f64.
    pub needs_f64: Mask,
}

for_each_instruction_set! {
    /// Fits a batch.
    #[inline]
    pub(crate) fn fit_paraboloids(task: &Task<'_>) -> Paraboloids {
        plain: fit,
        wide: fit,
        widest: fit,
    }
}

#[inline(always)]
fn fit(task: &Task<'_>) -> Paraboloids {
    let count = task.moments.count;
    let Spread { eigenvalues, longest, normal } = spread(task.moments.covariance());
    let too_few = count.lt(Lanes::splat(UNKNOWNS as f64));
    let line = eigenvalues[1].le(eigenvalues[0] * Lanes::splat(LINE));
    let no_plane = line | count.lt(Lanes::splat(3.0));

    let (axes, solution, converged, singular) = match task.axes {
        FitAxes::Sensor => {
            let axes = Axes::of_cloud();
            let solution = solve(&task.moments.along(&axes));
            let singular = solution.is_singular();
            (axes, solution, Mask::ALL, singular)
        }
        FitAxes::Surface => {
            let mut start = Axes { u: longest, v: cross(&normal, &longest), w: normal };
            if let Some((axes, known)) = &task.start {
                let near = Lanes::splat(NEAR).lt(dot(&axes.w, &normal).abs());
                start = axes.chosen(*known & near, &start);
            }
            turn_until_flat(task.moments, start, !(no_plane | too_few))
        }
    };

    // The side is chosen when the axes are final: on the way they may turn past the sensor.
    let upward = solution.normal(&axes);
    let away_from_sensor = dot(&upward, &task.towards_sensor(&upward)).lt(Lanes::ZERO);
    let mut principal = principal_curvatures(&solution.coefficients, &axes, away_from_sensor);
    // Where no paraboloid is determined, the plane still is.
    let plane_normal = inverted(&normal, dot(&normal, &task.towards_sensor(&normal)).lt(Lanes::ZERO));
    principal.normal = chosen(too_few | singular, &plane_normal, &principal.normal);
    let covariance = match task.axes {
        FitAxes::Surface => {
            let square = solution.residual_square;
            shape_covariance(&solution.shape, &axes, &principal.direction, square, count)
        }
        // On a slope, curvature depends on all six unknowns.
        FitAxes::Sensor => [Lanes::splat(f64::NAN); 6],
    };
    let mean = task.moments.mean();
    // Along the surface: a query above it sees points all around.
    let above = dot(mean, &principal.normal);
    let aside = dot(mean, mean) - above * above;
    let one_sided = Lanes::splat(ONE_SIDED * ONE_SIDED).lt(aside);
    let rough = Lanes::splat(ROUGH_ENOUGH * ROUGH_ENOUGH).le(solution.residual_square);
    let wide = (eigenvalues[0] * Lanes::splat(WIDE_ENOUGH)).le(eigenvalues[1]);
    let regular = Lanes::splat(REGULAR_ENOUGH).le(solution.smallest_pivot);
    let blunt = principal.k1.abs().max(principal.k2.abs()).le(Lanes::splat(BLUNT_ENOUGH));
    Paraboloids {
        principal,
        spread: eigenvalues,
        axes,
        coefficients: solution.coefficients,
        residual: solution.residual_square.max(Lanes::ZERO).sqrt(),
        condition: Lanes::ONE / solution.smallest_pivot.sqrt(),
        covariance,
        one_sided,
        no_plane,
        too_few,
        singular,
        converged,
        needs_f64: !(too_few | rough & wide & regular & blunt),
    }
}

impl Paraboloids {
    /// Where to begin with another ball around the same points: these axes, where they are the surface's own.
    pub fn start(&self) -> (Axes, Mask) {
        (self.axes, self.converged & !(self.no_plane | self.too_few | self.singular))
    }
}

impl Task<'_> {
    /// Towards the sensor, from what is known of it, for surfaces with these normals.
    #[inline(always)]
    pub(super) fn towards_sensor(&self, normal: &Vector) -> Vector {
        match (self.to_sensor, self.axes) {
            (Some(to_sensor), _) => {
                // A direction of no length: nobody knows, and the answer is at least always the same.
                let known = Lanes::ZERO.lt(dot(&to_sensor, &to_sensor));
                chosen(known, &to_sensor, &upwards(normal))
            }
            // The paper's z runs away from the sensor.
            (None, FitAxes::Sensor) => [Lanes::ZERO, Lanes::ZERO, -Lanes::ONE],
            // No sensor: up, so that the answer is at least always the same.
            (None, FitAxes::Surface) => upwards(normal),
        }
    }
}

/// The first of z, y, x along which the normal has a part at all.
#[inline(always)]
fn upwards(normal: &Vector) -> Vector {
    let (one, zero) = (Lanes::ONE, Lanes::ZERO);
    let tiny = Lanes::splat(1e-12);
    let z = tiny.lt(normal[2].abs());
    let y = tiny.lt(normal[1].abs());
    [z.select(zero, y.select(zero, one)), z.select(zero, y.select(one, zero)), z.select(one, zero)]
}

/// Turns the axes until the fitted slope at the centre is zero.
///
/// Where the patch is large against the radius of curvature, full turns overshoot and diverge: the
/// length of each turn is therefore the secant's, from the slopes before and after the last turn.
#[inline(always)]
pub(super) fn turn_until_flat(
    moments: &MomentBatch,
    start: Axes,
    fittable: Mask,
) -> (Axes, Solution, Mask, Mask) {
    let flat = Lanes::splat(FLAT * FLAT);
    let mut axes = start;
    let mut solution = solve(&moments.along(&axes));
    let mut damping = Lanes::ONE;
    // Points that determine no paraboloid seem to, once rounding has tilted the axes.
    let singular = solution.is_singular();
    let mut active = fittable & !singular & flat.lt(solution.slope_square());
    for _ in 0..MAX_TURNS {
        if !active.any() {
            break;
        }
        let [_, _, c, d, _, _] = solution.coefficients;
        let w = add_scaled(&add_scaled(&axes.w, -damping * c, &axes.u), -damping * d, &axes.v);
        let turned = axes.tilted_to(&w);
        // A lane that has converged keeps its axes, and so finds the same solution again.
        axes = turned.chosen(active, &axes);
        solution = solve(&moments.along(&axes));
        let [_, _, c_new, d_new, _, _] = solution.coefficients;
        let (gain_c, gain_d) = (c - c_new, d - d_new);
        let secant = damping * gain_c.mul_add(c, gain_d * d) / gain_c.mul_add(gain_c, gain_d * gain_d);
        damping = active.select(secant.max(Lanes::splat(0.2)).min(Lanes::splat(1.5)), damping);
        active = active & flat.lt(solution.slope_square());
    }
    let converged = solution.slope_square().le(flat);
    let singular = singular | solution.is_singular();
    (axes, solution, converged, singular)
}

/// The solution of one set of normal equations.
pub(super) struct Solution {
    /// a, b, c, d, e, f of eq. (5).
    pub coefficients: [Lanes; 6],
    /// Mean square of the heights' residuals.
    pub residual_square: Lanes,
    /// Smallest pivot of the normal equations, each relative to its diagonal element.
    smallest_pivot: Lanes,
    pub shape: ShapeFactor,
}

impl Solution {
    #[inline(always)]
    fn is_singular(&self) -> Mask {
        self.smallest_pivot.lt(Lanes::splat(SINGULAR))
    }

    #[inline(always)]
    fn slope_square(&self) -> Lanes {
        let [_, _, c, d, _, _] = self.coefficients;
        c.mul_add(c, d * d)
    }

    /// The normal at the centre, on the side of w.
    #[inline(always)]
    fn normal(&self, axes: &Axes) -> Vector {
        let [_, _, c, d, _, _] = self.coefficients;
        normalised(&add_scaled(&add_scaled(&axes.w, -c, &axes.u), -d, &axes.v))
    }
}

/// Normal equations of eq. (5) by L D L^T; the unknowns in the order f, c, d, a, e, b of 1, u, v, uu, uv, vv.
#[inline(always)]
fn solve(m: &PatchMoments) -> Solution {
    // Which moment stands in row i, column j <= i: the product of monomials i and j. The rest is not read.
    const PRODUCT: [[usize; UNKNOWNS]; UNKNOWNS] = [
        [0, 0, 0, 0, 0, 0],
        [1, 3, 0, 0, 0, 0],
        [2, 4, 5, 0, 0, 0],
        [3, 6, 7, 10, 0, 0],
        [4, 7, 8, 11, 12, 0],
        [5, 8, 9, 12, 13, 14],
    ];
    // Filled by a copy, and factored in place: rows above the present one hold L.
    let mut lower: [[Lanes; UNKNOWNS]; UNKNOWNS] =
        std::array::from_fn(|i| std::array::from_fn(|j| m.plane[PRODUCT[i][j]]));
    let mut inverse_pivot = [Lanes::ONE; UNKNOWNS];
    let mut forward = m.height;
    let mut residual_square = m.height_square;
    let mut smallest_pivot = Lanes::ONE;
    for i in 0..UNKNOWNS {
        let diagonal = lower[i][i];
        let mut pivot = diagonal;
        for j in 0..i {
            // This row is L D, up to j.
            let mut value = lower[i][j];
            for k in 0..j {
                value = (-lower[i][k]).mul_add(lower[j][k], value);
            }
            lower[i][j] = value;
        }
        for j in 0..i {
            let scaled = lower[i][j] * inverse_pivot[j];
            pivot = (-lower[i][j]).mul_add(scaled, pivot);
            forward[i] = (-scaled).mul_add(forward[j], forward[i]);
            lower[i][j] = scaled;
        }
        // The tiny number makes 0 / 0, where all points are equal, a pivot of 0.
        let relative = pivot / (diagonal + Lanes::splat(1e-300));
        smallest_pivot = relative.min(smallest_pivot);
        inverse_pivot[i] = Lanes::ONE / pivot;
        residual_square = (-forward[i]).mul_add(forward[i] * inverse_pivot[i], residual_square);
    }
    let mut unknowns = [Lanes::ZERO; UNKNOWNS];
    for i in (0..UNKNOWNS).rev() {
        let mut value = forward[i] * inverse_pivot[i];
        for k in i + 1..UNKNOWNS {
            value = (-lower[k][i]).mul_add(unknowns[k], value);
        }
        unknowns[i] = value;
    }
    let [f, c, d, a, e, b] = unknowns;
    let shape = ShapeFactor {
        lower: [lower[4][3], lower[5][3], lower[5][4]],
        inverse_pivot: [inverse_pivot[3], inverse_pivot[4], inverse_pivot[5]],
    };
    Solution { coefficients: [a, b, c, d, e, f], residual_square, smallest_pivot, shape }
}
