//! One surface fitted to points by orthogonal distance, for Python.

use crate::all_cores::on_all_cores;
use crate::rows;
use numpy::{PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use surfsig::{PrimitiveFitOptions, SurfaceKind};

/// The kind of a name.
pub fn kind_of(name: &str) -> PyResult<SurfaceKind> {
    let kinds = SurfaceKind::ALL.into_iter().chain(SurfaceKind::CURVES);
    let kind = kinds.into_iter().find(|kind| kind.name() == name);
    kind.ok_or_else(|| PyValueError::new_err("unknown kind"))
}

/// A surface without a boundary.
#[pyclass(frozen)]
pub struct Primitive(surfsig::Primitive);

#[pymethods]
impl Primitive {
    #[getter]
    fn point<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.point().to_pyarray(py)
    }

    #[getter]
    fn axis<'py>(&self, py: Python<'py>) -> Bound<'py, PyArray1<f64>> {
        self.0.axis().to_pyarray(py)
    }

    #[getter]
    fn radius(&self) -> f64 {
        self.0.radius()
    }

    #[getter]
    fn major_radius(&self) -> f64 {
        self.0.major_radius()
    }

    #[getter]
    fn half_angle(&self) -> f64 {
        self.0.half_angle()
    }

    fn distances<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
    ) -> PyResult<Bound<'py, PyArray1<f64>>> {
        let points = rows::<f64, 3>(&points)?;
        Ok(py.detach(|| self.0.distances(points)).to_pyarray(py))
    }

    /// The covariance, the directions across the axis, and the degrees of freedom; with the weights of the fit, and
    /// what it kept.
    #[pyo3(signature = (points, weights=None, radius=None, axis=None))]
    #[expect(clippy::type_complexity, reason = "a tuple in Python")]
    fn uncertainty<'py>(
        &self,
        py: Python<'py>,
        points: PyReadonlyArray2<'_, f64>,
        weights: Option<PyReadonlyArray1<'_, f64>>,
        radius: Option<f64>,
        axis: Option<[f64; 3]>,
    ) -> PyResult<(Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>, f64)> {
        let points = rows::<f64, 3>(&points)?;
        let weights = weights.as_ref().map(|weights| weights.as_slice()).transpose()?;
        let options = PrimitiveFitOptions { weights, radius, axis, ..Default::default() };
        let found = py.detach(|| self.0.uncertainty_with(points, &options));
        let parameters = self.0.kind().parameters();
        let covariance = found.covariance.to_pyarray(py).reshape([parameters, parameters])?;
        Ok((covariance, found.across.as_flattened().to_pyarray(py).reshape([2, 3])?, found.freedom))
    }

    fn independent_error(&self, py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<f64> {
        let points = rows::<f64, 3>(&points)?;
        Ok(py.detach(|| self.0.independent_error(points)))
    }
}

/// The surface or curve of a kind for which the sum of squared distances is least; `None` where the points determine
/// none.
#[pyfunction]
#[pyo3(signature = (points, kind, start=None, weights=None, radius=None, axis=None))]
pub fn fit_primitive(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
    kind: &str,
    start: Option<&Primitive>,
    weights: Option<PyReadonlyArray1<'_, f64>>,
    radius: Option<f64>,
    axis: Option<[f64; 3]>,
) -> PyResult<Option<Primitive>> {
    let (points, kind) = (rows::<f64, 3>(&points)?, kind_of(kind)?);
    let weights = weights.as_ref().map(|weights| weights.as_slice()).transpose()?;
    let options = PrimitiveFitOptions { start: start.map(|start| &start.0), weights, radius, axis };
    Ok(on_all_cores(py, || surfsig::fit_primitive_with(points, kind, &options))?.map(Primitive))
}
