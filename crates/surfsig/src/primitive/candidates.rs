//! Surfaces from which a fit begins: read off the points for axes of all directions, and the best of them refined.
//!
//! The sum of squared distances has several minima: two rings of points are near a cylinder about their own axis, and
//! near others across it. So the axes are spread over half the sphere, a few steps from each are made on a sample of
//! the points, and the surfaces with the smallest sums are those to follow.

use super::SurfaceKind;
use super::conditions::{Conditions, PrimitiveFitOptions};
use super::geometry::{Primitive, Vector};
use super::least_squares::{Fitted, SCREENING, SLIDING, Termination, refine_with};
use super::start::{bent, circle, fitted_to_moments, smallest, start, with_normals};
use crate::fit::spread_direction;
use crate::geometry::axes_across;
use nalgebra::{DMatrix, DVector, Matrix3, Vector2};
use std::borrow::Cow;

/// Axes spread over half the sphere, about 20 degrees apart.
const AXES: usize = 48;

/// Points that tell a good start from a bad one; of 8 points as of 500 all that there are would do no better.
const SAMPLE: usize = 200;

/// The golden ratio's fraction: its multiples are spread evenly.
const GOLDEN: f64 = 0.618_033_988_749_894_9;

/// Surfaces that slide along their valleys, the best of all starts.
const SLID: usize = 16;

/// Surfaces that are followed to their ends, of points no more than `SAMPLE`, and of more.
const FOLLOWED: [usize; 2] = [12, 4];

/// A start is followed if its root mean square is at most so many times the least of all.
const WORSE: f64 = 2.0;

/// Root mean squares, in units of the points' extent, among which none is better than another.
const NOTHING: f64 = 1e-7;

/// Half angle of a cone that begins as a cylinder.
const NARROW: f64 = 0.1;

/// Radii in units of the points' extent, of spheres that touch the plane of the points on either side.
const TOUCHING: [f64; 3] = [0.5, 2.0, 20.0];

/// Surfaces near points about 0 that extend so far, the best first.
pub(super) fn candidates(
    kind: SurfaceKind,
    points: &[Vector],
    extent: f64,
    options: &PrimitiveFitOptions,
) -> Vec<Primitive> {
    let direction = options.axis.map(|axis| Vector::from(axis).normalize());
    let (sample, weights) = sample(points, options.weights, SAMPLE);
    let raw: Vec<Primitive> = read_off(kind, &sample, extent, direction, weights.as_deref())
        .into_iter()
        .flat_map(|p| with_given(&p, options))
        .collect();
    let conditions = Conditions { weights: weights.as_deref(), ..options.conditions(kind) };
    let best = |starts: &[Primitive], termination: Termination| {
        let refined = starts.iter().filter_map(|p| {
            refine_with(p.beside(&Vector::zeros()), &sample, extent, &conditions, termination)
        });
        distinct(refined.collect(), extent)
    };
    let screened: Vec<Primitive> =
        best(&raw, SCREENING).iter().take(SLID).map(|fitted| fitted.primitive).collect();
    let found = best(&screened, SLIDING);
    let Some(least) = found.first().map(|fitted| fitted.rms) else {
        return Vec::new();
    };
    let limit = f64::max(WORSE * least, NOTHING * extent);
    let most = FOLLOWED[usize::from(points.len() > SAMPLE)];
    found.iter().take_while(|fitted| fitted.rms <= limit).take(most).map(|fitted| fitted.primitive).collect()
}

/// Surfaces that are not alike, the best first.
pub(super) fn distinct(mut fits: Vec<Fitted>, extent: f64) -> Vec<Fitted> {
    fits.sort_by(|a, b| a.rms.total_cmp(&b.rms));
    let mut kept: Vec<Fitted> = Vec::new();
    for fitted in fits {
        if !kept.iter().any(|other| alike(&other.primitive, &fitted.primitive, extent)) {
            kept.push(fitted);
        }
    }
    kept
}

/// Whether two surfaces lead to the same minimum, as far as a few steps tell.
fn alike(a: &Primitive, b: &Primitive, extent: f64) -> bool {
    let near = |x: f64, y: f64| (x - y).abs() <= 0.01 * f64::max(x.abs(), y.abs()) + 1e-9 * extent;
    let parallel = a.kind == SurfaceKind::Sphere || a.axis.cross(&b.axis).norm() < 0.01;
    parallel
        && near(a.radius, b.radius)
        && near(a.major_radius, b.major_radius)
        && (a.point - b.point).norm() < 0.01 * (extent + a.radius.abs())
}

