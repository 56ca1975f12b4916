//! The cylinder through a set of points, read off their moments.
//!
//! For a given axis the best cylinder is the smallest eigenvector of a 3 x 3 problem, Taubin's circle
//! of the points seen along the axis. Its mean square of distances is a smooth function of the axis,
//! whose least value is sought from several starts.

use super::taubin::{Best, Family, Pencil, Placement};
use crate::geometry::axes_across;
use crate::moments::Moments;
use nalgebra::{Matrix2, Matrix3, Vector2, Vector3};

/// A radius beyond this many times the points' extent is that of a plane.
const FLAT: f64 = 1e6;

/// Axes to start from, spread over half a sphere by the golden angle: about 20 degrees apart.
const STARTS: usize = 48;

/// Starts that are followed to their ends: the best ones.
const FOLLOWED: usize = 4;

/// Steps along one start, most of which need fewer than 8.
const MAX_STEPS: usize = 40;

/// Radians between the axes of whose mean squares the derivatives are differences.
const ANGLE_STEP: f64 = 1e-4;

/// Radians by which the axis still rotates once it has converged.
const CONVERGED: f64 = 1e-10;

/// A cylinder that was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Cylinder {
    /// Unit; the sign means nothing.
    pub axis: [f64; 3],
    /// The point of the axis next to the points' mean, in the coordinates of the moments.
    pub centre: [f64; 3],
    /// In the unit of the moments.
    pub radius: f64,
    /// Root mean square of the points' distances from the cylinder, to first order.
    pub residual: f64,
}

/// The cylinder with Taubin's normalisation: exact on points of a cylinder, and hardly biased by noise.
///
/// The moments should be those about a place near the points, as for a sphere. `None` for fewer than 5 points, for points of a plane, and where no axis converges.
///
/// ```
/// use surfsig::{fit_cylinder, Moments};
/// // A fifth of a pipe along x.
/// let points: Vec<[f64; 3]> = (0..100)
///     .map(|i| (0.01 * f64::from(i), 1.2 * (2.4 * f64::from(i)).fract()))
///     .map(|(x, t)| [x, 0.25 * t.cos(), 0.7 + 0.25 * t.sin()])
///     .collect();
/// let pipe = fit_cylinder(&Moments::of_points(&points)).unwrap();
/// assert!((pipe.radius - 0.25).abs() < 1e-6 && (pipe.centre[2] - 0.7).abs() < 1e-6);
/// assert!(pipe.axis[0].abs() > 1.0 - 1e-9);
/// ```
pub fn fit_cylinder(moments: &Moments<f64>) -> Option<Cylinder> {
    let (placement, local) = Placement::of(moments, 5)?;
    let pencil = Pencil::new(&local);
    let mut starts: Vec<(f64, Vector3<f64>)> = (0..STARTS)
        .map(|index| spread_direction(index, STARTS))
        .filter_map(|axis| Some((along(&pencil, &axis)?.mean_square, axis)))
        .collect();
    starts.sort_by(|a, b| a.0.total_cmp(&b.0));
    let (axis, best) = starts
        .iter()
        .take(FOLLOWED)
        .filter_map(|(_, axis)| descend(&pencil, *axis))
        .min_by(|a, b| a.1.mean_square.total_cmp(&b.1.mean_square))?;
    let [constant, linear @ .., _, _, _, _, _, _] = best.coefficients;
    // The trace of 1 - e e^T is 2.
    let square = 0.5 * (best.coefficients[4] + best.coefficients[7] + best.coefficients[9]);
    let centre = linear.map(|c| -0.5 * c / square);
    let radius = (centre.iter().map(|c| c * c).sum::<f64>() - constant / square).sqrt();
    (radius < FLAT).then(|| Cylinder {
        axis: axis.into(),
        centre: placement.place(centre),
        radius: placement.unit * radius,
        residual: placement.unit * best.mean_square.sqrt(),
    })
}

/// The given one of so many directions that are spread over half a sphere by the golden angle.
pub(crate) fn spread_direction(index: usize, count: usize) -> Vector3<f64> {
    let z = (index as f64 + 0.5) / count as f64;
    let (sine, cosine) = (index as f64 * 2.399_963_229_728_653).sin_cos();
    let rho = (1.0 - z * z).sqrt();
    Vector3::new(rho * cosine, rho * sine, z)
}

/// The best cylinder about a direction.
fn along(pencil: &Pencil, axis: &Vector3<f64>) -> Option<Best> {
    let [u, v] = axes_across(axis);
    let square = Matrix3::identity() - axis * axis.transpose();
    const PLACES: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    pencil.best(&Family::from_fn(3, |term, member| match (term, member) {
        (0..3, 0) => u[term],
        (0..3, 1) => v[term],
        (3.., 2) => {
            let (i, j) = PLACES[term - 3];
            if i == j { square[(i, i)] } else { 2.0 * square[(i, j)] }
        }
        _ => 0.0,
    }))
}

