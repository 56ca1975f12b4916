//! Point clouds as C gives them.

use crate::arrays::{points, position, present, put_new};
use crate::code::{Failure, guarded, surfsig_code};
use std::borrow::Cow;
use surfsig::{Offsets, PointCloud};

/// Points of the caller's. Made by surfsig_cloud_new_f32() or surfsig_cloud_new_f64(), freed by
/// surfsig_cloud_free().
///
/// Packed points are used where they are: they must neither change nor go as long as the cloud is used. Points with
/// other bytes between them are copied.
pub struct surfsig_cloud {
    rows: Rows,
    origin: [f64; 3],
}

/// The coordinates, less the origin.
enum Rows {
    F32(Cow<'static, [[f32; 3]]>),
    F64(Cow<'static, [[f64; 3]]>),
}

impl surfsig_cloud {
    pub(crate) fn view(&self) -> PointCloud<'_> {
        let offsets = match &self.rows {
            Rows::F32(rows) => Offsets::F32(rows),
            Rows::F64(rows) => Offsets::F64(rows),
        };
        PointCloud { offsets, origin: self.origin }
    }

    /// Coordinates in double precision; not a number for the points that are not finite.
    pub(crate) fn positions(&self) -> Cow<'_, [[f64; 3]]> {
        if let (Rows::F64(rows), [0.0, 0.0, 0.0]) = (&self.rows, self.origin) {
            return Cow::Borrowed(rows);
        }
        let cloud = self.view();
        Cow::Owned((0..cloud.len()).map(|i| cloud.position(i).unwrap_or([f64::NAN; 3])).collect())
    }
}

/// Makes a cloud of points in single precision.
///
/// Points that are not finite keep their numbers, belong to no neighbourhood, and get SURFSIG_STATUS_NOT_FINITE.
///
/// @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of points, at most 4294967295.
/// @param stride Bytes from one point's x to the next one's, at least 12: 12 for packed coordinates,
/// sizeof(pcl::PointXYZ) and the like otherwise.
/// @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
/// @param cloud Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_cloud_new_f32(
    points: *const f32,
    count: usize,
    stride: usize,
    origin: *const f64,
    cloud: *mut *mut surfsig_cloud,
) -> surfsig_code {
    // SAFETY: the conditions are the same.
    unsafe { new(points, count, stride, origin, cloud, Rows::F32) }
}

/// Makes a cloud of points in double precision, as surfsig_cloud_new_f32() does; the stride is at least 24 bytes.
///
/// @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of points, at most 4294967295.
/// @param stride Bytes from one point's x to the next one's.
/// @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
/// @param cloud Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_cloud_new_f64(
    points: *const f64,
    count: usize,
    stride: usize,
    origin: *const f64,
    cloud: *mut *mut surfsig_cloud,
) -> surfsig_code {
    // SAFETY: the conditions are the same.
    unsafe { new(points, count, stride, origin, cloud, Rows::F64) }
}

/// # Safety
/// `first` is null or points to `count` points, `stride` bytes apart, that stay as they are while the cloud lives;
/// `origin` is null or points to three numbers; `cloud` is null or points to where a pointer can be written.
unsafe fn new<T: Copy + 'static>(
    first: *const T,
    count: usize,
    stride: usize,
    origin: *const f64,
    cloud: *mut *mut surfsig_cloud,
    rows: impl Fn(Cow<'static, [[T; 3]]>) -> Rows,
) -> surfsig_code {
    let made = || -> Result<surfsig_cloud, Failure> {
        // SAFETY: the caller's condition.
        let offsets = unsafe { points(first, count, stride) }?;
        // SAFETY: the caller's condition.
        let origin = unsafe { position(origin, "origin") }?.unwrap_or_default();
        Ok(surfsig_cloud { rows: rows(offsets), origin })
    };
    // SAFETY: the caller's condition.
    guarded(|| unsafe { put_new(cloud, "cloud", made) })
}

/// Number of points; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_cloud_size(cloud: Option<&surfsig_cloud>) -> usize {
    cloud.map_or(0, |cloud| cloud.view().len())
}

/// Median distance of a finite point to its nearest other one; of many points, by a fixed choice of them. 0 for null,
/// and where no point has another. A radius of 5 to 10 times that is a start.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_cloud_spacing(cloud: Option<&surfsig_cloud>) -> f64 {
    let mut spacing = 0.0;
    guarded(|| {
        let positions = cloud.map(surfsig_cloud::positions).unwrap_or_default();
        let finite: Vec<_> = positions.iter().copied().filter(|p| p.iter().all(|c| c.is_finite())).collect();
        spacing = surfsig::with_threads(None, || surfsig::point_spacing(&finite))?;
        Ok(())
    });
    spacing
}

/// Frees a cloud, not the points; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_cloud_free(cloud: Option<Box<surfsig_cloud>>) {
    drop(cloud);
}

/// The cloud that a function needs.
pub(crate) fn given(cloud: Option<&surfsig_cloud>) -> Result<&surfsig_cloud, Failure> {
    present(cloud, "cloud")
}
