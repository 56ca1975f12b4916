//! The surfaces of a scan, for Python.

use crate::extract::Points;
use crate::primitive::kind_of;
use crate::watched::watched;
use numpy::{IntoPyArray, PyArray1, PyArrayMethods, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{Monitor, SurfaceOptions};

/// Find surfaces; see `surfsig.surfaces`. The labels, and a dictionary for each surface.
#[pyfunction]
#[pyo3(signature = (points, *, origin, kinds, min_points=None, noise=None, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
#[expect(clippy::type_complexity, reason = "a tuple in Python")]
pub fn find_surfaces<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    kinds: Vec<String>,
    min_points: Option<usize>,
    noise: Option<f64>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<(Bound<'py, PyArray1<i32>>, Vec<Bound<'py, PyDict>>)> {
    let cloud = points.cloud(origin)?;
    let kinds = kinds.iter().map(|name| kind_of(name)).collect::<PyResult<_>>()?;
    let options = SurfaceOptions { fewest: min_points, noise, kinds, threads };
    let work = |monitor: &Monitor| surfsig::find_surfaces(&cloud, &options, monitor);
    let found = watched(py, Some(cloud.len()), progress.as_ref(), work)?;
    let surfaces = found.surfaces.iter().map(|surface| {
        let entry = PyDict::new(py);
        entry.set_item("kind", surface.kind.name())?;
        entry.set_item("point", surface.point.to_pyarray(py))?;
        entry.set_item("axis", surface.axis.to_pyarray(py))?;
        entry.set_item("radius", surface.radius)?;
        entry.set_item("major_radius", surface.major_radius)?;
        entry.set_item("half_angle", surface.half_angle)?;
        entry.set_item("deviation", surface.deviation)?;
        entry.set_item("count", surface.count)?;
        entry.set_item("radius_std", surface.radius_std)?;
        entry.set_item("major_radius_std", surface.major_radius_std)?;
        entry.set_item("half_angle_std", surface.half_angle_std)?;
        let parameters = surface.covariance.len().isqrt();
        entry.set_item("covariance", surface.covariance.to_pyarray(py).reshape([parameters, parameters])?)?;
        entry.set_item("across", surface.across.map(|direction| direction.to_pyarray(py)).to_vec())?;
        entry.set_item("freedom", surface.freedom)?;
        Ok(entry)
    });
    let surfaces = surfaces.collect::<PyResult<_>>()?;
    Ok((found.labels.into_pyarray(py), surfaces))
}
