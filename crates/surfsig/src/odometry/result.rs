//! What odometry gives for each scan.

use crate::RigidTransform;
use crate::alignment::FreeDirection;

/// Why a scan has the pose that it has.
///
/// ```
/// assert_eq!(surfsig::ScanStatus::Tracked.name(), "tracked");
/// ```
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
#[repr(u8)]
#[non_exhaustive]
pub enum ScanStatus {
    /// Found next to where it was expected.
    Tracked = 0,
    /// Found by the signatures of its keypoints, after tracking had failed.
    Relocalised = 1,
    /// Not found: no pose.
    Lost = 2,
    /// It has hardly any points: no pose.
    TooFewPoints = 3,
}

impl ScanStatus {
    /// All of them, in the order of their numbers.
    pub const ALL: [Self; 4] = [Self::Tracked, Self::Relocalised, Self::Lost, Self::TooFewPoints];

    /// Its name in lower case.
    pub fn name(self) -> &'static str {
        match self {
            Self::Tracked => "tracked",
            Self::Relocalised => "relocalised",
            Self::Lost => "lost",
            Self::TooFewPoints => "too_few_points",
        }
    }
}

/// A scan's pose in the map of its segment, whose frame is that of the segment's first scan.
///
/// ```
/// use surfsig::{Odometry, OdometrySettings, PointCloud, Scan, ScanStatus};
///
/// let mut odometry = Odometry::new(OdometrySettings::default())?;
/// let found = odometry.push(&Scan::new(PointCloud::new(&[])))?;
/// assert_eq!(found[0].status, ScanStatus::TooFewPoints);
/// assert!(found[0].T_map_scan.is_none() && found[0].covariance[0][0].is_nan());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, PartialEq)]
pub struct ScanPose {
    /// The scan's number, from 0.
    pub scan: usize,
    /// Number of the map that the pose is in, from 0: where a sensor stays lost, another map is begun, whose frame is
    /// that of its first scan. Poses in different segments have no known relation.
    pub segment: usize,
    /// Takes the scan's points to the map; `None` where the scan has no pose.
    pub T_map_scan: Option<RigidTransform>,
    /// Of the twist m (rotation vector in radians, then translation) in the scan's own axes by which the pose is off:
    /// T_true = T_map_scan exp(m). It grows as the map goes on from the first scan. NaN where there is no pose; infinite
    /// in the entries of motions that nothing has determined, since the first scan on: the others are the limit as that
    /// variance grows.
    pub covariance: [[f64; 6]; 6],
    /// Motions, in the scan's coordinates, that the map does not determine for this scan, as along a smooth corridor:
    /// there the last motion goes on. Empty where there are none.
    pub free_directions: Vec<FreeDirection>,
    /// Why the pose is what it is.
    pub status: ScanStatus,
    /// Share of the scan's points that lie on the map; 0 where there is no pose.
    pub overlap: f64,
    /// Twist (rotation vector in radians, then translation) in the scan's own axes by which the sensor moves from this
    /// scan to the next one, if its motion goes on; `None` where the times of points are not known.
    pub twist: Option<[f64; 6]>,
}

impl ScanPose {
    /// A scan without a pose.
    pub(super) fn none(scan: usize, status: ScanStatus) -> Self {
        Self {
            scan,
            segment: 0,
            T_map_scan: None,
            covariance: [[f64::NAN; 6]; 6],
            free_directions: Vec::new(),
            status,
            overlap: 0.0,
            twist: None,
        }
    }
}

/// A scan that lies on what an earlier one saw, after a way around: two poses of the scan, of which the difference is what
/// that way has drifted by. The scan's own [`ScanPose`] is that by the earlier one.
///
/// ```
/// let odometry = surfsig::Odometry::new(surfsig::OdometrySettings::default())?;
/// assert!(odometry.loops().is_empty());
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LoopClosure {
    /// The scan's number, from 0.
    pub scan: usize,
    /// The earlier scan's.
    pub earlier: usize,
    /// Takes the scan's points to the earlier one.
    pub T_earlier_scan: RigidTransform,
    /// Takes the scan's points to the map, by the way around.
    pub T_map_scan_before: RigidTransform,
}
