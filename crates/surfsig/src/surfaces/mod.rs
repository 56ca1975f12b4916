//! Which parts of a scan are planes, spheres, cylinders, cones and tori.
//!
//! [`scene`] knows each point's neighbours, normal and noise ([`surroundings`], [`sheets`]); [`growth`] lets a
//! [`crate::Primitive`] grow, [`evidence`] says whether it counts, [`merging`] joins what is one and shares out what lies
//! between; [`unexplained`] looks again among the points that are left, by [`consensus`] at last; [`kinds`] tries what has
//! grown among noise as other kinds, [`pieces`] joins what does not touch, by [`comparison`], and [`measurement`] says
//! what each surface measures. Where parts of a cloud are looked at one by one, [`joining`] says which pieces are of one
//! surface, and [`sums`] of the parts measure it.

mod comparison;
mod consensus;
mod evidence;
mod graph;
mod growth;
mod joining;
mod kinds;
mod likeness;
mod local_fits;
mod measurement;
mod merging;
mod pieces;
mod scene;
mod sheets;
mod stamps;
mod sums;
mod surroundings;
mod unexplained;

use crate::primitive::{Primitive, SurfaceKind, Vector};
use crate::{Error, Monitor, PointCloud, with_threads};
use evidence::Evidence;
use growth::{Grower, Region};
use scene::{LOCAL, NONE, Scene};
use stamps::Stamps;

pub use evidence::FEWEST_SURFACE_POINTS;
pub use joining::{JoinedPieces, PiecePair, SurfacePiece, join_surface_pieces};
pub use sums::SurfaceSums;

/// Seeds of which surfaces begin; of larger clouds not every point is one.
const MOST_SEEDS: usize = 100_000;

/// Nearest points by which noise and normals are judged: first few, then more where no surface was found, for the
/// neighbours in a scan may err together.
const LEVELS: [usize; 3] = [LOCAL, 4 * LOCAL, 16 * LOCAL];

/// How surfaces are found.
///
/// ```
/// assert!(surfsig::SurfaceOptions::default().fewest.is_none());
/// ```
#[derive(Debug, Clone, Default)]
pub struct SurfaceOptions {
    /// Fewest points of a surface. Where it is `None`, a five-hundredth of all, from 20 to 1,000, and fewer, from 20
    /// (plane) to 36 (torus) that err each for itself, of surfaces that end at edges.
    pub fewest: Option<usize>,
    /// Standard deviation of the points' distances; estimated around each point where it is `None`.
    pub noise: Option<f64>,
    /// Kinds that are looked for; all where it is empty.
    pub kinds: Vec<SurfaceKind>,
    /// Number of threads; all cores where it is `None`. The result is the same.
    pub threads: Option<usize>,
}

/// A surface that was found.
#[derive(Debug, Clone)]
pub struct FoundSurface {
    /// What it is.
    pub kind: SurfaceKind,
    /// On the plane or the axis, near the points; the centre of a sphere or torus.
    pub point: [f64; 3],
    /// Unit: a plane's normal, the axis of all others; not a number for a sphere.
    pub axis: [f64; 3],
    /// Of a sphere or cylinder, of a cone at `point`, of a torus's tube; not a number for a plane.
    pub radius: f64,
    /// Of a torus; not a number for others.
    pub major_radius: f64,
    /// Of a cone, in radians; not a number for others.
    pub half_angle: f64,
    /// Root mean square of the distances of its points away from borders, corrected for its parameters.
    pub deviation: f64,
    /// Number of its points.
    pub count: usize,
    /// Standard errors of `radius`, `major_radius` and `half_angle`; not a number where they are, and where the points
    /// do not determine them.
    pub radius_std: f64,
    /// See `radius_std`.
    pub major_radius_std: f64,
    /// See `radius_std`.
    pub half_angle_std: f64,
    /// Covariance of the parameters, row by row; empty where the points do not determine them. A plane's offset along
    /// its normal and the normal's tilts; a sphere's centre and radius; of all others the shifts of `point`, the tilts
    /// of the axis, and then the radius (cylinder), the radius and the half angle (cone), the shift along the axis, the
    /// major radius and the tube's radius (torus). Shifts and tilts are along `across`.
    pub covariance: Vec<f64>,
    /// Two unit vectors across the axis.
    pub across: [[f64; 3]; 2],
    /// Degrees of freedom behind the covariance, for Student's t.
    pub freedom: f64,
    /// Distance up to which points are its own.
    pub tolerance: f64,
    /// Whether its points have no noise.
    pub is_exact: bool,
}

