//! A surface that grows over its neighbours.

use super::evidence::Evidence;
use super::scene::Scene;
use super::stamps::Stamps;
use crate::primitive::{
    EXACT, Primitive, QUICK, SurfaceKind, Termination, Vector, bent, extent, refine, start,
};
use nalgebra::Matrix3;

/// Points that every surface has.
const FEW: usize = 8;

/// Points that tell which surface goes through a seed's first points.
const SAMPLE_OF_FIRST: usize = 48;

/// Points that a fit looks at while a surface still grows.
const SAMPLE: usize = 800;

/// Points that decide about a kind of surface before it grows.
const SAMPLE_OF_KIND: usize = 200;

/// Standard deviations from the surface at which points belong to it.
const NEAR: f64 = 3.0;

/// What a surface's standard deviation may be, in units of the noise of its points' surroundings: neighbouring points
/// of a scan may err together.
const ROUGHEST: f64 = 1.15;

/// A surface whose points deviate more, in the same units, is rejected.
const ROUGH: f64 = 1.4;

/// A surface with less than this part of the fewest points does not become large by bending.
const SMALL: usize = 4;

/// A surface of so many points that deviate by more than noise is not the right one, and need not grow further.
const LARGE: usize = 2000;

/// Extent of a curved surface in units of its radius.
const MIN_ARC: f64 = 0.15;

/// Standard deviation of a surface's points in units of its extent.
const THICKEST: f64 = 0.035;

/// Points whose neighbours are looked at to tell a surface from a line, and the second spread of a line's neighbours in
/// units of the first (variances).
const LOOKED_AT: usize = 100;
const LINE: f64 = 0.01;

/// Rounds after the growth has ended.
const MAX_STABLE_ROUNDS: usize = 6;

/// Rounds of growing and fitting.
const MAX_ROUNDS: usize = 30;

/// A surface of a kind with more parameters must gain this share of points, ...
const MORE: f64 = 1.15;

/// ... or leave at most this share of the mean squared distance of the points that there are.
const BETTER: f64 = 0.8;

/// Of several kinds the simplest is taken whose standard deviation is at most so many times the least.
const AS_GOOD: f64 = 1.6;

/// A seed's first points need no surface with more parameters where one has this much of the noise.
const ENOUGH: f64 = 1.3;

/// Cosine of the angle between the surface's normal and that of a point's surroundings up to which the point may
/// belong to it. Without noise distances tell all, and normals at edges nothing.
pub(super) const ALONG: f64 = 0.9;

/// Evidence, in units of the logarithm of likelihood, for a parameter more.
const EVIDENCE: f64 = 10.0;

impl Scene {
    pub(super) fn termination(&self, noise: f64) -> Termination {
        if self.is_noiseless(noise) { EXACT } else { QUICK }
    }
}

/// A surface, and the points that belong to it.
#[derive(Clone)]
pub(super) struct Region {
    pub primitive: Primitive,
    pub members: Vec<u32>,
    /// Standard deviation of its points' distances.
    pub deviation: f64,
    /// The noise around its seed.
    pub noise: f64,
}

/// What grows surfaces.
pub(super) struct Grower<'a> {
    pub scene: &'a Scene,
    pub kinds: &'a [SurfaceKind],
    pub evidence: Evidence,
    /// Points around a seed from which a surface begins.
    pub first: usize,
    /// Points at which a surface is large enough.
    pub enough: usize,
    pub seen: &'a mut Stamps,
    pub inside: &'a mut Stamps,
}

