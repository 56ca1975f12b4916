//! Instances of models, for Python.

use crate::all_cores::on_all_cores;
use crate::field::{PHASES, PlacesArgument, table};
use crate::registration::{ScanArgument, free_directions_to_python};
use crate::rows;
use crate::settings::settings_class;
use crate::watched::watched;
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::borrow::Cow;
use std::sync::{Mutex, PoisonError};
use surfsig::{FIELD_SIGNATURE, FIND_STEPS_PER_MODEL, FieldPlaces, Instance, Model, ModelSource, Monitor};

settings_class! {
    /// How instances are searched and judged, for experts; see `surfsig.find_instances`.
    FindSettings of surfsig::FindSettings {
        /// Places of the model that are matched with each place of the scene.
        similar: usize = similar,
        /// Points of the model by which all transforms that matches propose are judged, without alignment.
        few_points: usize = few_points,
        /// Voxels of that judgement in the model's extent.
        rough_voxel: f64 = rough_voxel,
        /// Of these transforms, how many are judged by more points: those that most others agree with.
        agreed: usize = agreed,
        /// Of the model's extent, and radians, within which two of them agree.
        agreed_within: [f64; 2] = agreed_within,
        /// Of these, how many are aligned, by votes and support together.
        aligned: usize = aligned,
        /// Share of the model that, where it is confirmed, counts as much as e times the votes.
        support_per_vote: f64 = support_per_vote,
        /// Proposed transforms that are aligned where the scene's viewpoint is not known.
        proposals: usize = proposals,
        /// Points of the model in their alignment and judgement.
        first_points: usize = first_points,
        /// Voxels between correspondences in the steps of the first alignment: from, to, how many.
        first_distances: (f64, f64, usize) = first_distances,
        /// Of these, how many are judged by more points.
        kept: usize = kept,
        /// Points of the model by which few transforms are aligned and judged, wherever they come from.
        coarse_points: usize = coarse_points,
        /// Voxels between correspondences in the steps of that alignment.
        coarse_distances: (f64, f64, usize) = coarse_distances,
        /// Voxels of both judgements, in those of the last.
        coarse_voxels: f64 = coarse_voxels,
        /// Transforms that are aligned and judged by most points.
        tried: usize = tried,
        /// In the brief search for each of several models, how many transforms are aligned.
        brief_aligned: usize = brief_aligned,
        /// Of these, how many are aligned again and judged.
        brief_tried: usize = brief_tried,
        /// By that many points.
        brief_points: usize = brief_points,
        /// By how much the logarithm of the odds of the best of them may be below that of what is given up.
        brief_deficit: f64 = brief_deficit,
        /// How many of several models are searched after it, at most: those with the largest odds.
        searched: usize = searched,
        /// Points of the model in their alignment.
        aligned_points: usize = aligned_points,
        /// Points of the model in their judgement.
        fine_points: usize = fine_points,
        /// Voxels between correspondences in its steps.
        fine_distances: (f64, f64, usize) = fine_distances,
        /// Distance between points of the surface, in the scene's point spacings at least.
        spacings_per_voxel: f64 = spacings_per_voxel,
        /// The same in the scene's noise.
        noises_per_voxel: f64 = noises_per_voxel,
        /// Patch radii, and radians, within which two proposed transforms agree.
        agreement: [f64; 2] = agreement,
        /// Of these, between two proposals of which the less agreed one is left out.
        merged_share: f64 = merged_share,
        /// Patch radii, and radians, within which two aligned transforms are the same.
        same: [f64; 2] = same,
        /// Points of the scene that an instance is fitted to, at most.
        max_fitted: usize = max_fitted,
        /// Voxels from an instance's surface within which the scene's points are its own.
        own_distance: f64 = own_distance,
        /// What a point that the sensor saw through counts, in confirmed ones.
        contradicted_weight: f64 = contradicted_weight,
        /// The same of one where the sensor saw nothing.
        missing_weight: f64 = missing_weight,
        /// What a confirmed point counts where nobody knows what the sensor saw through.
        unknown_free_space_weight: f64 = unknown_free_space_weight,
        /// Spread of confirmed normals from which on they are more than a plane.
        round_spread: f64 = round_spread,
        /// Voxels from the scene's next point within which a point of the model lies on the scene.
        touching_distance: f64 = touching_distance,
        /// Mean agreement of touching surfaces that is reached by chance, and by equal ones.
        agreement_by_chance: [f64; 2] = agreement_by_chance,
    }
}

