//! A fit that outliers do not pull: the points are looked at again, and those far from the surface leave.

use crate::fit::paraboloid::{Paraboloids, UNKNOWNS};
use crate::members::Members;
use crate::moments::Moments;
use crate::simd::InstructionSet;
use crate::statistics::DEVIATIONS_PER_MEDIAN;

/// Passes after which the choice of points stands; four are usual.
pub(super) const MAX_PASSES: usize = 12;

/// A point this many standard deviations from the surface is an outlier; of a hundred thousand normal ones
/// 270 are.
const FAR: f64 = 3.0;

/// Distances, in radii, that rounding alone makes.
const ROUNDING: f64 = 1e-6;

/// Of each member, in their order, how far it is from the surface, in radii; and the same to be sorted.
#[derive(Default)]
pub(super) struct Distances {
    of_members: Vec<f64>,
    sorted: Vec<f64>,
}

/// The moments of the members near the fitted surface, or `None` where they are too few to judge, or there is
/// no surface.
///
/// What is far is judged by the median distance of all members, which outliers hardly move.
pub(super) fn without_outliers(
    members: &mut Members,
    fits: &Paraboloids,
    lane: usize,
    set: InstructionSet,
    distances: &mut Distances,
) -> Option<Moments<f64>> {
    let [u, v, w] = [&fits.axes.u, &fits.axes.v, &fits.axes.w].map(|axis| axis.map(|c| c.0[lane]));
    let [a, b, c, d, e, f] = fits.coefficients.map(|c| c.0[lane]);
    let distance = |point: &[f32; 3]| {
        let along = |axis: &[f64; 3]| (0..3).map(|i| axis[i] * f64::from(point[i])).sum::<f64>();
        let (x, y) = (along(&u), along(&v));
        // Equation (5), and the height across the slope.
        let height = along(&w) - (a * x * x + b * y * y + c * x + d * y + e * x * y + f);
        let (slope_x, slope_y) = (2.0 * a * x + e * y + c, 2.0 * b * y + e * x + d);
        height.abs() / (1.0 + slope_x * slope_x + slope_y * slope_y).sqrt()
    };
    let Distances { of_members, sorted } = distances;
    of_members.clear();
    of_members.extend(members.points.iter().map(distance));
    if of_members.len() <= UNKNOWNS || !of_members.iter().all(|d| d.is_finite()) {
        return None;
    }
    sorted.clone_from(of_members);
    let middle = sorted.len() / 2;
    let median = *sorted.select_nth_unstable_by(middle, f64::total_cmp).1;
    let limit = (FAR * DEVIATIONS_PER_MEDIAN * median).max(ROUNDING);
    let mut near = of_members.iter().map(|d| *d <= limit);
    Some(members.moments::<f64>(set, |_| near.next() == Some(true)))
}