impl Grower<'_> {
    /// The surface that grows from a seed, or the points that were tried.
    pub fn region_around(&mut self, seed: u32) -> Result<Region, Vec<u32>> {
        let region = self.largest_around(seed)?;
        if self.counts(&region) { Ok(region) } else { Err(region.members) }
    }

    /// Whether a surface is smooth and counts.
    pub fn counts(&mut self, region: &Region) -> bool {
        region.is_smooth(self.scene) && self.evidence.counts(region, self.scene, self.inside)
    }

    /// The surface that grows from a seed, smooth or not.
    pub fn largest_around(&mut self, seed: u32) -> Result<Region, Vec<u32>> {
        let first = self.scene.first_around(seed, self.first, self.seen);
        let noise = self.scene.noise_around(seed, self.seen);
        let mut best: Option<Region> = None;
        // Where no quadric explains a place, none of these surfaces does.
        let rough = !self.scene.is_noiseless(noise) && self.scene.noise[seed as usize] > 2.0 * noise;
        if first.len() < self.first / 2 || !noise.is_finite() || rough {
            return Err(first);
        }
        if let Some(start) = self.first_surface(&first, noise) {
            best = self.grow(start, &first, noise);
        }
        for &kind in self.kinds {
            let Some(simpler) = best.as_ref().filter(|best| best.primitive.kind < kind) else { continue };
            if simpler.deviation <= self.scene.floor || simpler.members.len() < self.evidence.small / SMALL {
                break;
            }
            // The points of the simpler surface are chosen to be near it; those around the seed are not.
            let better = [&simpler.members[..], &first].into_iter().find_map(|from| {
                let start = self.more_complex(kind, simpler, from)?;
                let region = self.grow(start, from, noise)?;
                region.is_better_than(simpler, self.scene).then_some(region)
            });
            best = better.or(best);
        }
        best.ok_or(first)
    }

    /// The simplest surface that explains a seed's first points as well as any.
    fn first_surface(&self, first: &[u32], noise: f64) -> Option<Primitive> {
        let (points, normals) = self.scene.sample(first, SAMPLE_OF_FIRST);
        let mut fits: Vec<(Primitive, f64)> = Vec::new();
        for &kind in self.kinds {
            let simpler = fits.iter().map(|(primitive, _)| *primitive).collect::<Vec<_>>();
            if let Some(fit) = fitted(kind, &points, &normals, &simpler, self.scene.termination(noise)) {
                fits.push(fit);
                if fit.1 <= ENOUGH * noise {
                    break;
                }
            }
        }
        let least = fits.iter().map(|(_, deviation)| *deviation).fold(f64::INFINITY, f64::min);
        let enough = AS_GOOD * least + 0.1 * self.scene.floor;
        let (primitive, deviation) = fits.into_iter().find(|(_, deviation)| *deviation <= enough)?;
        (deviation <= 2.0 * noise + self.scene.floor).then_some(primitive)
    }

    /// A surface of a kind with more parameters near some points, if it explains them much better than a simpler one.
    fn more_complex(&self, kind: SurfaceKind, simpler: &Region, points: &[u32]) -> Option<Primitive> {
        let all = points.len() as f64;
        let (points, normals) = self.scene.sample(points, SAMPLE_OF_KIND);
        let termination = self.scene.termination(simpler.noise);
        let (primitive, deviation) = fitted(kind, &points, &normals, &[simpler.primitive], termination)?;
        let chart = simpler.primitive.chart();
        let squares: f64 = points.iter().map(|point| chart.distance(point).powi(2)).sum();
        let before = (squares / points.len() as f64).sqrt();
        let more = kind.parameters() - simpler.primitive.kind.parameters();
        let gain = (points.len() as f64).min(all / self.scene.likeness.alike)
            * (before.max(1e-300) / deviation.max(1e-300)).ln();
        (gain > EVIDENCE * more as f64).then_some(primitive)
    }

    /// Grows a surface from some points: fits, takes the near points that hang together, and fits again.
    pub fn grow(&mut self, start: Primitive, from: &[u32], noise: f64) -> Option<Region> {
        let scene = self.scene;
        let mut region = Region { primitive: start, members: from.to_vec(), deviation: 0.0, noise };
        let mut stable_rounds = 0;
        for _ in 0..MAX_ROUNDS {
            let before = region.members.len();
            region.fit(scene, SAMPLE)?;
            if before > LARGE && !region.is_smooth(scene) {
                break;
            }
            let most = 2 * before;
            let tolerance = region.tolerance(scene);
            let chart = region.primitive.chart();
            let along = if scene.is_noiseless(noise) { -1.0 } else { ALONG };
            region.members = scene.reached(&chart, tolerance, along, &region.members, most, self.seen);
            let after = region.members.len();
            if after < FEW {
                return None;
            }
            stable_rounds += usize::from(after < most);
            if after >= self.enough
                || stable_rounds >= MAX_STABLE_ROUNDS
                || after < most && after.abs_diff(before) <= after / 300
            {
                break;
            }
        }
        region.members = scene.largest_part(&region.members, self.seen, self.inside);
        region.fit(scene, SAMPLE)?;
        (region.is_plausible(scene) && !region.is_line(scene, self.inside)).then_some(region)
    }
}

