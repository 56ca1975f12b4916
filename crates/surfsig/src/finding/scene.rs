//! A scene as models are looked for in it: its surface, and what its sensor saw.

use super::FindSettings;
use super::lines_of_sight::LinesOfSight;
use super::model::{Model, VOXELS_PER_RADIUS};
use super::samples::{PLACES_OF_SCENE, described, noise, oriented_outwards, samples};
use crate::alignment::OrientedSurface;
use crate::depth_image::{DepthImage, SurfacePlace};
use crate::scan::CenteredScan;
use crate::spacing::point_spacing;
use crate::visibility::{all_seen_from, estimated_viewpoint, measured_from};
use crate::voxels::Voxels;
use crate::{Error, FieldPlaces, Monitor};
use nalgebra::Vector3;
use rustc_hash::FxHashMap;
use std::f64::consts::SQRT_2;
use std::sync::{Arc, Mutex, OnceLock, PoisonError};

/// Images of a surface that are kept at most: in a large scene others are made again.
const MOST_IMAGES: usize = 2000;

/// A depth image that whoever needs it first makes.
type SharedImage = Arc<OnceLock<DepthImage>>;
/// Images by the step of the ladder of their reach, and their cell.
type SharedImages = FxHashMap<(i32, [i64; 3]), SharedImage>;

/// The samples of a scene's surface that no instance explains yet.
#[derive(Debug, Clone, Copy)]
pub(super) enum Free<'a> {
    /// All of them.
    All,
    /// Those that are marked.
    Only(&'a [bool]),
}

impl Free<'_> {
    /// Whether a sample is one of them.
    pub fn has(self, sample: usize) -> bool {
        match self {
            Self::All => true,
            Self::Only(marked) => marked[sample],
        }
    }
}

/// The surface of a scene, one sample per voxel.
pub(super) struct SceneSurface {
    pub surface: OrientedSurface,
    pub voxel: f64,
    /// Between the points of the scan.
    pub spacing: f64,
    /// Images of the whole scene, which all models share. Those of a fine surface take much memory, and few transforms are
    /// judged by each; they are not kept.
    images: Option<Mutex<SharedImages>>,
    /// See [`SceneSurface::see_from`].
    lines_of_sight: OnceLock<LinesOfSight>,
}

impl SceneSurface {
    pub fn new(samples: &[SurfacePlace], voxel: f64, spacing: f64) -> Self {
        let surface = OrientedSurface::new(samples);
        Self { surface, voxel, spacing, images: None, lines_of_sight: OnceLock::new() }
    }

    fn keeping_images(self) -> Self {
        Self { images: Some(Mutex::default()), ..self }
    }

    fn keeping_nearest(self, distance: f64) -> Self {
        Self { surface: self.surface.with_cells(self.voxel, distance * self.voxel), ..self }
    }

    pub fn samples(&self) -> &[SurfacePlace] {
        self.surface.points()
    }

    /// The place of an image of a cell that all models share, by the step of the ladder of their reach, if it is kept.
    pub fn shared_image(&self, step: i32, cell: [i64; 3]) -> Option<SharedImage> {
        let mut images = self.images.as_ref()?.lock().unwrap_or_else(PoisonError::into_inner);
        if images.len() >= MOST_IMAGES && !images.contains_key(&(step, cell)) {
            return None;
        }
        Some(Arc::clone(images.entry((step, cell)).or_default()))
    }

    /// Whether images of the whole scene are kept.
    pub fn keeps_images(&self) -> bool {
        self.images.is_some()
    }

    /// Sorts the samples by their direction from the viewpoint, the same one for all images, before the first image is made.
    /// A thread that did so while it makes one of many images would take over another image meanwhile, and wait for itself.
    pub fn see_from(&self, viewpoint: [f64; 3]) {
        self.lines_of_sight.get_or_init(|| LinesOfSight::new(self.samples(), viewpoint));
    }

