//! Poses between pieces of scans, for Python.

use crate::all_cores::on_all_cores;
use crate::registration::{alternatives_to_python, free_directions_to_python};
use crate::settings::settings_class;
use crate::watched::watched;
use crate::{invalid_input, rows, to_python};
use numpy::{PyArray2, PyArrayMethods, PyReadonlyArray1, PyReadonlyArray2, ToPyArray};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use surfsig::{
    ExaminedPose, Monitor, OrientedScan, PieceAlignment, PieceSituation, PosesOfPair, RigidTransform,
};

settings_class! {
    /// How poses between pieces are searched and judged, for experts; see `surfsig.find_recurrences`.
    RecurrenceSettings of surfsig::RecurrenceSettings {
        /// Voxels along a piece's extent, to which it is thinned before its points are paired.
        pair_voxels_per_extent: f64 = pair_voxels_per_extent,
        /// Point spacings along the voxels to which a piece is thinned before poses are judged by it.
        spacings_per_voxel: f64 = spacings_per_voxel,
        /// How far around a piece its depth image reaches, in its extents from its mean.
        image_reach: f64 = image_reach,
        /// Distance between the points of a pair, at least, in the unit of length that counts as a radian.
        min_pair_distance: f64 = min_pair_distance,
        /// Pairs of the target that are most similar to one of the source.
        similar_pairs: usize = similar_pairs,
        /// Of these, how many propose a pose, chosen at random.
        poses_per_pair: usize = poses_per_pair,
        /// Largest distance of the features of similar pairs, in radians, or units of length.
        feature_tolerance: f64 = feature_tolerance,
        /// Proposed poses, at most.
        proposals: usize = proposals,
        /// Points of each piece by which proposals are judged.
        first_points: usize = first_points,
        /// Tolerances within which they are, in those of the later judgements.
        first_tolerance: f64 = first_tolerance,
        /// Proposals that are judged by more points.
        tried: usize = tried,
        /// Points of each piece in the coarse search.
        coarse_points: usize = coarse_points,
        /// Points of each piece in the fine search.
        fine_points: usize = fine_points,
        /// Poses that each round of the coarse search keeps.
        kept: usize = kept,
        /// Random changes of each pose that is kept, in each round.
        mutations: usize = mutations,
        /// Standard deviation of the rotation of the first random changes, in radians.
        rotation_deviation: f64 = rotation_deviation,
        /// Standard deviation of their translation along each axis, in extents of the target.
        translation_deviation: f64 = translation_deviation,
        /// Rounds of the coarse search.
        coarse_rounds: usize = coarse_rounds,
        /// Rounds of the fine search.
        fine_rounds: usize = fine_rounds,
        /// Score of the coarse search below which a pair of pieces is given up.
        min_coarse_score: f64 = min_coarse_score,
        /// Steps of a least squares fit.
        fit_steps: usize = fit_steps,
        /// Share of the largest eigenvalue below which a motion is not observable.
        unobservable_share: f64 = unobservable_share,
        /// What a contradicted and a missing point count in the coarse search, in confirmed ones.
        coarse_weights: [f64; 2] = coarse_weights,
        /// The same in the fine search, and in the score.
        fine_weights: [f64; 2] = fine_weights,
        /// What a match counts whose confirmed points are on one plane.
        planar_weight: f64 = planar_weight,
        /// Spread of the confirmed normals from which on a match counts fully.
        round_spread: f64 = round_spread,
        /// What counts as a radius of a patch when a pose is examined, in extents of the smaller piece.
        radius_share: f64 = radius_share,
        /// Other poses that are brought near, at most.
        rival_starts: usize = rivals.proposals,
        /// Poses that pairs of points propose as rivals, at most.
        rival_proposals: usize = rival_proposals,
        /// Rounds of random changes that bring a rival near.
        rival_rounds: usize = rival_rounds,
        /// Points of each piece by which a pose is examined.
        examined_points: usize = examined_points,
        /// Points of each piece that make its surface, at most.
        surface_points: usize = surface_points,
        /// Points of all pieces of a group that show how the object looks, at most.
        object_points: usize = object_points,
        /// By how much an object's share of points in free space may grow with a symmetry.
        symmetry_excess: f64 = symmetry_excess,
        /// Radii of a patch by which a rival moves points elsewhere, at least.
        rival_distance: f64 = rivals.distance,
        /// What a rival explains less of what is seen with both poses, as a share, at least, to be refuted.
        rival_deficit: f64 = rivals.deficit,
        /// The same in its standard errors.
        rival_deviations: f64 = rivals.deviations,
        /// What a rival explains over what the best pose does, at least.
        least_explained: f64 = least_explained,
        /// By how much a rival's share of points in free space may be larger than the best pose's.
        free_space_excess: f64 = free_space_excess,
        /// Share of points in free space from which on a pose is doubted.
        doubted_free_space: f64 = doubted_free_space,
        /// Share of both pieces' points that lie on the other piece, below which a pose is doubted.
        trusted_overlap: f64 = trusted_overlap,
        /// Share of points in sight that disagree, from which on the mirror image is tried.
        doubted_disagreement: f64 = doubted_disagreement,
        /// What disagrees then, over what disagrees without, below which the mirror image is better.
        mirrored_disagreement: f64 = mirrored_disagreement,
        /// Logarithm of a scale from which on it is doubted.
        doubted_scale: f64 = doubted_scale,
        /// The same in its standard errors.
        scale_deviations: f64 = scale_deviations,
        /// Seed of the random choices.
        seed: u64 = seed,
    }
}

