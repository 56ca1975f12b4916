//! The poses of a sensor that moves, scan by scan.

use crate::arrays::{array, numbers, present, put, put_new, room};
use crate::cloud::{given, surfsig_cloud};
use crate::code::{Failure, guarded, surfsig_code};
use crate::options::thread_count;
use crate::registration::{SURFSIG_FREE_DIRECTIONS, surfsig_free_direction, surfsig_scan};
use crate::transform::{finite, surfsig_transform};
use std::ffi::{CStr, c_char};
use surfsig::{Odometry, OdometrySettings, ScanPose, ScanStatus, deskew, with_threads};

/// Why a scan has the pose that it has.
#[repr(u8)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum surfsig_scan_status {
    /// Found next to where it was expected.
    Tracked = 0,
    /// Found by the signatures of its keypoints, after tracking had failed.
    Relocalised = 1,
    /// Not found: no pose.
    Lost = 2,
    /// It has hardly any points: no pose.
    TooFewPoints = 3,
}

const _: () = assert!(ScanStatus::ALL.len() == 4, "every status of the core has one here");

impl From<ScanStatus> for surfsig_scan_status {
    fn from(status: ScanStatus) -> Self {
        match status {
            ScanStatus::Tracked => Self::Tracked,
            ScanStatus::Relocalised => Self::Relocalised,
            ScanStatus::Lost => Self::Lost,
            _ => Self::TooFewPoints,
        }
    }
}

/// A scan's pose in the map, whose frame is that of the first scan that has one.
#[allow(non_snake_case, reason = "the name says from where to where")]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_scan_pose {
    /// Why the pose is what it is.
    pub status: surfsig_scan_status,
    /// Share of the scan's points that lie on the map; 0 where there is no pose.
    pub overlap: f64,
    /// Takes the scan's points to the map; NaN where there is no pose.
    pub T_map_scan: surfsig_transform,
    /// Of the twist m (rotation vector in radians, then translation) in the scan's own axes by which the pose is off,
    /// T_true = T_map_scan exp(m): 6 x 6, row by row. NaN where there is no pose; infinite in the entries of motions that
    /// nothing has determined since the first scan.
    pub covariance: [f64; 36],
    /// Number of motions that the map does not determine for this scan: along them the last motion goes on.
    pub free_direction_count: usize,
    /// These motions, in the scan's coordinates.
    pub free_directions: [surfsig_free_direction; SURFSIG_FREE_DIRECTIONS],
}

impl surfsig_scan_pose {
    fn of(pose: &ScanPose) -> Self {
        let mut covariance = [f64::NAN; 36];
        covariance.copy_from_slice(pose.covariance.as_flattened());
        Self {
            status: pose.status.into(),
            overlap: pose.overlap,
            T_map_scan: surfsig_transform::or_nan(pose.T_map_scan.as_ref()),
            covariance,
            free_direction_count: pose.free_directions.len(),
            free_directions: surfsig_free_direction::array_of(&pose.free_directions),
        }
    }
}

/// A sensor that is followed from scan to scan. Made by surfsig_odometry_new(), freed by surfsig_odometry_free(). It
/// refers to nothing of the caller's.
pub struct surfsig_odometry {
    odometry: Odometry,
}

/// A status in words, as "tracked"; null for a number that is none. Null-terminated, never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_scan_status_name(status: u8) -> *const c_char {
    const NAMES: [&CStr; 4] = [c"tracked", c"relocalised", c"lost", c"too_few_points"];
    NAMES.get(usize::from(status)).map_or(std::ptr::null(), |name| name.as_ptr())
}

/// Begins a sequence.
///
/// @param voxel Edge of the voxels in which scans and map are thinned, in the scans' unit; 0 to take it from the first
/// scan.
/// @param max_correspondence_distance Largest distance between points that correspond, in the scans' unit; 0 to take it
/// from how far off the last predictions were.
/// @param map_range How far the map goes around the sensor, in the scans' unit; 0 to take it from the scans.
/// @param threads 1 to 1024; 0 for all cores. The result is the same, bit for bit.
/// @param odometry Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_odometry_new(
    voxel: f64,
    max_correspondence_distance: f64,
    map_range: f64,
    threads: u32,
    odometry: *mut *mut surfsig_odometry,
) -> surfsig_code {
    let given = |length: f64| (length != 0.0).then_some(length);
    let made = || {
        let settings = OdometrySettings {
            voxel: given(voxel),
            max_correspondence_distance: given(max_correspondence_distance),
            map_range: given(map_range),
            threads: thread_count(threads)?,
            ..OdometrySettings::default()
        };
        Ok(surfsig_odometry { odometry: Odometry::new(settings)? })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(odometry, "odometry", made) })
}

/// Ends a sequence; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_odometry_free(odometry: Option<Box<surfsig_odometry>>) {
    drop(odometry);
}

/// Takes the next scan, in its own frame, in which the sensor is at the viewpoint, or at 0 where none is given.
///
/// A scan that is lost may still get a pose by the next ones: surfsig_odometry_pose() then gives it.
///
/// @param odometry The sequence.
/// @param scan The scan; its directions are not looked at.
/// @param pose Where the scan's result is put; null where nobody wants it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_odometry_push(
    odometry: Option<&mut surfsig_odometry>,
    scan: *const surfsig_scan,
    pose: *mut surfsig_scan_pose,
) -> surfsig_code {
    guarded(|| {
        let odometry = &mut present(odometry, "odometry")?.odometry;
        // SAFETY: the caller gives a scan whose pointers are as they say.
        let scan = unsafe { array(scan, 1, "scan")?[0].checked("scan")? };
        odometry.push(&scan)?;
        match odometry.poses().last() {
            // SAFETY: the caller gives room for a result.
            Some(last) if !pose.is_null() => unsafe { put(pose, surfsig_scan_pose::of(last), "pose") },
            _ => Ok(()),
        }
    })
}

