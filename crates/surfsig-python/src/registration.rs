//! Registration of scans, for Python.

use crate::extract::Points;
use crate::settings::settings_class;
use crate::watched::watched;
use crate::{invalid_input, rows};
use numpy::{IntoPyArray, PyArrayMethods, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{Alternative, FreeDirection, Monitor, REGISTRATION_STEPS, RigidTransform, Scan};

/// Points (n, 3), their origin, where the sensor stood, and in place of that vectors (n, 3) to its side.
#[derive(FromPyObject)]
pub struct ScanArgument<'py>(Points<'py>, [f64; 3], Option<[f64; 3]>, Option<PyReadonlyArray2<'py, f32>>);

impl ScanArgument<'_> {
    pub fn scan(&self) -> PyResult<Scan<'_>> {
        let cloud = self.0.cloud(self.1)?;
        let directions = self.3.as_ref().map(rows::<f32, 3>).transpose()?;
        if directions.is_some_and(|directions| directions.len() != cloud.len()) {
            return Err(invalid_input("there must be one direction for each point"));
        }
        Ok(Scan { cloud, viewpoint: self.2, directions })
    }
}

settings_class! {
    /// How scans are registered, for experts; see `surfsig.register`.
    RegistrationSettings of surfsig::RegistrationSettings {
        /// Radius of the patches over the median distance of a scan's points from their middle.
        radius_share: f64 = radius_share,
        /// Keypoints of each scan.
        keypoints: usize = keypoints,
        /// Candidates for keypoints along a patch's radius.
        candidates_per_radius: f64 = candidates_per_radius,
        /// Voxels along a patch's radius, to which scans are thinned before their patches are described.
        description_voxels_per_radius: f64 = description_voxels_per_radius,
        /// Voxels along a patch's radius, to which scans are thinned before they are refined.
        voxels_per_radius: f64 = voxels_per_radius,
        /// The same where normals are oriented by their neighbours, because no viewpoint is known.
        orientation_voxels_per_radius: f64 = orientation_voxels_per_radius,
        /// Radii of a patch between a moved place and its correspondence within which a match agrees.
        consensus_max_distance: f64 = consensus.max_distance,
        /// Smallest cosine between their axes, likewise.
        consensus_min_cosine: f64 = consensus.min_cosine,
        /// Matches whose transforms are tried, the most similar first.
        consensus_proposals: usize = consensus.proposals,
        /// Largest distances between correspondences in the two rounds of generalised ICP, in voxels.
        gicp_distances: [f64; 2] = gicp_distances,
        /// Steps of each round, at most.
        gicp_iterations: usize = gicp_iterations,
        /// Voxels from the target's nearest point beyond which there is no surface to measure from.
        surface_max_distance: f64 = point_to_surface.max_distance,
        /// Standard deviations within which a residual is an inlier.
        surface_max_deviations: f64 = point_to_surface.max_deviations,
        /// Steps of the last fit, at most.
        surface_max_iterations: usize = point_to_surface.max_iterations,
        /// Points of the source in the last fit, at most.
        max_points: usize = max_points,
        /// Proposed transforms that are tried beside the best one, at most.
        rival_proposals: usize = rivals.proposals,
        /// The score of a proposal over the best one's, at least.
        rival_least_score: f64 = rivals.least_score,
        /// Radii of a patch by which a rival moves points elsewhere, at least.
        rival_distance: f64 = rivals.distance,
        /// Distances from the surface over the points' paths, below which a motion is weakly held.
        rival_weak: f64 = rivals.weak,
        /// Share of what the target's normals say of a weak motion that both scans' say alike, to hold it.
        rival_held_share: f64 = rivals.held_share,
        /// What both say alike, in standard errors, likewise.
        rival_held_deviations: f64 = rivals.held_deviations,
        /// What a rival explains less, as a share, at least, to be refuted.
        rival_deficit: f64 = rivals.deficit,
        /// The same in its standard errors.
        rival_deviations: f64 = rivals.deviations,
        /// Radians of a pixel of the range images that tell free space.
        free_space_pixel: f64 = free_space.pixel,
        /// Voxels before what was measured within which a point is on it.
        free_space_margin: f64 = free_space.margin,
        /// The same as a share of the range.
        free_space_relative_margin: f64 = free_space.relative_margin,
        /// Share of points in free space from which on a transform is doubted.
        doubted_free_space: f64 = free_space.doubted_share,
        /// By how much the shares of two transforms must differ for the smaller one to win.
        free_space_excess: f64 = free_space.excess,
        /// Share of points in free space up to which few matches are enough.
        certain_free_space: f64 = free_space.certain_share,
        /// Matches that agree, from which on a transform is trusted that leaves nothing in free space.
        certain_inliers: usize = certain_inliers,
        /// Share that such a transform explains, at least.
        certain_explained: f64 = certain_explained,
        /// Matches that agree, per match and overlap, below which the source's mirror image is tried.
        doubted_agreement: f64 = doubted_agreement,
        /// How many times as many matches of the mirror image must agree.
        mirrored_inliers: f64 = mirrored_inliers,
        /// Logarithm of a scale from which on it is doubted.
        doubted_scale: f64 = doubted_scale,
        /// The same in its standard errors.
        scale_deviations: f64 = scale_deviations,
        /// Matches that agree, from which on a transform is trusted.
        trusted_inliers: usize = trusted_inliers,
        /// Overlap from which on it is.
        trusted_overlap: f64 = trusted_overlap,
        /// Overlap from which on a transform is trusted that the caller gave roughly.
        trusted_overlap_of_start: f64 = trusted_overlap_of_start,
    }
}

