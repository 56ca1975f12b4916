//! The general quadric of any set of points, one at a time: the public face of [`super::quadric`].

use super::paraboloid::{FitAxes, Task};
use super::quadric::{Local, UNKNOWNS, fit_quadrics};
use super::taubin::{Placement, TERMS};
use crate::moments::Moments;
use crate::simd::InstructionSet;
use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::MomentBatch;

/// The surface Q = 0 of a polynomial of second degree, in the coordinates of the moments.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Quadric {
    /// Of 1, x, y, z, xx, xy, xz, yy, yz, zz. The mean square of the gradient over the points is 1, so
    /// that Q is about the distance from the surface.
    pub coefficients: [f64; 10],
    /// Root mean square of the points' distances, to first order.
    pub residual: f64,
    /// By how much the next best quadric's mean square exceeds this one's, less where points are few.
    /// Below 4, as on a plane, the points do not tell which quadric they lie on.
    pub gap: f64,
    /// Root mean square of the points' distances from their mean.
    pub extent: f64,
}

/// What a surface is at one of its points.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SurfacePoint {
    /// Where it is.
    pub position: [f64; 3],
    /// Unit, along the gradient of Q.
    pub normal: [f64; 3],
    /// Larger principal curvature; positive where the surface falls away from the normal.
    pub k1: f64,
    /// Smaller principal curvature.
    pub k2: f64,
    /// Unit tangent along k1; the sign means nothing.
    pub direction: [f64; 3],
}

/// The quadric of a set of points with Taubin's normalisation.
///
/// Exact on points that lie on a quadric. The moments should be those about a place near the points, as
/// for a sphere. `None` for fewer than 9 points, and where the iteration does not converge.
///
/// ```
/// use surfsig::{fit_quadric, Moments};
/// // A cone about z with half the opening angle 45 degrees.
/// let points: Vec<[f64; 3]> = (0..200)
///     .map(|i| (1.0 + 0.004 * f64::from(i), 2.4 * f64::from(i)))
///     .map(|(z, t)| [z * t.cos(), z * t.sin(), z])
///     .collect();
/// let cone = fit_quadric(&Moments::of_points(&points)).unwrap();
/// assert!(cone.residual < 1e-6 && cone.gap > 1e3);
/// let at = cone.nearest([1.4, 0.0, 1.5]).unwrap();
/// assert!((at.position[0] - 1.45).abs() < 1e-6 && (at.position[2] - 1.45).abs() < 1e-6);
/// assert!((at.k1.abs() + at.k2.abs() - 1.0 / (1.45 * 2.0_f64.sqrt())).abs() < 1e-6);
/// ```
pub fn fit_quadric(moments: &Moments<f64>) -> Option<Quadric> {
    let (placement, local) = Placement::of(moments, UNKNOWNS)?;
    let batch = MomentBatch::new(&[local]);
    let task = Task { moments: &batch, axes: FitAxes::Surface, to_sensor: None, start: None };
    let fits = fit_quadrics(InstructionSet::detect(), &task);
    let fitted = fits.coefficients.map(|c| c.0[0]);
    if !fits.solved.get(0) || !fitted.iter().all(|c| c.is_finite()) {
        return None;
    }
    let Placement { centre, unit } = placement;
    let quadric = Quadric {
        coefficients: scaled(fitted, unit),
        residual: unit * fits.residual.0[0],
        gap: fits.gap.0[0],
        extent: unit,
    };
    Some(Quadric { coefficients: quadric.about(centre.map(|c| -c)), ..quadric })
}

/// The coefficients in a unit of length that is shorter by a factor, Q in that unit too.
fn scaled(coefficients: [f64; TERMS + 1], factor: f64) -> [f64; TERMS + 1] {
    std::array::from_fn(|i| coefficients[i] * factor.powi(if i == 0 { 1 } else { -i32::from(i > 3) }))
}

impl Quadric {
    /// Q at a place: about its distance from the surface, with a sign.
    ///
    /// ```
    /// # use surfsig::Quadric;
    /// let coefficients = [-0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.5];
    /// let sphere = Quadric { coefficients, residual: 0.0, gap: 1e3, extent: 1.0 };
    /// assert_eq!(sphere.value([1.0, 1.0, 0.0]), 0.5);
    /// ```
    pub fn value(&self, [x, y, z]: [f64; 3]) -> f64 {
        let [one, a, b, c, xx, xy, xz, yy, yz, zz] = self.coefficients;
        one + x * (a + xx * x + xy * y + xz * z) + y * (b + yy * y + yz * z) + z * (c + zz * z)
    }

    /// The gradient of Q at a place.
    ///
    /// ```
    /// # use surfsig::Quadric;
    /// let coefficients = [-0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.5];
    /// let sphere = Quadric { coefficients, residual: 0.0, gap: 1e3, extent: 1.0 };
    /// assert_eq!(sphere.gradient([0.0, 0.6, 0.8]), [0.0, 0.6, 0.8]);
    /// ```
    pub fn gradient(&self, [x, y, z]: [f64; 3]) -> [f64; 3] {
        let [_, a, b, c, xx, xy, xz, yy, yz, zz] = self.coefficients;
        [
            a + 2.0 * xx * x + xy * y + xz * z,
            b + xy * x + 2.0 * yy * y + yz * z,
            c + xz * x + yz * y + 2.0 * zz * z,
        ]
    }

