//! Odometry, for Python.

use crate::all_cores::on_all_cores;
use crate::extract::Points;
use crate::registration::free_directions_to_python;
use crate::settings::settings_class;
use crate::to_python;
use numpy::{IntoPyArray, PyArray1, PyArray2, PyArrayMethods, PyReadonlyArray1};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::Scan;

settings_class! {
    /// How a sensor is followed, for experts; see `surfsig.estimate_odometry`.
    OdometrySettings of surfsig::OdometrySettings {
        /// Voxels that the first scan fills, where no voxel is given.
        voxels_of_scan: f64 = scale.voxels_of_scan,
        /// Radius of the patches that keypoints are described by, in median ranges.
        patch_radius: f64 = scale.patch_radius,
        /// Points of a scan without which it is not aligned.
        min_points: usize = scale.min_points,
        /// Edge, in voxels, of the coarser voxels of which generalised ICP takes a scan's points.
        coarse_voxel: f64 = alignment.coarse_voxel,
        /// Steps point to plane that follow it.
        plane_steps: usize = alignment.plane_steps,
        /// Largest distance between corresponding points in the last steps, in voxels.
        max_point_distance: f64 = alignment.max_point_distance,
        /// Largest point-to-plane residual of an inlier, in voxels.
        max_residual: f64 = alignment.max_residual,
        /// Share of what the map's normals say about a weak motion that both halves of their neighbourhoods say alike,
        /// from which on the surface holds it.
        held_share: f64 = alignment.held_share,
        /// Range of the map over the distance within which 99 in 100 points of a scan are.
        map_range_factor: f64 = map.range_factor,
        /// Translation, in voxels, from which on the next scan goes into the map.
        map_min_translation: f64 = map.min_translation,
        /// Rotation, in radians, likewise.
        map_min_rotation: f64 = map.min_rotation,
        /// Largest distance of corresponding points, in root mean squares of the errors of predictions.
        prediction_max_deviation: f64 = prediction.max_deviation,
        /// Scans that the expected overlap is taken from.
        expectation_scans: usize = expectation.scans,
        /// Share of the expected overlap below which a pose is doubted.
        doubted_overlap: f64 = expectation.doubted_overlap,
        /// Overlap of a pose that is believed, at least.
        min_overlap: f64 = expectation.min_overlap,
        /// Keyframes that are searched, at most, the latest first.
        max_keyframes: usize = relocalisation.max_keyframes,
        /// Matches that agree with a pose that is tried, at least.
        min_matches: usize = relocalisation.min_matches,
        /// Scans that must follow each other where the sensor is found again.
        scans_on_trial: usize = relocalisation.scans_on_trial,
    }
}

/// Points (n, 3) where they would have been measured at one time, as offsets from the origin, by the sensor's twist (6,)
/// and their times (n,); see `surfsig.deskew`.
#[pyfunction]
#[pyo3(signature = (points, times, twist, *, origin))]
pub fn deskewed_points<'py>(
    py: Python<'py>,
    points: Points<'py>,
    times: PyReadonlyArray1<'py, f64>,
    twist: [f64; 6],
    origin: [f64; 3],
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let (cloud, times) = (points.cloud(origin)?, times.as_slice()?);
    let found = on_all_cores(py, || surfsig::deskew(&cloud, times, twist))?.map_err(to_python)?;
    let count = found.len();
    found.into_flattened().into_pyarray(py).reshape([count, 3])
}

/// When a lidar that spins about z measured points (n, 3), by its rotations a second; see `surfsig.odometry.point_times`.
#[pyfunction]
#[pyo3(signature = (points, *, origin, sensor, spin_rate))]
pub fn spin_times<'py>(
    py: Python<'py>,
    points: Points<'py>,
    origin: [f64; 3],
    sensor: [f64; 3],
    spin_rate: f64,
) -> PyResult<Bound<'py, PyArray1<f64>>> {
    let cloud = points.cloud(origin)?;
    Ok(on_all_cores(py, || surfsig::spin_times(&cloud, sensor, spin_rate))?.into_pyarray(py))
}

/// The first and the last of the finite times (n,), or None if fewer than `fewest` are different.
#[pyfunction]
pub fn time_range(
    py: Python<'_>,
    times: PyReadonlyArray1<'_, f64>,
    fewest: usize,
) -> PyResult<Option<[f64; 2]>> {
    let times = times.as_slice()?;
    Ok(py.detach(|| surfsig::time_range(times, fewest)))
}

