//! Odometry: the pose of each scan of a sequence in a map that the scans before it have made.
//!
//! A scan is thinned ([`thinned_scan`]) by lengths of the first one ([`scale`]), expected where the last motion leads, and
//! aligned ([`scan_alignment`]) with the map of the surroundings ([`local_map`]). Where it lies there worse than scans
//! did of late ([`expectation`]), it is searched among keyframes ([`keyframes`]). Along motions that the map
//! ([`map_surface`]) does not determine, as along a smooth corridor, the last motion goes on. [`tracker`] goes from scan
//! to scan.

mod correspondences;
mod expectation;
mod keyframes;
mod local_map;
mod map_surface;
mod result;
mod scale;
mod scan_alignment;
mod settings;
mod thinned_scan;
mod tracker;
mod voxel_index;

pub use result::{ScanPose, ScanStatus};
pub use settings::{
    ExpectationSettings, MapSettings, OdometrySettings, PredictionSettings, RelocalisationSettings,
    ScaleSettings, ScanAlignmentSettings,
};

use crate::alignment::{FreeDirection, infinite_along, motions_beyond};
use crate::{Error, RigidTransform, Scan, with_threads};
use nalgebra::{Matrix6, Vector6};
use scale::Scale;
use thinned_scan::{SensorPosition, ThinnedScan};
use tracker::{LEAST_OPEN, Step, Tracker};

/// Voxels from the sensor beyond which no point is measured; they are numbered with 32 bits.
const FARTHEST: f64 = 1e9;

/// Follows a sensor from scan to scan.
///
/// ```
/// use surfsig::{Odometry, OdometrySettings, PointCloud, Scan, ScanStatus};
///
/// // A room of 8 x 6 x 3 with a pillar, seen from a point within it.
/// let scan = |x: f64| -> Vec<[f64; 3]> {
///     let walls = [([-x, -3.0, -1.5], [8.0 - x, 3.0, 1.5]), ([5.0 - x, 1.0, -9.0], [5.5 - x, 1.5, 9.0])];
///     let ray = |i: i32| {
///         let (turn, rise) = (f64::from(i % 360).to_radians(), f64::from(i / 360 - 16) * 0.04);
///         let ray = [turn.cos(), turn.sin(), rise];
///         // The nearest side of the room from within, or of the pillar from without.
///         let sides = |(low, high): ([f64; 3], [f64; 3])| {
///             [0, 1, 2].map(|k| { let (a, b) = (low[k] / ray[k], high[k] / ray[k]); [a.min(b), a.max(b)] })
///         };
///         let room = sides(walls[0]).map(|[_, leave]| leave).into_iter().fold(f64::INFINITY, f64::min);
///         let pillar = sides(walls[1]);
///         let enter = pillar.iter().fold(0.0_f64, |t, [enter, _]| t.max(*enter));
///         let is_met = pillar.iter().all(|[_, leave]| enter < *leave);
///         let range = if is_met { enter.min(room) } else { room };
///         ray.map(|c| c * range)
///     };
///     (0..360 * 33).map(ray).collect()
/// };
/// let mut odometry = Odometry::new(OdometrySettings::default())?;
/// for step in 0..3 {
///     let x = 2.0 + 0.1 * f64::from(step);
///     let found = odometry.push(&Scan::new(PointCloud::new_f64(&scan(x))))?;
///     assert_eq!((found.len(), found[0].status), (1, ScanStatus::Tracked));
///     let pose = found[0].T_map_scan.unwrap().to_matrix();
///     assert!((pose[0][3] - (x - 2.0)).abs() < 0.01 && pose[1][3].abs() < 0.01);
/// }
/// assert_eq!(odometry.poses().len(), 3);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub struct Odometry {
    settings: OdometrySettings,
    sensor_position: SensorPosition,
    /// Where the sensor is in the frame of each scan.
    sensors: Vec<[f64; 3]>,
    poses: Vec<ScanPose>,
    tracked: Option<Tracked>,
}

impl std::fmt::Debug for Odometry {
    /// Without the map, which is long.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut told = f.debug_struct("Odometry");
        told.field("scans", &self.poses.len()).field("voxel", &self.voxel()).finish_non_exhaustive()
    }
}

/// What there is from the first scan on that has a pose.
struct Tracked {
    /// Its number.
    first: usize,
    scale: Scale,
    tracker: Tracker,
}

impl Odometry {
    /// Begins a sequence.
    ///
    /// # Errors
    /// [`Error::InvalidLength`] if a length of the settings is not a finite number above 0.
    pub fn new(settings: OdometrySettings) -> Result<Self, Error> {
        settings.check()?;
        let sensor_position = SensorPosition::default();
        Ok(Self { settings, sensor_position, sensors: Vec::new(), poses: Vec::new(), tracked: None })
    }

