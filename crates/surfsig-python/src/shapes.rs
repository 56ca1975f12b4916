//! Spheres and cylinders through points, from their moments.

use crate::rows;
use numpy::PyReadonlyArray2;
use pyo3::prelude::*;
use surfsig::Moments;

/// Centre and radius of the algebraic sphere; `None` where the points determine none.
#[pyfunction]
pub fn fit_sphere(py: Python<'_>, points: PyReadonlyArray2<'_, f64>) -> PyResult<Option<([f64; 3], f64)>> {
    let points = rows::<f64, 3>(&points)?;
    let sphere = py.detach(|| surfsig::fit_sphere(&Moments::of_points(points)));
    Ok(sphere.map(|sphere| (sphere.centre, sphere.radius)))
}

/// Point of the axis, axis, and radius of the algebraic cylinder; `None` where the points determine none.
#[pyfunction]
#[expect(clippy::type_complexity, reason = "a tuple in Python")]
pub fn fit_cylinder(
    py: Python<'_>,
    points: PyReadonlyArray2<'_, f64>,
) -> PyResult<Option<([f64; 3], [f64; 3], f64)>> {
    let points = rows::<f64, 3>(&points)?;
    let cylinder = py.detach(|| surfsig::fit_cylinder(&Moments::of_points(points)));
    Ok(cylinder.map(|cylinder| (cylinder.centre, cylinder.axis, cylinder.radius)))
}
