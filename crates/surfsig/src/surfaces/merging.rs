//! Surfaces next to each other: one that was found in parts, and points between them.

use super::growth::Region;
use super::scene::{NONE, Scene};
use rustc_hash::FxHashMap;

/// Pairs of neighbouring points by which two surfaces are next to each other.
const TOUCHING: usize = 8;

/// Points that tell whether two surfaces are one.
const SAMPLE: usize = 2000;

/// Root mean square of the smaller one's distances from the joint surface, in units of noise, up to which they are one.
const NEAR: f64 = 2.0;

/// Rounds in which points that are left join the surfaces next to them.
const ROUNDS: usize = 4;

/// Joins surfaces that one surface explains.
pub(super) fn merge(scene: &mut Scene, regions: &mut Vec<Region>) {
    loop {
        let mut pairs: Vec<((i32, i32), usize)> = touching(scene).into_iter().collect();
        pairs.retain(|(_, count)| *count >= TOUCHING);
        // The closest first; the order of a hash map is nobody's.
        pairs.sort_by_key(|&(pair, count)| (std::cmp::Reverse(count), pair));
        let mut changed = vec![false; regions.len()];
        for ((a, b), _) in pairs {
            let (a, b) = (a as usize, b as usize);
            if changed[a] || changed[b] {
                continue;
            }
            let (large, small) =
                if regions[a].members.len() >= regions[b].members.len() { (a, b) } else { (b, a) };
            if let Some(joined) = joined(scene, &regions[large], &regions[small]) {
                for &member in &joined.members {
                    scene.labels[member as usize] = large as i32;
                }
                regions[large] = joined;
                regions[small].members.clear();
                (changed[a], changed[b]) = (true, true);
            }
        }
        if !changed.contains(&true) {
            break;
        }
    }
    regions.retain(|region| !region.members.is_empty());
    relabel(scene, regions);
}

/// How many pairs of neighbouring points two surfaces have in common.
fn touching(scene: &Scene) -> FxHashMap<(i32, i32), usize> {
    let mut pairs = FxHashMap::default();
    for (point, &label) in scene.labels.iter().enumerate().filter(|(_, label)| **label != NONE) {
        for other in scene.graph.of(point as u32) {
            let other = scene.labels[other as usize];
            if other != NONE && other != label {
                *pairs.entry((label.min(other), label.max(other))).or_insert(0) += 1;
            }
        }
    }
    pairs
}

/// Both as one surface of the kind that either has, if that is as smooth.
fn joined(scene: &Scene, large: &Region, small: &Region) -> Option<Region> {
    let members = [&large.members[..], &small.members[..]].concat();
    [large, small].into_iter().find_map(|of_kind| {
        let mut joined =
            Region { members: members.clone(), noise: large.noise.max(small.noise), ..of_kind.clone() };
        joined.fit(scene, SAMPLE)?;
        // Among many points few do not show how far they are from the surface. Those that err alike may be far from it.
        let is_near = scene.likeness.alike > 1.0
            || joined.root_mean_square(&small.members, scene) <= NEAR * joined.noise + scene.floor;
        (is_near && joined.is_smooth(scene) && joined.is_plausible(scene)).then_some(joined)
    })
}

/// Gives points that are left, and those at borders, to the nearest of the surfaces next to them.
pub(super) fn assign(scene: &mut Scene, regions: &mut [Region]) {
    let charts: Vec<_> =
        regions.iter().map(|region| (region.primitive.chart(), region.tolerance(scene))).collect();
    for _ in 0..ROUNDS {
        let nearest = |point: usize| {
            let own = scene.labels[point];
            let next = scene.graph.of(point as u32).map(|other| scene.labels[other as usize]);
            let mut best = (f64::INFINITY, own);
            for label in std::iter::once(own).chain(next).filter(|label| *label != NONE) {
                let (chart, tolerance) = &charts[label as usize];
                let distance = chart.distance(&scene.points[point]).abs() / tolerance;
                if distance < best.0 && (distance <= 1.0 || label == own) {
                    best = (distance, label);
                }
            }
            best.1
        };
        let labels: Vec<i32> = (0..scene.points.len()).map(nearest).collect();
        if labels == scene.labels {
            break;
        }
        scene.labels = labels;
    }
    for region in regions.iter_mut() {
        region.members.clear();
    }
    for (point, &label) in scene.labels.iter().enumerate().filter(|(_, label)| **label != NONE) {
        regions[label as usize].members.push(point as u32);
    }
}

/// Labels the members of each surface by its number, and no other point.
pub(super) fn relabel(scene: &mut Scene, regions: &[Region]) {
    scene.labels.fill(NONE);
    for (number, region) in regions.iter().enumerate() {
        for &member in &region.members {
            scene.labels[member as usize] = number as i32;
        }
    }
}
