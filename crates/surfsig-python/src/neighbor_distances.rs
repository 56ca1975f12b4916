//! Distances between neighbours, for Python.

use crate::rows;
use crate::watched::watched;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;
use surfsig::Monitor;

/// Of each point (n, 3) the mean distance to its `count` nearest others, (n,).
#[pyfunction]
#[pyo3(signature = (points, *, count, threads=None, progress=None))]
pub fn mean_neighbor_distances<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    count: usize,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let points = rows::<f64, 3>(&points)?;
    let work = |monitor: &Monitor| surfsig::mean_neighbor_distances(points, count, threads, monitor);
    let found = watched(py, Some(points.len()), progress.as_ref(), work)?;
    Ok(found.into_pyarray(py))
}
