//! What can have been seen from where, for Python.

use crate::all_cores::on_all_cores;
use crate::rows;
use numpy::{IntoPyArray, PyArray1, PyReadonlyArray2};
use pyo3::prelude::*;

/// Of each place (m, 3) whether points (n, 3) hide it, seen from far away along a unit vector; `across` are two unit
/// vectors square to that. See `surfsig.visibility`.
#[pyfunction]
pub fn hidden_from<'py>(
    py: Python<'py>,
    direction: [f64; 3],
    across: [[f64; 3]; 2],
    places: PyReadonlyArray2<'py, f64>,
    points: PyReadonlyArray2<'py, f64>,
    spacing: f64,
) -> PyResult<Bound<'py, PyArray1<bool>>> {
    let (places, points) = (rows::<f64, 3>(&places)?, rows::<f64, 3>(&points)?);
    let hidden = py.detach(|| surfsig::hidden_from(direction, across, places, points, spacing));
    Ok(hidden.into_pyarray(py))
}

/// Whether a sensor at the origin may have measured points (n, 3); see `surfsig.visibility`.
#[pyfunction]
pub fn measured_from_origin(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    spacing: f64,
) -> PyResult<bool> {
    let points = rows::<f64, 3>(&points)?;
    on_all_cores(py, || surfsig::measured_from_origin(points, spacing))
}

/// From where a sensor measured points (n, 3), or None; see `surfsig.visibility`.
#[pyfunction]
pub fn estimated_viewpoint(py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Option<[f64; 3]>> {
    let points = rows::<f64, 3>(&points)?;
    on_all_cores(py, || surfsig::estimated_viewpoint(points))
}
