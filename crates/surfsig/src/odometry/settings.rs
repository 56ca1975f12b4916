//! All that odometry is told: each number once, with its unit, its meaning and its reason.

mod relocalisation;

pub use relocalisation::{RelocalisationSettings, SegmentSettings};

use crate::Error;
use crate::visibility::RangeImageSettings;

/// How [`crate::Odometry`] works. Nothing has to be set. `benchmarks/sweep_settings.py` shows what other values give on
/// simulated scenes.
///
/// Lengths of the first three fields are in the scans' unit; all others are in voxels, so that no number depends on the
/// unit or the sensor. Where no other reason is given, a value is the one with which the simulated sequences of
/// `benchmarks/odometry.py` were followed without a wrong pose.
///
/// ```
/// use surfsig::{Odometry, OdometrySettings};
///
/// let settings = OdometrySettings { voxel: Some(0.25), ..Default::default() };
/// assert!(Odometry::new(settings).is_ok());
/// let wrong = OdometrySettings { map_range: Some(-1.0), ..Default::default() };
/// assert_eq!(Odometry::new(wrong).unwrap_err().to_string(), "map_range must be a finite number above 0, not -1");
/// ```
#[derive(Debug, Clone, Default, PartialEq)]
pub struct OdometrySettings {
    /// Edge of the voxels in which scans and map are thinned, in the scans' unit; by default such that the first scan
    /// fills `scale.voxels_of_scan`.
    pub voxel: Option<f64>,
    /// Largest distance between points that correspond, in the scans' unit; by default from how well the motion was
    /// predicted so far (see [`PredictionSettings`]).
    pub max_correspondence_distance: Option<f64>,
    /// Distance from the sensor up to which the map is kept, in the scans' unit; by default
    /// `map.range_factor` times the distance within which 99 in 100 points of a scan are.
    pub map_range: Option<f64>,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
    /// Lengths that are taken from the first scan.
    pub scale: ScaleSettings,
    /// How a scan is aligned with the map.
    pub alignment: ScanAlignmentSettings,
    /// How the map grows.
    pub map: MapSettings,
    /// Where the next scan is expected.
    pub prediction: PredictionSettings,
    /// When a pose is doubted, and when it is believed.
    pub expectation: ExpectationSettings,
    /// When another map is begun.
    pub segments: SegmentSettings,
    /// How a sensor that was lost is found again.
    pub relocalisation: RelocalisationSettings,
    /// What a scan looked through; lengths in voxels.
    pub range_image: RangeImageSettings,
}

impl OdometrySettings {
    /// An error where a length is none.
    pub(super) fn check(&self) -> Result<(), Error> {
        let lengths = [
            ("voxel", self.voxel),
            ("max_correspondence_distance", self.max_correspondence_distance),
            ("map_range", self.map_range),
        ];
        for (name, length) in lengths {
            if let Some(length) = length.filter(|length| !(length.is_finite() && *length > 0.0)) {
                return Err(Error::InvalidLength { name, length });
            }
        }
        Ok(())
    }
}

/// Lengths that a sequence is worked with, taken from its first scan.
#[derive(Debug, Clone, PartialEq)]
pub struct ScaleSettings {
    /// Voxels that the first scan fills: enough for millimetres in a room, few enough for milliseconds.
    pub voxels_of_scan: f64,
    /// Share of the points that fill voxels of their own, at most, where a scan is sparse: each point is then used,
    /// and the map still joins what was seen twice.
    pub largest_filled_share: f64,
    /// Share of the points, the nearest to their median, by which lengths are taken: an outlier may be anywhere.
    pub central_share: f64,
    /// Radius of the patches that keypoints are described by, in median distances of the points from their median:
    /// large enough to hold furniture, small enough for several hundred patches in a room.
    pub patch_radius: f64,
    /// Points of a scan, and voxels that it fills, without which it is not aligned.
    pub min_points: usize,
    /// Median distances of the first scan's points from their median beyond which a sensor is not believed to be at
    /// the viewpoint: the scan is then in coordinates of a map, and its median stands for the sensor.
    pub farthest_viewpoint: f64,
}

impl ScaleSettings {
    /// Voxels that a scan of so many points should fill.
    pub(super) fn wanted(&self, points: usize) -> f64 {
        self.voxels_of_scan.min(self.largest_filled_share * points as f64)
    }
}

