//! Depth images of pieces, for Python.

use crate::{invalid_input, rows};
use numpy::{IntoPyArray, PyArray1, PyArray2, PyReadonlyArray1, PyReadonlyArray2, PyReadonlyArray3};
use numpy::{PyArrayMethods, PyUntypedArrayMethods};
use pyo3::prelude::*;
use surfsig::{Judgement, RigidTransform, SurfacePlace};

/// Places on a surface with unit normals, (n, 3) each, float32.
#[pyclass(frozen, module = "surfsig")]
pub struct SurfacePlaces {
    places: Vec<SurfacePlace>,
}

#[pymethods]
impl SurfacePlaces {
    #[new]
    fn new(places: PyReadonlyArray2<'_, f32>, normals: PyReadonlyArray2<'_, f32>) -> PyResult<Self> {
        let (places, normals) = (rows::<_, 3>(&places)?, rows::<_, 3>(&normals)?);
        if places.len() != normals.len() {
            return Err(invalid_input("expected one normal for each place"));
        }
        let pair = |(place, normal): (&[f32; 3], &[f32; 3])| SurfacePlace { place: *place, normal: *normal };
        Ok(Self { places: places.iter().zip(normals).map(pair).collect() })
    }
}

/// What a sensor saw around a piece of a scan; see the crate's `DepthImage`.
#[pyclass(frozen, module = "surfsig")]
pub struct DepthImage {
    image: surfsig::DepthImage,
}

#[pymethods]
impl DepthImage {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "keywords of the Python class")]
    #[pyo3(signature = (points, own, *, viewpoint, spacing, reach, floors, second=None))]
    fn new(
        py: Python<'_>,
        points: &SurfacePlaces,
        own: PyReadonlyArray1<'_, bool>,
        viewpoint: [f64; 3],
        spacing: f64,
        reach: f64,
        floors: &SurfacePlaces,
        second: Option<[f64; 3]>,
    ) -> PyResult<Self> {
        let own = own.as_slice()?;
        if own.len() != points.places.len() {
            return Err(invalid_input("expected one flag for each point"));
        }
        let make = || surfsig::DepthImage::new(&points.places, own, viewpoint, spacing, reach, second);
        Ok(Self { image: py.detach(make).standing_on(&floors.places) })
    }

    /// Shares (poses, 4) of the first `most` places: confirmed, contradicted, astray, missing.
    fn judge<'py>(
        &self,
        py: Python<'py>,
        poses: PyReadonlyArray3<'py, f64>,
        places: &SurfacePlaces,
        most: usize,
        tolerance: f32,
    ) -> PyResult<Bound<'py, PyArray2<f32>>> {
        let poses = poses_of(&poses)?;
        let places = &places.places[..most.min(places.places.len())];
        let found = py.detach(|| self.image.judge_all(&poses, places, tolerance));
        let row = |judged: &Judgement| [judged.confirmed, judged.contradicted, judged.astray, judged.missing];
        let shares: Vec<f32> = found.iter().flat_map(row).collect();
        shares.into_pyarray(py).reshape([found.len(), 4])
    }

    /// For the places that a pose moves to the piece or beside it: their numbers, and the scan's points (m, 3) and
    /// normals (m, 3) there.
    #[expect(clippy::type_complexity, reason = "a tuple in Python")]
    fn correspondences<'py>(
        &self,
        py: Python<'py>,
        pose: PyReadonlyArray2<'py, f64>,
        places: &SurfacePlaces,
        most: usize,
        tolerance: f32,
    ) -> PyResult<(Bound<'py, PyArray1<i64>>, Bound<'py, PyArray2<f64>>, Bound<'py, PyArray2<f64>>)> {
        let wrong = || invalid_input("expected a C-contiguous array of shape (4, 4)");
        let (pose, _) = rows::<_, 4>(&pose)?.as_chunks::<4>();
        let pose = transform(pose.first().ok_or_else(wrong)?)?;
        let places = &places.places[..most.min(places.places.len())];
        let found = py.detach(|| self.image.correspondences(&pose, places, tolerance));
        let kept: Vec<(i64, SurfacePlace)> =
            (0..).zip(found).filter_map(|(number, there)| Some((number, there?))).collect();
        let numbers: Vec<i64> = kept.iter().map(|(number, _)| *number).collect();
        let matrix = |part: fn(&SurfacePlace) -> [f32; 3]| {
            let rows: Vec<f64> = kept.iter().flat_map(|(_, there)| part(there)).map(f64::from).collect();
            rows.into_pyarray(py).reshape([kept.len(), 3])
        };
        Ok((numbers.into_pyarray(py), matrix(|there| there.place)?, matrix(|there| there.normal)?))
    }
}

/// The transforms of an (n, 4, 4) array that stands row by row in memory.
fn poses_of(poses: &PyReadonlyArray3<'_, f64>) -> PyResult<Vec<RigidTransform>> {
    if !poses.is_c_contiguous() || poses.shape()[1..] != [4, 4] {
        return Err(invalid_input("expected a C-contiguous array of shape (n, 4, 4)"));
    }
    poses.as_slice()?.as_chunks::<4>().0.as_chunks::<4>().0.iter().map(transform).collect()
}

fn transform(matrix: &[[f64; 4]; 4]) -> PyResult<RigidTransform> {
    RigidTransform::from_matrix(matrix).map_err(|error| invalid_input(&error.to_string()))
}
