//! A surface that grows over its neighbours.

use super::least_squares::refine;
use super::primitive::{Primitive, SurfaceKind, Vector};
use super::scene::{Scene, Stamps};
use super::start::{bent, start};

/// Points that every surface has.
const FEW: usize = 12;

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

/// A surface whose points stray more, in the same units, is none.
const ROUGH: f64 = 1.4;

/// A surface with less than this part of the fewest points does not become large by bending.
const SMALL: usize = 4;

/// A surface with so many points that strays more than noise does is not the right one, and need not grow further.
const LARGE: usize = 2000;

/// Extent of a curved surface in units of its radius.
const LEAST_TURN: f64 = 0.15;

/// Rounds after the growth has ended.
const MAX_SETTLING: usize = 6;

/// Rounds of growing and fitting.
const MAX_ROUNDS: usize = 30;

/// A surface of a kind with more parameters must gain this share of points, ...
const MORE: f64 = 1.15;

/// ... or explain those that there are so much better: of the mean square there is no more left.
const BETTER: f64 = 0.8;

/// Of several kinds the simplest is taken whose standard deviation is at most so many times the least.
const AS_GOOD: f64 = 1.6;

/// A seed's first points need no surface with more parameters where one has this much of the noise.
const ENOUGH: f64 = 1.3;

/// Cosine of the angle between the surface's normal and that of a point's surroundings up to which the point may
/// belong to it, ...
const ALONG: f64 = 0.9;

/// ... unless noise is below so many floors: then distances tell all, and normals at edges nothing.
const NOISELESS: f64 = 20.0;

/// Evidence, in units of the logarithm of likelihood, for a parameter more.
const EVIDENCE: f64 = 10.0;

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
    pub fewest: usize,
    /// Points around a seed from which a surface begins.
    pub first: usize,
    pub seen: &'a mut Stamps,
    pub inside: &'a mut Stamps,
}