    /// What the surface is where it is nearest to a place; `None` where the steps towards it do not converge, as
    /// from a sphere's centre.
    ///
    /// ```
    /// # use surfsig::Quadric;
    /// let coefficients = [-0.5, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0, 0.5, 0.0, 0.5];
    /// let sphere = Quadric { coefficients, residual: 0.0, gap: 1e3, extent: 1.0 };
    /// let at = sphere.nearest([0.0, 0.0, 1.5]).unwrap();
    /// assert!((at.position[2] - 1.0).abs() < 1e-9 && (at.k1 - 1.0).abs() < 1e-9);
    /// assert_eq!(sphere.nearest([0.0; 3]), None);
    /// ```
    pub fn nearest(&self, place: [f64; 3]) -> Option<SurfacePoint> {
        let [one, terms @ ..] = scaled(self.about(place), 1.0 / self.extent).map(Lanes::splat);
        let local = Local::at_foot(one, &terms);
        let principal = local.principal(!Mask::ALL);
        let vector = |v: [Lanes; 3]| v.map(|c| c.0[0]);
        local.on_surface.get(0).then(|| SurfacePoint {
            position: [0, 1, 2].map(|axis| place[axis] + self.extent * local.foot[axis].0[0]),
            normal: vector(principal.normal),
            k1: principal.k1.0[0] / self.extent,
            k2: principal.k2.0[0] / self.extent,
            direction: vector(principal.direction),
        })
    }

    /// The coefficients in coordinates whose origin is at a place.
    fn about(&self, place: [f64; 3]) -> [f64; 10] {
        let mut moved = self.coefficients;
        moved[0] = self.value(place);
        moved[1..4].copy_from_slice(&self.gradient(place));
        moved
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::{Draws, Shape, turned};
    use nalgebra::{Rotation3, Vector3};
    use proptest::prelude::*;

    proptest! {
        #![proptest_config(ProptestConfig { cases: 64, rng_seed: prop::test_runner::RngSeed::Fixed(6), ..Default::default() })]

        #[test]
        fn place_turn_and_unit_change_nothing(
            turn in prop::array::uniform3(-4.0_f64..4.0),
            place in prop::array::uniform3(-5.0_f64..5.0),
            unit in prop::sample::select(vec![1e-3, 1.0, 1e3]),
        ) {
            let shape = Shape::Ellipsoid([0.8, 1.2, 1.0]);
            let points = shape.points(200, -1.0, 0.002, &mut Draws(2));
            let expected = fit_quadric(&Moments::of_points(&points)).unwrap();
            let rotation = Rotation3::new(Vector3::from(turn));
            let moved = Moments::<f64>::of_points(&turned(&points, &rotation)).shifted(place).scaled(unit);
            let found = fit_quadric(&moved).unwrap();
            prop_assert!((found.residual / unit - expected.residual).abs() < 1e-6 * expected.residual);
            // Where the gap is wide, the iteration ends before the next eigenvalue has converged.
            prop_assert!((found.gap / expected.gap).ln().abs() < 0.5, "{} {}", found.gap, expected.gap);
            prop_assert!((found.extent / unit - expected.extent).abs() < 1e-9);
            let [from, to] = [[0.0, 0.0, 0.1], (rotation * Vector3::new(0.0, 0.0, 0.1) + Vector3::from(place)).into()];
            let near = expected.nearest(from).unwrap();
            let other = found.nearest(to.map(|c| unit * c)).unwrap();
            // The gradient's side is that of the eigenvector, which means nothing.
            let side = (rotation * Vector3::from(near.normal)).dot(&Vector3::from(other.normal)).signum();
            let ks = if side > 0.0 { [other.k1, other.k2] } else { [-other.k2, -other.k1] };
            prop_assert!((ks[0] * unit - near.k1).abs() < 1e-4 && (ks[1] * unit - near.k2).abs() < 1e-4);
            prop_assert!((found.value(other.position) / unit).abs() < 1e-7);
            let distance = Vector3::from(other.position) / unit - Vector3::from(to);
            prop_assert!((distance - rotation * (Vector3::from(near.position) - Vector3::from(from))).norm() < 1e-6);
        }
    }

    #[test]
    fn what_determines_no_quadric_is_none() {
        let none = |points: &[[f64; 3]]| fit_quadric(&Moments::of_points(points)).is_none();
        assert!(none(&[]));
        assert!(none(&[[0.5, 0.0, 1.0]; 20]));
        assert!(none(&Shape::Sphere(1.0).points(8, -1.0, 0.0, &mut Draws(1))));
        assert!(none(&[[f64::INFINITY, 0.0, 0.0]; 20]));
        let plane = fit_quadric(&Moments::of_points(&Shape::Plane.points(90, -1.0, 0.01, &mut Draws(1))));
        assert!(plane.is_none_or(|fit| fit.gap < 4.0));
    }
}