impl Default for ScaleSettings {
    fn default() -> Self {
        Self {
            voxels_of_scan: 4000.0,
            largest_filled_share: 0.8,
            central_share: 0.99,
            patch_radius: 0.35,
            min_points: 50,
            farthest_viewpoint: 30.0,
        }
    }
}

/// How a scan is aligned with the map: GICP from where it is expected, then point to plane.
#[derive(Debug, Clone, PartialEq)]
pub struct ScanAlignmentSettings {
    /// Steps of GICP after which the pose is taken as it is, in each of its two rounds.
    pub max_iterations: usize,
    /// Rotation of a step of GICP, in radians, below which it has converged (with `translation_epsilon`).
    pub rotation_epsilon: f64,
    /// Translation of a step of GICP, in voxels, likewise. What is left the steps point to plane take.
    pub translation_epsilon: f64,
    /// Edge, in voxels, of the coarser voxels of which GICP takes a scan's points: it only has to find the basin of
    /// the steps point to plane, which take all of them.
    pub coarse_voxel: f64,
    /// Points of these voxels that the first round takes, at most: it only has to come near enough for the second one.
    /// About a third of those of a scan; searches try their starts with them.
    pub first_points: usize,
    /// Steps point to plane: each squares the error that is left.
    pub plane_steps: usize,
    /// Largest distance between corresponding points in the second round and point to plane, in voxels: the diagonal
    /// of a voxel is 1.7.
    pub max_point_distance: f64,
    /// Largest point-to-plane residual of an inlier, in voxels.
    pub max_residual: f64,
    /// The same, in standard deviations of the residuals (by their median).
    pub max_deviation: f64,
    /// Least standard deviation of the residuals, in voxels: without noise all would be outliers by rounding.
    pub min_deviation: f64,
    /// Distance to the map's nearest point, in voxels, within which the map explains a point whatever the residual, as
    /// at edges, where the map's normal is none.
    pub explained_distance: f64,
    /// The root mean square of the distances from the map's planes that a motion makes, over that of its points' paths,
    /// below which a motion is weak: that much errors of the normals alone may say.
    pub weak: f64,
    /// Correspondences, at most, by which it is told whether the surface holds a weak motion, or errors of its normals do.
    pub held_samples: usize,
    /// Share of what the map's normals say about a motion that both halves of their neighbourhoods say alike, from which
    /// on the surface holds it.
    pub held_share: f64,
    /// What both say alike, in standard errors, likewise.
    pub held_deviations: f64,
    /// Steps point to plane once it is known which motions the map does not determine.
    pub constrained_steps: usize,
    /// Steps point to plane that refine the pose and the motion within a scan at once, where times are known.
    pub deskew_steps: usize,
    /// Standard deviation, in voxels, of the twist within a scan that its pose and those before it tell, from scan to scan
    /// and at the median range: small enough to count as much as thousands of points do.
    pub deskew_deviation: f64,
    /// Correspondences without which there is no pose.
    pub min_correspondences: usize,
    /// Points of the map, at most, that are looked up in the scan's range image: their share needs no more.
    pub free_space_samples: usize,
}

impl Default for ScanAlignmentSettings {
    fn default() -> Self {
        Self {
            max_iterations: 30,
            rotation_epsilon: 1e-3,
            translation_epsilon: 1e-2,
            coarse_voxel: 1.5,
            first_points: 600,
            plane_steps: 2,
            max_point_distance: 2.0,
            max_residual: 0.5,
            max_deviation: 3.0,
            min_deviation: 0.02,
            explained_distance: 1.2,
            weak: 0.25,
            held_samples: 2000,
            held_share: 0.5,
            held_deviations: 3.0,
            constrained_steps: 3,
            deskew_steps: 3,
            deskew_deviation: 0.01,
            min_correspondences: 30,
            free_space_samples: 8000,
        }
    }
}

/// How the map of the sensor's surroundings grows.
#[derive(Debug, Clone, PartialEq)]
pub struct MapSettings {
    /// Nearest points that a normal is taken from: as many as GICP's, about two voxels around.
    pub normal_neighbors: usize,
    /// Largest thickness of a point's neighbours that are on a plane: their standard deviation along the normal over
    /// the smaller one within the plane. Others, as at edges, have no normal. With 0.35, as in registration, errors of
    /// the simulated sequences were about half of those with normals everywhere.
    pub max_thickness: f64,
    /// Translation since the last scan that went into the map, in voxels, from which on the next one goes in.
    pub min_translation: f64,
    /// Rotation since then, in radians, likewise.
    pub min_rotation: f64,
    /// Range of the map over the distance within which 99 in 100 points of a scan are: what the next scans see must be
    /// in it.
    pub range_factor: f64,
    /// Scans in a row that look through a point of the map after which it is taken out, as what has moved on: one
    /// alone may have a wrong pixel or pose.
    pub scans_through: u8,
}