/// Takes the next scan of a sensor that moves while it scans: points are taken to where they would have been measured at
/// the time of the pose, by a constant twist that is refined with the pose.
///
/// @param odometry The sequence.
/// @param scan The scan; its directions are not looked at.
/// @param times Of each point, from the time of the pose on, in intervals from this scan to the next one: -0.5 to 0.5 for
/// a sensor that scans all along, and a pose at the middle. What is not finite counts as 0.
/// @param pose Where the scan's result is put; null where nobody wants it.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_odometry_push_timed(
    odometry: Option<&mut surfsig_odometry>,
    scan: *const surfsig_scan,
    times: *const f64,
    pose: *mut surfsig_scan_pose,
) -> surfsig_code {
    guarded(|| {
        let odometry = &mut present(odometry, "odometry")?.odometry;
        // SAFETY: the caller gives a scan whose pointers are as they say.
        let scan = unsafe { array(scan, 1, "scan")?[0].checked("scan")? };
        // SAFETY: the caller gives as many times as the scan has points, or null.
        let times = unsafe { array(times, scan.cloud.len(), "times")? };
        odometry.push_timed(&scan, times)?;
        match odometry.poses().last() {
            // SAFETY: the caller gives room for a result.
            Some(last) if !pose.is_null() => unsafe { put(pose, surfsig_scan_pose::of(last), "pose") },
            _ => Ok(()),
        }
    })
}

/// Number of the map that a scan's pose is in, from 0: where a sensor stays lost, another map is begun, whose frame is
/// that of its first scan. -1 for a scan without a pose, one that there is not, and null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_odometry_segment(odometry: Option<&surfsig_odometry>, index: usize) -> i64 {
    let pose = odometry.and_then(|odometry| odometry.odometry.poses().get(index));
    let segment = pose.filter(|pose| pose.T_map_scan.is_some()).map(|pose| pose.segment);
    segment.and_then(|segment| i64::try_from(segment).ok()).unwrap_or(-1)
}

/// Gives the twist (rotation vector in radians, then translation) in a scan's own axes by which the sensor moves from
/// that scan to the next one, if its motion goes on: NaN where no times of points were given, and where there is no pose.
///
/// @param odometry The sequence.
/// @param index Number of a scan, from 0.
/// @param twist Room for 6 doubles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_odometry_twist(
    odometry: Option<&surfsig_odometry>,
    index: usize,
    twist: *mut f64,
) -> surfsig_code {
    guarded(|| {
        let poses = present(odometry, "odometry")?.odometry.poses();
        let found = poses.get(index).ok_or_else(|| outside(index, poses.len()))?;
        // SAFETY: the caller gives room for six values, or null.
        let room = unsafe { room(twist, 6, "twist")? };
        room.copy_from_slice(&found.twist.unwrap_or([f64::NAN; 6]));
        Ok(())
    })
}

fn outside(index: usize, count: usize) -> Failure {
    Failure::invalid_input(format!("scan {index} is outside a sequence of {count}"))
}

/// Number of scans so far; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_odometry_size(odometry: Option<&surfsig_odometry>) -> usize {
    odometry.map_or(0, |odometry| odometry.odometry.poses().len())
}

/// Edge of the voxels in which scans and map are thinned, in the scans' unit; NaN before a scan has points, and for
/// null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_odometry_voxel(odometry: Option<&surfsig_odometry>) -> f64 {
    odometry.and_then(|odometry| odometry.odometry.voxel()).unwrap_or(f64::NAN)
}

/// Gives what is known now of any scan so far.
///
/// @param odometry The sequence.
/// @param index Number of a scan, from 0.
/// @param pose Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_odometry_pose(
    odometry: Option<&surfsig_odometry>,
    index: usize,
    pose: *mut surfsig_scan_pose,
) -> surfsig_code {
    guarded(|| {
        let poses = present(odometry, "odometry")?.odometry.poses();
        let found = poses.get(index).ok_or_else(|| outside(index, poses.len()))?;
        // SAFETY: the caller gives room for a result, or null.
        unsafe { put(pose, surfsig_scan_pose::of(found), "pose") }
    })
}

/// Takes the points of a scan to where they would have been measured at the time of its pose: exp(t m) p, with the
/// sensor's twist m in a unit of time, and each point's time t in that unit.
///
/// @param cloud The scan's points.
/// @param times Of each point, from the time of the pose on. A point whose time is not finite stays.
/// @param twist A rotation vector in radians, and a translation: 6 doubles, finite, as those of surfsig_odometry_twist(),
/// which are for an interval between scans.
/// @param points Room for (n, 3) doubles, packed: offsets from the cloud's origin. Not a number for points that are not
/// finite.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_deskew(
    cloud: Option<&surfsig_cloud>,
    times: *const f64,
    twist: *const f64,
    points: *mut f64,
) -> surfsig_code {
    guarded(|| {
        let cloud = given(cloud)?.view();
        // SAFETY: the caller gives as many times as there are points, or null.
        let times = unsafe { array(times, cloud.len(), "times")? };
        // SAFETY: the caller gives six numbers, or null.
        let twist = finite(present(unsafe { numbers(twist) }, "twist")?, "twist")?;
        // SAFETY: the caller gives room for as many points, or null.
        let room = unsafe { room(points.cast::<[f64; 3]>(), cloud.len(), "points")? };
        room.copy_from_slice(&with_threads(None, || deskew(&cloud, times, twist))??);
        Ok(())
    })
}