impl FoundSurface {
    /// The surface without its errors.
    ///
    /// ```
    /// use surfsig::{find_surfaces, Monitor, PointCloud, SurfaceOptions};
    /// let points: Vec<[f64; 3]> = (0..900).map(|i| [(i % 30) as f64, (i / 30) as f64, 2.0]).collect();
    /// let found = find_surfaces(&PointCloud::new_f64(&points), &SurfaceOptions::default(), &Monitor::default())?;
    /// assert!((found.surfaces[0].primitive().distances(&[[5.0, 6.0, 5.0]])[0].abs() - 3.0).abs() < 1e-9);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn primitive(&self) -> Primitive {
        let or_nothing = |size: f64| if size.is_nan() { 0.0 } else { size };
        let is_sphere = self.kind == SurfaceKind::Sphere;
        Primitive {
            kind: self.kind,
            point: Vector::from(self.point),
            // A sphere's is never looked at.
            axis: if is_sphere { Vector::z() } else { Vector::from(self.axis) },
            radius: or_nothing(self.radius),
            major_radius: or_nothing(self.major_radius),
            half_angle: or_nothing(self.half_angle),
        }
    }
}

/// The surfaces of a scan.
#[derive(Debug, Clone)]
pub struct FoundSurfaces {
    /// Of each point the number of its surface, or -1.
    pub labels: Vec<i32>,
    /// The surfaces, the one with most points first.
    pub surfaces: Vec<FoundSurface>,
    /// Whether each point is one that its surface was fitted to: those at borders are not.
    pub measured: Vec<bool>,
    /// Distances below this are rounding.
    pub rounding: f64,
}

/// Finds the planes, spheres, cylinders, cones and tori of a scan.
///
/// # Errors
/// As [`crate::extract()`].
///
/// ```
/// use surfsig::{find_surfaces, Monitor, PointCloud, SurfaceKind, SurfaceOptions};
/// // Two faces of a box.
/// let floor = (0..900).map(|i| [(i % 30) as f64, (i / 30) as f64, 0.0]);
/// let wall = (0..600).map(|i| [(i % 30) as f64, 0.0, 1.0 + (i / 30) as f64]);
/// let points: Vec<[f64; 3]> = floor.chain(wall).collect();
/// let found = find_surfaces(&PointCloud::new_f64(&points), &SurfaceOptions::default(), &Monitor::default())?;
/// assert_eq!(found.surfaces.len(), 2);
/// assert!(found.surfaces.iter().all(|s| s.kind == SurfaceKind::Plane));
/// assert_ne!(found.labels[450], found.labels[1200]);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn find_surfaces(
    cloud: &PointCloud<'_>,
    options: &SurfaceOptions,
    monitor: &Monitor,
) -> Result<FoundSurfaces, Error> {
    with_threads(options.threads, || {
        let Some(mut scene) = Scene::new(cloud, options.noise, LOCAL, None, monitor)? else {
            return Ok(FoundSurfaces {
                labels: vec![NONE; cloud.len()],
                surfaces: Vec::new(),
                measured: vec![false; cloud.len()],
                rounding: 0.0,
            });
        };
        let evidence = Evidence::new(options.fewest, &scene);
        // The simplest first, in whatever order they were asked for.
        let wanted = |kind: &SurfaceKind| options.kinds.is_empty() || options.kinds.contains(kind);
        let kinds: Vec<SurfaceKind> = SurfaceKind::ALL.into_iter().filter(wanted).collect();
        // Without noise neighbours do not err together.
        let levels = if scene.is_exact { &LEVELS[..1] } else { &LEVELS[..] };
        let mut regions = regions(&mut scene, &kinds, evidence, levels, monitor)?;
        let mut inside = Stamps::new(scene.points.len());
        let mut share_out = |scene: &mut Scene, regions: &mut Vec<Region>| {
            merging::merge(scene, regions);
            merging::assign(scene, regions);
            // Some may have lost their points to a nearer one.
            regions.retain(|region| evidence.counts(region, scene, &mut inside));
            merging::relabel(scene, regions);
        };
        share_out(&mut scene, &mut regions);
        if unexplained::add(&mut scene, &mut regions, &kinds, evidence, monitor)? {
            share_out(&mut scene, &mut regions);
        }
        if !scene.is_exact && self::kinds::try_again(&mut scene, &mut regions, &kinds, evidence) {
            share_out(&mut scene, &mut regions);
        }
        pieces::join(&mut scene, &mut regions);
        Ok(assembled(cloud.len(), scene, &kinds, regions))
    })?
}

