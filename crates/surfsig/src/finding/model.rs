//! A model as it is looked for, prepared once.

use super::samples::{PLACES_OF_MODEL, described, mean_length, noise, oriented_outwards, samples};
use crate::depth_image::SurfacePlace;
use crate::kd_tree::KdTree;
use crate::scan::CenteredScan;
use crate::spacing::point_spacing;
use crate::visibility::all_seen_from;
use crate::{Error, FieldPlaces, Monitor, Scan, with_threads};

/// Radius of the smallest patches in units of the median distance of the model's points from their centre.
const RADIUS_SHARE: f64 = 0.4;
/// Between radii of patches: those of models of a library are on one ladder, so that a scene is described once for all.
const LADDER: f64 = std::f64::consts::SQRT_2;
/// Steps of the ladder from the smallest patches to the others. Where a camera's noise hides what is small, patches of
/// a quarter to a third of the object give most right proposals (`benchmarks/clutter.py`).
const LARGER: [i32; 2] = [1, 2];
/// Voxels of a patch's radius between the samples of a surface.
pub(super) const VOXELS_PER_RADIUS: f64 = 16.0;
/// Point spacings that a patch's radius has at least.
pub(super) const SPACINGS_PER_RADIUS: f64 = 8.0;
/// Length of the mean normal below which a surface goes all around, and has an outer side.
const CLOSED: f64 = 0.2;
/// Points without which there is nothing to find.
pub(super) const MIN_POINTS: usize = 50;

/// Steps of [`Model::new`] that [`Monitor::done`] counts.
pub const MODEL_STEPS: usize = 2;

/// What [`crate::find_instances`] looks for. Coordinates are about `center`, so that all digits are kept.
///
/// ```
/// use surfsig::{Model, Monitor, PointCloud, Scan};
/// let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
/// let egg: Vec<[f64; 3]> = (0..4000)
///     .map(|i| {
///         let z = 1.0 - (f64::from(i) + 0.5) / 2000.0;
///         let (sine, cosine) = (golden * f64::from(i)).sin_cos();
///         [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, 1.5 * z]
///     })
///     .collect();
/// let model = Model::new(&Scan::new(PointCloud::new_f64(&egg)), None, &Monitor::default())?;
/// assert!(model.is_sided && model.normals.len() == model.samples.len());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct Model {
    /// All points.
    pub points: Vec<[f64; 3]>,
    /// In the coordinates in which the model came.
    pub center: [f64; 3],
    /// Distance between the points.
    pub spacing: f64,
    /// Points of the surface, one per voxel.
    pub samples: Vec<[f64; 3]>,
    /// Outward unit normals of the samples.
    pub normals: Vec<[f64; 3]>,
    /// Places all over the surface, with their field signatures and the radius of their patches.
    pub places: FieldPlaces,
    /// The same of larger patches, the smaller first.
    pub larger_places: Vec<FieldPlaces>,
    /// Whether it is known which side is the outer one.
    pub is_sided: bool,
}

impl Model {
    /// Prepares a model: a whole object, or one view of it. Its patches get a radius by its size. A viewpoint counts where
    /// all points can have been seen from there, and there are no directions.
    ///
    /// # Errors
    /// [`Error::InvalidModel`] where it has too few points, no extent or no surface; [`Error::Threads`],
    /// [`Error::Cancelled`].
    pub fn new(scan: &Scan<'_>, threads: Option<usize>, monitor: &Monitor) -> Result<Self, Error> {
        with_threads(threads, || Self::prepared(CenteredScan::new(scan), monitor))?
    }

