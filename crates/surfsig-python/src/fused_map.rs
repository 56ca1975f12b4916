//! Many scans as one map, for Python.

use crate::extract::Points;
use crate::{invalid_input, to_python};
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::RigidTransform;

/// Scans in one frame, a point for each voxel; see the crate's `FusedMap`.
#[pyclass(module = "surfsig._surfsig")]
pub struct FusedMap {
    map: surfsig::FusedMap,
}

#[pymethods]
impl FusedMap {
    #[new]
    fn new(voxel: f64) -> PyResult<Self> {
        Ok(Self { map: surfsig::FusedMap::new(voxel).map_err(to_python)? })
    }

    /// Adds a scan's finite points (n, 3), seen from a viewpoint in its own coordinates.
    #[pyo3(signature = (points, *, origin, T_map_scan, viewpoint))]
    #[allow(non_snake_case, reason = "the name says from where to where")]
    fn add(
        &mut self,
        py: Python<'_>,
        points: Points<'_>,
        origin: [f64; 3],
        T_map_scan: [[f64; 4]; 4],
        viewpoint: [f64; 3],
    ) -> PyResult<()> {
        let cloud = points.cloud(origin)?;
        let T_map_scan =
            RigidTransform::from_matrix(&T_map_scan).map_err(|error| invalid_input(&error.to_string()))?;
        let map = &mut self.map;
        py.detach(|| map.add(&cloud, &T_map_scan, viewpoint)).map_err(to_python)
    }

    /// Arrays with an entry for each voxel: points (m, 3), scans (m,), directions_to_sensor (m, 3).
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let (points, scans, directions) =
            py.detach(|| (self.map.points(), self.map.scans(), self.map.directions_to_sensor()));
        let arrays = PyDict::new(py);
        let count = points.len();
        arrays.set_item("points", points.into_flattened().into_pyarray(py).reshape([count, 3])?)?;
        arrays.set_item("scans", scans.into_pyarray(py))?;
        let directions = directions.into_flattened().into_pyarray(py).reshape([count, 3])?;
        arrays.set_item("directions_to_sensor", directions)?;
        Ok(arrays)
    }
}
