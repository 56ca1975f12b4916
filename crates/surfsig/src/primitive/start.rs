//! Where a fit begins: surfaces read off points, or off points and their normals.

use super::{Primitive, SurfaceKind, Vector};
use crate::extract::extract_within;
use crate::fit::{FitKind, fit_cylinder, fit_sphere};
use crate::geometry::axes_across;
use crate::{ExtractOptions, Moments, Monitor, Neighborhood, PointCloud, Queries};
use nalgebra::{Matrix2, Matrix3, Matrix4, SymmetricEigen, Vector2, Vector4};

/// Nearest points that tell a point's normal.
const NEAREST: usize = 24;

/// The sphere or cylinder that points' moments tell.
pub(super) fn fitted_to_moments(kind: SurfaceKind, points: &[Vector]) -> Option<Primitive> {
    let positions: Vec<[f64; 3]> = points.iter().map(|&point| point.into()).collect();
    let moments = Moments::of_points(&positions);
    let (point, axis, radius) = if kind == SurfaceKind::Sphere {
        let sphere = fit_sphere(&moments)?;
        (sphere.centre, [0.0, 0.0, 1.0], sphere.radius)
    } else {
        let cylinder = fit_cylinder(&moments)?;
        (cylinder.centre, cylinder.axis, cylinder.radius)
    };
    Some(Primitive {
        kind,
        point: point.into(),
        axis: axis.into(),
        radius,
        major_radius: 0.0,
        half_angle: 0.0,
    })
}

/// The points whose normals their nearest points tell, and these.
pub(super) fn with_normals(positions: &[[f64; 3]]) -> (Vec<Vector>, Vec<Vector>) {
    let options = ExtractOptions { fit: FitKind::Quadric, ..Default::default() };
    let cloud = PointCloud::new_f64(positions);
    let nearest = Neighborhood::Nearest(NEAREST);
    let Ok(found) = extract_within(&cloud, nearest, &Queries::All, &options, &Monitor::default()) else {
        return Default::default();
    };
    let normals = found.normals.iter().map(|normal| Vector::from(normal.map(f64::from)));
    let known = positions.iter().map(|&point| Vector::from(point)).zip(normals);
    known.filter(|(_, normal)| normal.iter().all(|c| c.is_finite())).unzip()
}

/// A surface of a kind that goes roughly through the points; `None` where they determine none, and for curves.
pub(crate) fn start(kind: SurfaceKind, points: &[Vector], normals: &[Vector]) -> Option<Primitive> {
    let count = points.len() as f64;
    let centre = points.iter().sum::<Vector>() / count;
    let none =
        Primitive { kind, point: centre, axis: Vector::z(), radius: 0.0, major_radius: 0.0, half_angle: 0.0 };
    match kind {
        SurfaceKind::Plane => {
            let spread: Matrix3<f64> = points.iter().map(|p| (p - centre) * (p - centre).transpose()).sum();
            Some(Primitive { axis: smallest(&spread)?, ..none })
        }
        SurfaceKind::Sphere => {
            // |q|^2 = 2 c q + k, linear in the centre c and k = r^2 - c^2.
            let mut normal = Matrix4::zeros();
            let mut right = Vector4::zeros();
            for q in points.iter().map(|p| p - centre) {
                let row = Vector4::new(2.0 * q.x, 2.0 * q.y, 2.0 * q.z, 1.0);
                normal += row * row.transpose();
                right += q.norm_squared() * row;
            }
            let solution = normal.cholesky()?.solve(&right);
            let from = Vector::new(solution.x, solution.y, solution.z);
            let square = solution.w + from.norm_squared();
            (square > 0.0).then(|| Primitive { point: centre + from, radius: square.sqrt(), ..none })
        }
        SurfaceKind::Cylinder => {
            // All normals are across the axis.
            let axis = smallest(&normals.iter().map(|n| n * n.transpose()).sum())?;
            let [first, second] = axes_across(&axis);
            let seen = points.iter().map(|p| p - centre).map(|q| Vector2::new(q.dot(&first), q.dot(&second)));
            let (middle, radius) = circle(&seen.collect::<Vec<_>>())?;
            Some(Primitive { point: centre + middle.x * first + middle.y * second, axis, radius, ..none })
        }
        SurfaceKind::Cone | SurfaceKind::Torus => {
            let (on_axis, axis) = axis_of_revolution(points, normals, centre)?;
            let profile: Vec<Vector2<f64>> = points
                .iter()
                .map(|p| p - on_axis)
                .map(|q| Vector2::new(q.dot(&axis), (q - q.dot(&axis) * axis).norm()))
                .collect();
            let revolved = Primitive { point: on_axis, axis, ..none };
            if kind == SurfaceKind::Torus {
                let (middle, radius) = circle(&profile)?;
                return Some(Primitive {
                    point: on_axis + middle.x * axis,
                    radius,
                    major_radius: middle.y,
                    ..revolved
                });
            }
            let mean = profile.iter().sum::<Vector2<f64>>() / count;
            let spread: Matrix2<f64> = profile.iter().map(|p| (p - mean) * (p - mean).transpose()).sum();
            let eigen = SymmetricEigen::new(spread);
            let along = eigen.eigenvectors.column(eigen.eigenvalues.imax()).into_owned();
            let slope = (along.y / along.x).atan();
            // The radius grows along the axis.
            let axis = if slope < 0.0 { -axis } else { axis };
            let point = on_axis + mean.x * revolved.axis;
            Some(Primitive { point, axis, radius: mean.y, half_angle: slope.abs(), ..none })
        }
        SurfaceKind::Circle | SurfaceKind::Line => None,
    }
}