    /// What the sensor saw around a point, about that point, with all that is before and behind it: a thing far before it
    /// hides a model, and what is seen far behind it was seen through it. Free samples may confirm a model.
    ///
    /// # Panics
    /// If it was not told from where the surface was seen.
    pub fn image(&self, middle: [f64; 3], reach: f64, free: Free<'_>) -> DepthImage {
        let lines = self.lines_of_sight.get().expect("a surface that was seen from somewhere");
        let from = [0, 1, 2].map(|k| lines.viewpoint[k] - middle[k]);
        let (mut near, mut is_free) = (Vec::new(), Vec::new());
        // The image is a square.
        let half_diagonal = (SQRT_2 * reach).atan2(Vector3::from(from).norm());
        lines.each_around(middle, half_diagonal, |number| {
            let sample = &self.samples()[number as usize];
            let place = [0, 1, 2].map(|k| (f64::from(sample.place[k]) - middle[k]) as f32);
            near.push(SurfacePlace { place, normal: sample.normal });
            is_free.push(free.has(number as usize));
        });
        DepthImage::new(&near, &is_free, from, self.voxel, reach, None)
    }
}

/// How a surface is made: from samples one voxel apart, thinned to larger voxels, and for what.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Detail {
    Fine { voxel: f64 },
    Coarse { voxel: f64, to: f64 },
    Rough { voxel: f64, to: f64 },
}

/// A scan, prepared for models; what is made once for a length is kept.
pub(super) struct Scene<'a> {
    pub scan: CenteredScan,
    pub spacing: f64,
    /// Whether the sensor says which side of the surface is the outer one.
    pub is_oriented: bool,
    /// From where all was seen, about the scan's centre, where that is known.
    pub viewpoint: Option<[f64; 3]>,
    settings: &'a FindSettings,
    monitor: &'a Monitor,
    noises: Vec<(f64, f64)>,
    samples: Vec<(f64, Arc<Vec<SurfacePlace>>)>,
    surfaces: Vec<(Detail, Arc<SceneSurface>)>,
    places: Vec<(f64, Arc<FieldPlaces>)>,
}

impl<'a> Scene<'a> {
    /// `radius` is that of patches over which the surface's side is told where the sensor does not. Without a viewpoint
    /// the origin of the scan's coordinates is one, where all points can have been seen from there; else it is told by
    /// their density, if that can be.
    pub fn new(
        scan: CenteredScan,
        radius: f64,
        settings: &'a FindSettings,
        monitor: &'a Monitor,
    ) -> Result<Self, Error> {
        let spacing = point_spacing(&scan.points);
        let is_unknown = !scan.scan().is_oriented();
        let origin = scan.center.map(|x| -x);
        let viewpoint = scan.viewpoint.unwrap_or(origin);
        // Noise and mixed pixels hide more points of a depth image than are hidden from a viewpoint that may be any: that
        // the given one is the origin of the coordinates speaks for it.
        let is_seen = all_seen_from(viewpoint, &scan.points, spacing)
            || (scan.viewpoint == Some(origin) && measured_from(origin, &scan.points, spacing));
        let viewpoint = is_seen.then_some(viewpoint);
        let viewpoint = viewpoint.or_else(|| is_unknown.then(|| estimated_viewpoint(&scan.points)).flatten());
        let scan = CenteredScan { viewpoint: viewpoint.filter(|_| scan.directions.is_none()), ..scan };
        let is_oriented = scan.scan().is_oriented();
        let scan = if is_oriented { scan } else { oriented_outwards(scan, radius, monitor)? };
        Ok(Self {
            spacing,
            scan,
            is_oriented,
            viewpoint,
            settings,
            monitor,
            noises: Vec::new(),
            samples: Vec::new(),
            surfaces: Vec::new(),
            places: Vec::new(),
        })
    }

    /// Distance between the samples in which a model is looked for.
    pub fn voxel(&mut self, model: &Model) -> Result<f64, Error> {
        self.resolved(model.voxel().max(model.spacing))
    }

    /// A distance between samples, or the least one at which they are on the surface, if that is more.
    fn resolved(&mut self, voxel: f64) -> Result<f64, Error> {
        let voxel = voxel.max(self.settings.spacings_per_voxel * self.spacing);
        Ok(voxel.max(self.settings.noises_per_voxel * self.noise(voxel)?))
    }

