//! What a surface measures, and how sure that is: fitted anew, to the last digits, to points that are certainly its own.
//!
//! Where two surfaces meet, points within the noise of both are shared out by their distance. Those that are taken for a
//! surface's own there are its neighbour's in part, all on one side of it, and bend it by more than its standard error:
//! of simulated scenes (benchmarks/intervals.py) the fit to all points has intervals that hold fewer than half of the
//! radii. So a strip along each border is left out, as wide as the noise of both surfaces reaches. What is left out is
//! told by the place on the surface below a point, and not by the point's own distance, which would choose by noise.

use super::FoundSurface;
use super::growth::Region;
use super::scene::{NONE, Scene};
use crate::primitive::{Chart, Primitive, SurfaceKind, Uncertainty, Vector, fit_primitive, uncertainty};
use rayon::prelude::*;
use rustc_hash::{FxHashMap, FxHashSet};

/// Neighbours of a point that may not be the surface's, of the twelve that it has: outliers have no surface, and a
/// point next to one is as good as any.
const MOST_OTHERS: usize = 2;

/// Part of the sum of both tolerances, of three deviations each, that a strip reaches from the border: beyond four
/// deviations hardly a point is the other surface's. ...
const REACH: f64 = 0.67;

/// ... A surface of which this part is not at a border is measured there. ...
const ENOUGH: f64 = 0.3;

/// ... Where less is left, the strips are narrower by these factors, and at last there are none.
const NARROWER: [f64; 3] = [1.0, 0.5, 0.0];

/// Fewest points that a surface is measured by, for each of its parameters.
const FEWEST_FOR_PARAMETER: usize = 6;

/// Standard errors by which a size must differ from what a simpler kind has in its place.
const SIGNIFICANT: f64 = 2.0;

/// Part of the limit of a surface's points in which the density of their distances at the limit is counted.
const AT_LIMIT: f64 = 0.1;

/// What a shift of the surface brings in and out there is at most this part of it: more is no density of noise.
const MOST_SHARE: f64 = 0.5;

/// The surfaces of a scene, whose points have their numbers as labels, in the same order.
/// With each the points that it was fitted to.
pub(super) fn measured(
    scene: &Scene,
    kinds: &[SurfaceKind],
    regions: &[Region],
) -> Vec<(FoundSurface, Vec<u32>)> {
    let limits: Vec<Limit> = regions
        .iter()
        .map(|region| Limit { chart: region.primitive.chart(), tolerance: region.tolerance(scene) })
        .collect();
    let described = |(number, region): (usize, &Region)| {
        let mut inner =
            Region { members: certain(scene, &limits, number, &region.members), ..region.clone() };
        let mut found = fitted(&mut inner, scene, limits[number].tolerance);
        while let Some(simpler) = insignificant(&found).filter(|simpler| kinds.contains(simpler)) {
            let Some(mut as_smooth) = inner.of_kind(simpler, scene) else { break };
            found = fitted(&mut as_smooth, scene, limits[number].tolerance);
            inner = as_smooth;
        }
        let is_exact = scene.is_noiseless(region.noise);
        let tolerance = limits[number].tolerance;
        (FoundSurface { count: region.members.len(), tolerance, is_exact, ..found }, inner.members)
    };
    regions.par_iter().enumerate().map(described).collect()
}

/// A surface, and the distance up to which points are its own.
struct Limit {
    chart: Chart,
    tolerance: f64,
}

impl Limit {
    /// The place on the surface below a point.
    fn foot(&self, point: &Vector) -> Vector {
        point - self.chart.distance(point) * self.chart.normal(point)
    }
}

/// Those of a surface's points that no other surface has a part in.
fn certain(scene: &Scene, limits: &[Limit], number: usize, members: &[u32]) -> Vec<u32> {
    let own = number as i32;
    let label = |point: u32| scene.labels[point as usize];
    let mut borders: FxHashMap<i32, Vec<u32>> = FxHashMap::default();
    let mut inside = Vec::with_capacity(members.len());
    for &member in members {
        let others = || scene.graph.of(member).map(label).filter(move |&other| other != own);
        for other in others().filter(|&other| other != NONE) {
            let border = borders.entry(other).or_default();
            if border.last() != Some(&member) {
                border.push(member);
            }
        }
        if others().count() <= MOST_OTHERS {
            inside.push(member);
        }
    }
    let parameters = limits[number].chart.primitive.kind.parameters();
    let fewest = f64::max(ENOUGH * members.len() as f64, (FEWEST_FOR_PARAMETER * parameters) as f64) as usize;
    if inside.len() < fewest {
        return members.to_vec();
    }
    let left = |narrower: f64| {
        let mut strip = FxHashSet::default();
        for (&other, border) in &borders {
            strip.extend(along_border(scene, limits, (number, other as usize), border, narrower));
        }
        let left = inside.iter().copied().filter(|point| !strip.contains(point)).collect::<Vec<_>>();
        (left.len() >= fewest).then_some(left)
    };
    NARROWER.into_iter().find_map(left).unwrap_or(inside)
}