/// Surfaces of a kind that are nearly a simpler one, whose points extend so far: cones that hardly open, and tori
/// that hardly bend or hardly have a hole.
pub(crate) fn bent(simpler: &Primitive, kind: SurfaceKind, extent: f64) -> Vec<Primitive> {
    match (simpler.kind, kind) {
        (SurfaceKind::Cylinder, SurfaceKind::Cone) => [simpler.axis, -simpler.axis]
            .map(|axis| Primitive { kind, axis, half_angle: 0.1, ..*simpler })
            .into(),
        (SurfaceKind::Cylinder, SurfaceKind::Torus) => {
            let [across, other] = axes_across(&simpler.axis);
            let major_radius = 3.0 * (extent + simpler.radius);
            [across, -across, other, -other]
                .map(|towards| Primitive {
                    kind,
                    point: simpler.point + major_radius * towards,
                    axis: simpler.axis.cross(&towards),
                    major_radius,
                    ..*simpler
                })
                .into()
        }
        _ => Vec::new(),
    }
}

/// The eigenvector of the smallest eigenvalue.
pub(crate) fn smallest(matrix: &Matrix3<f64>) -> Option<Vector> {
    if !matrix.iter().all(|entry| entry.is_finite()) {
        return None;
    }
    let eigen = SymmetricEigen::new(*matrix);
    Some(eigen.eigenvectors.column(eigen.eigenvalues.imin()).into_owned())
}

/// Centre and radius of a circle near points: |q|^2 = 2 c q + k.
pub(super) fn circle(points: &[Vector2<f64>]) -> Option<(Vector2<f64>, f64)> {
    let mean = points.iter().sum::<Vector2<f64>>() / points.len() as f64;
    let mut normal = Matrix3::zeros();
    let mut right = Vector::zeros();
    for q in points.iter().map(|p| p - mean) {
        let row = Vector::new(2.0 * q.x, 2.0 * q.y, 1.0);
        normal += row * row.transpose();
        right += q.norm_squared() * row;
    }
    let solution = normal.cholesky()?.solve(&right);
    let from = Vector2::new(solution.x, solution.y);
    let square = solution.z + from.norm_squared();
    (square > 0.0).then(|| (mean + from, square.sqrt()))
}

/// A point on the axis, and its direction, of the surface of revolution whose normals these are: all of them meet the
/// axis, so their Pluecker coordinates (n, p x n) lie in one linear complex (Pottmann and Randrup).
fn axis_of_revolution(points: &[Vector], normals: &[Vector], centre: Vector) -> Option<(Vector, Vector)> {
    let (mut nn, mut nm, mut mm) = (Matrix3::zeros(), Matrix3::zeros(), Matrix3::zeros());
    for (point, n) in points.iter().zip(normals) {
        let moment = (point - centre).cross(n);
        nn += n * n.transpose();
        nm += n * moment.transpose();
        mm += moment * moment.transpose();
    }
    // Normals that hardly leave a plane do not tell the shift across it; a little weight keeps it near the centre.
    let weight = 1e-9 * nn.trace();
    let inverse = (nn + weight * Matrix3::identity()).try_inverse()?;
    let axis = smallest(&(mm - nm.transpose() * inverse * nm))?;
    let shift = -inverse * nm * axis;
    let across = shift - shift.dot(&axis) * axis;
    Some((centre + axis.cross(&across), axis))
}
