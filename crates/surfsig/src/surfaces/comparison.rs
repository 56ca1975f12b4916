//! Whether two pieces are of one surface, as far as some of their points tell.
//!
//! Two pieces are one where their joint fit is no worse than the separate ones but by chance: what the sum of squares
//! grows by, in units of the variance, is then distributed as chi-square with as many degrees of freedom as there are
//! parameters less. Errors that neighbours have in common enlarge it by the design effect.

use crate::primitive::{EXACT, Primitive, QUICK, Termination, Vector, design_effect, extent, refine};

/// Points of a piece that a fit looks at.
pub(super) const SAMPLE: usize = 1000;

/// Widest gap between pieces, in units of the width of the narrower one in the gap's direction: what is farther away may be
/// another surface that was made to the same measures, as the teeth of a wheel are.
const GAP: f64 = 0.25;

/// Points of each piece between which the gap is measured.
pub(super) const SAMPLE_OF_GAP: usize = 150;

/// Points of the smaller piece, and their distance from the larger one's surface in its tolerances up to which a joint fit
/// is tried.
const SAMPLE_OF_DISTANCE: usize = 12;
const NEAR: f64 = 4.0;

/// 99.9 % quantiles of chi-square with 3 to 7 degrees of freedom: of a thousand pieces one stays apart by chance.
const QUANTILES: [f64; 5] = [16.27, 18.47, 20.52, 22.46, 24.32];

/// What the sum of squares may grow by, as a share of it: where errors have so much in common that chance allows anything,
/// nothing is known to be one.
const LARGEST_GROWTH: f64 = 0.25;

/// Blocks in which errors in common are looked for.
const BLOCKS: [usize; 2] = [8, 16];

/// What is compared of a piece of a surface.
pub(super) struct Comparison {
    pub primitive: Primitive,
    pub points: Vec<Vector>,
    pub extent: f64,
    /// Distance from the surface up to which points belong to it.
    tolerance: f64,
    /// Distances below this are rounding.
    rounding: f64,
    is_exact: bool,
    /// Sum of squared distances from its own fit.
    sum: f64,
    /// By what factor fewer of its points are independent.
    design_effect: f64,
}

impl Comparison {
    /// Of a surface near some points.
    pub fn new(near: Primitive, points: Vec<Vector>, tolerance: f64, rounding: f64, is_exact: bool) -> Self {
        let extent = extent(&points);
        let fitted = refine(near, &points, extent, termination(is_exact));
        let primitive = fitted.map_or(near, |fitted| fitted.primitive);
        let chart = primitive.chart();
        let residuals: Vec<f64> = points.iter().map(|point| chart.distance(point)).collect();
        let effects = BLOCKS.map(|blocks| design_effect(&points, &residuals, blocks));
        Self {
            primitive,
            sum: residuals.iter().map(|residual| residual * residual).sum(),
            design_effect: effects.into_iter().fold(1.0, f64::max),
            extent,
            tolerance,
            rounding,
            is_exact,
            points,
        }
    }

    /// Whether some points of a smaller piece are near this one's surface.
    pub fn is_near(&self, small: &Self) -> bool {
        let chart = self.primitive.chart();
        let near = |point: Vector| chart.distance(&point).abs() <= NEAR * self.tolerance;
        thinned(&small.points, SAMPLE_OF_DISTANCE).all(near)
    }

    /// The surface of which both are pieces.
    pub fn joint(&self, small: &Self) -> Option<Primitive> {
        let points = [&self.points[..], &small.points[..]].concat();
        let count = points.len() as f64;
        let (own, others) = (self.primitive.kind.parameters(), small.primitive.kind.parameters());
        let separate = self.sum + small.sum;
        let variance = separate / (count - (own + others) as f64);
        let effect = self.design_effect.max(small.design_effect);
        let starts = [self.primitive, small.primitive];
        starts.into_iter().find_map(|start| {
            let termination = termination(self.is_exact && small.is_exact);
            let fitted = refine(start, &points, extent(&points), termination)?;
            let fewer = own + others - start.kind.parameters();
            let growth = count * fitted.rms * fitted.rms - separate;
            let chance = (QUANTILES[fewer - 3] * variance * effect).min(LARGEST_GROWTH * separate);
            let same = growth <= chance || fitted.rms <= self.rounding;
            same.then_some(fitted.primitive)
        })
    }

    /// Whether a gap is narrow beside the widths of both.
    pub fn is_narrow(&self, other: &Self, gap: &Vector) -> bool {
        let (length, direction) = (gap.norm(), gap.normalize());
        length <= GAP * self.width(&direction).min(other.width(&direction))
    }

    /// From a point of this piece to the nearest one of the other, as far as samples tell.
    pub fn gap(&self, other: &Self) -> Vector {
        let between = thinned(&self.points, SAMPLE_OF_GAP)
            .flat_map(|point| thinned(&other.points, SAMPLE_OF_GAP).map(move |next| next - point));
        between.min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared())).unwrap_or_default()
    }

    /// How far its points extend in a direction.
    fn width(&self, direction: &Vector) -> f64 {
        let along = self.points.iter().map(|point| point.dot(direction));
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    }
}

fn termination(is_exact: bool) -> Termination {
    if is_exact { EXACT } else { QUICK }
}

/// Some of many, evenly.
pub(super) fn thinned<T: Copy>(all: &[T], most: usize) -> impl Iterator<Item = T> + '_ {
    all.iter().step_by(all.len().div_ceil(most).max(1)).copied()
}
