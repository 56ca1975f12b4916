//! Odometry, for Python.

use crate::extract::Points;
use crate::to_python;
use numpy::{IntoPyArray, PyArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{OdometrySettings, Scan};

/// Follows a sensor from scan to scan; see the crate's `Odometry`.
#[pyclass(module = "surfsig._surfsig")]
pub struct Odometry {
    odometry: surfsig::Odometry,
}

#[pymethods]
impl Odometry {
    #[new]
    #[pyo3(signature = (*, voxel=None, max_correspondence_distance=None, map_range=None, threads=None))]
    fn new(
        voxel: Option<f64>,
        max_correspondence_distance: Option<f64>,
        map_range: Option<f64>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let settings =
            OdometrySettings { voxel, max_correspondence_distance, map_range, threads, ..Default::default() };
        Ok(Self { odometry: surfsig::Odometry::new(settings).map_err(to_python)? })
    }

    /// Takes the next scan: points (n, 3) of either precision.
    #[pyo3(signature = (points, *, origin, viewpoint=None))]
    fn push(
        &mut self,
        py: Python<'_>,
        points: Points<'_>,
        origin: [f64; 3],
        viewpoint: Option<[f64; 3]>,
    ) -> PyResult<()> {
        let scan = Scan { viewpoint, ..Scan::new(points.cloud(origin)?) };
        let odometry = &mut self.odometry;
        py.detach(|| odometry.push(&scan)).map_err(to_python)?;
        Ok(())
    }

    /// Number of scans so far.
    fn __len__(&self) -> usize {
        self.odometry.poses().len()
    }

    /// Edge of the voxels; None before a scan has points.
    #[getter]
    fn voxel(&self) -> Option<f64> {
        self.odometry.voxel()
    }

    /// Arrays with an entry for each scan: poses, covariances, status, overlaps.
    fn arrays<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyDict>> {
        let found = self.odometry.poses();
        let matrix = |pose: &surfsig::ScanPose| {
            pose.T_map_scan.map_or([[f64::NAN; 4]; 4], |transform| transform.to_matrix())
        };
        let poses: Vec<f64> = found.iter().flat_map(matrix).flatten().collect();
        let covariances: Vec<f64> = found.iter().flat_map(|pose| pose.covariance).flatten().collect();
        let status: Vec<u8> = found.iter().map(|pose| pose.status as u8).collect();
        let overlaps: Vec<f64> = found.iter().map(|pose| pose.overlap).collect();
        let arrays = PyDict::new(py);
        arrays.set_item("poses", poses.into_pyarray(py).reshape([found.len(), 4, 4])?)?;
        arrays.set_item("covariances", covariances.into_pyarray(py).reshape([found.len(), 6, 6])?)?;
        arrays.set_item("status", status.into_pyarray(py))?;
        arrays.set_item("overlaps", overlaps.into_pyarray(py))?;
        Ok(arrays)
    }
}