/// At most so many of the points, with their weights.
pub(super) fn sample<'a>(
    points: &'a [Vector],
    weights: Option<&'a [f64]>,
    most: usize,
) -> (Cow<'a, [Vector]>, Option<Cow<'a, [f64]>>) {
    if points.len() <= most {
        return (points.into(), weights.map(Into::into));
    }
    let chosen = || (0..most).map(|i| ((i as f64 * GOLDEN).fract() * points.len() as f64) as usize);
    let weights = weights.map(|weights| chosen().map(|i| weights[i]).collect());
    (chosen().map(|i| points[i]).collect(), weights)
}

/// The surface with the radius that is given: it touches the same place, on either side.
fn with_given(p: &Primitive, options: &PrimitiveFitOptions) -> Vec<Primitive> {
    let axis = options.axis.map_or(p.axis, |axis| Vector::from(axis).normalize());
    let p = Primitive { axis, ..*p };
    let Some(radius) = options.radius else {
        return vec![p];
    };
    let across = if p.kind == SurfaceKind::Cylinder { p.point - p.point.dot(&axis) * axis } else { p.point };
    let length = across.norm();
    let outward = if length > 0.0 { across / length } else { Vector::zeros() };
    let foot = p.point - p.radius.min(length) * outward;
    let moved = |by: f64| Primitive { point: foot + by * outward, radius, ..p };
    vec![Primitive { radius, ..p }, moved(radius), moved(-radius)]
}

/// Surfaces for all axes, or for the one that is given, of no more points than a sample has.
fn read_off(
    kind: SurfaceKind,
    points: &[Vector],
    extent: f64,
    direction: Option<Vector>,
    weights: Option<&[f64]>,
) -> Vec<Primitive> {
    let none = Primitive {
        kind,
        point: Vector::zeros(),
        axis: Vector::z(),
        radius: 0.0,
        major_radius: 0.0,
        half_angle: 0.0,
    };
    let Some((centre, [least, _, most])) = principal(points, weights) else {
        return Vec::new();
    };
    let known = matches!(kind, SurfaceKind::Plane | SurfaceKind::Line);
    let axes: Vec<Vector> = match direction {
        Some(direction) => vec![direction],
        None if known => vec![if kind == SurfaceKind::Plane { least } else { most }],
        None => {
            let [other, _] = axes_across(&least);
            let spread = (0..AXES).map(|index| spread_direction(index, AXES));
            [least, most, least.cross(&most), other].into_iter().chain(spread).collect()
        }
    };
    if known {
        return vec![Primitive { point: centre, axis: axes[0], ..none }];
    }
    if kind == SurfaceKind::Sphere {
        let touching = TOUCHING.into_iter().flat_map(|radius| {
            let radius = radius * extent;
            [radius, -radius].map(|by| Primitive { point: centre + by * least, radius, ..none })
        });
        let algebraic = [fitted_to_moments(kind, points), start(kind, points, &[])];
        return algebraic.into_iter().flatten().chain(touching).collect();
    }
    let on_axes = axes.iter().flat_map(|axis| about(kind, points, axis));
    let mut found: Vec<Primitive> = on_axes.collect();
    let positions: Vec<[f64; 3]> = points.iter().map(|&point| point.into()).collect();
    if kind == SurfaceKind::Cylinder {
        found.extend(fitted_to_moments(kind, points));
    }
    if matches!(kind, SurfaceKind::Cone | SurfaceKind::Torus) {
        let (known, normals) = with_normals(&positions);
        found.extend(start(kind, &known, &normals));
        // The cylinder that a torus nearly is lies across the torus's axis.
        let axis = direction.filter(|_| kind == SurfaceKind::Cone).map(Into::into);
        let of_pipes = PrimitiveFitOptions { axis, ..Default::default() };
        let pipes = candidates(SurfaceKind::Cylinder, points, extent, &of_pipes);
        found.extend(pipes.iter().flat_map(|pipe| bent(pipe, kind, extent)));
    }
    found
}

/// The weighted mean of points, and their principal axes, the one of least spread first.
fn principal(points: &[Vector], weights: Option<&[f64]>) -> Option<(Vector, [Vector; 3])> {
    let weight = |i: usize| weights.map_or(1.0, |weights| weights[i]);
    let total: f64 = (0..points.len()).map(weight).sum();
    let centre = points.iter().enumerate().map(|(i, p)| weight(i) * p).sum::<Vector>() / total;
    let square = |(i, p): (usize, &Vector)| weight(i) * (p - centre) * (p - centre).transpose();
    let spread: Matrix3<f64> = points.iter().enumerate().map(square).sum();
    let least = smallest(&spread)?;
    let most = smallest(&-spread)?;
    Some((centre, [least, least.cross(&most), most]))
}

