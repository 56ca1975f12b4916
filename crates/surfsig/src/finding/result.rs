//! What [`crate::find_instances`] gives.

use super::Measures;
use crate::alignment::{Doubt, FreeDirection};
use crate::geometry::RigidTransform;

/// A model that is in a scene.
///
/// ```
/// use surfsig::{find_instances, FindSettings, Instance, Monitor, PointCloud, Scan};
/// let scene = Scan::new(PointCloud::new(&[]));
/// let found: Vec<Instance> = find_instances(&[], &scene, &FindSettings::default(), &Monitor::default())?;
/// assert!(found.is_empty());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, PartialEq)]
pub struct Instance {
    /// The model's number among those that were looked for.
    pub model: usize,
    /// Takes the model's points, in the coordinates in which it came, to the scene.
    pub T_scene_model: RigidTransform,
    /// Of the small twist (rotation vector in radians, then translation) in the scene's axes, about `center`, that takes
    /// the given transform to the true one. Infinite in the entries of free directions; the others are the limit as that
    /// variance grows.
    pub covariance: [[f64; 6]; 6],
    /// Middle of what lies on the scene's points, in the scene's coordinates.
    pub center: [f64; 3],
    /// Probability that the transform is right: within a tenth of the model's diameter. Learnt on simulated scenes.
    pub score: f64,
    /// What it was computed from.
    pub measures: Measures,
    /// Share of the surface facing the sensor that is seen, 0 to 1; of all of it where the viewpoint is not known.
    pub visible: f64,
    /// Share of the model's whole surface that lies on the scene's, 0 to 1.
    pub overlap: f64,
    /// Root mean square of the distances there, in the scans' unit.
    pub rms: f64,
    /// Motions, in the scene's coordinates, that what is seen does not determine.
    pub free_directions: Vec<FreeDirection>,
    /// Other transforms (T_scene_model) that explain as much of what is seen, as of a box that looks the same after half a
    /// turn: the symmetries of the model that no sensor's view refutes.
    pub alternatives: Vec<RigidTransform>,
    /// How many times as large as the model the instance is, by a similarity transform fitted to the surface; NaN where
    /// what is seen does not determine it. The transform itself is rigid.
    pub scale: f64,
    /// Of `scale`.
    pub scale_standard_error: f64,
    /// Why the transform is not the only right one, or not right: free directions, alternatives, another size. Empty
    /// where it is trusted.
    pub doubts: Vec<Doubt>,
    /// Numbers of the scene's points that are the instance's, ascending.
    pub indices: Vec<usize>,
}
