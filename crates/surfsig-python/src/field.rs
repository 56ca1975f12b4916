//! Field signatures, for Python.

use crate::extract::{At, Points};
use crate::watched::watched;
use crate::{invalid_input, rows, to_python};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{
    FIELD_PHASES, FIELD_SIGNATURE, FieldOptions, FieldPatches, FieldPhases, FieldPlaces, KeypointOptions,
    Monitor, PointCloud, Queries, Radius,
};

/// Numbers that the phases of a place are.
pub const PHASES: usize = size_of::<FieldPhases>() / size_of::<f32>();

/// Make field signatures; see `surfsig.extract_field_signatures`. With `pools` what the frame sees in place of them.
#[pyfunction]
#[pyo3(signature = (points, *, origin, radius, at=None, viewpoint=None, directions=None, threads=None, progress=None, pools=false))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn field_signatures<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    radius: f64,
    at: Option<At<'py>>,
    viewpoint: Option<[f64; 3]>,
    directions: Option<PyReadonlyArray2<'py, f32>>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
    pools: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let cloud = points.cloud(origin)?;
    let queries = match &at {
        None => Queries::All,
        Some(At::Indices(indices)) => Queries::Indices(indices.as_slice()?),
        Some(At::Positions(positions)) => Queries::Positions(PointCloud::new_f64(rows::<f64, 3>(positions)?)),
    };
    let radius = Radius::new(radius).map_err(to_python)?;
    let directions = directions.as_ref().map(rows::<f32, 3>).transpose()?;
    let options = FieldOptions { viewpoint, directions, threads, instruction_set: None };
    let total = queries.len(&cloud);
    let arrays = PyDict::new(py);
    if pools {
        let work = |monitor: &Monitor| surfsig::field_pools(&cloud, radius, &queries, &options, monitor);
        let found = watched(py, Some(total), progress.as_ref(), work)?;
        let sums: Vec<f32> = found.values.iter().flat_map(|pool| pool.as_flattened()).copied().collect();
        arrays.set_item("pools", table(py, sums, numbers_each(&found.values))?)?;
        places(&arrays, found)?;
    } else {
        let work = |monitor: &Monitor| surfsig::field_signatures(&cloud, radius, &queries, &options, monitor);
        let found = watched(py, Some(total), progress.as_ref(), work)?;
        let mut vectors = Vec::with_capacity(total * FIELD_SIGNATURE);
        let mut phases = Vec::with_capacity(total * PHASES);
        for signature in &found.values {
            vectors.extend_from_slice(signature.vector.as_slice());
            phases.extend_from_slice(signature.phases.as_flattened().as_flattened());
        }
        arrays.set_item("vectors", table(py, vectors, FIELD_SIGNATURE)?)?;
        arrays.set_item("phases", table(py, phases, PHASES)?)?;
        places(&arrays, found)?;
    }
    Ok(arrays)
}

/// Choose keypoints; see `surfsig.find_keypoints`. As `field_signatures`, with their numbers in the cloud.
#[pyfunction]
#[pyo3(signature = (points, *, origin, radius, count=None, spacing=None, viewpoint=None, directions=None, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn field_keypoints<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    radius: f64,
    count: Option<usize>,
    spacing: Option<f64>,
    viewpoint: Option<[f64; 3]>,
    directions: Option<PyReadonlyArray2<'py, f32>>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let cloud = points.cloud(origin)?;
    let radius = Radius::new(radius).map_err(to_python)?;
    let directions = directions.as_ref().map(rows::<f32, 3>).transpose()?;
    let options = FieldOptions { viewpoint, directions, threads, instruction_set: None };
    let mut keypoints = KeypointOptions { spacing, ..Default::default() };
    if let Some(count) = count {
        keypoints.count = count;
    }
    let work = |monitor: &Monitor| surfsig::find_keypoints(&cloud, radius, &keypoints, &options, monitor);
    let found = watched(py, None, progress.as_ref(), work)?;
    let arrays = PyDict::new(py);
    arrays.set_item("indices", found.indices.into_pyarray(py))?;
    arrays.set_item("vectors", table(py, found.vectors.into_flattened(), FIELD_SIGNATURE)?)?;
    let phases = found.phases.as_flattened().as_flattened().as_flattened().to_vec();
    arrays.set_item("phases", table(py, phases, PHASES)?)?;
    arrays.set_item("axes", table(py, found.axes.into_flattened(), 3)?)?;
    arrays.set_item("tangents", table(py, found.tangents.into_flattened(), 3)?)?;
    arrays.set_item("count", found.count.into_pyarray(py))?;
    Ok(arrays)
}