/// Newton's steps from an axis to that of a least mean square; `None` where they do not converge.
fn descend(pencil: &Pencil, start: Vector3<f64>) -> Option<(Vector3<f64>, Best)> {
    let mut axis = start;
    let mut best = along(pencil, &axis)?;
    let mut damping = 0.0;
    for _ in 0..MAX_STEPS {
        let [u, v] = axes_across(&axis);
        let tilted = |s: f64, t: f64| (axis + s * u + t * v).normalize();
        let at = |i: i32, j: i32| {
            Some(along(pencil, &tilted(f64::from(i) * ANGLE_STEP, f64::from(j) * ANGLE_STEP))?.mean_square)
        };
        let centre = best.mean_square;
        let (left, right, down, up) = (at(-1, 0)?, at(1, 0)?, at(0, -1)?, at(0, 1)?);
        let mixed = 0.25 * (at(1, 1)? + at(-1, -1)? - at(1, -1)? - at(-1, 1)?);
        let slope = Vector2::new(right - left, up - down) * 0.5;
        let bend = Matrix2::new(right + left - 2.0 * centre, mixed, mixed, up + down - 2.0 * centre);
        // Where the function bends down or a step failed, more of the identity: a shorter step downhill.
        let eigen = bend.symmetric_eigen();
        let (least, most) = (eigen.eigenvalues.min(), eigen.eigenvalues.amax());
        let lift = damping * most + (1e-3 * most - least).max(0.0);
        let step = -(bend + Matrix2::identity() * lift).try_inverse()? * slope * ANGLE_STEP;
        let step = step * (0.3 / step.norm().max(0.3));
        let next = tilted(step.x, step.y);
        match along(pencil, &next) {
            Some(found) if found.mean_square <= centre => {
                (axis, best, damping) = (next, found, 0.1 * damping);
            }
            // No better axis is left between rounding.
            _ if step.norm() < 1e-6 => return Some((axis, best)),
            _ => damping = (4.0 * damping).max(0.1),
        }
        if step.norm() < CONVERGED {
            return Some((axis, best));
        }
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::{Draws, Shape, turned};
    use nalgebra::Rotation3;
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 100, rng_seed: prop::test_runner::RngSeed::Fixed(9), ..Default::default() })]

        #[test]
        fn is_exact_on_cylinders_anywhere(
            radius in 0.15_f64..20.0,
            turn in prop::array::uniform3(-4.0_f64..4.0),
            place in prop::array::uniform3(-5.0_f64..5.0),
            unit in prop::sample::select(vec![1e-3, 1.0, 1e3]),
        ) {
            let points = Shape::Cylinder(radius).points(80, -1.0, 0.0, &mut Draws(3));
            let rotation = Rotation3::new(Vector3::from(turn));
            let local = Moments::<f64>::of_points(&turned(&points, &rotation));
            let cylinder = fit_cylinder(&local.shifted(place).scaled(unit)).unwrap();
            let tolerance = 1e-6 * radius.max(1.0);
            prop_assert!((cylinder.radius / unit - radius).abs() < tolerance, "{} {radius}", cylinder.radius);
            let axis = rotation * Vector3::y();
            prop_assert!(Vector3::from(cylinder.axis).cross(&axis).norm() < tolerance);
            let on_axis = rotation * Vector3::new(0.0, 0.0, -radius) + Vector3::from(place);
            let aside = (Vector3::from(cylinder.centre) / unit - on_axis).cross(&axis).norm();
            prop_assert!(aside < 10.0 * tolerance, "{aside}");
        }
    }

    #[test]
    fn noise_does_not_bias_it() {
        let (mut draws, mut radii, mut squares) = (Draws(4), 0.0, 0.0);
        for _ in 0..500 {
            let points = Shape::Cylinder(1.0).points(200, -1.0, 0.01, &mut draws);
            let cylinder = fit_cylinder(&Moments::of_points(&points)).unwrap();
            radii += cylinder.radius / 500.0;
            squares += cylinder.residual.powi(2) / 500.0;
        }
        assert!((radii - 1.0).abs() < 0.004, "{radii}");
        // Five parameters are fitted to 200 points.
        assert!((squares.sqrt() / 0.01 - 0.975_f64.sqrt()).abs() < 0.01, "{squares}");
    }

    #[test]
    fn what_determines_no_cylinder_is_none() {
        let none = |points: &[[f64; 3]]| fit_cylinder(&Moments::of_points(points)).is_none();
        assert!(none(&[]));
        assert!(none(&[[0.0, 0.0, 1.0]; 9]));
        assert!(none(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [1.0; 3]]));
        assert!(none(&Shape::Plane.points(60, -1.0, 0.0, &mut Draws(5))));
    }
}
