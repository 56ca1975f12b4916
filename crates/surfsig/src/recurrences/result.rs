//! What [`crate::align_pieces`] and [`crate::examine_poses`] give.

use crate::alignment::{Alternative, Doubt, FreeDirection};
use crate::depth_image::Judgement;
use crate::geometry::RigidTransform;

/// How well one piece lies on another.
///
/// ```
/// use surfsig::{Judgement, PieceAlignment, RigidTransform};
/// let T_target_source = RigidTransform::identity();
/// let alignment = PieceAlignment { T_target_source, judgements: [Judgement::default(); 2], score: 0.0 };
/// assert_eq!(alignment.judgements[0].confirmed, 0.0);
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PieceAlignment {
    /// Takes points of the source, about its centre, to the target, about its own.
    pub T_target_source: RigidTransform,
    /// Of the source's points in the target's depth image, and the other way round.
    pub judgements: [Judgement; 2],
    /// 1 where all is seen from both sides and agrees; 0 and below where nothing speaks for a match.
    pub score: f64,
}

/// What was measured of a pose between two pieces; of poses that follow each other the worst.
///
/// ```
/// use surfsig::PoseEvidence;
/// let itself = PoseEvidence::of_itself();
/// assert_eq!((itself.overlap, itself.scale), (1.0, 1.0));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PoseEvidence {
    /// Mean share of both pieces' points that lie on the other piece, 0 to 1.
    pub overlap: f64,
    /// The same of those points by which the alternatives are judged.
    pub explained: f64,
    /// The larger share of one piece's points, of those in sight of the other's sensor, where it looked through or would
    /// have seen something.
    pub free_space: f64,
    /// How many times as large as the target the source is; NaN where the overlap does not determine it.
    pub scale: f64,
    /// Its standard error.
    pub scale_standard_error: f64,
}

impl PoseEvidence {
    /// Of a piece that lies on itself.
    ///
    /// ```
    /// assert_eq!(surfsig::PoseEvidence::of_itself().free_space, 0.0);
    /// ```
    pub fn of_itself() -> Self {
        Self { overlap: 1.0, explained: 1.0, free_space: 0.0, scale: 1.0, scale_standard_error: 0.0 }
    }

    /// Of a pose that follows another one.
    pub(super) fn after(&self, other: &Self) -> Self {
        let scale = self.scale * other.scale;
        let relative = |one: &Self| one.scale_standard_error / one.scale;
        Self {
            overlap: self.overlap.min(other.overlap),
            explained: self.explained.min(other.explained),
            free_space: self.free_space.max(other.free_space),
            scale,
            scale_standard_error: scale * relative(self).hypot(relative(other)),
        }
    }
}

/// A pose that was tried to be refuted: of a target on the piece that its chain of poses begins with, the source.
///
/// ```
/// use surfsig::{examine_poses, ExaminedPose, Monitor, RecurrenceSettings};
/// let nothing: Vec<ExaminedPose> =
///     examine_poses(&[], &[], &RecurrenceSettings::default(), &Monitor::default())?;
/// assert!(nothing.is_empty());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, PartialEq)]
pub struct ExaminedPose {
    /// Takes points of the source, about its centre, to the target, about its own.
    pub T_target_source: RigidTransform,
    /// Motions of the source, in the target's coordinates about its centre, that what is seen of both does not determine.
    pub free_directions: Vec<FreeDirection>,
    /// Other poses that explain as much of what both sensors saw, but for free motions, as of a box that looks the same
    /// after half a turn.
    pub alternatives: Vec<Alternative>,
    /// What was measured.
    pub evidence: PoseEvidence,
    /// Why the pose is not trusted; empty where it is.
    pub doubts: Vec<Doubt>,
}
