//! Places of a surface found by where they are, for Python.

use crate::depth_image::{SurfacePlaces, poses_of};
use crate::{invalid_input, to_python};
use numpy::{IntoPyArray, PyArray2, PyArray3, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray3};
use pyo3::prelude::*;
use surfsig::RigidTransform;

/// See the crate's `SurfaceIndex`.
#[pyclass(frozen, module = "surfsig")]
pub struct SurfaceIndex {
    index: surfsig::SurfaceIndex,
}

#[pymethods]
impl SurfaceIndex {
    #[new]
    fn new(places: &SurfacePlaces, cell: f32) -> PyResult<Self> {
        if cell.is_nan() || cell <= 0.0 {
            return Err(invalid_input("cell must be a number above 0"));
        }
        Ok(Self { index: surfsig::SurfaceIndex::new(places.places.clone(), cell) })
    }

    /// For each pose the numbers (poses, places) of the nearest places that face alike, -1 where none is near.
    fn partners<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        places: &SurfacePlaces,
        reach: f32,
    ) -> PyResult<Bound<'py, PyArray2<i64>>> {
        let poses = poses_of(&poses)?;
        let found = |pose| self.index.partners(pose, &places.places, reach);
        let number = |found: Option<usize>| found.map_or(-1, |number| number as i64);
        let numbers: Vec<i64> = py.detach(|| poses.iter().flat_map(found).map(number).collect());
        numbers.into_pyarray(py).reshape([poses.len(), places.places.len()])
    }

    /// Poses (n, 4, 4) of places, fitted to the surface by point to plane, a step for each of `reaches` (k,).
    #[pyo3(signature = (poses, places, reaches, threads=None))]
    fn settle<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        places: &SurfacePlaces,
        reaches: PyReadonlyArray1<'py, f32>,
        threads: Option<usize>,
    ) -> PyResult<Bound<'py, PyArray3<f64>>> {
        let (poses, reaches) = (poses_of(&poses)?, reaches.as_slice()?);
        let work = || self.index.settle_all(&poses, &places.places, reaches);
        let settled = py.detach(|| surfsig::with_threads(threads, work)).map_err(to_python)?;
        let numbers: Vec<f64> = settled.iter().flat_map(RigidTransform::to_matrix).flatten().collect();
        numbers.into_pyarray(py).reshape([poses.len(), 4, 4])
    }
}