    /// Takes the next scan, in its own frame, in which the sensor is at the viewpoint, or at 0 where none is given.
    ///
    /// Gives the result of this scan, and before it those of earlier scans that it confirms: where a sensor that was
    /// lost is found again, poses are kept back until some scans have followed each other. Missing returns that a
    /// driver wrote as points at 0 count as points, and should be left out before. In scans whose coordinates are those
    /// of a map, where the viewpoint is far from all points, the median of the first scan stands for it.
    ///
    /// # Errors
    /// [`Error::Threads`] where the system refuses the threads.
    ///
    /// ```
    /// use surfsig::{Odometry, OdometrySettings, PointCloud, Scan, ScanStatus};
    /// let mut odometry = Odometry::new(OdometrySettings::default())?;
    /// let few = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// assert_eq!(odometry.push(&Scan::new(PointCloud::new(&few)))?[0].status, ScanStatus::TooFewPoints);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn push(&mut self, scan: &Scan<'_>) -> Result<Vec<ScanPose>, Error> {
        with_threads(self.settings.threads, || self.push_here(scan))
    }

    /// The results of all scans so far. One that is lost may still get a pose by the next scans.
    ///
    /// ```
    /// let odometry = surfsig::Odometry::new(surfsig::OdometrySettings::default())?;
    /// assert!(odometry.poses().is_empty());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn poses(&self) -> &[ScanPose] {
        &self.poses
    }

    /// Edge of the voxels in which scans and map are thinned, in the scans' unit; `None` before a scan has points.
    ///
    /// ```
    /// let odometry = surfsig::Odometry::new(surfsig::OdometrySettings::default())?;
    /// assert_eq!(odometry.voxel(), None);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn voxel(&self) -> Option<f64> {
        self.tracked.as_ref().map(|tracked| tracked.scale.voxel)
    }

    fn push_here(&mut self, scan: &Scan<'_>) -> Vec<ScanPose> {
        let farthest = self.settings.scale.farthest_viewpoint;
        let (mut points, sensor) = self.sensor_position.about_sensor(scan, farthest);
        let number = self.poses.len();
        self.sensors.push(sensor);
        self.poses.push(ScanPose::none(number, ScanStatus::TooFewPoints));
        let min_points = self.settings.scale.min_points;
        let is_usable = points.len() >= min_points && points.iter().any(|point| *point != points[0]);
        if is_usable && self.tracked.is_none() {
            let scale = Scale::new(&points, self.settings.voxel, &self.settings.scale);
            let tracker = Tracker::new(&self.settings, &scale);
            self.tracked = Some(Tracked { first: number, scale, tracker });
        }
        let Some(tracked) = &mut self.tracked else { return vec![self.poses[number].clone()] };
        let per_voxel = 1.0 / tracked.scale.voxel;
        points.iter_mut().for_each(|point| *point = point.map(|c| c * per_voxel));
        points.retain(|point| point.iter().all(|c| c.abs() < FARTHEST));
        let scan = is_usable.then(|| ThinnedScan::new(points, &self.settings));
        let Some(scan) = scan.filter(|scan| scan.points.len() >= min_points) else {
            tracked.tracker.skip();
            return vec![self.poses[number].clone()];
        };
        self.poses[number].status = ScanStatus::Lost;
        let mut changed = Vec::new();
        for step in tracked.tracker.follow(&scan) {
            let index = tracked.first + step.number;
            let sensors = [self.sensors[index], self.sensors[tracked.first]];
            self.poses[index] =
                in_frames(&step, index, sensors, tracked.scale.voxel, tracked.scale.median_range);
            changed.push(index);
        }
        if changed.last() != Some(&number) {
            changed.push(number);
        }
        changed.into_iter().map(|index| self.poses[index].clone()).collect()
    }
}

/// From voxels about the sensor to the scan's own unit and frame, and to the map's: the frame of the first scan.
/// `sensors` are the scan's and the first one's; `unit` is the length by which a rotation moves points.
fn in_frames(step: &Step, scan: usize, sensors: [[f64; 3]; 2], voxel: f64, unit: f64) -> ScanPose {
    let to = |translation: [f64; 3]| RigidTransform::from_rotation_vector([0.0; 3], translation);
    let mut pose = step.T_map_scan;
    pose.translation *= voxel;
    let from_sensor = to(sensors[0]);
    // A twist about the sensor, in voxels, as one in the scan's frame.
    let adjoint = from_sensor.adjoint();
    let carried = Matrix6::from_fn(|i, j| adjoint[i][j] * if j < 3 { 1.0 } else { voxel });
    let both = step.covariance.random + step.covariance.systematic;
    let open: Vec<Vector6<f64>> = motions_beyond(&step.covariance.open, LEAST_OPEN, unit / voxel)
        .iter()
        .map(|motion| carried * motion)
        .collect();
    let covariance = infinite_along(&(carried * both * carried.transpose()), &open, unit);
    let in_unit = |direction: &FreeDirection| match *direction {
        FreeDirection::Translation { axis } => FreeDirection::Translation { axis },
        FreeDirection::Rotation { axis, point } => {
            FreeDirection::Rotation { axis, point: point.map(|c| c * voxel) }
        }
        FreeDirection::RotationAboutPoint { point } => {
            FreeDirection::RotationAboutPoint { point: point.map(|c| c * voxel) }
        }
    };
    let free = step.free_directions.iter().map(|direction| in_unit(direction).transformed(&from_sensor));
    ScanPose {
        scan,
        T_map_scan: Some(to(sensors[1]) * pose * from_sensor.inverse()),
        covariance: std::array::from_fn(|i| std::array::from_fn(|j| covariance[(i, j)])),
        free_directions: free.collect(),
        status: step.status,
        overlap: step.overlap,
    }
}
