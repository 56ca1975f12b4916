//! One surface of a kind: its distance, its fit, and how sure that is.
//!
//! [`geometry`] measures distances and their derivatives, [`start`] reads a surface off points, [`candidates`] finds
//! those near the least sum of squared distances, [`least_squares`] makes it least by [`linear`] steps under
//! [`conditions`], [`uncertainty`] says from [`blocks`] of neighbours how sure the parameters are.

mod blocks;
mod candidates;
mod conditions;
mod geometry;
mod kind;
mod least_squares;
mod linear;
mod start;
mod uncertainty;

pub(crate) use blocks::{Blocks, design_effect};
pub use conditions::PrimitiveFitOptions;
pub use geometry::Primitive;
pub(crate) use geometry::{Chart, Vector, extent};
pub use kind::SurfaceKind;
pub(crate) use least_squares::{EXACT, QUICK, Termination, refine};
pub(crate) use start::{bent, smallest, start};
pub use uncertainty::PrimitiveUncertainty;
pub(crate) use uncertainty::{BlockEquations, Uncertainty, uncertainty, uncertainty_of_equations};

use candidates::{candidates, distinct, sample};
use conditions::Conditions;
use least_squares::{EXHAUSTIVE, polish, refine_with, sum_of_squares};

/// Points of which a fit takes a sample until it is near its minimum, as near as the standard errors of so many are: two
/// or three steps with all points lead on from there.
const MANY: usize = 4000;

/// Fits a surface to points: the sum of squared orthogonal distances is least.
///
/// The fit begins from `start`, which must be of the same kind and near the points, or from what the points tell, for
/// axes of all directions: the least of the minima that these lead to is taken. The sum of a curve (a circle or line) is
/// that of the squared distances in space.
///
/// `None` where the points are no more than the parameters (of a curve, half of these), do not determine all of them
/// (those of a circle no sphere), or are not finite.
///
/// ```
/// use surfsig::{fit_primitive, SurfaceKind};
/// // A third of a pipe along x.
/// let points: Vec<[f64; 3]> = (0..100)
///     .map(|i| (0.01 * f64::from(i), 2.0 * (2.4 * f64::from(i)).fract()))
///     .map(|(x, t)| [x, 0.25 * t.cos(), 0.7 + 0.25 * t.sin()])
///     .collect();
/// let pipe = fit_primitive(&points, SurfaceKind::Cylinder, None).unwrap();
/// assert!((pipe.radius() - 0.25).abs() < 1e-9 && (pipe.point()[2] - 0.7).abs() < 1e-9);
/// assert!(pipe.distances(&points).iter().all(|distance| distance.abs() < 1e-9));
/// assert!(fit_primitive(&points[..5], SurfaceKind::Cylinder, None).is_none());
/// ```
pub fn fit_primitive(points: &[[f64; 3]], kind: SurfaceKind, start: Option<&Primitive>) -> Option<Primitive> {
    fit_primitive_with(points, kind, &PrimitiveFitOptions { start, ..Default::default() })
}

/// Fits a surface of which something is known, or to points that do not count alike: see [`fit_primitive`].
///
/// `None` also where an option has no meaning for the kind or the points.
///
/// ```
/// use surfsig::{fit_primitive_with, PrimitiveFitOptions, SurfaceKind};
/// // The last point does not count.
/// let points = [[0.0, 0.0, 1.0], [1.0, 0.0, 1.0], [0.0, 1.0, 1.0], [1.0, 1.0, 1.0], [0.5, 0.5, 7.0]];
/// let options = PrimitiveFitOptions { weights: Some(&[1.0, 1.0, 1.0, 1.0, 0.0]), ..Default::default() };
/// let plane = fit_primitive_with(&points, SurfaceKind::Plane, &options).unwrap();
/// assert!((plane.axis()[2] - 1.0).abs() < 1e-15 && (plane.point()[2] - 1.0).abs() < 1e-15);
/// ```
pub fn fit_primitive_with(
    points: &[[f64; 3]],
    kind: SurfaceKind,
    options: &PrimitiveFitOptions,
) -> Option<Primitive> {
    if !options.are_valid(kind, points.len()) {
        return None;
    }
    let (points, weights) = options.counted(points);
    fit_counted(&points, kind, &PrimitiveFitOptions { weights: weights.as_deref(), ..*options })
}