    /// Its places with signatures of patches of a radius, the same for all models.
    pub fn places(&mut self, radius: f64) -> Result<Arc<FieldPlaces>, Error> {
        if let Some((_, known)) = self.places.iter().find(|(of, _)| *of == radius) {
            return Ok(Arc::clone(known));
        }
        let voxel = self.resolved(radius / VOXELS_PER_RADIUS)?;
        let (some, noise) = (self.scan.thinned(voxel).points, self.noise(voxel)?);
        let places = described(&self.scan, &some, noise, radius, PLACES_OF_SCENE, self.monitor)?;
        let places = Arc::new(places);
        self.places.push((radius, Arc::clone(&places)));
        Ok(places)
    }

    fn noise(&mut self, voxel: f64) -> Result<f64, Error> {
        if let Some((_, known)) = self.noises.iter().find(|(of, _)| *of == voxel) {
            return Ok(*known);
        }
        let noise = noise(&self.scan, voxel, self.monitor)?;
        self.noises.push((voxel, noise));
        Ok(noise)
    }

    fn samples(&mut self, voxel: f64) -> Result<Arc<Vec<SurfacePlace>>, Error> {
        if let Some((_, known)) = self.samples.iter().find(|(of, _)| *of == voxel) {
            return Ok(Arc::clone(known));
        }
        let samples = Arc::new(samples(&self.scan, voxel, self.monitor)?);
        self.samples.push((voxel, Arc::clone(&samples)));
        Ok(samples)
    }

    /// Its surface with one sample per voxel.
    pub fn fine_surface(&mut self, voxel: f64) -> Result<Arc<SceneSurface>, Error> {
        self.surface(Detail::Fine { voxel })
    }

    /// The same with larger voxels, from the samples of the fine one, to which many transforms are aligned.
    pub fn coarse_surface(&mut self, voxel: f64, to: f64) -> Result<Arc<SceneSurface>, Error> {
        self.surface(Detail::Coarse { voxel, to })
    }

    /// The same, to which none are.
    pub fn rough_surface(&mut self, voxel: f64, to: f64) -> Result<Arc<SceneSurface>, Error> {
        self.surface(Detail::Rough { voxel, to })
    }

    fn surface(&mut self, detail: Detail) -> Result<Arc<SceneSurface>, Error> {
        if let Some((_, known)) = self.surfaces.iter().find(|(of, _)| *of == detail) {
            return Ok(Arc::clone(known));
        }
        let (Detail::Fine { voxel } | Detail::Coarse { voxel, .. } | Detail::Rough { voxel, .. }) = detail;
        let samples = self.samples(voxel)?;
        let thinned = |to| SceneSurface::new(&thinned(&samples, to), to, self.spacing).keeping_images();
        let surface = match detail {
            Detail::Fine { .. } => SceneSurface::new(&samples, voxel, self.spacing),
            Detail::Coarse { to, .. } => thinned(to).keeping_nearest(self.settings.first_distances.0),
            Detail::Rough { to, .. } => thinned(to),
        };
        let surface = Arc::new(surface);
        self.surfaces.push((detail, Arc::clone(&surface)));
        Ok(surface)
    }
}

/// Of each voxel the mean of the points, with the direction of their mean normal.
fn thinned(points: &[SurfacePlace], voxel: f64) -> Vec<SurfacePlace> {
    let positions: Vec<[f64; 3]> = points.iter().map(|point| point.place.map(f64::from)).collect();
    let voxels = Voxels::new(&positions, voxel);
    let normals = voxels.sums(points.iter().map(|point| point.normal.map(f64::from)));
    let point = |(place, normal): ([f64; 3], [f64; 3])| {
        let normal = Vector3::from(normal).try_normalize(0.0)?;
        Some(SurfacePlace { place: place.map(|x| x as f32), normal: normal.map(|x| x as f32).into() })
    };
    voxels.means(&positions).into_iter().zip(normals).filter_map(point).collect()
}