/// Points, vectors, axes, tangents and phases of places, row by row.
#[derive(FromPyObject)]
pub struct PlacesArgument<'py>(
    PyReadonlyArray2<'py, f64>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, f32>,
    PyReadonlyArray2<'py, f32>,
);

impl PlacesArgument<'_> {
    pub fn places(&self) -> PyResult<FieldPlaces> {
        let phases = rows::<f32, PHASES>(&self.4)?.as_flattened().as_chunks::<2>().0;
        let orders = phases.as_chunks::<FIELD_PHASES>().0.as_chunks::<7>().0;
        let places = FieldPlaces {
            points: rows::<f64, 3>(&self.0)?.to_vec(),
            vectors: rows::<f32, FIELD_SIGNATURE>(&self.1)?.to_vec(),
            axes: rows::<f32, 3>(&self.2)?.to_vec(),
            tangents: rows::<f32, 3>(&self.3)?.to_vec(),
            phases: orders.to_vec(),
            ..FieldPlaces::new(1.0)
        };
        let lengths = [places.vectors.len(), places.axes.len(), places.tangents.len(), places.phases.len()];
        if lengths != [places.len(); 4] {
            return Err(invalid_input("places must have one vector, axis, tangent and phases each"));
        }
        Ok(places)
    }
}

/// Match places; see `surfsig.match_fields`. Numbers of both, distances, and transforms row by row.
#[pyfunction]
#[pyo3(signature = (source, target, *, mutual, threads=None))]
pub fn match_fields<'py>(
    py: Python<'py>,
    source: PlacesArgument<'py>,
    target: PlacesArgument<'py>,
    mutual: bool,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyDict>> {
    let (source, target) = (source.places()?, target.places()?);
    let run = || surfsig::with_threads(threads, || surfsig::match_fields(&source, &target, mutual));
    let found = py.detach(run).map_err(to_python)?;
    let arrays = PyDict::new(py);
    let numbers = |of: fn(&surfsig::FieldMatch) -> usize| -> Vec<i64> {
        found.iter().map(|one| of(one) as i64).collect()
    };
    arrays.set_item("source", numbers(|one| one.source).into_pyarray(py))?;
    arrays.set_item("target", numbers(|one| one.target).into_pyarray(py))?;
    let distances: Vec<f32> = found.iter().map(|one| one.distance).collect();
    arrays.set_item("distances", distances.into_pyarray(py))?;
    let transforms: Vec<f64> =
        found.iter().flat_map(|one| one.T_target_source.to_matrix()).flatten().collect();
    arrays.set_item("poses", transforms.into_pyarray(py).reshape([found.len(), 4, 4])?)?;
    Ok(arrays)
}

/// Rows of `width` numbers; where there are no rows, they have that width, too.
pub fn table(py: Python<'_>, values: Vec<f32>, width: usize) -> PyResult<Bound<'_, PyAny>> {
    let count = values.len() / width;
    Ok(PyArray1::from_vec(py, values).reshape([count, width])?.into_any())
}

fn numbers_each<T>(_: &[Box<T>]) -> usize {
    size_of::<T>() / size_of::<f32>()
}

/// What belongs to a patch whatever it holds.
fn places<T>(arrays: &Bound<'_, PyDict>, found: FieldPatches<T>) -> PyResult<()> {
    let py = arrays.py();
    arrays.set_item("axes", table(py, found.axes.into_flattened(), 3)?)?;
    arrays.set_item("tangents", table(py, found.tangents.into_flattened(), 3)?)?;
    arrays.set_item("count", found.count.into_pyarray(py))?;
    let status: Vec<u8> = found.status.into_iter().map(|status| status as u8).collect();
    arrays.set_item("status", status.into_pyarray(py))
}