/// The same of points that all have a weight.
fn fit_counted(points: &[[f64; 3]], kind: SurfaceKind, options: &PrimitiveFitOptions) -> Option<Primitive> {
    let conditions = options.conditions(kind);
    if points.len() * kind.components() <= conditions.free_parameters().len() || points.len() < 3 {
        return None;
    }
    // About their mean and in their own unit: squares of coordinates far from 0 lose digits. A power of 2 loses none.
    let mean = points.iter().map(|&p| Vector::from(p)).sum::<Vector>() / points.len() as f64;
    let mut local: Vec<Vector> = points.iter().map(|&p| Vector::from(p) - mean).collect();
    let unit = extent(&local).log2().round().exp2();
    if !(unit > 0.0 && unit.is_finite()) {
        return None;
    }
    local.iter_mut().for_each(|p| *p /= unit);
    let extent = extent(&local);
    let radius = options.radius.map(|radius| radius / unit);
    let local_options = PrimitiveFitOptions { radius, ..*options };
    let starts = match options.start {
        Some(start) => {
            let axis = options.axis.map_or(start.axis, |axis| Vector::from(axis).normalize());
            let local = start.shifted(&-mean).scaled(1.0 / unit);
            vec![Primitive { axis, radius: radius.unwrap_or(local.radius), ..local }]
        }
        None => candidates(kind, &local, extent, &local_options),
    };
    let primitive = least(&starts, &local, extent, &conditions)?.beside(&Vector::zeros()).upward();
    primitive.is_valid(extent, EXHAUSTIVE.flat).then(|| primitive.scaled(unit).shifted(&mean))
}

