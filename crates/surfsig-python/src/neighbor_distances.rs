//! Distances between neighbours, for Python.

use crate::extract::watched;
use crate::rows;
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
    let monitor = Monitor::default();
    let report = || -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            let call = |call: &Py<PyAny>| call.call1(py, (monitor.done(), points.len())).map(|_| ());
            progress.as_ref().map_or(Ok(()), call)
        })
    };
    let run = || surfsig::mean_neighbor_distances(points, count, threads, &monitor);
    let found = py.detach(|| watched(run, report, || monitor.cancel()))?;
    report()?;
    Ok(found.into_pyarray(py))
}