    fn prepared(scan: CenteredScan, monitor: &Monitor) -> Result<Self, Error> {
        let count = scan.points.len();
        if count < MIN_POINTS {
            let text = format!("a model needs {MIN_POINTS} finite points at least, not {count}");
            return Err(Error::InvalidModel(text));
        }
        let spacing = point_spacing(&scan.points);
        let radius = (RADIUS_SHARE * scan.size()).max(SPACINGS_PER_RADIUS * spacing);
        if radius == 0.0 {
            return Err(Error::InvalidModel("a model's points must not all be at one place".into()));
        }
        let radius = on_ladder(radius);
        let is_known =
            |&viewpoint: &_| scan.directions.is_none() && all_seen_from(viewpoint, &scan.points, spacing);
        let mut scan = CenteredScan { viewpoint: scan.viewpoint.filter(is_known), ..scan };
        let mut is_sided = scan.scan().is_oriented();
        if !is_sided {
            scan = oriented_outwards(scan, radius, monitor)?;
            // What goes all around has its volume inside.
            let directions = scan.directions.as_ref();
            is_sided = directions.is_some_and(|all| !all.is_empty() && mean_length(all.iter()) < CLOSED);
        }
        monitor.add(1);
        let model = Self::described(scan, radius, spacing, is_sided, monitor)?;
        monitor.add(1);
        Ok(model)
    }

    fn described(
        scan: CenteredScan,
        radius: f64,
        spacing: f64,
        is_sided: bool,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let voxel = (radius / VOXELS_PER_RADIUS).max(spacing);
        let samples = samples(&scan, voxel, monitor)?;
        if samples.is_empty() {
            let text = "a model's points must lie on a surface: these have no normals";
            return Err(Error::InvalidModel(text.into()));
        }
        let noise = noise(&scan, voxel, monitor)?;
        let positions: Vec<[f64; 3]> = samples.iter().map(|sample| sample.place.map(f64::from)).collect();
        let places_of = |radius: f64| described(&scan, &positions, noise, radius, PLACES_OF_MODEL, monitor);
        let places = places_of(radius)?;
        Ok(Self {
            larger_places: LARGER
                .iter()
                .map(|step| places_of(radius * LADDER.powi(*step)))
                .collect::<Result<_, _>>()?,
            center: scan.center,
            spacing,
            normals: samples.iter().map(|sample| sample.normal.map(f64::from)).collect(),
            places,
            is_sided,
            samples: positions,
            points: scan.points,
        })
    }