impl RecurrenceSettings {
    /// Those of the core, with threads.
    fn with_threads(settings: Option<Self>, threads: Option<usize>) -> surfsig::RecurrenceSettings {
        let core = settings.map_or_else(surfsig::RecurrenceSettings::default, |settings| settings.core);
        surfsig::RecurrenceSettings { threads, ..core }
    }
}

/// A piece of a scan, seen from one side; see the crate's `PieceView`.
#[pyclass(frozen, module = "surfsig")]
pub struct PieceView {
    view: surfsig::PieceView,
}

#[pymethods]
impl PieceView {
    #[new]
    #[expect(clippy::too_many_arguments, reason = "keywords of the Python class")]
    #[pyo3(signature = (
        points, normals, piece, *, viewpoint, second_viewpoint=None, support_planes, spacing, tolerance, pair_unit,
        settings=None
    ))]
    fn new(
        py: Python<'_>,
        points: PyReadonlyArray2<'_, f64>,
        normals: PyReadonlyArray2<'_, f64>,
        piece: PyReadonlyArray1<'_, i64>,
        viewpoint: [f64; 3],
        second_viewpoint: Option<[f64; 3]>,
        support_planes: Vec<[[f64; 3]; 2]>,
        spacing: f64,
        tolerance: f64,
        pair_unit: f64,
        settings: Option<RecurrenceSettings>,
    ) -> PyResult<Self> {
        let (points, normals) = (rows::<f64, 3>(&points)?, rows::<f64, 3>(&normals)?);
        let number = |&number: &i64| {
            usize::try_from(number)
                .map_err(|_| invalid_input(&format!("a point cannot have the number {number}")))
        };
        let piece = piece.as_slice()?.iter().map(number).collect::<PyResult<Vec<usize>>>()?;
        let scan = OrientedScan { points, normals, spacing, tolerance };
        let situation = PieceSituation { viewpoint, second_viewpoint, support_planes };
        let settings = RecurrenceSettings::with_threads(settings, None);
        let make = || surfsig::PieceView::new(&scan, &piece, &situation, pair_unit, &settings);
        Ok(Self { view: on_all_cores(py, make)?.map_err(to_python)? })
    }

    /// The mean of the piece's points, in the scan: the origin of poses.
    #[getter]
    fn center(&self) -> [f64; 3] {
        self.view.center()
    }
}

/// A pose T_target_source, (4, 4), and its score.
type Alignment<'py> = (Bound<'py, PyArray2<f64>>, f64);

fn alignment_to_python(py: Python<'_>, found: PieceAlignment) -> PyResult<Alignment<'_>> {
    let matrix = found.T_target_source.to_matrix();
    Ok((matrix.as_flattened().to_pyarray(py).reshape([4, 4])?, found.score))
}

fn core_views(views: &[Py<PieceView>]) -> Vec<&surfsig::PieceView> {
    views.iter().map(|view| &view.get().view).collect()
}

/// Align pairs of pieces (source, target); of each its pose T_target_source and its score, or None.
#[pyfunction]
#[pyo3(signature = (views, pairs, *, settings=None, threads=None, progress=None))]
pub fn align_pieces<'py>(
    py: Python<'py>,
    views: Vec<Py<PieceView>>,
    pairs: Vec<[usize; 2]>,
    settings: Option<RecurrenceSettings>,
    threads: Option<usize>,
    progress: Option<Py<PyAny>>,
) -> PyResult<Vec<Option<Alignment<'py>>>> {
    let views = core_views(&views);
    let settings = RecurrenceSettings::with_threads(settings, threads);
    let work = |monitor: &Monitor| surfsig::align_pieces(&views, &pairs, &settings, monitor);
    let found = watched(py, Some(pairs.len()), progress.as_ref(), work)?;
    found.into_iter().map(|found| found.map(|found| alignment_to_python(py, found)).transpose()).collect()
}

