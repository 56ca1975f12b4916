//! Which parts of a scan are planes, spheres, cylinders, cones and tori.
//!
//! [`scene`] knows each point's neighbours, normal and noise; [`start`] reads a surface off points and normals,
//! [`least_squares`] fits it by orthogonal distance, [`growth`] lets it grow, [`settling`] joins what is one and shares
//! out what lies between.

mod graph;
mod growth;
mod least_squares;
mod primitive;
mod scene;
mod settling;
mod start;

pub use primitive::SurfaceKind;

use crate::{Error, Monitor, PointCloud, with_threads};
use growth::{Grower, Region};
use scene::{LOCAL, NONE, Scene, Stamps};

/// Seeds of which surfaces begin; of larger clouds not every point is one.
const MOST_SEEDS: usize = 100_000;

/// Nearest points by which noise and normals are judged: first few, then more where no surface was found, for the
/// neighbours in a scan may err together.
const LEVELS: [usize; 3] = [LOCAL, 4 * LOCAL, 16 * LOCAL];

/// Failures in which a point takes part until it is no seed any more.
const TRIES: u8 = 1;

/// How surfaces are found.
///
/// ```
/// assert!(surfsig::SurfaceOptions::default().fewest.is_none());
/// ```
#[derive(Debug, Clone, Default)]
pub struct SurfaceOptions {
    /// Fewest points of a surface; a five-hundredth of all, from 20 to 1,000, where it is `None`.
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
    /// Root mean square of its points' distances, corrected for its parameters.
    pub deviation: f64,
    /// Number of its points.
    pub count: usize,
}

/// The surfaces of a scan.
#[derive(Debug, Clone)]
pub struct FoundSurfaces {
    /// Of each point the number of its surface, or -1.
    pub labels: Vec<i32>,
    /// The surfaces, the one with most points first.
    pub surfaces: Vec<FoundSurface>,
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
        let Some(mut scene) = Scene::new(cloud, options.noise, monitor)? else {
            return Ok(FoundSurfaces { labels: vec![NONE; cloud.len()], surfaces: Vec::new() });
        };
        let fewest = options.fewest.unwrap_or_else(|| (scene.points.len() / 500).clamp(20, 1000));
        let all = SurfaceKind::ALL;
        let kinds = if options.kinds.is_empty() { &all[..] } else { &options.kinds };
        let mut regions = regions(&mut scene, kinds, fewest, monitor)?;
        settling::merge(&mut scene, &mut regions);
        settling::assign(&mut scene, &mut regions);
        Ok(assembled(cloud.len(), &scene, regions))
    })?
}

/// Grows surfaces from seeds, the smoothest first, until no seed is left.
fn regions(
    scene: &mut Scene,
    kinds: &[SurfaceKind],
    fewest: usize,
    monitor: &Monitor,
) -> Result<Vec<Region>, Error> {
    let count = scene.points.len();
    let (mut seen, mut inside) = (Stamps::new(count), Stamps::new(count));
    let mut regions = Vec::new();
    for level in LEVELS {
        if level > LOCAL {
            scene.look_farther(level, monitor)?;
        }
        let left = (0..count as u32).filter(|&point| scene.labels[point as usize] == NONE);
        let mut seeds: Vec<u32> = left.step_by(count.div_ceil(MOST_SEEDS)).collect();
        seeds.sort_by(|&a, &b| scene.noise[a as usize].total_cmp(&scene.noise[b as usize]));
        let mut tried = vec![0_u8; count];
        for seed in seeds {
            if scene.labels[seed as usize] != NONE || tried[seed as usize] >= TRIES {
                continue;
            }
            monitor.check()?;
            let mut grower =
                Grower { scene, kinds, fewest, first: level, seen: &mut seen, inside: &mut inside };
            match grower.region_around(seed) {
                Ok(region) => {
                    monitor.add(region.members.len());
                    for &member in &region.members {
                        scene.labels[member as usize] = regions.len() as i32;
                    }
                    regions.push(region);
                }
                Err(members) => members.into_iter().for_each(|point| tried[point as usize] += 1),
            }
        }
    }
    Ok(regions)
}

/// What was found, the largest first.
fn assembled(points: usize, scene: &Scene, mut regions: Vec<Region>) -> FoundSurfaces {
    regions.sort_by_key(|region| std::cmp::Reverse(region.members.len()));
    let mut labels = vec![NONE; points];
    let surfaces = regions.iter_mut().enumerate().map(|(number, region)| {
        for &member in &region.members {
            labels[scene.numbers[member as usize] as usize] = number as i32;
        }
        // A fit that fails keeps the last one.
        let _ = region.fit(scene, usize::MAX);
        let p = &region.primitive;
        let only = |kinds: &[SurfaceKind], value: f64| if kinds.contains(&p.kind) { value } else { f64::NAN };
        let axis = if p.kind == SurfaceKind::Sphere { [f64::NAN; 3] } else { p.axis.into() };
        FoundSurface {
            kind: p.kind,
            point: (p.point + scene.origin).into(),
            axis,
            radius: if p.kind == SurfaceKind::Plane { f64::NAN } else { p.radius },
            major_radius: only(&[SurfaceKind::Torus], p.major_radius),
            half_angle: only(&[SurfaceKind::Cone], p.half_angle),
            deviation: region.deviation,
            count: region.members.len(),
        }
    });
    let surfaces = surfaces.collect();
    FoundSurfaces { labels, surfaces }
}