/// A surface of a kind through points, and their standard deviation from it; begun from the normals, and from
/// simpler surfaces through the same points.
fn fitted(
    kind: SurfaceKind,
    points: &[Vector],
    normals: &[Vector],
    simpler: &[Primitive],
    termination: Termination,
) -> Option<(Primitive, f64)> {
    let (count, parameters) = (points.len(), kind.parameters());
    if count < parameters + 5 {
        return None;
    }
    let extent = extent(points);
    let starts =
        start(kind, points, normals).into_iter().chain(simpler.iter().flat_map(|p| bent(p, kind, extent)));
    let fits = starts.filter_map(|start| refine(start, points, extent, termination));
    let best = fits.min_by(|a, b| a.rms.total_cmp(&b.rms))?;
    Some((best.primitive, best.rms * (count as f64 / (count - parameters) as f64).sqrt()))
}

impl Region {
    /// Whether it is smooth and another is not, or has more points, or explains about as many much better.
    fn is_better_than(&self, other: &Self, scene: &Scene) -> bool {
        let (size, old) = (self.members.len() as f64, other.members.len() as f64);
        let closer = self.deviation.powi(2) < BETTER * other.deviation.powi(2);
        match (self.is_smooth(scene), other.is_smooth(scene)) {
            (true, false) => size >= 0.5 * old,
            (false, true) => false,
            _ => size >= MORE * old || size >= old / MORE && closer,
        }
    }

    /// Fits the surface to its points, evenly thinned to at most so many.
    pub fn fit(&mut self, scene: &Scene, most: usize) -> Option<()> {
        let step = self.members.len().div_ceil(most).max(1);
        let points: Vec<Vector> =
            self.members.iter().step_by(step).map(|&point| scene.points[point as usize]).collect();
        let fitted = refine(self.primitive, &points, extent(&points), scene.termination(self.noise))?;
        let (count, parameters) = (points.len() as f64, fitted.primitive.kind.parameters() as f64);
        self.primitive = fitted.primitive;
        self.deviation = fitted.rms * (count / (count - parameters)).sqrt();
        Some(())
    }

    /// The same points as a surface of another kind, if it is smooth.
    pub fn of_kind(&self, kind: SurfaceKind, scene: &Scene) -> Option<Self> {
        let (points, normals) = scene.sample(&self.members, SAMPLE);
        let mut region = Self { primitive: start(kind, &points, &normals)?, ..self.clone() };
        region.fit(scene, usize::MAX)?;
        region.is_smooth(scene).then_some(region)
    }

    /// Root mean square of some points' distances from the surface.
    pub fn root_mean_square(&self, points: &[u32], scene: &Scene) -> f64 {
        let chart = self.primitive.chart();
        let squares: f64 =
            points.iter().map(|&point| chart.distance(&scene.points[point as usize]).powi(2)).sum();
        (squares / points.len() as f64).sqrt()
    }

    /// Distance from the surface up to which points belong to it.
    pub fn tolerance(&self, scene: &Scene) -> f64 {
        NEAR * self.deviation.max(0.3 * self.noise).min(ROUGHEST * self.noise) + scene.floor
    }

    /// Whether it is thin against its extent, and a plane, or turns enough within its extent to be told from one: no
    /// plane is a huge cylinder, and no cloud of noise a thick sphere.
    pub fn is_plausible(&self, scene: &Scene) -> bool {
        let (points, _) = scene.sample(&self.members, SAMPLE_OF_KIND);
        let extent = extent(&points);
        let bent = self.primitive.kind == SurfaceKind::Plane || extent >= MIN_ARC * self.primitive.radius;
        bent && self.deviation <= THICKEST * extent
    }

    /// Whether most of its points have their neighbours along a line only: one line of a lidar lies on the cone that its
    /// beam sweeps, and that is no surface.
    fn is_line(&self, scene: &Scene, inside: &mut Stamps) -> bool {
        inside.clear();
        self.members.iter().for_each(|&member| {
            inside.set(member);
        });
        let step = self.members.len().div_ceil(LOOKED_AT);
        let on_line = |&&member: &&u32| {
            let others = scene.graph.of(member).filter(|&other| inside.has(other));
            let from = scene.points[member as usize];
            let spread: Matrix3<f64> =
                others.map(|other| scene.points[other as usize] - from).map(|q| q * q.transpose()).sum();
            let mut sizes = spread.symmetric_eigenvalues();
            sizes.as_mut_slice().sort_by(f64::total_cmp);
            sizes[1] < LINE * sizes[2]
        };
        let looked_at = self.members.len().div_ceil(step);
        2 * self.members.iter().step_by(step).filter(on_line).count() > looked_at
    }

    /// Whether its points deviate by no more than noise.
    pub fn is_smooth(&self, scene: &Scene) -> bool {
        self.deviation <= ROUGH * self.noise + scene.floor
    }
}
