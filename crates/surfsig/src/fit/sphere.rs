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
/// `None` for fewer than 4 points, for points of a circle, and for a plane.
///
/// ```
/// use surfsig::{fit_sphere, Moments};
/// // A narrow cap.
/// let points: Vec<[f64; 3]> = (0..100)
///     .map(|i| (0.002 * f64::from(i), 2.4 * f64::from(i)))
///     .map(|(a, t)| [3.0 + 0.5 * a.sin() * t.cos(), 0.5 * a.sin() * t.sin(), 0.5 * a.cos()])
///     .collect();
/// let sphere = fit_sphere(&Moments::of_points(&points)).unwrap();
/// assert!((sphere.radius - 0.5).abs() < 1e-9 && (sphere.centre[0] - 3.0).abs() < 1e-9);
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
