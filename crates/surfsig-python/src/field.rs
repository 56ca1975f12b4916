//! Field signatures, for Python.

use crate::extract::{At, Points, watched};
use crate::{invalid_input, rows, to_python};
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, PyReadonlyArray2};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{
    FIELD_PHASES, FIELD_SIGNATURE, FieldOptions, FieldPatches, Monitor, PointCloud, Queries, Radius,
};

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
    let monitor = Monitor::default();
    let total = queries.len(&cloud);
    let report = || -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            progress.as_ref().map_or(Ok(()), |call| call.call1(py, (monitor.done(), total)).map(|_| ()))
        })
    };
    let cancel = || monitor.cancel();
    let arrays = PyDict::new(py);
    if pools {
        let run = || surfsig::field_pools(&cloud, radius, &queries, &options, &monitor);
        let found = py.detach(|| watched(run, report, cancel))?;
        let sums: Vec<f32> = found.values.iter().flat_map(|pool| pool.as_flattened()).copied().collect();
        arrays.set_item("pools", table(py, sums, total)?)?;
        places(&arrays, found)?;
    } else {
        let run = || surfsig::field_signatures(&cloud, radius, &queries, &options, &monitor);
        let found = py.detach(|| watched(run, report, cancel))?;
        let mut vectors = Vec::with_capacity(total * FIELD_SIGNATURE);
        let mut phases = Vec::with_capacity(total * 14 * FIELD_PHASES);
        for signature in &found.values {
            vectors.extend_from_slice(signature.vector.as_slice());
            phases.extend_from_slice(signature.phases.as_flattened().as_flattened());
        }
        arrays.set_item("vectors", table(py, vectors, total)?)?;
        arrays.set_item("phases", table(py, phases, total)?)?;
        places(&arrays, found)?;
    }
    report()?;
    Ok(arrays)
}

/// How unlike each place is to the others; see `surfsig.find_keypoints`.
#[pyfunction]
#[pyo3(signature = (vectors, places, *, radius, threads=None))]
pub fn field_distinctiveness<'py>(
    py: Python<'py>,
    vectors: PyReadonlyArray2<'py, f32>,
    places: PyReadonlyArray2<'py, f64>,
    radius: f64,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyArray1<f32>>> {
    let (vectors, places) = (rows::<f32, FIELD_SIGNATURE>(&vectors)?, rows::<f64, 3>(&places)?);
    if vectors.len() != places.len() {
        return Err(invalid_input(&format!("{} vectors for {} places", vectors.len(), places.len())));
    }
    let radius = Radius::new(radius).map_err(to_python)?;
    let monitor = Monitor::default();
    let run = || surfsig::field_distinctiveness(vectors, places, radius, threads, &monitor);
    let found =
        py.detach(|| watched(run, || Python::attach(|py| py.check_signals()), || monitor.cancel()))?;
    Ok(found.into_pyarray(py))
}

/// As many rows as there are places.
fn table(py: Python<'_>, values: Vec<f32>, count: usize) -> PyResult<Bound<'_, PyAny>> {
    let width = values.len() / count.max(1);
    Ok(PyArray1::from_vec(py, values).reshape([count, width])?.into_any())
}

/// What belongs to a patch whatever it holds.
fn places<T>(arrays: &Bound<'_, PyDict>, found: FieldPatches<T>) -> PyResult<()> {
    let py = arrays.py();
    let count = found.count.len();
    arrays.set_item("axes", table(py, found.axes.into_flattened(), count)?)?;
    arrays.set_item("tangents", table(py, found.tangents.into_flattened(), count)?)?;
    arrays.set_item("count", found.count.into_pyarray(py))?;
    let status: Vec<u8> = found.status.into_iter().map(|status| status as u8).collect();
    arrays.set_item("status", status.into_pyarray(py))
}
