//! Whether pieces of scans show the same object, and where: poses of one piece on another, [`align_pieces`].
//!
//! A piece becomes a [`PieceView`] ([`piece_view`]): points, their pairs, and a depth image. Pairs of oriented points
//! propose poses ([`point_pairs`]); those with which what the sensor saw of both pieces agrees ([`agreement`]) are
//! changed at random, judged by more points ([`pose_search`]) and fitted by least squares ([`refinement`]). Poses that are
//! kept are then tried to be refuted ([`examination`], [`rival_search`]), one after the other from piece to piece
//! ([`chain`]), and all pieces of a group tell whether their object looks the same after a motion ([`object_symmetry`]).

mod agreement;
mod chain;
mod examination;
mod object_symmetry;
mod piece_view;
mod point_pairs;
mod pose_search;
mod refinement;
mod result;
mod rival_search;
mod settings;

pub use piece_view::{OrientedScan, PieceSituation, PieceView};
pub use result::{ExaminedPose, PieceAlignment, PoseEvidence};
pub use settings::RecurrenceSettings;

use crate::geometry::RigidTransform;
use crate::{Error, Monitor, with_threads};
use agreement::PiecePair;
use rayon::prelude::*;

/// Aligns pairs of pieces, given by the numbers of the source and of the target; `None` where no pose is any good.
///
/// The choices at random depend on the seed and on the numbers of both pieces, so the result is the same whatever else
/// is aligned, and whatever the number of threads. [`Monitor::done`] counts pairs.
///
/// # Errors
/// [`Error::PieceOutOfRange`], [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{align_pieces, Monitor, OrientedScan, PieceSituation, PieceView, RecurrenceSettings};
/// use surfsig::RigidTransform;
///
/// // A bent sheet, seen from above, and the same one elsewhere.
/// let sheet = |i: u32| (f64::from(i % 40) - 19.5, f64::from(i / 40) - 14.5);
/// let height = |x: f64, y: f64| 0.02 * x * x + 0.01 * x * y - 2e-3 * y * y * y;
/// let points: Vec<[f64; 3]> =
///     (0..1200).map(sheet).map(|(x, y)| [x, y, height(x, y)]).collect();
/// let normal = |(x, y): (f64, f64)| {
///     let (dx, dy) = (0.04 * x + 0.01 * y, 0.01 * x - 6e-3 * y * y);
///     [-dx, -dy, 1.0].map(|component| component / (1.0 + dx * dx + dy * dy).sqrt())
/// };
/// let normals: Vec<[f64; 3]> = (0..1200).map(sheet).map(normal).collect();
/// let motion = RigidTransform::from_rotation_vector([0.2, -0.1, 2.0], [100.0, 50.0, 20.0]);
/// let settings = RecurrenceSettings::default();
/// let numbers: Vec<usize> = (0..1200).collect();
/// let view = |motion: RigidTransform| {
///     let moved = motion.transform_points(&points);
///     let rotated: Vec<_> = normals.iter().map(|&n| motion.transform_vector(n)).collect();
///     let scan = OrientedScan { points: &moved, normals: &rotated, spacing: 1.0, tolerance: 0.4 };
///     let viewpoint = motion.transform_point([0.0, 0.0, 1e3]);
///     let seen = PieceSituation { viewpoint, ..Default::default() };
///     PieceView::new(&scan, &numbers, &seen, 2.0, &settings)
/// };
/// let views = [view(RigidTransform::identity())?, view(motion)?];
/// let found = align_pieces(&[&views[0], &views[1]], &[[0, 1]], &settings, &Monitor::default())?;
/// let alignment = found[0].expect("the same sheet");
/// assert!(alignment.score > 0.8);
/// // Poses are about the centres of both pieces, so that here nothing is translated.
/// let rotation = RigidTransform::from_rotation_vector([0.2, -0.1, 2.0], [0.0; 3]);
/// let off = (rotation.inverse() * alignment.T_target_source).log();
/// assert!(off[..3].iter().all(|radians| radians.abs() < 0.03));
/// assert!(off[3..].iter().all(|distance| distance.abs() < 1.0));
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn align_pieces(
    views: &[&PieceView],
    pairs: &[[usize; 2]],
    settings: &RecurrenceSettings,
    monitor: &Monitor,
) -> Result<Vec<Option<PieceAlignment>>, Error> {
    of_pairs(
        views,
        pairs,
        |pair| *pair,
        settings,
        monitor,
        |pair, &[source, target]| pose_search::align(pair, &[settings.seed, source as u64, target as u64]),
    )
}

/// Poses of one piece on another that are good, as they come from other alignments.
#[allow(non_snake_case)]
#[derive(Debug, Clone, PartialEq)]
pub struct PosesOfPair {
    /// The numbers of the source and of the target.
    pub pair: [usize; 2],
    /// T_target_source, as in [`PieceAlignment`].
    pub poses: Vec<RigidTransform>,
}

