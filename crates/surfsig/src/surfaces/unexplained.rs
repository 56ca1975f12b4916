//! Surfaces among the points that no surface explains yet.
//!
//! A narrow or sparse surface may have no point whose nearest neighbours are all its own. Once its neighbours' surfaces
//! are known, the points that are left are looked at without them: neighbours, normals and noise are those of these
//! points alone, and at last of fewer neighbours.

use super::evidence::Evidence;
use super::growth::{Grower, Region};
use super::scene::{FEW_LOCAL, LOCAL, NONE, Scene};
use super::stamps::Stamps;
use crate::primitive::SurfaceKind;
use crate::{Error, Monitor};

/// Nearest points that tell noise and normals among what is left.
const NEIGHBOURS: [usize; 2] = [LOCAL, FEW_LOCAL];

/// Passes with each, as long as they find something.
const PASSES: usize = 2;

/// One point in so many that exact surfaces leave is enough for measured points among exact ones.
const MEASURED_SHARE: usize = 4;

/// How surfaces are looked for among what is left.
#[derive(Clone, Copy)]
enum Search {
    /// Surfaces without noise, with so many nearest points for normals.
    Exact(usize),
    /// Planes without noise through three points and others.
    Planes,
    /// Surfaces with noise.
    Measured,
}

/// Adds surfaces; tells whether there are any. Only where there is no noise: points that noise took away from a surface
/// that was found would seem to be one of their own.
pub(super) fn add(
    scene: &mut Scene,
    regions: &mut Vec<Region>,
    kinds: &[SurfaceKind],
    evidence: Evidence,
    monitor: &Monitor,
) -> Result<bool, Error> {
    if !scene.is_exact {
        return Ok(false);
    }
    let before = regions.len();
    let measured = scene.chosen.len().div_ceil(MEASURED_SHARE).max(evidence.small);
    let mut add_among_left = |search: Search, least: usize| -> Result<bool, Error> {
        let is_left = |&point: &u32| scene.labels[point as usize] == NONE;
        let left: Vec<u32> = scene.chosen.iter().copied().filter(is_left).collect();
        if left.len() < least {
            return Ok(false);
        }
        let (neighbours, is_exact) = match search {
            Search::Exact(neighbours) => (neighbours, true),
            Search::Planes => (FEW_LOCAL, true),
            Search::Measured => (LOCAL, false),
        };
        let Some(mut apart) = scene.apart(&left, neighbours, is_exact, monitor)? else { return Ok(false) };
        let found = match search {
            Search::Planes => planes(&mut apart, evidence, monitor)?,
            _ => super::regions(&mut apart, kinds, evidence, &[neighbours], monitor)?,
        };
        let is_any = !found.is_empty();
        for mut region in found {
            region.primitive.point += apart.origin;
            for member in &mut region.members {
                let own = *member as usize;
                let point = left[apart.numbers[own] as usize];
                scene.noise[point as usize] = apart.noise[own];
                scene.normals[point as usize] = apart.normals[own];
                scene.labels[point as usize] = regions.len() as i32;
                *member = point;
            }
            regions.push(region);
        }
        Ok(is_any)
    };
    for neighbours in NEIGHBOURS {
        let mut passes = 0..PASSES;
        while passes.next().is_some() && add_among_left(Search::Exact(neighbours), evidence.small)? {}
    }
    if kinds.contains(&SurfaceKind::Plane) && add_among_left(Search::Planes, evidence.small)? {
        add_among_left(Search::Exact(FEW_LOCAL), evidence.small)?;
    }
    add_among_left(Search::Measured, measured)?;
    Ok(regions.len() > before)
}

/// Planes through few points.
fn planes(scene: &mut Scene, evidence: Evidence, monitor: &Monitor) -> Result<Vec<Region>, Error> {
    let count = scene.points.len();
    let (mut seen, mut inside) = (Stamps::new(count), Stamps::new(count));
    let mut regions: Vec<Region> = Vec::new();
    for seed in scene.chosen.clone() {
        if scene.labels[seed as usize] != NONE {
            continue;
        }
        monitor.check()?;
        let (seen, inside) = (&mut seen, &mut inside);
        let kinds = &[SurfaceKind::Plane];
        let mut grower =
            Grower { scene, kinds, evidence, first: FEW_LOCAL, enough: usize::MAX, seen, inside };
        if let Some(region) = grower.plane_around(seed) {
            for &member in &region.members {
                scene.labels[member as usize] = regions.len() as i32;
            }
            regions.push(region);
        }
    }
    Ok(regions)
}
