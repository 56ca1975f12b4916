//! A fit that outliers do not pull: the points are looked at again, and those far from the surface leave.

use crate::fit::paraboloid::Paraboloids;
use crate::members::Members;
use crate::moments::Moments;
use crate::simd::InstructionSet;

/// Passes after which the choice of points stands; four are usual.
pub(super) const MAX_PASSES: usize = 12;

/// A point this many standard deviations from the surface is an outlier; of a hundred thousand normal ones
/// 270 are.
const FAR: f64 = 3.0;

/// Standard deviations per median of the absolute values, for normal noise.
const DEVIATIONS_PER_MEDIAN: f64 = 1.4826;

/// Distances, in radii, that rounding alone makes.
const ROUNDING: f64 = 1e-6;

/// The moments of the members near the fitted surface, or `None` where no other members are than were fitted.
///
/// What is far is judged by the median distance of all members, which outliers hardly move.
pub(super) fn without_outliers(
    members: &mut Members,
    fits: &Paraboloids,
    lane: usize,
    fitted: f64,
    set: InstructionSet,
    distances: &mut Vec<f64>,
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
    distances.clear();
    distances.extend(members.points.iter().map(distance));
    if distances.len() < 7 || !distances.iter().all(|d| d.is_finite()) {
        return None;
    }
    let middle = distances.len() / 2;
    let median = *distances.select_nth_unstable_by(middle, f64::total_cmp).1;
    let limit = (FAR * DEVIATIONS_PER_MEDIAN * median).max(ROUNDING);
    let moments = members.moments::<f64>(set, |point| distance(point) <= limit);
    (moments.count() != fitted).then_some(moments)
}
