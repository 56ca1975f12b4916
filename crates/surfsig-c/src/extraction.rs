//! Extraction, and the columns that it gives.

use crate::arrays::points;
use crate::code::{Failure, guarded, surfsig_code};
use crate::options::{position, surfsig_options};
use crate::status::surfsig_status;
use std::borrow::Cow;
use surfsig::{Extraction, Monitor, Offsets, PointCloud, Radius, extract_monitored};

/// What an extraction gives: columns of one length, in the order of the places. Made by
/// surfsig_extract_f32() or surfsig_extract_f64(), freed by surfsig_extraction_free(). It refers to
/// nothing of the caller's.
pub struct surfsig_extraction {
    pub found: Extraction,
    /// Threads for what is made from it later.
    pub threads: Option<usize>,
}

/// Extracts curvature from the points within a radius; eq. (5) of the paper, and from it k1 and k2.
///
/// Points that are not finite belong to no ball and get SURFSIG_STATUS_NOT_FINITE. No point at all gives an
/// extraction of size 0.
///
/// @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of points.
/// @param stride Bytes from one point's x to the next one's, at least 12: 12 for packed coordinates, which
/// are used where they are; sizeof(pcl::PointXYZ) and the like otherwise, and the coordinates are copied.
/// @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
/// @param radius Radius of the ball around each place, in the cloud's unit; finite and above 0.
/// @param options How; null for the default.
/// @param extraction Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract_f32(
    points: *const f32,
    count: usize,
    stride: usize,
    origin: *const f64,
    radius: f64,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
) -> surfsig_code {
    // SAFETY: the conditions are the same.
    unsafe { extract(points, count, stride, origin, radius, options, extraction, |rows| Offsets::F32(rows)) }
}

/// Extracts curvature from points in double precision, as surfsig_extract_f32() does; the stride is at
/// least 24 bytes.
///
/// @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of points.
/// @param stride Bytes from one point's x to the next one's.
/// @param origin x, y, z that are added to each point, finite; null for 0, 0, 0.
/// @param radius Radius of the ball around each place, in the cloud's unit; finite and above 0.
/// @param options How; null for the default.
/// @param extraction Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract_f64(
    points: *const f64,
    count: usize,
    stride: usize,
    origin: *const f64,
    radius: f64,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
) -> surfsig_code {
    // SAFETY: the conditions are the same.
    unsafe { extract(points, count, stride, origin, radius, options, extraction, |rows| Offsets::F64(rows)) }
}

/// # Safety
/// `first` is null or points to `count` points, `stride` bytes apart; `origin` is null or points to three
/// numbers; `extraction` is null or points to where a pointer can be written.
#[expect(clippy::too_many_arguments, reason = "those of the C functions")]
unsafe fn extract<T: Copy>(
    first: *const T,
    count: usize,
    stride: usize,
    origin: *const f64,
    radius: f64,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
    offsets: impl Fn(&[[T; 3]]) -> Offsets<'_>,
) -> surfsig_code {
    guarded(|| {
        if extraction.is_null() {
            return Err(Failure::invalid_input("extraction must not be null"));
        }
        // SAFETY: not null, and the caller's to be written; what stood there may have had no value.
        unsafe { extraction.write(std::ptr::null_mut()) };
        let radius = Radius::new(radius)?;
        // SAFETY: the caller's condition.
        let rows: Cow<'_, [[T; 3]]> = unsafe { points(first, count, stride) }?;
        // SAFETY: the caller's condition.
        let origin = unsafe { position(origin, "origin") }?.unwrap_or_default();
        let default = surfsig_options::default();
        let options = options.unwrap_or(&default);
        let cloud = PointCloud { offsets: offsets(&rows), origin };
        let monitor = Monitor::default();
        let found = extract_monitored(&cloud, radius, &options.queries(), &options.extract, &monitor)?;
        let made = Box::new(surfsig_extraction { found, threads: options.extract.threads });
        // SAFETY: as above.
        unsafe { extraction.write(Box::into_raw(made)) };
        Ok(())
    })
}

/// Frees an extraction and its columns; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_free(extraction: Option<Box<surfsig_extraction>>) {
    drop(extraction);
}

/// Number of places, which is the length of each column; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_size(extraction: Option<&surfsig_extraction>) -> usize {
    extraction.map_or(0, |extraction| extraction.found.len())
}

/// A column's first entry; null for an empty one, or where there is no extraction.
fn column<T, R>(extraction: Option<&surfsig_extraction>, of: impl Fn(&Extraction) -> &[T]) -> *const R {
    let column = extraction.map_or(&[][..], |extraction| of(&extraction.found));
    if column.is_empty() { std::ptr::null() } else { column.as_ptr().cast() }
}

/// Larger principal curvature by value, (size) floats per unit of length; a bump seen from the sensor is
/// positive. Like every column it lives as long as the extraction; null where that is empty or null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_k1(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.k1)
}

/// Smaller principal curvature by value, (size) floats per unit of length.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_k2(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.k2)
}

/// Unit normals of the fitted surface, towards the sensor: (size, 3) floats, row by row.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_normals(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.normals)
}

/// Unit tangents along k1, (size, 3) floats, row by row; the sign means nothing.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_directions(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.directions)
}

/// Root mean square of the points' heights above the fit, (size) floats.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_residual(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.residual)
}

/// How much, at least, the worst determined coefficient suffers from the points' arrangement, (size)
/// floats: the factor on its standard error, 1 for not at all, about 1.5 on a full disc.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_condition(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.condition)
}

/// Points in the ball, the place itself included, (size) numbers.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_count(extraction: Option<&surfsig_extraction>) -> *const u32 {
    column(extraction, |found| &found.count)
}

/// What became of each place, (size) bytes.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_status(
    extraction: Option<&surfsig_extraction>,
) -> *const surfsig_status {
    column(extraction, |found| &found.status)
}

/// (l1 - l2) / l1 of the covariance's eigenvalues, (size) floats: 1 on a line.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_linearity(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.linearity)
}

/// (l2 - l3) / l1, (size) floats: 1 on a plane.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_planarity(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.planarity)
}

/// l3 / l1, (size) floats: 1 in a volume.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_scattering(extraction: Option<&surfsig_extraction>) -> *const f32 {
    column(extraction, |found| &found.scattering)
}