/// The points of a surface that hang together with those of its border beside another, and lie as near to that as both
/// may err.
fn along_border(
    scene: &Scene,
    limits: &[Limit],
    (own, other): (usize, usize),
    border: &[u32],
    narrower: f64,
) -> FxHashSet<u32> {
    let width = narrower * REACH * (limits[own].tolerance + limits[other].tolerance);
    let is_near = |point: u32| {
        let foot = limits[own].foot(&scene.points[point as usize]);
        limits[other].chart.distance(&foot).abs() <= width
    };
    let mut strip: FxHashSet<u32> = border.iter().copied().collect();
    let mut found = border.to_vec();
    while let Some(point) = found.pop() {
        for next in scene.graph.of(point) {
            if scene.labels[next as usize] == own as i32 && !strip.contains(&next) && is_near(next) {
                strip.insert(next);
                found.push(next);
            }
        }
    }
    strip
}

/// Fits a region's surface to the last digits, and describes it. A fit that fails keeps the last one.
fn fitted(region: &mut Region, scene: &Scene, tolerance: f64) -> FoundSurface {
    let points: Vec<Vector> = region.members.iter().map(|&member| scene.points[member as usize]).collect();
    let positions: Vec<[f64; 3]> = points.iter().map(|&point| point.into()).collect();
    let kind = region.primitive.kind;
    if let Some(best) = fit_primitive(&positions, kind, Some(&region.primitive)) {
        region.primitive = best;
    }
    let chart = region.primitive.chart();
    let distances: Vec<f64> = points.iter().map(|point| chart.distance(point)).collect();
    let freedom = points.len().saturating_sub(kind.parameters()).max(1);
    let at_limit = distances.iter().filter(|distance| is_at_limit(**distance, tolerance)).count();
    region.deviation = (distances.iter().map(|d| d * d).sum::<f64>() / freedom as f64).sqrt();
    let sure = uncertainty(&region.primitive, &points).map(|sure| Uncertainty {
        covariance: sure.covariance * variance_factor(at_limit, distances.len()),
        ..sure
    });
    described(&region.primitive, region.deviation, scene.origin, sure)
}

/// By how much a parameter's variance grows because points beyond a limit are not counted: where the surface moves,
/// points leave on one side and come in on the other, so that the sum of the residuals changes by 1 - 2 T f(T) times the
/// shift, with their density f at the limit T, instead of by once (the asymptotic variance of a skipped mean).
pub(super) fn variance_factor(at_limit: usize, count: usize) -> f64 {
    let share = at_limit as f64 / count.max(1) as f64 / AT_LIMIT;
    (1.0 - share.min(MOST_SHARE)).powi(-2)
}

/// Whether a distance is near the limit, as density is counted there.
pub(super) fn is_at_limit(distance: f64, limit: f64) -> bool {
    distance.abs() > (1.0 - AT_LIMIT) * limit
}

/// The simpler kind that a surface is not significantly different from: a sphere or cylinder whose radius is uncertain by
/// half of itself may as well be a plane, and a cone that hardly opens a cylinder.
fn insignificant(found: &FoundSurface) -> Option<SurfaceKind> {
    let (size, error, simpler) = match found.kind {
        SurfaceKind::Sphere | SurfaceKind::Cylinder => (found.radius, found.radius_std, SurfaceKind::Plane),
        SurfaceKind::Cone => (found.half_angle, found.half_angle_std, SurfaceKind::Cylinder),
        SurfaceKind::Plane | SurfaceKind::Torus | SurfaceKind::Circle | SurfaceKind::Line => return None,
    };
    (size < SIGNIFICANT * error).then_some(simpler)
}

/// A surface with its errors; its count, tolerance and noise are not known here.
pub(super) fn described(
    p: &Primitive,
    deviation: f64,
    origin: Vector,
    sure: Option<Uncertainty>,
) -> FoundSurface {
    let parameters = p.kind.parameters();
    // Of a parameter by its place in the covariance, on one kind of surface.
    let std_of = |kind: SurfaceKind, place: usize| match &sure {
        Some(sure) if p.kind == kind => sure.covariance[(place, place)].sqrt(),
        _ => f64::NAN,
    };
    let radius_std = match p.kind {
        SurfaceKind::Plane | SurfaceKind::Circle | SurfaceKind::Line => f64::NAN,
        SurfaceKind::Sphere => std_of(p.kind, 3),
        SurfaceKind::Cylinder | SurfaceKind::Cone => std_of(p.kind, 4),
        SurfaceKind::Torus => std_of(p.kind, 6),
    };
    FoundSurface {
        kind: p.kind,
        point: (p.point + origin).into(),
        axis: p.axis(),
        radius: p.radius(),
        major_radius: p.major_radius(),
        half_angle: p.half_angle(),
        deviation,
        count: 0,
        tolerance: f64::NAN,
        is_exact: false,
        radius_std,
        major_radius_std: std_of(SurfaceKind::Torus, 5),
        half_angle_std: std_of(SurfaceKind::Cone, 5),
        covariance: sure.as_ref().map_or_else(Vec::new, |sure| {
            (0..parameters * parameters).map(|i| sure.covariance[(i / parameters, i % parameters)]).collect()
        }),
        across: p.chart().across.map(Into::into),
        freedom: sure.map_or(f64::NAN, |sure| sure.freedom),
    }
}