/// Searches around good poses of pairs of pieces for the best one of each pair; `None` where no pose is given.
///
/// Seeds, threads and the monitor are as in [`align_pieces`].
///
/// # Errors
/// [`Error::PieceOutOfRange`], [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{refine_poses, Monitor, RecurrenceSettings, PosesOfPair};
/// let nothing = refine_poses(&[], &[], &RecurrenceSettings::default(), &Monitor::default())?;
/// assert!(nothing.is_empty());
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn refine_poses(
    views: &[&PieceView],
    poses: &[PosesOfPair],
    settings: &RecurrenceSettings,
    monitor: &Monitor,
) -> Result<Vec<Option<PieceAlignment>>, Error> {
    of_pairs(
        views,
        poses,
        |of| of.pair,
        settings,
        monitor,
        |pair, of| {
            // Unlike the key of `align`, so that a refinement does not repeat its choices.
            let key = [settings.seed, of.pair[0] as u64, of.pair[1] as u64, 1];
            pose_search::refined(pair, &of.poses, &key)
        },
    )
}

/// Judges poses of pairs of pieces by all of their points, without a search; in their order.
///
/// # Errors
/// [`Error::PieceOutOfRange`], [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{judge_poses, Monitor, RecurrenceSettings, RigidTransform};
/// let poses = [([0, 1], RigidTransform::identity())];
/// assert!(judge_poses(&[], &poses, &RecurrenceSettings::default(), &Monitor::default()).is_err());
/// ```
pub fn judge_poses(
    views: &[&PieceView],
    poses: &[([usize; 2], RigidTransform)],
    settings: &RecurrenceSettings,
    monitor: &Monitor,
) -> Result<Vec<PieceAlignment>, Error> {
    of_pairs(views, poses, |of| of.0, settings, monitor, |pair, of| pose_search::measured(pair, &of.1))
}

/// Tries to refute poses T_target_source of pairs of pieces that follow each other: free motions, other poses that explain
/// as much, points in free space, another size or hand. Of each target the pose on the piece that its chain begins with.
///
/// The source of a pair is the target of an earlier one, or the beginning of a chain. Seeds, threads and the monitor are
/// as in [`align_pieces`].
///
/// # Errors
/// [`Error::PieceOutOfRange`], [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{examine_poses, Monitor, OrientedScan, PieceSituation, PieceView, RecurrenceSettings};
/// use surfsig::RigidTransform;
///
/// // A square of 20 points by 20, which lies on itself.
/// let points: Vec<[f64; 3]> = (0..400).map(|i| [f64::from(i % 20), f64::from(i / 20), 0.0]).collect();
/// let normals = vec![[0.0, 0.0, 1.0]; 400];
/// let scan = OrientedScan { points: &points, normals: &normals, spacing: 1.0, tolerance: 0.4 };
/// let seen = PieceSituation { viewpoint: [10.0, 10.0, 1000.0], ..Default::default() };
/// let settings = RecurrenceSettings::default();
/// let piece: Vec<usize> = (0..400).collect();
/// let view = PieceView::new(&scan, &piece, &seen, 1.0, &settings)?;
/// let poses = [([0, 1], RigidTransform::identity())];
/// let found = examine_poses(&[&view, &view], &poses, &settings, &Monitor::default())?;
/// assert_eq!(found[0].free_directions.len(), 3, "a plane slides and rotates");
/// assert_eq!(found[0].doubts[0].name(), "free_directions");
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn examine_poses(
    views: &[&PieceView],
    poses: &[([usize; 2], RigidTransform)],
    settings: &RecurrenceSettings,
    monitor: &Monitor,
) -> Result<Vec<ExaminedPose>, Error> {
    // Unlike the keys of `align` and of refinements.
    let key = |[source, target]: [usize; 2]| [settings.seed, source as u64, target as u64, 2];
    let examined =
        of_pairs(views, poses, |of| of.0, settings, monitor, |pair, of| pair.examined(&of.1, &key(of.0)))?;
    let mut found: Vec<ExaminedPose> = Vec::with_capacity(poses.len());
    for (number, (([source, target], pose), examination)) in poses.iter().zip(examined).enumerate() {
        let before = poses[..number].iter().rposition(|other| other.0[1] == *source);
        let pair = PiecePair { source: views[*source], target: views[*target], settings };
        found.push(chain::chained(&pair, pose, examination, before.map(|number| &found[number])));
    }
    with_threads(settings.threads, || chain::with_symmetries(views, poses, &mut found, settings))?;
    Ok(found)
}

/// Does work for each item that belongs to a pair of pieces.
fn of_pairs<T: Sync, R: Send>(
    views: &[&PieceView],
    items: &[T],
    pair_of: impl Fn(&T) -> [usize; 2] + Sync,
    settings: &RecurrenceSettings,
    monitor: &Monitor,
    work: impl Fn(&PiecePair<'_>, &T) -> R + Sync,
) -> Result<Vec<R>, Error> {
    let len = views.len();
    if let Some(piece) = items.iter().flat_map(&pair_of).find(|&piece| piece >= len) {
        return Err(Error::PieceOutOfRange { piece, len });
    }
    let of_item = |item: &T| {
        monitor.check()?;
        let [source, target] = pair_of(item).map(|piece| views[piece]);
        let result = work(&PiecePair { source, target, settings }, item);
        monitor.add(1);
        Ok(result)
    };
    with_threads(settings.threads, || items.par_iter().with_max_len(1).map(of_item).collect())?
}

#[cfg(test)]
mod tests;
