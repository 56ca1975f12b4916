//! Surfaces among the points that no surface explains yet.
//!
//! A narrow or sparse surface may have no point whose nearest neighbours are all its own. Once its neighbours' surfaces
//! are known, the points that are left are looked at without them: neighbours, normals and noise are those of these
//! points alone, and at last of fewer neighbours.

use super::growth::Region;
use super::scene::{FEW_LOCAL, LOCAL, NONE, Scene};
use crate::primitive::SurfaceKind;
use crate::{Error, Monitor};

/// Nearest points that tell noise and normals among what is left.
const NEIGHBOURS: [usize; 2] = [LOCAL, FEW_LOCAL];

/// Passes with each, as long as they find something.
const PASSES: usize = 2;

/// One point in so many that exact surfaces leave is enough for measured points among exact ones.
const MEASURED_SHARE: usize = 4;

/// Adds surfaces; tells whether there are any. Only where there is no noise: points that noise took away from a surface
/// that was found would seem to be one of their own.
pub(super) fn add(
    scene: &mut Scene,
    regions: &mut Vec<Region>,
    kinds: &[SurfaceKind],
    fewest: usize,
    monitor: &Monitor,
) -> Result<bool, Error> {
    if !scene.is_exact {
        return Ok(false);
    }
    let before = regions.len();
    let measured = scene.chosen.len().div_ceil(MEASURED_SHARE).max(fewest);
    let mut add_among_left = |neighbours: usize, least: usize, is_exact: bool| -> Result<bool, Error> {
        let is_left = |&point: &u32| scene.labels[point as usize] == NONE;
        let left: Vec<u32> = scene.chosen.iter().copied().filter(is_left).collect();
        if left.len() < least {
            return Ok(false);
        }
        let Some(mut apart) = scene.apart(&left, neighbours, is_exact, monitor)? else { return Ok(false) };
        let found = super::regions(&mut apart, kinds, fewest, &[neighbours], monitor)?;
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
        while passes.next().is_some() && add_among_left(neighbours, fewest, true)? {}
    }
    add_among_left(LOCAL, measured, false)?;
    Ok(regions.len() > before)
}