/// Points (n, 3), their centre, spacing, radius of the patches, samples and normals (m, 3), places with signatures,
/// larger radii with theirs, and whether the outer side is known.
#[derive(FromPyObject)]
pub struct ModelArgument<'py>(
    PyReadonlyArray2<'py, f64>,
    [f64; 3],
    f64,
    f64,
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f64>,
    PlacesArgument<'py>,
    Vec<(f64, PlacesArgument<'py>)>,
    bool,
);

impl ModelArgument<'_> {
    fn model(&self) -> PyResult<Model> {
        Ok(Model {
            points: rows::<f64, 3>(&self.0)?.to_vec(),
            center: self.1,
            spacing: self.2,
            samples: rows::<f64, 3>(&self.4)?.to_vec(),
            normals: rows::<f64, 3>(&self.5)?.to_vec(),
            places: FieldPlaces { radius: self.3, ..self.6.places()? },
            larger_places: self
                .7
                .iter()
                .map(|(radius, places)| Ok(FieldPlaces { radius: *radius, ..places.places()? }))
                .collect::<PyResult<_>>()?,
            is_sided: self.8,
        })
    }
}

/// Prepare a model to be found; by the names of the crate's `Model`, with the arrays of its places.
#[pyfunction]
#[pyo3(signature = (scan, *, threads=None))]
pub fn prepare_model<'py>(
    py: Python<'py>,
    scan: ScanArgument<'py>,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let scan = scan.scan()?;
    let work = |monitor: &Monitor| Model::new(&scan, threads, monitor);
    let model = watched(py, None, None, work)?;
    model_to_python(py, model)
}

/// What tells whether a model may be in a scene; by the names of the crate's `Model`, as `prepare_model`.
#[pyfunction]
pub fn brief_model<'py>(py: Python<'py>, model: ModelArgument<'py>) -> PyResult<Bound<'py, PyDict>> {
    model_to_python(py, model.model()?.brief())
}

fn model_to_python(py: Python<'_>, model: Model) -> PyResult<Bound<'_, PyDict>> {
    let result = PyDict::new(py);
    let matrix = |points: Vec<[f64; 3]>| {
        let count = points.len();
        points.into_flattened().into_pyarray(py).reshape([count, 3])
    };
    result.set_item("points", matrix(model.points)?)?;
    result.set_item("center", model.center.to_pyarray(py))?;
    result.set_item("spacing", model.spacing)?;
    result.set_item("radius", model.places.radius)?;
    result.set_item("samples", matrix(model.samples)?)?;
    result.set_item("normals", matrix(model.normals)?)?;
    result.set_item("is_sided", model.is_sided)?;
    result.set_item("places", places_to_python(py, model.places)?)?;
    let larger = model.larger_places.into_iter().map(|places| places_to_python(py, places));
    result.set_item("larger_places", larger.collect::<PyResult<Vec<_>>>()?)?;
    Ok(result)
}

/// Places by the names of the crate's arrays, with the radius of their patches.
fn places_to_python(py: Python<'_>, places: FieldPlaces) -> PyResult<Bound<'_, PyDict>> {
    let arrays = PyDict::new(py);
    let count = places.points.len();
    arrays.set_item("radius", places.radius)?;
    arrays.set_item("points", places.points.into_flattened().into_pyarray(py).reshape([count, 3])?)?;
    arrays.set_item("vectors", table(py, places.vectors.into_flattened(), FIELD_SIGNATURE)?)?;
    arrays.set_item("axes", table(py, places.axes.into_flattened(), 3)?)?;
    arrays.set_item("tangents", table(py, places.tangents.into_flattened(), 3)?)?;
    let phases = places.phases.as_flattened().as_flattened().as_flattened().to_vec();
    arrays.set_item("phases", table(py, phases, PHASES)?)?;
    arrays.set_item("count", places.count.into_pyarray(py))?;
    Ok(arrays)
}

/// Models that a function of Python's gives when they are needed: of a number, and whether what `Model::brief` has is enough.
struct LoadedModels {
    radii: Vec<f64>,
    load: Py<PyAny>,
    /// What the function raised.
    raised: Mutex<Option<PyErr>>,
}

impl LoadedModels {
    fn load(&self, number: usize, is_brief: bool) -> Result<Model, surfsig::Error> {
        let loaded = Python::attach(|py| {
            let loaded = self.load.bind(py).call1((number, is_brief))?;
            loaded.extract::<ModelArgument<'_>>()?.model()
        });
        loaded.map_err(|error| {
            *self.raised.lock().unwrap_or_else(PoisonError::into_inner) = Some(error);
            surfsig::Error::Cancelled
        })
    }
}

impl ModelSource for LoadedModels {
    fn count(&self) -> usize {
        self.radii.len()
    }

    fn radius(&self, number: usize) -> f64 {
        self.radii[number]
    }

    fn brief(&self, number: usize) -> Result<Cow<'_, Model>, surfsig::Error> {
        Ok(Cow::Owned(self.load(number, true)?.brief()))
    }

    fn whole(&self, number: usize) -> Result<Cow<'_, Model>, surfsig::Error> {
        Ok(Cow::Owned(self.load(number, false)?))
    }
}

