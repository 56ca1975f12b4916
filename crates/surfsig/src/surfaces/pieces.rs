//! Pieces of one surface that do not touch: a shadow, what stands before it, or a seam has cut it.
//!
//! Two pieces are one where their joint fit is no worse than the separate ones but by chance: what the sum of squares
//! grows by, in units of the variance, is then distributed as chi-square with as many degrees of freedom as there are
//! parameters less. Errors that neighbours have in common enlarge it by the design effect.

use super::growth::Region;
use super::merging::relabel;
use super::scene::Scene;
use crate::primitive::{Primitive, Vector, design_effect, extent, refine};
use rayon::prelude::*;

/// Points of a piece that a fit looks at.
const SAMPLE: usize = 1000;

/// Widest gap between pieces, in units of the width of the narrower one in the gap's direction: what is farther away may be
/// another surface that was made to the same measures, as the teeth of a wheel are.
const GAP: f64 = 0.25;

/// The same where nothing else is next to the gap, as in a shadow, in units of the smaller one's extent.
const EMPTY_GAP: f64 = 1.5;

/// Points of each piece between which the gap is measured.
const SAMPLE_OF_GAP: usize = 150;

/// Points of the smaller piece, and their distance from the larger one's surface in its tolerances up to which a joint fit
/// is tried.
const SAMPLE_OF_DISTANCE: usize = 12;
const NEAR: f64 = 4.0;

/// 99.9 % quantiles of chi-square with 3 to 7 degrees of freedom: of a thousand pieces one stays apart by chance.
const QUANTILES: [f64; 5] = [16.27, 18.47, 20.52, 22.46, 24.32];

/// What the sum of squares may grow by, as a share of it: where errors have so much in common that chance allows anything,
/// nothing is known to be one.
const LARGEST_GROWTH: f64 = 0.25;

/// Blocks in which errors in common are looked for.
const BLOCKS: [usize; 2] = [8, 16];

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

/// What is compared of a surface.
struct Piece {
    label: i32,
    primitive: Primitive,
    points: Vec<Vector>,
    /// Numbers of these points.
    numbers: Vec<u32>,
    extent: f64,
    tolerance: f64,
    /// Sum of squared distances from its own fit.
    sum: f64,
    /// By what factor fewer of its points are independent.
    design_effect: f64,
    is_exact: bool,
}

impl Piece {
    fn new(label: i32, region: &Region, scene: &Scene) -> Self {
        let numbers: Vec<u32> = thinned(&region.members, SAMPLE).collect();
        let points: Vec<Vector> = numbers.iter().map(|&member| scene.points[member as usize]).collect();
        let extent = extent(&points);
        let fitted = refine(region.primitive, &points, extent, scene.termination(region.noise));
        let primitive = fitted.map_or(region.primitive, |fitted| fitted.primitive);
        let chart = primitive.chart();
        let residuals: Vec<f64> = points.iter().map(|point| chart.distance(point)).collect();
        let effects = BLOCKS.map(|blocks| design_effect(&points, &residuals, blocks));
        Self {
            label,
            numbers,
            primitive,
            sum: residuals.iter().map(|residual| residual * residual).sum(),
            design_effect: effects.into_iter().fold(1.0, f64::max),
            extent,
            tolerance: region.tolerance(scene),
            is_exact: scene.is_noiseless(region.noise),
            points,
        }
    }

    /// The surface of which both are pieces.
    fn joined(&self, small: &Self, scene: &Scene) -> Option<Primitive> {
        let chart = self.primitive.chart();
        let near = |point: Vector| chart.distance(&point).abs() <= NEAR * self.tolerance;
        if !thinned(&small.points, SAMPLE_OF_DISTANCE).all(near) {
            return None;
        }
        let gap = self.gap(small);
        let (length, direction) = (gap.norm(), gap.normalize());
        let is_narrow = length <= GAP * self.width(&direction).min(small.width(&direction));
        let is_empty =
            || length <= EMPTY_GAP * small.extent && self.is_open(small, scene) && small.is_open(self, scene);
        if !is_narrow && !is_empty() {
            return None;
        }
        let points = [&self.points[..], &small.points[..]].concat();
        let count = points.len() as f64;
        let (own, others) = (self.primitive.kind.parameters(), small.primitive.kind.parameters());
        let separate = self.sum + small.sum;
        let variance = separate / (count - (own + others) as f64);
        let effect = self.design_effect.max(small.design_effect);
        let starts = [self.primitive, small.primitive];
        starts.into_iter().find_map(|start| {
            let noise = if self.is_exact && small.is_exact { 0.0 } else { f64::INFINITY };
            let fitted = refine(start, &points, extent(&points), scene.termination(noise))?;
            let fewer = own + others - start.kind.parameters();
            let growth = count * fitted.rms * fitted.rms - separate;
            let chance = (QUANTILES[fewer - 3] * variance * effect).min(LARGEST_GROWTH * separate);
            let same = growth <= chance || fitted.rms <= scene.floor;
            same.then_some(fitted.primitive)
        })
    }

    /// Whether this piece ends without another surface where it is next to another piece.
    fn is_open(&self, other: &Self, scene: &Scene) -> bool {
        let others: Vec<Vector> = thinned(&other.points, SAMPLE_OF_GAP).collect();
        let distance = |point: &Vector| {
            others.iter().map(|next| (next - point).norm_squared()).fold(f64::INFINITY, f64::min)
        };
        let mut by_distance: Vec<(f64, u32)> =
            self.points.iter().map(distance).zip(self.numbers.iter().copied()).collect();
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

    /// From a point of this piece to the nearest one of the other, as far as samples tell.
    fn gap(&self, other: &Self) -> Vector {
        let between = thinned(&self.points, SAMPLE_OF_GAP)
            .flat_map(|point| thinned(&other.points, SAMPLE_OF_GAP).map(move |next| next - point));
        between.min_by(|a, b| a.norm_squared().total_cmp(&b.norm_squared())).unwrap_or_default()
    }

    /// How far its points extend in a direction.
    fn width(&self, direction: &Vector) -> f64 {
        let along = self.points.iter().map(|point| point.dot(direction));
        let (low, high) =
            along.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), x| (low.min(x), high.max(x)));
        high - low
    }
}

/// Some of many, evenly.
fn thinned<T: Copy>(all: &[T], most: usize) -> impl Iterator<Item = T> + '_ {
    all.iter().step_by(all.len().div_ceil(most).max(1)).copied()
}
