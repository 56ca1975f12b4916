//! How scans are registered.

use crate::alignment::{ConsensusSettings, PointToSurfaceSettings, RivalSettings, ScaleLimits};

/// What an expert may change; nothing has to be set. `benchmarks/sweep_settings.py` shows what other values give on
/// simulated scenes.
///
/// ```
/// let settings = surfsig::RegistrationSettings { keypoints: 500, ..Default::default() };
/// assert_eq!(settings.voxels_per_radius, 16.0);
/// ```
#[derive(Debug, Clone, PartialEq)]
pub struct RegistrationSettings {
    /// Radius of the patches that are matched, in the scans' unit; `None` for `radius_share` of the smaller scan.
    pub radius: Option<f64>,
    /// Radius of the patches over the median distance of a scan's points from their middle: so large that a patch has
    /// shape, and so small that most of it lies within the overlap.
    pub radius_share: f64,
    /// Keypoints of each scan.
    pub keypoints: usize,
    /// Candidates for keypoints along a patch's radius. With 4 to 8 as many poses of redkitchen, bunny and lidar are
    /// right (`benchmarks/registration.py`); with 5 most matches agree, and 8 takes twice the time.
    pub candidates_per_radius: f64,
    /// Voxels along a patch's radius, to which scans are thinned before their patches are described: the curvature of
    /// a patch is taken from balls of a quarter of its radius, which then hold some hundred means.
    pub description_voxels_per_radius: f64,
    /// Voxels along a patch's radius, to which scans are thinned before they are refined.
    pub voxels_per_radius: f64,
    /// The same where normals are oriented by their neighbours, because no viewpoint is known.
    pub orientation_voxels_per_radius: f64,
    /// When matches agree.
    pub consensus: ConsensusSettings,
    /// Largest distances between correspondences in the rounds of generalised ICP, in voxels.
    pub gicp_distances: [f64; 2],
    /// Steps of each round, at most.
    pub gicp_iterations: usize,
    /// Radians, and voxels, of a step below which generalised ICP has converged; what follows takes smaller ones.
    pub gicp_epsilon: [f64; 2],
    /// The last steps.
    pub point_to_surface: PointToSurfaceSettings,
    /// Points of the source in the last steps, at most: more make the transform no surer, as neighbours err alike.
    pub max_points: usize,
    /// Points without which there is nothing to register.
    pub min_points: usize,
    /// Voxels of each scan without which there are no distributions to refine by.
    pub min_voxels: usize,
    /// When another transform explains as much.
    pub rivals: RivalSettings,
    /// How rivals, and sources of another size, are fitted: from farther away than a transform that was refined.
    pub rival_fit: PointToSurfaceSettings,
    /// When points lie where a sensor looked through.
    pub free_space: FreeSpaceSettings,
    /// The search by faces, where matches find no transform that can be trusted.
    pub faces: FaceSettings,
    /// The logarithm of a scale from which on it is doubted, if it differs from 0 by so many standard errors: ranges of
    /// sensors differ by a thousandth, maps fused of a depth camera's images by a hundredth (0.992 and 1.012 between those
    /// of redkitchen, whose poses are right: `benchmarks/registration.py`).
    pub doubted_scale: f64,
    /// These standard errors.
    pub scale_deviations: f64,
    /// Matches that agree, from which on a transform is trusted: at most 22 agree with one of the 108 pairs of rooms
    /// without overlap (`benchmarks/registration.py`), and at most 28 with one of 30 pairs of periodic terrains; at
    /// least 62 with a right one of redkitchen, bunny and lidar.
    pub trusted_inliers: usize,
    /// Matches that agree, from which on a transform is trusted that leaves nothing in free space.
    pub certain_inliers: usize,
    /// Share that such a transform explains, at least: waves that come again explain a third of the wrong ones.
    pub certain_explained: f64,
    /// Matches that agree, per match and overlap, below which it is tried whether the source's mirror image fits better:
    /// 0.2 to 0.3 of mirrored rooms, 0.33 and more of right ones. It must also explain more of the source's points than chance
    /// does: halls are nearly their own mirror images.
    pub doubted_agreement: f64,
    /// How many times as many matches of the mirror image must agree.
    pub mirrored_inliers: f64,
    /// Overlap from which on it is.
    pub trusted_overlap: f64,
    /// Overlap from which on a transform is trusted that the caller gave roughly.
    pub trusted_overlap_of_start: f64,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
}