/// The surface with the least of the minima to which starts lead, to the last digits; `None` where there is none, or
/// the points do not determine it. Its point, at which shifts are counted, is beside 0.
fn least(starts: &[Primitive], points: &[Vector], extent: f64, conditions: &Conditions) -> Option<Primitive> {
    // Of many points some lead near the minimum, and only the last steps look at all.
    let (some, weights) = sample(points, conditions.weights, MANY);
    let some_conditions = Conditions { weights: weights.as_deref(), ..*conditions };
    let beside = |primitive: &Primitive| primitive.beside(&Vector::zeros());
    let fits = starts
        .iter()
        .filter_map(|start| refine_with(beside(start), &some, extent, &some_conditions, EXHAUSTIVE));
    let fits = distinct(fits.collect(), extent);
    let near = if some.len() == points.len() || fits.len() == 1 {
        fits.into_iter().next()?.primitive
    } else {
        let sums = fits.iter().map(|fitted| sum_of_squares(&fitted.primitive, points, conditions));
        let ranked = fits.iter().zip(sums).min_by(|(_, a), (_, b)| a.total_cmp(b));
        ranked?.0.primitive
    };
    let polished = polish(beside(&near), points, conditions)?;
    if polished.converged || some.len() == points.len() {
        return Some(polished.primitive);
    }
    // What some points tell is not near enough.
    let all = refine_with(beside(&near), points, extent, conditions, EXHAUSTIVE)?.primitive;
    Some(polish(beside(&all), points, conditions)?.primitive)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Points of a surface that turns about (0.6, 0, 0.8), by their distance from that axis and their height.
    fn revolved(count: u32, profile: impl Fn(f64) -> (f64, f64)) -> Vec<[f64; 3]> {
        let [axis, first, second] = [[0.6, 0.0, 0.8], [0.8, 0.0, -0.6], [0.0, 1.0, 0.0]].map(Vector::from);
        let place = |i: u32| {
            let (away, height) = profile((0.414_214 * f64::from(i)).fract());
            let (sine, cosine) = (2.399_963 * f64::from(i)).sin_cos();
            Vector::new(5.0, 6.0, 7.0) + height * axis + away * (cosine * first + sine * second)
        };
        (0..count).map(|i| place(i).into()).collect()
    }

    #[test]
    fn cones_and_tori_are_found_without_a_start() {
        let points = revolved(2000, |share| (0.5 + 0.4 * share, share));
        let cone = fit_primitive(&points, SurfaceKind::Cone, None).unwrap();
        assert!((cone.half_angle() - 0.4_f64.atan()).abs() < 1e-9, "{cone:?}");
        assert!(Vector::from(cone.axis()).dot(&Vector::new(0.6, 0.0, 0.8)) > 1.0 - 1e-12);
        let tube = |share: f64| (std::f64::consts::TAU * share).sin_cos();
        let points = revolved(2000, |share| (1.0 + 0.3 * tube(share).1, 0.3 * tube(share).0));
        let torus = fit_primitive(&points, SurfaceKind::Torus, None).unwrap();
        assert!((torus.radius() - 0.3).abs() < 1e-9 && (torus.major_radius() - 1.0).abs() < 1e-9);
        assert!((Vector::from(torus.point()) - Vector::new(5.0, 6.0, 7.0)).norm() < 1e-8);
    }

    #[test]
    fn a_fit_goes_on_from_a_start() {
        let points = revolved(300, |share| (0.5, share));
        let near = fit_primitive(&points[..40], SurfaceKind::Cylinder, None).unwrap();
        let fitted = fit_primitive(&points, SurfaceKind::Cylinder, Some(&near)).unwrap();
        assert!((fitted.radius() - 0.5).abs() < 1e-10);
        // Its point is beside the middle of the points.
        let middle = points.iter().map(|&p| Vector::from(p)).sum::<Vector>() / 300.0;
        let from = middle - Vector::from(fitted.point());
        assert!(from.dot(&Vector::from(fitted.axis())).abs() < 1e-12);
        assert!(fit_primitive(&points, SurfaceKind::Sphere, Some(&near)).is_none());
    }

    #[test]
    fn two_rings_lead_to_their_cylinder() {
        let points = revolved(60, |share| (0.5, if share < 0.5 { 0.0 } else { 2.0 }));
        let pipe = fit_primitive(&points, SurfaceKind::Cylinder, None).unwrap();
        assert!((pipe.radius() - 0.5).abs() < 1e-12);
        assert!(Vector::from(pipe.axis()).cross(&Vector::new(0.6, 0.0, 0.8)).norm() < 1e-12);
    }

    #[test]
    fn circles_and_lines_are_fitted_in_space() {
        let circle = fit_primitive(&revolved(5, |_| (0.5, 1.0)), SurfaceKind::Circle, None).unwrap();
        assert!((circle.radius() - 0.5).abs() < 1e-14);
        let centre = Vector::new(5.6, 6.0, 7.8);
        assert!((Vector::from(circle.point()) - centre).norm() < 1e-13);
        let line = fit_primitive(&revolved(5, |share| (0.0, share)), SurfaceKind::Line, None).unwrap();
        assert!(Vector::from(line.axis()).cross(&Vector::new(0.6, 0.0, 0.8)).norm() < 1e-14);
        assert!(line.radius().is_nan());
    }

    #[test]
    fn what_is_known_is_kept() {
        let points = revolved(40, |share| (0.5 + 0.01 * (9.0 * share).sin(), share));
        let axis = Some([0.0, 0.0, 2.0]);
        let options = PrimitiveFitOptions { radius: Some(0.48), axis, ..Default::default() };
        let pipe = fit_primitive_with(&points, SurfaceKind::Cylinder, &options).unwrap();
        assert!(pipe.radius() == 0.48 && pipe.axis() == [0.0, 0.0, 1.0]);
        let covariance = pipe.uncertainty_with(&points, &options).covariance;
        assert!(covariance[0] > 0.0 && (2..5).all(|kept| covariance[6 * kept] == 0.0));
        // A radius is no plane's, and an axis no sphere's; weights are as many as points.
        assert!(fit_primitive_with(&points, SurfaceKind::Plane, &options).is_none());
        assert!(fit_primitive_with(&points, SurfaceKind::Sphere, &options).is_none());
        let options = PrimitiveFitOptions { weights: Some(&[1.0; 3]), ..Default::default() };
        assert!(fit_primitive_with(&points, SurfaceKind::Plane, &options).is_none());
    }

    #[test]
    fn what_determines_no_surface_is_none() {
        let circle: Vec<[f64; 3]> =
            (0..9).map(|i| f64::from(i).sin_cos()).map(|(x, y)| [x, y, 0.0]).collect();
        let line: Vec<[f64; 3]> = (0..9).map(f64::from).map(|i| [i, 2.0 * i, 3.0 * i]).collect();
        assert!(fit_primitive(&circle, SurfaceKind::Sphere, None).is_none());
        for kind in SurfaceKind::ALL {
            for points in [&line[..], &[[1.0, 2.0, 3.0]; 9], &[[f64::NAN; 3]; 9], &[[1e200; 3]; 9], &[]] {
                assert!(fit_primitive(points, kind, None).is_none(), "{kind:?} {points:?}");
            }
        }
    }
}