/// Search around good poses (k, 4, 4) of pairs of pieces; of each pair the best pose and its score, or None.
#[pyfunction]
#[pyo3(signature = (views, poses, *, settings=None, threads=None))]
pub fn refine_poses<'py>(
    py: Python<'py>,
    views: Vec<Py<PieceView>>,
    poses: Vec<([usize; 2], Vec<PyReadonlyArray2<'py, f64>>)>,
    settings: Option<RecurrenceSettings>,
    threads: Option<usize>,
) -> PyResult<Vec<Option<Alignment<'py>>>> {
    let views = core_views(&views);
    let of_pair = |(pair, poses): &([usize; 2], Vec<_>)| {
        Ok(PosesOfPair { pair: *pair, poses: poses.iter().map(transform).collect::<PyResult<_>>()? })
    };
    let poses = poses.iter().map(of_pair).collect::<PyResult<Vec<PosesOfPair>>>()?;
    let settings = RecurrenceSettings::with_threads(settings, threads);
    let work = |monitor: &Monitor| surfsig::refine_poses(&views, &poses, &settings, monitor);
    let found = watched(py, None, None, work)?;
    found.into_iter().map(|found| found.map(|found| alignment_to_python(py, found)).transpose()).collect()
}

/// Judge poses of pairs of pieces without a search; of each its score.
#[pyfunction]
#[pyo3(signature = (views, poses, *, settings=None, threads=None))]
pub fn judge_poses(
    py: Python<'_>,
    views: Vec<Py<PieceView>>,
    poses: Vec<([usize; 2], PyReadonlyArray2<'_, f64>)>,
    settings: Option<RecurrenceSettings>,
    threads: Option<usize>,
) -> PyResult<Vec<f64>> {
    let views = core_views(&views);
    let of_pair = |(pair, pose): &([usize; 2], _)| Ok((*pair, transform(pose)?));
    let poses = poses.iter().map(of_pair).collect::<PyResult<Vec<_>>>()?;
    let settings = RecurrenceSettings::with_threads(settings, threads);
    let work = |monitor: &Monitor| surfsig::judge_poses(&views, &poses, &settings, monitor);
    Ok(watched(py, None, None, work)?.into_iter().map(|found| found.score).collect())
}

/// Try to refute poses of pairs of pieces that follow each other; of each target its pose on the piece that its chain
/// begins with, by the names of the crate's `ExaminedPose` and `PoseEvidence`.
#[pyfunction]
#[pyo3(signature = (views, poses, *, settings=None, threads=None))]
pub fn examine_poses<'py>(
    py: Python<'py>,
    views: Vec<Py<PieceView>>,
    poses: Vec<([usize; 2], PyReadonlyArray2<'py, f64>)>,
    settings: Option<RecurrenceSettings>,
    threads: Option<usize>,
) -> PyResult<Vec<Bound<'py, PyDict>>> {
    let views = core_views(&views);
    let of_pair = |(pair, pose): &([usize; 2], _)| Ok((*pair, transform(pose)?));
    let poses = poses.iter().map(of_pair).collect::<PyResult<Vec<_>>>()?;
    let settings = RecurrenceSettings::with_threads(settings, threads);
    let work = |monitor: &Monitor| surfsig::examine_poses(&views, &poses, &settings, monitor);
    watched(py, None, None, work)?.iter().map(|found| examined_to_python(py, found)).collect()
}

fn examined_to_python<'py>(py: Python<'py>, found: &ExaminedPose) -> PyResult<Bound<'py, PyDict>> {
    let result = PyDict::new(py);
    let matrix = found.T_target_source.to_matrix();
    result.set_item("T_target_source", matrix.as_flattened().to_pyarray(py).reshape([4, 4])?)?;
    result.set_item("free_directions", free_directions_to_python(&found.free_directions))?;
    result.set_item("alternatives", alternatives_to_python(&found.alternatives))?;
    result.set_item("overlap", found.evidence.overlap)?;
    result.set_item("explained", found.evidence.explained)?;
    result.set_item("free_space", found.evidence.free_space)?;
    result.set_item("scale", found.evidence.scale)?;
    result.set_item("scale_standard_error", found.evidence.scale_standard_error)?;
    let reasons: Vec<String> = found.doubts.iter().map(ToString::to_string).collect();
    result.set_item("reasons", reasons)?;
    let doubts: Vec<&str> = found.doubts.iter().map(surfsig::Doubt::name).collect();
    result.set_item("doubts", doubts)?;
    Ok(result)
}

fn transform(pose: &PyReadonlyArray2<'_, f64>) -> PyResult<RigidTransform> {
    let wrong = || invalid_input("expected a C-contiguous array of shape (4, 4)");
    let (matrices, _) = rows::<f64, 4>(pose)?.as_chunks::<4>();
    let matrix = matrices.first().ok_or_else(wrong)?;
    RigidTransform::from_matrix(matrix).map_err(|error| invalid_input(&error.to_string()))
}