/// Find instances of models; see `surfsig.find_instances`. `load` gives a model by its number, and whether it may be brief.
/// Of each instance its values by the names of its attributes, with the number of its model.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
#[pyo3(signature = (radii, load, scene, *, min_score, at_most=None, settings=None, threads=None, progress=None))]
pub fn find_instances<'py>(
    py: Python<'py>,
    radii: Vec<f64>,
    load: Py<PyAny>,
    scene: ScanArgument<'py>,
    min_score: f64,
    at_most: Option<usize>,
    settings: Option<FindSettings>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let scene = scene.scan()?;
    let mut settings = settings.map_or_else(surfsig::FindSettings::default, |settings| settings.core);
    settings.min_score = min_score;
    settings.at_most = at_most.unwrap_or(usize::MAX);
    settings.threads = threads;
    let models = LoadedModels { radii, load, raised: Mutex::default() };
    let total = 2 + FIND_STEPS_PER_MODEL * models.count();
    let work = |monitor: &Monitor| surfsig::find_instances_of(&models, &scene, &settings, monitor);
    let found = watched(py, Some(total), progress.as_ref(), work);
    if let Some(raised) = models.raised.lock().unwrap_or_else(PoisonError::into_inner).take() {
        return Err(raised);
    }
    found?.into_iter().map(|instance| to_python(py, instance)).collect()
}

fn to_python(py: Python<'_>, instance: Instance) -> PyResult<Bound<'_, PyDict>> {
    let result = PyDict::new(py);
    result.set_item("model", instance.model)?;
    let matrix = instance.T_scene_model.to_matrix();
    result.set_item("T_scene_model", matrix.as_flattened().to_pyarray(py).reshape([4, 4])?)?;
    result.set_item("covariance", instance.covariance.as_flattened().to_pyarray(py).reshape([6, 6])?)?;
    result.set_item("center", instance.center.to_pyarray(py))?;
    result.set_item("score", instance.score)?;
    let measures = PyDict::new(py);
    for (name, value) in instance.measures.named() {
        measures.set_item(name, value)?;
    }
    result.set_item("measures", measures)?;
    result.set_item("visible", instance.visible)?;
    result.set_item("overlap", instance.overlap)?;
    result.set_item("rms", instance.rms)?;
    result.set_item("free_directions", free_directions_to_python(&instance.free_directions))?;
    let alternatives: Vec<[[f64; 4]; 4]> = instance.alternatives.iter().map(|one| one.to_matrix()).collect();
    result.set_item("alternatives", alternatives)?;
    result.set_item("scale", instance.scale)?;
    result.set_item("scale_standard_error", instance.scale_standard_error)?;
    result.set_item("doubts", instance.doubts.iter().map(surfsig::Doubt::name).collect::<Vec<_>>())?;
    result.set_item("reasons", instance.doubts.iter().map(ToString::to_string).collect::<Vec<_>>())?;
    let indices: Vec<i64> = instance.indices.into_iter().map(|index| index as i64).collect();
    result.set_item("indices", indices.into_pyarray(py))?;
    Ok(result)
}

/// Median distance of a point (n, 3) to its nearest other one; see `surfsig.spacing`.
#[pyfunction]
pub fn point_spacing(py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<f64> {
    let points = rows::<f64, 3>(&points)?;
    on_all_cores(py, || surfsig::point_spacing(points))
}
