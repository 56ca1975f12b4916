//! What [`crate::register`] gives.

use crate::alignment::{Alternative, Doubt, FreeDirection};
use crate::geometry::RigidTransform;

/// How a source lies in a target, and how sure that is.
///
/// ```
/// use surfsig::{register, Monitor, PointCloud, RegistrationSettings, Scan};
/// let nothing = Scan::new(PointCloud::new(&[]));
/// let found = register(&nothing, &nothing, None, &RegistrationSettings::default(), &Monitor::default())?;
/// assert!(found.T_target_source.is_none() && !found.trusted && found.rms.is_nan());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, PartialEq)]
pub struct Registration {
    /// Takes the source's points to the target; `None` where nothing was found.
    pub T_target_source: Option<RigidTransform>,
    /// Of the small twist (rotation vector in radians, then translation) in the target's axes, about `center`, that
    /// takes the given transform to the true one. Large in the free directions; NaN where nothing was found.
    ///
    /// Infinite in the entries of free directions; the others are the limit as that variance grows.
    pub covariance: [[f64; 6]; 6],
    /// Its inverse, which is 0 along free directions.
    pub information: [[f64; 6]; 6],
    /// Middle of the overlap, in the target's coordinates.
    pub center: [f64; 3],
    /// Motions of the source, in the target's coordinates, that the overlap does not determine.
    pub free_directions: Vec<FreeDirection>,
    /// Other transforms that explain as much, as of a box that looks the same after half a turn.
    pub alternatives: Vec<Alternative>,
    /// Keypoints that were matched; 0 where a start was given.
    pub matches: usize,
    /// Those of them that agree with the transform.
    pub inliers: usize,
    /// Share of the source's surface that lies on the target's, 0 to 1.
    pub overlap: f64,
    /// The same, where points count the more the nearer they are, as for the alternatives.
    pub explained: f64,
    /// The larger share of one scan's points that lie where the other's sensor looked through, of those that it would
    /// have measured; NaN where no viewpoint is known from which all was seen.
    pub free_space: f64,
    /// How many times as large as the target the source is, by the distances that a similarity transform leaves; NaN
    /// where the overlap does not determine it.
    pub scale: f64,
    /// Its standard error.
    pub scale_standard_error: f64,
    /// Root mean square of the distances there, in the scans' unit.
    pub rms: f64,
    /// Of the patches that were matched, or would have been.
    pub radius: f64,
    /// Whether the transform is right, by what was seen: no test has refuted it.
    pub trusted: bool,
    /// Why it is not trusted; empty where it is.
    pub doubts: Vec<Doubt>,
}

impl Registration {
    /// Nothing was found.
    pub(super) fn nothing(radius: f64, matches: usize) -> Self {
        Self {
            T_target_source: None,
            covariance: [[f64::NAN; 6]; 6],
            information: [[f64::NAN; 6]; 6],
            center: [f64::NAN; 3],
            free_directions: Vec::new(),
            alternatives: Vec::new(),
            matches,
            inliers: 0,
            overlap: 0.0,
            explained: 0.0,
            free_space: f64::NAN,
            scale: f64::NAN,
            scale_standard_error: f64::NAN,
            rms: f64::NAN,
            radius,
            trusted: false,
            doubts: vec![Doubt::NotFound],
        }
    }
}