/// Register two scans; see `surfsig.register`. By the names of its result, of which a transform is None where there
/// is none.
#[pyfunction]
#[pyo3(signature = (source, target, *, start=None, radius=None, keypoints=None, settings=None, threads=None, progress=None))]
#[expect(clippy::too_many_arguments, reason = "keywords of the Python function")]
pub fn register<'py>(
    py: Python<'py>,
    source: ScanArgument<'py>,
    target: ScanArgument<'py>,
    start: Option<[[f64; 4]; 4]>,
    radius: Option<f64>,
    keypoints: Option<usize>,
    settings: Option<RegistrationSettings>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Bound<'py, PyDict>> {
    let (source, target) = (source.scan()?, target.scan()?);
    let start = start.map(|matrix| RigidTransform::from_matrix(&matrix)).transpose();
    let start = start.map_err(|error| invalid_input(&error.to_string()))?;
    let mut settings = settings.map_or_else(surfsig::RegistrationSettings::default, |settings| settings.core);
    settings.radius = radius;
    settings.threads = threads;
    if let Some(count) = keypoints {
        settings.keypoints = count;
    }
    let work = |monitor: &Monitor| surfsig::register(&source, &target, start.as_ref(), &settings, monitor);
    let found = watched(py, Some(REGISTRATION_STEPS), progress.as_ref(), work)?;
    let result = PyDict::new(py);
    let matrix = found.T_target_source.map(|transform| transform.to_matrix().to_vec());
    result.set_item("T_target_source", matrix)?;
    result.set_item("covariance", found.covariance.as_flattened().to_pyarray(py).reshape([6, 6])?)?;
    result.set_item("center", found.center.to_pyarray(py))?;
    result.set_item("information", found.information.as_flattened().to_pyarray(py).reshape([6, 6])?)?;
    result.set_item("free_directions", free_directions_to_python(&found.free_directions))?;
    result.set_item("matches", found.matches)?;
    result.set_item("inliers", found.inliers)?;
    result.set_item("overlap", found.overlap)?;
    result.set_item("rms", found.rms)?;
    result.set_item("radius", found.radius)?;
    result.set_item("trusted", found.trusted)?;
    let reasons: Vec<String> = found.doubts.iter().map(ToString::to_string).collect();
    result.set_item("reasons", reasons)?;
    let doubts: Vec<&str> = found.doubts.iter().map(surfsig::Doubt::name).collect();
    result.set_item("doubts", doubts)?;
    result.set_item("alternatives", alternatives_to_python(&found.alternatives))?;
    result.set_item("explained", found.explained)?;
    result.set_item("free_space", found.free_space)?;
    result.set_item("scale", found.scale)?;
    result.set_item("scale_standard_error", found.scale_standard_error)?;
    Ok(result)
}