impl Default for MapSettings {
    fn default() -> Self {
        Self {
            normal_neighbors: 20,
            max_thickness: 0.35,
            min_translation: 1.0,
            min_rotation: 0.03,
            range_factor: 1.2,
            scans_through: 2,
        }
    }
}

/// Where the next scan is expected: where the last motion, repeated, leads; and how far from there it may be, as in
/// KISS-ICP (Vizzo and others, 2023).
#[derive(Debug, Clone, PartialEq)]
pub struct PredictionSettings {
    /// Largest distance of corresponding points, in root mean squares of the distances by which earlier predictions
    /// were wrong at the scan's median range.
    pub max_deviation: f64,
    /// Least such distance, in voxels.
    pub min_correspondence_distance: f64,
    /// Error of a prediction before any was tried, in median ranges: a sensor that is carried at a walk and scans
    /// twice a second.
    pub first_error: f64,
    /// Error of a prediction, in voxels, below which it says nothing about the motion, as of a sensor that stands.
    pub min_error: f64,
    /// Scans without a pose after which the motion is no longer believed to go on.
    pub max_lost: usize,
}

impl Default for PredictionSettings {
    fn default() -> Self {
        Self {
            max_deviation: 3.0,
            min_correspondence_distance: 2.0,
            first_error: 0.1,
            min_error: 0.1,
            max_lost: 5,
        }
    }
}

/// When a pose is doubted, and when it is believed, by what the last scans did: overlap and contradictions depend on the
/// sensor and its surroundings, so no fixed share would do.
#[derive(Debug, Clone, PartialEq)]
pub struct ExpectationSettings {
    /// Scans that the expectation is taken from.
    pub scans: usize,
    /// Share of the expected overlap (their median, less what no earlier scan would have measured) below which a pose is
    /// doubted.
    pub doubted_overlap: f64,
    /// Share of the expected overlap from which on a pose that was searched may be believed at once.
    pub certain_overlap: f64,
    /// Expected overlap before any scan has a pose.
    pub first_overlap: f64,
    /// Overlap of a pose that is believed, at least, as a share of the points that earlier scans would have measured:
    /// where sight opens, most of a scan is new.
    pub min_overlap: f64,
    /// Share of all points that must lie on the map, at least.
    pub least_overlap: f64,
    /// Standard deviation of a pose that is believed, at most: in voxels, at the median range.
    pub max_deviation: f64,
    /// Share of the map's points in sight that are in free space, above the expected share (the median), from which on
    /// scan and map contradict each other.
    pub free_space_excess: f64,
    /// Share of the scan's points that keyframes would have seen and the map lacks, above the largest of the last
    /// scans, likewise.
    pub unexplained_excess: f64,
    /// Such a share up to which a pose that was searched may be believed at once.
    pub certain_unexplained: f64,
    /// The excess in free space up to which a scan at its expected pose is believed: something has left.
    pub departed_excess: f64,
    /// The excess of unexplained points up to which a scan at its expected pose is believed: something has come.
    pub arrived_excess: f64,
    /// Distance between the expected and the found pose, in voxels at the median range, up to which more may have left
    /// and come: a sensor that was carried away is not seen there by chance.
    pub near: f64,
    /// The excess in free space up to which a scan so near to its expected pose is believed, as where lorries pass.
    pub departed_excess_near: f64,
    /// The excess of unexplained points, likewise.
    pub arrived_excess_near: f64,
}

impl Default for ExpectationSettings {
    fn default() -> Self {
        Self {
            scans: 10,
            doubted_overlap: 0.85,
            certain_overlap: 0.93,
            first_overlap: 0.4,
            min_overlap: 0.4,
            least_overlap: 0.1,
            max_deviation: 0.5,
            free_space_excess: 0.01,
            unexplained_excess: 0.015,
            certain_unexplained: 0.02,
            departed_excess: 0.05,
            arrived_excess: 0.2,
            near: 0.67,
            departed_excess_near: 0.3,
            arrived_excess_near: 0.4,
        }
    }
}