impl Grower<'_> {
    /// The surface that grows from a seed or the points that were tried.
    pub fn region_around(&mut self, seed: u32) -> Result<Region, Vec<u32>> {
        let first = self.scene.around(seed, self.first, self.seen);
        let noise = self.scene.noise_around(seed, self.seen);
        let mut best: Option<Region> = None;
        // Where no quadric explains a place, none of these surfaces does.
        let rough = noise > NOISELESS * self.scene.floor && self.scene.noise[seed as usize] > 2.0 * noise;
        if first.len() < self.first / 2 || !noise.is_finite() || rough {
            return Err(first);
        }
        if let Some(start) = self.first_surface(&first, noise) {
            best = self.grow(start, &first, noise);
        }
        for &kind in self.kinds {
            let Some(simpler) = best.as_ref().filter(|best| best.primitive.kind < kind) else { continue };
            if simpler.deviation <= self.scene.floor || simpler.members.len() < self.fewest / SMALL {
                break;
            }
            if let Some(start) = self.more_complex(kind, simpler)
                && let Some(region) = self.grow(start, &simpler.members, noise)
                && region.is_better_than(simpler, self.scene)
            {
                best = Some(region);
            }
        }
        match best {
            Some(region) if region.is_smooth(self.scene) && region.members.len() >= self.fewest => Ok(region),
            Some(region) => Err(region.members),
            None => Err(first),
        }
    }

    /// The simplest surface that explains a seed's first points as well as any.
    fn first_surface(&self, first: &[u32], noise: f64) -> Option<Primitive> {
        let (points, normals) = self.scene.sample(first, SAMPLE_OF_FIRST);
        let mut fits: Vec<(Primitive, f64)> = Vec::new();
        for &kind in self.kinds {
            let simpler = fits.iter().map(|(primitive, _)| *primitive).collect::<Vec<_>>();
            if let Some(fit) = fitted(kind, &points, &normals, &simpler) {
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

    /// A surface of a kind with more parameters near the points of a simpler one, if it explains them much better.
    fn more_complex(&self, kind: SurfaceKind, simpler: &Region) -> Option<Primitive> {
        let (points, normals) = self.scene.sample(&simpler.members, SAMPLE_OF_KIND);
        let (primitive, deviation) = fitted(kind, &points, &normals, &[simpler.primitive])?;
        let more = kind.parameters() - simpler.primitive.kind.parameters();
        let gain = points.len() as f64 * (simpler.deviation.max(1e-300) / deviation.max(1e-300)).ln();
        (gain > EVIDENCE * more as f64).then_some(primitive)
    }

    /// Grows a surface from some points: fits, takes the near points that hang together, and fits again.
    fn grow(&mut self, start: Primitive, from: &[u32], noise: f64) -> Option<Region> {
        let scene = self.scene;
        let mut region = Region { primitive: start, members: from.to_vec(), deviation: 0.0, noise };
        let mut settled = 0;
        for _ in 0..MAX_ROUNDS {
            let before = region.members.len();
            region.fit(scene, SAMPLE)?;
            if before > LARGE && !region.is_smooth(scene) {
                break;
            }
            let most = 2 * before;
            let tolerance = region.tolerance(scene);
            let chart = region.primitive.chart();
            let along = if noise > NOISELESS * scene.floor { ALONG } else { -1.0 };
            region.members = scene.reached(&chart, tolerance, along, &region.members, most, self.seen);
            let after = region.members.len();
            if after < FEW {
                return None;
            }
            settled += usize::from(after < most);
            if settled >= MAX_SETTLING || after < most && after.abs_diff(before) <= after / 300 {
                break;
            }
        }
        region.members = scene.largest_part(&region.members, self.seen, self.inside);
        region.fit(scene, SAMPLE)?;
        region.is_bent(scene).then_some(region)
    }
}

/// A surface of a kind through points, and their standard deviation from it; begun from the normals, and from
/// simpler surfaces through the same points.
fn fitted(
    kind: SurfaceKind,
    points: &[Vector],
    normals: &[Vector],
    simpler: &[Primitive],
) -> Option<(Primitive, f64)> {
    let (count, parameters) = (points.len(), kind.parameters());
    if count < parameters + 5 {
        return None;
    }
    let extent = extent(points);
    let starts =
        start(kind, points, normals).into_iter().chain(simpler.iter().flat_map(|p| bent(p, kind, extent)));
    let fits = starts.filter_map(|start| refine(start, points, extent));
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
        let fitted = refine(self.primitive, &points, extent(&points))?;
        let (count, parameters) = (points.len() as f64, fitted.primitive.kind.parameters() as f64);
        self.primitive = fitted.primitive;
        self.deviation = fitted.rms * (count / (count - parameters)).sqrt();
        Some(())
    }

    /// Distance from the surface up to which points belong to it.
    pub fn tolerance(&self, scene: &Scene) -> f64 {
        NEAR * self.deviation.max(0.3 * self.noise).min(ROUGHEST * self.noise) + scene.floor
    }

    /// Whether it is a plane, or turns enough within its extent to be told from one: no plane is a huge cylinder.
    fn is_bent(&self, scene: &Scene) -> bool {
        let (points, _) = scene.sample(&self.members, SAMPLE_OF_KIND);
        self.primitive.kind == SurfaceKind::Plane || extent(&points) >= LEAST_TURN * self.primitive.radius
    }

    /// Whether its points stray no more than noise does.
    pub fn is_smooth(&self, scene: &Scene) -> bool {
        self.deviation <= ROUGH * self.noise + scene.floor
    }
}

/// How far points are spread: the diagonal of their box.
fn extent(points: &[Vector]) -> f64 {
    let far = Vector::repeat(f64::INFINITY);
    let (low, high) = points.iter().fold((far, -far), |(low, high), p| (low.inf(p), high.sup(p)));
    (high - low).norm()
}