    /// What tells whether the model may be in a scene: of its places those with the largest patches, and no points but the
    /// samples. It takes some quarter of the memory; [`crate::ModelSource`] says what for.
    ///
    /// ```
    /// # use surfsig::{Model, Monitor, PointCloud, Scan};
    /// # let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
    /// # let egg: Vec<[f64; 3]> = (0..4000)
    /// #     .map(|i| {
    /// #         let z = 1.0 - (f64::from(i) + 0.5) / 2000.0;
    /// #         let (sine, cosine) = (golden * f64::from(i)).sin_cos();
    /// #         [(1.0 - z * z).sqrt() * cosine, (1.0 - z * z).sqrt() * sine, 1.5 * z]
    /// #     })
    /// #     .collect();
    /// let model = Model::new(&Scan::new(PointCloud::new_f64(&egg)), None, &Monitor::default())?;
    /// let brief = model.brief();
    /// assert!(brief.places.is_empty() && brief.larger_places.last() == model.larger_places.last());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn brief(&self) -> Self {
        let points = if self.samples.len() >= MIN_POINTS { &self.samples } else { &self.points };
        let mut brief = self.with_points(points);
        match (brief.larger_places.last_mut(), self.larger_places.last()) {
            (Some(brief), Some(largest)) => brief.clone_from(largest),
            _ => brief.places.clone_from(&self.places),
        }
        brief
    }

    /// The model as it is judged.
    pub(super) fn without_places(&self) -> Self {
        self.with_points(&self.points)
    }

    /// The same with these points, and without places.
    fn with_points(&self, points: &[[f64; 3]]) -> Self {
        let none = |places: &FieldPlaces| FieldPlaces::new(places.radius);
        Self {
            points: points.to_vec(),
            center: self.center,
            spacing: self.spacing,
            samples: self.samples.clone(),
            normals: self.normals.clone(),
            places: none(&self.places),
            larger_places: self.larger_places.iter().map(none).collect(),
            is_sided: self.is_sided,
        }
    }

    /// The same with patches of about another radius.
    pub(super) fn with_radius(&self, radius: f64, monitor: &Monitor) -> Result<Self, Error> {
        Self::described(self.oriented(1.0), on_ladder(radius), self.spacing, self.is_sided, monitor)
    }

    /// Places with signatures of patches of all radii, the smallest first.
    pub(super) fn all_places(&self) -> impl Iterator<Item = &FieldPlaces> {
        std::iter::once(&self.places).chain(&self.larger_places)
    }

    /// Of these, those by which it is looked for. Where it is known what the sensor saw through, the smallest do not help: of
    /// 166 objects in clutter 120 are found without them in place of 122, with a probability of 0.2 and more 129 in place of
    /// 128 (`benchmarks/clutter.py`, seeds 720 to 727, 730 to 733, 1000 to 1010). Where it is not, they alone do.
    pub(super) fn places_sought(&self, is_free_space_known: bool) -> &[FieldPlaces] {
        if is_free_space_known && self.larger_places.iter().any(|places| !places.is_empty()) {
            &self.larger_places
        } else {
            std::slice::from_ref(&self.places)
        }
    }

    /// The same with the surface's other side as the outer one.
    pub(super) fn inside_out(&self, monitor: &Monitor) -> Result<Self, Error> {
        Self::described(self.oriented(-1.0), self.places.radius, self.spacing, self.is_sided, monitor)
    }

    /// The points, each with the normal of the nearest sample times `side`.
    fn oriented(&self, side: f64) -> CenteredScan {
        let tree = KdTree::new(&self.samples);
        let direction = |point: &[f64; 3]| {
            tree.nearest(*point, f64::INFINITY)
                .map_or([0.0; 3], |(sample, _)| self.normals[sample as usize].map(|x| (side * x) as f32))
        };
        CenteredScan {
            points: self.points.clone(),
            numbers: Vec::new(),
            center: self.center,
            viewpoint: None,
            directions: Some(self.points.iter().map(direction).collect()),
        }
    }

    /// An error where arrays that somebody stored do not belong together.
    pub(super) fn check(&self) -> Result<(), Error> {
        let finite = |points: &[[f64; 3]]| points.iter().flatten().all(|x| x.is_finite());
        let are_whole = |places: &FieldPlaces| {
            [places.vectors.len(), places.axes.len(), places.tangents.len(), places.phases.len()]
                == [places.points.len(); 4]
                && places.radius.is_finite()
                && places.radius >= 0.0
                && finite(&places.points)
        };
        let is_whole = self.normals.len() == self.samples.len()
            && !self.samples.is_empty()
            && self.points.len() >= MIN_POINTS
            && self.all_places().all(are_whole)
            && self.spacing.is_finite()
            && self.spacing >= 0.0
            && [&self.points, &self.samples, &self.normals].iter().all(|all| finite(all));
        if is_whole {
            Ok(())
        } else {
            Err(Error::InvalidModel("a model's arrays do not belong together".into()))
        }
    }

    /// Distance between the samples.
    pub(super) fn voxel(&self) -> f64 {
        self.places.radius / VOXELS_PER_RADIUS
    }

    /// Whether the surface goes all around.
    pub(super) fn is_closed(&self) -> bool {
        let normals: Vec<[f32; 3]> = self.normals.iter().map(|normal| normal.map(|x| x as f32)).collect();
        mean_length(normals.iter()) < CLOSED
    }

    /// Largest distance of a sample from the centre; points that lie on no surface have no sample.
    pub(super) fn extent(&self) -> f64 {
        let square = |sample: &[f64; 3]| sample.iter().map(|x| x * x).sum::<f64>();
        self.samples.iter().map(square).fold(0.0, f64::max).sqrt()
    }

    /// The samples with their normals, of those with the given numbers.
    pub(super) fn surface(&self, numbers: &[usize]) -> Vec<SurfacePlace> {
        let sample = |&i: &usize| SurfacePlace {
            place: self.samples[i].map(|x| x as f32),
            normal: self.normals[i].map(|x| x as f32),
        };
        numbers.iter().map(sample).collect()
    }
}

/// The nearest length on the ladder.
pub(super) fn on_ladder(length: f64) -> f64 {
    LADDER.powf((length.ln() / LADDER.ln()).round())
}

/// The step of the ladder to the next length that is not below one, and that length.
pub(super) fn rung_above(length: f64) -> (i32, f64) {
    let step = (length.ln() / LADDER.ln()).ceil() as i32;
    (step, LADDER.powi(step))
}