/// The share of points in the other sensor's free space after a transform; NaN where it is not known.
#[pyfunction]
#[pyo3(signature = (source, target, T_target_source, *, radius=None, settings=None, threads=None))]
#[allow(non_snake_case)]
pub fn free_space_share(
    py: Python<'_>,
    source: ScanArgument<'_>,
    target: ScanArgument<'_>,
    T_target_source: [[f64; 4]; 4],
    radius: Option<f64>,
    settings: Option<RegistrationSettings>,
    threads: Option<usize>,
) -> PyResult<f64> {
    let (source, target) = (source.scan()?, target.scan()?);
    let transform =
        RigidTransform::from_matrix(&T_target_source).map_err(|error| invalid_input(&error.to_string()))?;
    let settings = settings.map_or_else(surfsig::RegistrationSettings::default, |settings| settings.core);
    let settings = surfsig::RegistrationSettings { radius, threads, ..settings };
    watched(py, None, None, |_| surfsig::free_space_share(&source, &target, &transform, &settings))
}

/// Motions that points with unit normals slide along; see `surfsig.FreeDirection`. Of each its kind, axis and point.
#[pyfunction]
pub fn free_directions(
    points: PyReadonlyArray2<'_, f64>,
    normals: PyReadonlyArray2<'_, f64>,
) -> PyResult<Vec<FreeDirectionTuple>> {
    let (points, normals) = (rows::<f64, 3>(&points)?, rows::<f64, 3>(&normals)?);
    Ok(free_directions_to_python(&surfsig::free_directions(points, normals)))
}

/// Kind, axis and point, of which either may be missing.
type FreeDirectionTuple = (&'static str, Option<[f64; 3]>, Option<[f64; 3]>);

/// The arguments of `surfsig.FreeDirection`.
pub fn free_directions_to_python(directions: &[FreeDirection]) -> Vec<FreeDirectionTuple> {
    let tuple = |direction: &FreeDirection| match *direction {
        FreeDirection::Translation { axis } => ("translation", Some(axis), None),
        FreeDirection::Rotation { axis, point } => ("rotation", Some(axis), Some(point)),
        FreeDirection::RotationAboutPoint { point } => ("rotation", None, Some(point)),
    };
    directions.iter().map(tuple).collect()
}

/// A transform T_target_source, what it explains, and its share of points in free space.
type AlternativeTuple = ([[f64; 4]; 4], f64, f64);

/// The arguments of `surfsig.Alternative`.
pub fn alternatives_to_python(alternatives: &[Alternative]) -> Vec<AlternativeTuple> {
    let tuple = |one: &Alternative| (one.T_target_source.to_matrix(), one.explained, one.free_space);
    alternatives.iter().map(tuple).collect()
}

/// Directions (n, 3) of points (n, 3) that are all on one side of each piece of surface, which side is open.
#[pyfunction]
#[pyo3(signature = (points, *, voxel, threads=None))]
pub fn consistent_directions<'py>(
    py: Python<'py>,
    points: PyReadonlyArray2<'py, f64>,
    voxel: f64,
    threads: Option<usize>,
) -> PyResult<Bound<'py, PyAny>> {
    let points = rows::<f64, 3>(&points)?;
    let work = |monitor: &Monitor| surfsig::consistent_directions(points, voxel, threads, monitor);
    let found = watched(py, None, None, work)?;
    Ok(found.into_flattened().into_pyarray(py).reshape([points.len(), 3])?.into_any())
}