/// Surfaces of revolution about an axis of this direction that are roughly near the points.
fn about(kind: SurfaceKind, points: &[Vector], axis: &Vector) -> Vec<Primitive> {
    let [first, second] = axes_across(axis);
    let seen: Vec<Vector2<f64>> =
        points.iter().map(|p| Vector2::new(p.dot(&first), p.dot(&second))).collect();
    let place = |middle: Vector2<f64>| middle.x * first + middle.y * second;
    let none = Primitive {
        kind,
        point: Vector::zeros(),
        axis: *axis,
        radius: 0.0,
        major_radius: 0.0,
        half_angle: 0.0,
    };
    let ring = circle(&seen);
    let Some((middle, radius)) = ring else {
        return Vec::new();
    };
    let round = Primitive { point: place(middle), radius, ..none };
    match kind {
        SurfaceKind::Cone => cones(points, &seen, &round),
        SurfaceKind::Torus => {
            let profile: Vec<Vector2<f64>> = points
                .iter()
                .zip(&seen)
                .map(|(p, q)| Vector2::new(p.dot(axis), (q - middle).norm()))
                .collect();
            let of_profile = circle(&profile).map(|(middle, tube)| Primitive {
                point: round.point + middle.x * axis,
                radius: tube,
                major_radius: f64::max(middle.y, 1.1 * tube),
                ..round
            });
            // Of little of the tube the profile tells nothing: a tube as thick as the points deviate from the ring.
            let square = profile.iter().map(|q| (q.y - radius).powi(2) + q.x * q.x).sum::<f64>();
            let tube = (square / profile.len() as f64).sqrt().min(0.9 * radius);
            of_profile
                .into_iter()
                .chain([Primitive { radius: tube, major_radius: radius, ..round }])
                .collect()
        }
        _ => vec![round],
    }
}

/// Cones about an axis: x^2 + y^2 = 2 c q + (k h)^2 + 2 k m h + m^2 - c^2, linear in c, k^2, k m and m^2 - c^2, whose
/// radius is m + k h at the height h.
fn cones(points: &[Vector], seen: &[Vector2<f64>], round: &Primitive) -> Vec<Primitive> {
    let [first, second] = axes_across(&round.axis);
    let heights: Vec<f64> = points.iter().map(|p| p.dot(&round.axis)).collect();
    let rows = DMatrix::from_fn(points.len(), 5, |i, j| {
        [2.0 * seen[i].x, 2.0 * seen[i].y, heights[i] * heights[i], 2.0 * heights[i], 1.0][j]
    });
    let right = DVector::from_iterator(points.len(), seen.iter().map(|q| q.norm_squared()));
    let solution = rows.tr_mul(&rows).cholesky().map(|solver| solver.solve(&rows.tr_mul(&right)));
    let algebraic = solution.and_then(|s| {
        let slope = s[2].max(0.0).sqrt();
        let radius = s[3] / slope;
        (slope > 0.0 && radius.is_finite()).then(|| Primitive {
            point: s[0] * first + s[1] * second,
            axis: radius.signum() * round.axis,
            radius: radius.abs(),
            half_angle: slope.atan().clamp(0.02, 1.5),
            ..*round
        })
    });
    let narrow = [round.axis, -round.axis].map(|axis| Primitive { axis, half_angle: NARROW, ..*round });
    algebraic.into_iter().chain(narrow).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_principal_axes_are_those_of_the_spread() {
        let points: Vec<Vector> = (0..50)
            .map(f64::from)
            .map(|i| Vector::new(0.1 * (1.3 * i).sin(), 2.0 * (0.7 * i).cos(), (2.1 * i).sin()))
            .collect();
        let (_, [least, middle, most]) = principal(&points, None).unwrap();
        assert!(least.x.abs() > 0.99 && middle.z.abs() > 0.9 && most.y.abs() > 0.9);
    }

    #[test]
    fn a_weight_counts_like_as_many_points() {
        let points = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.2], [0.0, 2.0, 0.5], [1.0, 1.0, -0.3]].map(Vector::from);
        let doubled: Vec<Vector> = points.iter().copied().chain([points[1]]).collect();
        let (centre, [least, ..]) = principal(&points, Some(&[1.0, 2.0, 1.0, 1.0])).unwrap();
        let (same, [alike, ..]) = principal(&doubled, None).unwrap();
        assert!((centre - same).norm() < 1e-15 && least.cross(&alike).norm() < 1e-12);
    }
}
