//! The kind of a surface that has grown, tried again.
//!
//! Among noise a few first points are as near to a sphere as to the pipe on which they are, and the sphere grows over a
//! strip of it. Once a surface has grown, others grow from its points, and that one is taken that explains the points of
//! all of them best.

use super::evidence::Evidence;
use super::growth::{Grower, Region};
use super::scene::{LOCAL, NONE, Scene};
use super::stamps::Stamps;
use crate::fit_primitive;
use crate::primitive::{Chart, Primitive, SurfaceKind, Vector, bent, extent, refine, start};
use rayon::prelude::*;

/// Points from which another kind begins.
const SAMPLE: usize = 400;

/// The same where no normals tell the axis, and axes of all directions are tried.
const SAMPLE_OF_ALL: usize = 100;

/// Another kind is tried if its root mean square is at most so many times that of the surface's own.
const LIKELY: f64 = 1.6;

/// Distance, in standard deviations, from which on a point is not explained, whatever its distance is.
const UNEXPLAINED: f64 = 3.0;

/// Evidence, in units of the logarithm of likelihood, that a kind must have for each parameter more.
const EVIDENCE: f64 = 5.0;

/// Lets surfaces grow again as other kinds where these explain more; tells whether any has changed.
pub(super) fn try_again(
    scene: &mut Scene,
    regions: &mut [Region],
    kinds: &[SurfaceKind],
    evidence: Evidence,
) -> bool {
    let count = scene.points.len();
    let (mut seen, mut inside) = (Stamps::new(count), Stamps::new(count));
    let others: Vec<Vec<Primitive>> =
        regions.par_iter().map(|region| other_kinds(region, scene, kinds)).collect();
    // At a border points are near two surfaces, and the first one took them.
    let mut owners = std::mem::replace(&mut scene.labels, vec![NONE; count]);
    let mut is_changed = false;
    for (number, others) in others.into_iter().enumerate() {
        for primitive in others {
            let region = &regions[number];
            let (seen, inside) = (&mut seen, &mut inside);
            let mut grower =
                Grower { scene, kinds, evidence, first: LOCAL, enough: usize::MAX, seen, inside };
            let Some(grown) = grower.grow(primitive, &region.members, region.noise) else { continue };
            if grower.counts(&grown) && explains_more(&grown, number, regions, &owners, scene) {
                replace(number, grown, regions, &mut owners, scene);
                is_changed = true;
            }
        }
    }
    scene.labels = owners;
    is_changed
}

/// Puts a surface in another one's place; it has the points that are nearer to it than to their own surface.
fn replace(number: usize, mut grown: Region, regions: &mut [Region], owners: &mut [i32], scene: &Scene) {
    regions[number].members.iter().for_each(|&member| owners[member as usize] = NONE);
    let charts: Vec<Chart> = regions.iter().map(|region| region.primitive.chart()).collect();
    let chart = grown.primitive.chart();
    grown.members.retain(|&member| {
        let place = &scene.points[member as usize];
        let owner = owners[member as usize];
        owner == NONE || chart.distance(place).abs() < charts[owner as usize].distance(place).abs()
    });
    for &member in &grown.members {
        owners[member as usize] = number as i32;
    }
    regions[number] = grown;
    for (label, region) in regions.iter_mut().enumerate() {
        region.members.retain(|&member| owners[member as usize] == label as i32);
    }
}

/// Surfaces of other kinds that are nearly as near to a region's points, the simplest first. A plane stays one: what it
/// bends by, its growth has seen.
fn other_kinds(region: &Region, scene: &Scene, kinds: &[SurfaceKind]) -> Vec<Primitive> {
    let own = region.primitive.kind;
    let (points, normals) = scene.sample(&region.members, SAMPLE);
    let extent = extent(&points);
    let termination = scene.termination(region.noise);
    let fitted = refine(region.primitive, &points, extent, termination);
    let Some(fitted) = fitted.filter(|_| own != SurfaceKind::Plane) else {
        return Vec::new();
    };
    let mut found = Vec::new();
    // A sphere is what any few first points are near to; of all others only a simpler kind is tried, for what bends more
    // reaches over their borders. So it does where neighbouring points err alike, which bends what is none.
    let may_bend_more = own == SurfaceKind::Sphere && scene.likeness.alike <= 1.0;
    let is_tried = |kind: &&SurfaceKind| **kind < own || may_bend_more && **kind > own;
    for &kind in kinds.iter().filter(is_tried) {
        let simpler = std::iter::once(&region.primitive).chain(&found);
        let bends: Vec<Primitive> = simpler.flat_map(|simpler| bent(simpler, kind, extent)).collect();
        let all_axes = if own == SurfaceKind::Sphere { for_all_axes(kind, &points) } else { None };
        let starts = start(kind, &points, &normals).into_iter().chain(bends).chain(all_axes);
        let fits = starts.filter_map(|start| refine(start, &points, extent, termination));
        let best = fits.min_by(|a, b| a.rms.total_cmp(&b.rms));
        found.extend(best.filter(|best| best.rms <= LIKELY * fitted.rms).map(|best| best.primitive));
    }
    found
}

/// The surface of a kind through some of the points, for axes of all directions: the normals of short strips do not tell
/// the axis.
fn for_all_axes(kind: SurfaceKind, points: &[Vector]) -> Option<Primitive> {
    let step = points.len().div_ceil(SAMPLE_OF_ALL).max(1);
    let some: Vec<[f64; 3]> = points.iter().step_by(step).map(|&point| point.into()).collect();
    fit_primitive(&some, kind, None)
}

/// Whether a surface in the place of another explains the points of both better, beyond what its parameters cost. Points
/// of a third surface have that, too.
fn explains_more(surface: &Region, number: usize, regions: &[Region], owners: &[i32], scene: &Scene) -> bool {
    let other = &regions[number];
    let scale = surface.deviation.min(other.deviation).max(0.3 * surface.noise) + scene.floor;
    let mut points = [&surface.members[..], &other.members[..]].concat();
    points.sort_unstable();
    points.dedup();
    let of_owner = |point: u32| {
        let owner = owners[point as usize];
        if owner == NONE || owner == number as i32 {
            return f64::INFINITY;
        }
        regions[owner as usize].primitive.chart().distance(&scene.points[point as usize]).abs()
    };
    // Minus the logarithm of likelihood where any distance is as likely as one of three deviations.
    let cost = |region: &Region| {
        let chart = region.primitive.chart();
        let squares: f64 = points
            .iter()
            .map(|&point| chart.distance(&scene.points[point as usize]).abs().min(of_owner(point)) / scale)
            .map(|distance| distance.min(UNEXPLAINED).powi(2))
            .sum();
        0.5 * squares / scene.likeness.alike + EVIDENCE * region.primitive.kind.parameters() as f64
    };
    cost(surface) < cost(other)
}
