//! The sphere through a set of points, read off their moments.

use super::taubin::{Family, Pencil, Placement};
use crate::moments::Moments;

/// A radius beyond this many times the points' extent is that of a plane.
const FLAT: f64 = 1e6;

/// A sphere that was fitted.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sphere {
    /// In the coordinates of the moments.
    pub centre: [f64; 3],
    /// In their unit.
    pub radius: f64,
    /// Root mean square of the points' distances from the sphere, to first order.
    pub residual: f64,
}

/// The sphere with Taubin's normalisation: exact on points of a sphere, and hardly biased by noise.
///
/// The moments should be those about a place near the points: digits are lost with the fourth power of
/// its distance over the points' extent. `None` for fewer than 4 points, for points of a circle, and for a plane.
///
/// ```
/// use surfsig::{fit_sphere, Moments};
/// // A narrow cap.
/// let points: Vec<[f64; 3]> = (0..100)
///     .map(|i| (0.002 * f64::from(i), 2.4 * f64::from(i)))
///     .map(|(a, t)| [0.3 + 0.5 * a.sin() * t.cos(), 0.5 * a.sin() * t.sin(), 0.5 * a.cos()])
///     .collect();
/// let sphere = fit_sphere(&Moments::of_points(&points)).unwrap();
/// assert!((sphere.radius - 0.5).abs() < 1e-6 && (sphere.centre[0] - 0.3).abs() < 1e-6);
/// ```
pub fn fit_sphere(moments: &Moments<f64>) -> Option<Sphere> {
    let (placement, local) = Placement::of(moments, 4)?;
    // x, y, z, and xx + yy + zz.
    let family = Family::from_fn(4, |term, member| match member {
        3 => f64::from([3, 6, 8].contains(&term)),
        _ => f64::from(term == member),
    });
    let best = Pencil::new(&local).best(&family)?;
    let [constant, x, y, z, square, ..] = best.coefficients;
    let centre = [x, y, z].map(|c| -0.5 * c / square);
    let radius = (centre.iter().map(|c| c * c).sum::<f64>() - constant / square).sqrt();
    (radius < FLAT).then(|| Sphere {
        centre: placement.place(centre),
        radius: placement.unit * radius,
        residual: placement.unit * best.mean_square.sqrt(),
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::{Draws, Shape, turned};
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(8), ..Default::default() })]

        #[test]
        fn is_exact_on_spheres_anywhere(
            radius in 0.4_f64..100.0,
            turn in prop::array::uniform3(-4.0_f64..4.0),
            place in prop::array::uniform3(-5.0_f64..5.0),
            unit in prop::sample::select(vec![1e-3, 1.0, 1e3]),
        ) {
            let points = Shape::Sphere(radius).points(50, -1.0, 0.0, &mut Draws(3));
            let rotation = Rotation3::new(Vector3::from(turn));
            let local = Moments::<f64>::of_points(&turned(&points, &rotation));
            let sphere = fit_sphere(&local.shifted(place).scaled(unit)).unwrap();
            // The sphere's top is at the origin. Its depth has digits as it stands out of rounding.
            let tolerance = 1e-8 * radius.powi(3).max(1.0) * unit;
            prop_assert!((sphere.radius - unit * radius).abs() < tolerance, "{} {radius}", sphere.radius);
            let centre = (rotation * Vector3::new(0.0, 0.0, -radius) + Vector3::from(place)) * unit;
            prop_assert!((Vector3::from(sphere.centre) - centre).norm() < tolerance);
            prop_assert!(sphere.residual < 1e-5 * unit);
        }
    }

    #[test]
    fn noise_does_not_bias_it() {
        let (mut draws, mut radii, mut squares) = (Draws(4), 0.0, 0.0);
        for _ in 0..500 {
            let points = Shape::Sphere(1.5).points(200, -1.0, 0.01, &mut draws);
            let sphere = fit_sphere(&Moments::of_points(&points)).unwrap();
            radii += sphere.radius / 500.0;
            squares += sphere.residual.powi(2) / 500.0;
        }
        assert!((radii - 1.5).abs() < 0.006, "{radii}");
        // Four parameters are fitted to 200 points.
        assert!((squares.sqrt() / 0.01 - 0.98_f64.sqrt()).abs() < 0.01, "{squares}");
    }

    #[test]
    fn what_determines_no_sphere_is_none() {
        let mut draws = Draws(5);
        let none = |points: &[[f64; 3]]| fit_sphere(&Moments::of_points(points)).is_none();
        assert!(none(&[]));
        assert!(none(&[[0.0, 0.0, 1.0]; 9]));
        assert!(none(&[[0.0, 0.0, 1.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0]]));
        assert!(none(&[[f64::NAN; 3]; 9]));
        assert!(none(&Shape::Plane.points(60, -1.0, 0.0, &mut draws)));
    }
}
