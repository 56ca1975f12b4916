//! Pieces of one surface that do not touch: a shadow, what stands before it, or a seam has cut it.

use super::comparison::{Comparison, SAMPLE, SAMPLE_OF_GAP, thinned};
use super::growth::Region;
use super::merging::relabel;
use super::scene::Scene;
use crate::primitive::{Primitive, Vector};
use rayon::prelude::*;

/// Widest gap where nothing else is next to it, as in a shadow, in units of the smaller piece's extent.
const EMPTY_GAP: f64 = 1.5;

/// Points of each piece next to the gap.
const AT_GAP: usize = 10;

/// Joins pieces of one surface, the largest first.
pub(super) fn join(scene: &mut Scene, regions: &mut Vec<Region>) {
    regions.sort_by_key(|region| std::cmp::Reverse(region.members.len()));
    relabel(scene, regions);
    let mut pieces: Vec<Piece> = regions
        .par_iter()
        .enumerate()
        .map(|(label, region)| Piece::new(label as i32, region, scene))
        .collect();
    let mut large = 0;
    while large < regions.len() {
        let mut small = large + 1;
        while small < regions.len() {
            if let Some(primitive) = pieces[large].joined(&pieces[small], scene) {
                let members = regions.remove(small).members;
                pieces.remove(small);
                let label = pieces[large].label;
                members.iter().for_each(|&member| scene.labels[member as usize] = label);
                regions[large].members.extend(members);
                regions[large].primitive = primitive;
                // A fit that fails keeps the joint one.
                let _ = regions[large].fit(scene, 2 * SAMPLE);
                pieces[large] = Piece::new(label, &regions[large], scene);
                // A larger piece may reach what the smaller one did not.
                small = large + 1;
            } else {
                small += 1;
            }
        }
        large += 1;
    }
    relabel(scene, regions);
}

/// A piece in its scene.
struct Piece {
    label: i32,
    compared: Comparison,
    /// Numbers of the points that are compared.
    numbers: Vec<u32>,
}

impl Piece {
    fn new(label: i32, region: &Region, scene: &Scene) -> Self {
        let numbers: Vec<u32> = thinned(&region.members, SAMPLE).collect();
        let points: Vec<Vector> = numbers.iter().map(|&member| scene.points[member as usize]).collect();
        let (tolerance, is_exact) = (region.tolerance(scene), scene.is_noiseless(region.noise));
        let compared = Comparison::new(region.primitive, points, tolerance, scene.floor, is_exact);
        Self { label, compared, numbers }
    }

    /// The surface of which both are pieces.
    fn joined(&self, small: &Self, scene: &Scene) -> Option<Primitive> {
        if !self.compared.is_near(&small.compared) {
            return None;
        }
        let gap = self.compared.gap(&small.compared);
        let is_empty = || {
            gap.norm() <= EMPTY_GAP * small.compared.extent
                && self.is_open(small, scene)
                && small.is_open(self, scene)
        };
        if !self.compared.is_narrow(&small.compared, &gap) && !is_empty() {
            return None;
        }
        self.compared.joint(&small.compared)
    }

    /// Whether this piece ends without another surface where it is next to another piece.
    fn is_open(&self, other: &Self, scene: &Scene) -> bool {
        let others: Vec<Vector> = thinned(&other.compared.points, SAMPLE_OF_GAP).collect();
        let distance = |point: &Vector| {
            others.iter().map(|next| (next - point).norm_squared()).fold(f64::INFINITY, f64::min)
        };
        let mut by_distance: Vec<(f64, u32)> =
            self.compared.points.iter().map(distance).zip(self.numbers.iter().copied()).collect();
        by_distance.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        by_distance.truncate(AT_GAP);
        let touches = |&&(_, point): &&(f64, u32)| {
            scene.graph.of(point).any(|next| {
                let label = scene.labels[next as usize];
                label != self.label && label != other.label
            })
        };
        2 * by_distance.iter().filter(touches).count() <= by_distance.len()
    }
}