/// The scan, the earlier one, T_earlier_scan, and the scan's pose by the way around.
type LoopInPython = (usize, usize, [[f64; 4]; 4], [[f64; 4]; 4]);

/// Follows a sensor from scan to scan; see the crate's `Odometry`.
#[pyclass(module = "surfsig._surfsig")]
pub struct Odometry {
    odometry: surfsig::Odometry,
}

#[pymethods]
impl Odometry {
    #[new]
    #[pyo3(signature = (*, voxel=None, max_correspondence_distance=None, map_range=None, settings=None, threads=None))]
    fn new(
        voxel: Option<f64>,
        max_correspondence_distance: Option<f64>,
        map_range: Option<f64>,
        settings: Option<OdometrySettings>,
        threads: Option<usize>,
    ) -> PyResult<Self> {
        let settings = settings.map_or_else(surfsig::OdometrySettings::default, |settings| settings.core);
        let settings =
            surfsig::OdometrySettings { voxel, max_correspondence_distance, map_range, threads, ..settings };
        Ok(Self { odometry: surfsig::Odometry::new(settings).map_err(to_python)? })
    }

    /// Takes the next scan: points (n, 3) of either precision, and their times in intervals between scans, where these
    /// are known. Gives the numbers of the scans whose results are new.
    #[pyo3(signature = (points, *, origin, viewpoint=None, times=None))]
    fn push(
        &mut self,
        py: Python<'_>,
        points: Points<'_>,
        origin: [f64; 3],
        viewpoint: Option<[f64; 3]>,
        times: Option<PyReadonlyArray1<'_, f64>>,
    ) -> PyResult<Vec<usize>> {
        let scan = Scan { viewpoint, ..Scan::new(points.cloud(origin)?) };
        let odometry = &mut self.odometry;
        let times = times.as_ref().map(|times| times.as_slice()).transpose()?;
        let found = py.detach(|| match times {
            Some(times) => odometry.push_timed(&scan, times),
            None => odometry.push(&scan),
        });
        Ok(found.map_err(to_python)?.iter().map(|pose| pose.scan).collect())
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

    /// Loops: the scan, the earlier one, T_earlier_scan, and the scan's pose by the way around.
    fn loops(&self) -> Vec<LoopInPython> {
        let found = self.odometry.loops().iter();
        let told = |one: &surfsig::LoopClosure| {
            (one.scan, one.earlier, one.T_earlier_scan.to_matrix(), one.T_map_scan_before.to_matrix())
        };
        found.map(told).collect()
    }

    /// Arrays with an entry for each scan, or for the last one: poses, covariances, status, segments, overlaps, twists;
    /// and a list of free directions of each.
    #[pyo3(signature = (*, last_only=false))]
    fn arrays<'py>(&self, py: Python<'py>, last_only: bool) -> PyResult<Bound<'py, PyDict>> {
        let found = self.odometry.poses();
        let found = if last_only { &found[found.len().saturating_sub(1)..] } else { found };
        let matrix = |pose: &surfsig::ScanPose| {
            pose.T_map_scan.map_or([[f64::NAN; 4]; 4], |transform| transform.to_matrix())
        };
        let poses: Vec<f64> = found.iter().flat_map(matrix).flatten().collect();
        let covariances: Vec<f64> = found.iter().flat_map(|pose| pose.covariance).flatten().collect();
        let status: Vec<u8> = found.iter().map(|pose| pose.status as u8).collect();
        let segments: Vec<i64> = found
            .iter()
            .map(|pose| if pose.T_map_scan.is_some() { pose.segment as i64 } else { -1 })
            .collect();
        let overlaps: Vec<f64> = found.iter().map(|pose| pose.overlap).collect();
        let arrays = PyDict::new(py);
        arrays.set_item("poses", poses.into_pyarray(py).reshape([found.len(), 4, 4])?)?;
        arrays.set_item("covariances", covariances.into_pyarray(py).reshape([found.len(), 6, 6])?)?;
        arrays.set_item("status", status.into_pyarray(py))?;
        let twists: Vec<f64> = found.iter().flat_map(|pose| pose.twist.unwrap_or([f64::NAN; 6])).collect();
        arrays.set_item("twists", twists.into_pyarray(py).reshape([found.len(), 6])?)?;
        arrays.set_item("segments", segments.into_pyarray(py))?;
        arrays.set_item("overlaps", overlaps.into_pyarray(py))?;
        let free: Vec<_> =
            found.iter().map(|pose| free_directions_to_python(&pose.free_directions)).collect();
        arrays.set_item("free_directions", free)?;
        Ok(arrays)
    }
}