/// Grows surfaces from seeds, the smoothest first, until no seed is left.
fn regions(
    scene: &mut Scene,
    kinds: &[SurfaceKind],
    evidence: Evidence,
    levels: &[usize],
    monitor: &Monitor,
) -> Result<Vec<Region>, Error> {
    let count = scene.points.len();
    let (mut seen, mut inside) = (Stamps::new(count), Stamps::new(count));
    let mut regions = Vec::new();
    let mut unknown = scene.is_noise_unknown();
    for &level in levels {
        if level > levels[0] {
            scene.look_farther(level, monitor)?;
        }
        let mut seeds = scene.seeds(MOST_SEEDS);
        if unknown {
            let mut grow = |scene: &Scene, seed: u32, enough: usize| {
                let (seen, inside) = (&mut seen, &mut inside);
                let evidence = Evidence::of(enough / 40);
                Grower { scene, kinds, evidence, first: level, enough, seen, inside }
                    .largest_around(seed)
                    .ok()
            };
            unknown = !likeness::learn(scene, &seeds, &mut grow);
            // Errors that neighbours have in common look like a second sheet.
            if scene.likeness.alike > 1.0 && scene.forget_sheets() {
                seeds = scene.seeds(MOST_SEEDS);
                unknown = !likeness::learn(scene, &seeds, &mut grow);
            }
        }
        // A point that took part in a failure is no seed any more.
        let mut tried = vec![false; count];
        for seed in seeds {
            if scene.labels[seed as usize] != NONE || tried[seed as usize] {
                continue;
            }
            monitor.check()?;
            let mut grower = Grower {
                scene,
                kinds,
                evidence,
                first: level,
                enough: usize::MAX,
                seen: &mut seen,
                inside: &mut inside,
            };
            match grower.region_around(seed) {
                Ok(region) => {
                    monitor.add(region.members.len());
                    for &member in &region.members {
                        scene.labels[member as usize] = regions.len() as i32;
                    }
                    regions.push(region);
                }
                Err(members) => members.into_iter().for_each(|point| tried[point as usize] = true),
            }
        }
    }
    Ok(regions)
}

/// What was found, the largest first.
fn assembled(
    points: usize,
    mut scene: Scene,
    kinds: &[SurfaceKind],
    mut regions: Vec<Region>,
) -> FoundSurfaces {
    regions.sort_by_key(|region| std::cmp::Reverse(region.members.len()));
    merging::relabel(&mut scene, &regions);
    let mut labels = vec![NONE; points];
    for (&number, &label) in scene.numbers.iter().zip(&scene.labels) {
        labels[number as usize] = label;
    }
    let mut measured = vec![false; points];
    let mut surfaces = Vec::with_capacity(regions.len());
    for (surface, inner) in measurement::measured(&scene, kinds, &regions) {
        inner.iter().for_each(|&point| measured[scene.numbers[point as usize] as usize] = true);
        surfaces.push(surface);
    }
    FoundSurfaces { labels, surfaces, measured, rounding: scene.floor }
}
