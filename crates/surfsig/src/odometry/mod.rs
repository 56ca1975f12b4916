//! Odometry: the pose of each scan of a sequence in a map that the scans before it have made.
//!
//! A scan is thinned ([`thinned_scan`]) by lengths of the first one ([`scale`]), expected where the last motion leads, and
//! aligned ([`scan_alignment`]) with the map of the surroundings ([`local_map`]). Where it lies there worse than scans
//! did of late ([`expectation`]), it is searched: by other motions, by rotations of the sensor ([`rotation_search`]), of
//! which few points tell the likeliest ([`rough_alignment`]), and among keyframes ([`keyframes`]). Along motions that the
//! map does not determine, as along a smooth corridor (halves of the map's neighbourhoods tell), the last motion goes on;
//! [`motions`] says how large they are. [`tracker`] goes from scan to scan. Where it stays lost, or the lengths do not
//! fit, another map is begun ([`segment`], [`segments`]). Loops are looked for around where the sensor is expected, as far as
//! the way around may have drifted ([`translation_search`]).

mod correspondences;
mod deskewing;
mod expectation;
mod keyframes;
mod local_map;
mod motions;
mod point_times;
mod pose_covariance;
mod result;
mod rotation_search;
mod rough_alignment;
mod scale;
mod scan_alignment;
mod segment;
mod segments;
mod settings;
mod thinned_scan;
mod tracker;
mod translation_search;
mod voxel_index;

pub use point_times::{deskew, spin_times, time_range};
pub use result::{LoopClosure, ScanPose, ScanStatus};
pub use settings::{
    ExpectationSettings, MapSettings, OdometrySettings, PredictionSettings, RelocalisationSettings,
    ScaleSettings, ScanAlignmentSettings, SegmentSettings,
};

use crate::{Error, Scan, with_threads};
use segments::Segments;
use thinned_scan::SensorPosition;

/// Intervals between scans beyond which a point's time is none.
const LARGEST_TIME: f64 = 10.0;

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
    segments: Segments,
    loops: Vec<LoopClosure>,
}

impl std::fmt::Debug for Odometry {
    /// Without the map, which is long.
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let mut told = f.debug_struct("Odometry");
        told.field("scans", &self.poses.len()).field("voxel", &self.voxel()).finish_non_exhaustive()
    }
}

impl Odometry {
    /// Begins a sequence.
    ///
    /// # Errors
    /// [`Error::InvalidLength`] if a length of the settings is not a finite number above 0.
    pub fn new(settings: OdometrySettings) -> Result<Self, Error> {
        settings.check()?;
        let segments = Segments::new(&settings);
        let sensor_position = SensorPosition::default();
        Ok(Self {
            settings,
            sensor_position,
            sensors: Vec::new(),
            poses: Vec::new(),
            segments,
            loops: Vec::new(),
        })
    }

    /// Takes the next scan, in its own frame, in which the sensor is at the viewpoint, or at 0 where none is given.
    ///
    /// Gives the result of this scan, and before it those of earlier scans that it confirms or disproves: where a sensor
    /// that was lost is found again, or another map is begun, poses are kept back until some scans have followed each
    /// other. Missing returns that a
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
        with_threads(self.settings.threads, || self.push_here(scan, None))
    }

    /// Takes the next scan of a sensor that moves while it scans: each point has the time at which it was measured, in
    /// intervals from this scan to the next one, from the time on of which the pose is asked. Points are taken to where
    /// they would have been measured at that time, by a constant twist that is refined with the pose
    /// ([`ScanPose::twist`]).
    ///
    /// # Errors
    /// [`Error::Threads`] where the system refuses the threads; [`Error::TimesMismatch`] if there are not as many times
    /// as points.
    ///
    /// ```
    /// use surfsig::{Odometry, OdometrySettings, PointCloud, Scan};
    /// let mut odometry = Odometry::new(OdometrySettings::default())?;
    /// let few = [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]];
    /// assert!(odometry.push_timed(&Scan::new(PointCloud::new(&few)), &[-0.5, 0.5])?[0].twist.is_none());
    /// assert!(odometry.push_timed(&Scan::new(PointCloud::new(&few)), &[0.0]).is_err());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn push_timed(&mut self, scan: &Scan<'_>, times: &[f64]) -> Result<Vec<ScanPose>, Error> {
        if times.len() != scan.cloud.len() {
            return Err(Error::TimesMismatch { times: times.len(), points: scan.cloud.len() });
        }
        with_threads(self.settings.threads, || self.push_here(scan, Some(times)))
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

    /// Scans that the sensor has come back with to where it was. Poses of scans on the way around stay as they were given:
    /// a pose graph distributes the drift over them.
    ///
    /// ```
    /// let odometry = surfsig::Odometry::new(surfsig::OdometrySettings::default())?;
    /// assert!(odometry.loops().is_empty());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn loops(&self) -> &[LoopClosure] {
        &self.loops
    }

    /// Edge of the voxels in which scans and the present map are thinned, in the scans' unit; `None` before a scan has
    /// points.
    ///
    /// ```
    /// let odometry = surfsig::Odometry::new(surfsig::OdometrySettings::default())?;
    /// assert_eq!(odometry.voxel(), None);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn voxel(&self) -> Option<f64> {
        self.segments.voxel()
    }

    fn push_here(&mut self, scan: &Scan<'_>, times: Option<&[f64]>) -> Vec<ScanPose> {
        let farthest = self.settings.scale.farthest_viewpoint;
        // A time that nobody knows is that of the pose.
        let known = |time: &f64| if time.abs() <= LARGEST_TIME { *time } else { 0.0 };
        let times: Option<Vec<f64>> = times.map(|times| times.iter().map(known).collect());
        let (measured, sensor) = self.sensor_position.about_sensor(scan, times.as_deref(), farthest);
        let points = &measured.points;
        let number = self.poses.len();
        self.sensors.push(sensor);
        let is_usable =
            points.len() >= self.settings.scale.min_points && points.iter().any(|point| *point != points[0]);
        let followed = self.segments.follow(is_usable.then_some(measured));
        let status = if followed.is_thin { ScanStatus::TooFewPoints } else { ScanStatus::Lost };
        self.poses.push(ScanPose::none(number, status));
        self.loops.extend(followed.loops.iter().map(|found| found.in_frames(&self.sensors)));
        let mut changed = followed.disproved;
        for index in &changed {
            self.poses[*index] = ScanPose::none(*index, ScanStatus::Lost);
        }
        for found in followed.found {
            let pose = found.in_frames(&self.sensors);
            changed.push(pose.scan);
            let index = pose.scan;
            self.poses[index] = pose;
        }
        changed.push(number);
        changed.sort_unstable();
        changed.dedup();
        changed.into_iter().map(|index| self.poses[index].clone()).collect()
    }
}