impl Default for RegistrationSettings {
    fn default() -> Self {
        Self {
            radius: None,
            radius_share: 0.4,
            keypoints: 1000,
            candidates_per_radius: 5.0,
            description_voxels_per_radius: 24.0,
            voxels_per_radius: 16.0,
            orientation_voxels_per_radius: 10.0,
            consensus: ConsensusSettings::default(),
            gicp_distances: [4.0, 2.0],
            gicp_iterations: 20,
            gicp_epsilon: [3e-4, 1e-2],
            point_to_surface: PointToSurfaceSettings::default(),
            max_points: 6000,
            min_points: 50,
            min_voxels: 16,
            rivals: RivalSettings::default(),
            rival_fit: PointToSurfaceSettings {
                max_distance: 9.0,
                max_iterations: 10,
                ..PointToSurfaceSettings::default()
            },
            free_space: FreeSpaceSettings::default(),
            faces: FaceSettings::default(),
            doubted_scale: 0.0125,
            scale_deviations: ScaleLimits::DEFAULT.deviations,
            trusted_inliers: 32,
            certain_inliers: 8,
            certain_explained: 0.5,
            doubted_agreement: 0.5,
            mirrored_inliers: 1.25,
            trusted_overlap: 0.04,
            trusted_overlap_of_start: 0.3,
            threads: None,
        }
    }
}

/// When a point lies where a sensor looked through.
///
/// ```
/// assert!(surfsig::FreeSpaceSettings::default().doubted_share < 0.1);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FreeSpaceSettings {
    /// Width of a pixel of the range image, in radians: wider than the gaps between the rings of a lidar.
    pub pixel: f64,
    /// Length before what was measured within which a point is on it, in voxels.
    pub margin: f64,
    /// The same as a share of the range.
    pub relative_margin: f64,
    /// Points in sight without which nothing is said.
    pub min_points: usize,
    /// Share of points in free space from which on a transform is doubted: at most 0.009 of those of right ones of
    /// simulated lidars and depth cameras, 0.005 of a real lidar; 0.024 and more of wrong ones
    /// (`benchmarks/trust.py`).
    pub doubted_share: f64,
    /// By how much the shares of two transforms must differ for the smaller one to win.
    pub excess: f64,
    /// What a transform may explain less than the best one, as a share, and still win by its free space: a half turn in a
    /// hall with two rows of columns explained 6 % more than the truth, and had 1.3 % of the points in free space.
    pub deficit: f64,
    /// Share up to which few matches are enough.
    pub certain_share: f64,
}

impl Default for FreeSpaceSettings {
    fn default() -> Self {
        Self {
            pixel: 3.0_f64.to_radians(),
            margin: 2.0,
            relative_margin: 0.02,
            min_points: 50,
            doubted_share: 0.02,
            excess: 0.01,
            deficit: 0.15,
            certain_share: 0.005,
        }
    }
}

/// How transforms are searched that take floors, ceilings and walls of one scan onto those of another, where both
/// viewpoints are known.
///
/// Values are those of 97 pairs of scans of simulated storeys (`surfsig.simulate.storey`, seeds 1, 2 and 20): where the
/// scans share a tenth or more, the true transform came first in all.
///
/// ```
/// assert!(surfsig::FaceSettings::default().rival_share < 1.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct FaceSettings {
    /// Points of each scan that judge a transform.
    pub points: usize,
    /// Translations that are tried along each axis, at most.
    pub translations: usize,
    /// The area of faces that a translation brings together, over the largest one along that axis, at least.
    pub least_share: f64,
    /// Distance within which a point lies on the other scan, in voxels: faces are compared in steps of one.
    pub near: f64,
    /// Share of the points in free space that refutes a transform, before it is refined: true ones have none.
    pub refuting_share: f64,
    /// Share of one scan's points that the other's sensor must have in its sight, for free space to say something.
    pub least_in_sight: f64,
    /// Candidates that are kept.
    pub candidates: usize,
    /// Share of a scan that the best one must explain to be trusted: wrong ones of which nothing is in free space
    /// explained up to 0.17, right ones of scans with 30 % in common 0.22 and more.
    pub certain_score: f64,
    /// Share of the points in free space up to which a transform is trusted that explains half (`certain_explained`) and
    /// is better than all others that take faces onto faces: at most 0.013 of right ones in 38 corridors with niches
    /// (`benchmarks/trust.py`); 0.02 and more of wrong ones that lay a room onto one of the same size.
    pub certain_free_space: f64,
    /// What the next one explains over what the best one does, at most, for that to be trusted: up to 0.56 beside right
    /// ones.
    pub rival_share: f64,
}

impl Default for FaceSettings {
    fn default() -> Self {
        Self {
            points: 300,
            translations: 8,
            least_share: 0.15,
            near: 2.0,
            refuting_share: 0.03,
            least_in_sight: 0.05,
            candidates: 12,
            certain_score: 0.2,
            certain_free_space: 0.015,
            rival_share: 0.6,
        }
    }
}
