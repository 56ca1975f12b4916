//! Extraction, and the columns that it gives.

use crate::arrays::{array, put_new, room};
use crate::cloud::{given, surfsig_cloud};
use crate::code::{Failure, guarded, surfsig_code};
use crate::options::{Prepared, surfsig_options};
use std::sync::Arc;
use surfsig::{
    ExtractOptions, Extraction, FitUsed, Monitor, Neighborhood, PointCloud, Queries, Radius, Status,
    extract_auto_radius, extract_monitored, extract_radii,
};

/// What an extraction gives: columns of one length, in the order of the queries. Made by surfsig_extract() and the
/// like, freed by surfsig_extraction_free(). It refers to nothing of the caller's.
pub struct surfsig_extraction {
    pub(crate) found: Extraction,
    /// Numbers of the queries in the cloud; empty where these are all of its points, or none of them.
    indices: Arc<[u32]>,
    /// Threads for what is made from it later.
    pub(crate) threads: Option<usize>,
}

/// Extracts curvature from the points within a radius; eq. (5) of the paper, and from it k1 and k2.
///
/// A cloud without points gives an extraction of size 0.
///
/// @param cloud The points.
/// @param radius Radius of the ball around each query, in the cloud's unit; finite and above 0.
/// @param options How, and at which queries; null for the default: at every point.
/// @param extraction Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract(
    cloud: Option<&surfsig_cloud>,
    radius: f64,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
) -> surfsig_code {
    let made = || {
        let radius = Radius::new(radius)?;
        let around = match options.and_then(|options| options.neighbors) {
            None => Neighborhood::Ball(radius),
            Some(most) => Neighborhood::Hybrid { radius, most },
        };
        one_extraction(cloud, options, |task, monitor| {
            extract_monitored(task.cloud, around, &task.queries, &task.options, monitor)
        })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(extraction, "extraction", made) })
}

/// Extracts curvature from the nearest points of each query, as surfsig_extract() does.
///
/// @param cloud The points.
/// @param neighbors How many, the query itself included where it is a point of the cloud; at least 1.
/// @param options How, and at which queries; null for the default.
/// @param extraction Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract_nearest(
    cloud: Option<&surfsig_cloud>,
    neighbors: u32,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
) -> surfsig_code {
    let made = || {
        without_neighbors(options)?;
        let nearest = Neighborhood::Nearest(neighbors as usize);
        one_extraction(cloud, options, |task, monitor| {
            extract_monitored(task.cloud, nearest, &task.queries, &task.options, monitor)
        })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(extraction, "extraction", made) })
}

/// Extracts curvature from balls whose radius each query chooses, as surfsig_extract() does: of the radii 2^(i/2), in
/// the cloud's unit, the largest that the fit still explains. In the surface's axes only.
///
/// @param cloud The points.
/// @param options How, and at which queries; null for the default.
/// @param extraction Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract_auto_radius(
    cloud: Option<&surfsig_cloud>,
    options: Option<&surfsig_options>,
    extraction: *mut *mut surfsig_extraction,
) -> surfsig_code {
    let made = || {
        without_neighbors(options)?;
        one_extraction(cloud, options, |task, monitor| {
            extract_auto_radius(task.cloud, &task.queries, &task.options, monitor)
        })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(extraction, "extraction", made) })
}

/// Extracts curvature from balls of several radii, in one pass over the points. Values differ from those of
/// surfsig_extract() with one radius by rounding only.
///
/// @param cloud The points.
/// @param radii Radii of the balls, (count), in the cloud's unit; each finite and above 0.
/// @param count How many; 0 does nothing.
/// @param options How, and at which queries; null for the default.
/// @param extractions Where the results are put, (count), one for each radius in their order, each to be freed; null
/// is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_extract_radii(
    cloud: Option<&surfsig_cloud>,
    radii: *const f64,
    count: usize,
    options: Option<&surfsig_options>,
    extractions: *mut *mut surfsig_extraction,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives room for `count` pointers, and `count` radii.
        let results = unsafe { room(extractions, count, "extractions") }?;
        // SAFETY: as above.
        let radii = unsafe { array(radii, count, "radii") }?;
        without_neighbors(options)?;
        let radii = radii.iter().map(|&radius| Radius::new(radius)).collect::<Result<Vec<_>, _>>()?;
        let made = extractions_of(cloud, options, radii.len(), |task, monitor| {
            extract_radii(task.cloud, &radii, &task.queries, &task.options, monitor)
        })?;
        for (result, made) in results.iter_mut().zip(made) {
            *result = Box::into_raw(Box::new(made));
        }
        Ok(())
    })
}

/// What an extraction is asked for.
struct Task<'a> {
    cloud: &'a PointCloud<'a>,
    queries: Queries<'a>,
    options: ExtractOptions<'a>,
}

/// An error where options say something that is for surfsig_extract() alone.
fn without_neighbors(options: Option<&surfsig_options>) -> Result<(), Failure> {
    match options.and_then(|options| options.neighbors) {
        None => Ok(()),
        Some(_) => Err(Failure::invalid_input("options with neighbors are for surfsig_extract() only")),
    }
}

/// The one extraction of some work.
fn one_extraction(
    cloud: Option<&surfsig_cloud>,
    options: Option<&surfsig_options>,
    work: impl FnOnce(&Task<'_>, &Monitor) -> Result<Extraction, surfsig::Error> + Send,
) -> Result<surfsig_extraction, Failure> {
    let work = |task: &Task<'_>, monitor: &Monitor| Ok(vec![work(task, monitor)?]);
    Ok(extractions_of(cloud, options, 1, work)?.swap_remove(0))
}

/// The extractions of some work, watched. The monitor counts each query so many times.
fn extractions_of(
    cloud: Option<&surfsig_cloud>,
    options: Option<&surfsig_options>,
    times: usize,
    work: impl FnOnce(&Task<'_>, &Monitor) -> Result<Vec<Extraction>, surfsig::Error> + Send,
) -> Result<Vec<surfsig_extraction>, Failure> {
    let cloud = given(cloud)?.view();
    let default = surfsig_options::default();
    let options = options.unwrap_or(&default);
    let prepared: Prepared<'_> = options.prepared(&cloud)?;
    let task = Task { cloud: &cloud, queries: prepared.queries(), options: prepared.options() };
    let total = times * task.queries.len(&cloud);
    let found = options.progress.watched(total, |monitor| work(&task, monitor))?;
    let indices: Arc<[u32]> = prepared.indices.into();
    let threads = options.threads;
    Ok(found
        .into_iter()
        .map(|found| surfsig_extraction { found, indices: Arc::clone(&indices), threads })
        .collect())
}

/// Frees an extraction and its columns; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_free(extraction: Option<Box<surfsig_extraction>>) {
    drop(extraction);
}

/// Number of queries, which is the length of each column; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_size(extraction: Option<&surfsig_extraction>) -> usize {
    extraction.map_or(0, |extraction| extraction.found.len())
}

/// Radius of the balls; of nearest neighbours and of radii that queries chose, of the largest ball that was looked
/// through. NaN for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_radius(extraction: Option<&surfsig_extraction>) -> f64 {
    extraction.map_or(f64::NAN, |extraction| extraction.found.radius)
}

/// 1 where a viewpoint or normals say on which side the sensor was; 0 where the side of each normal, and with it the
/// sign of curvature, is a convention, and for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_extraction_oriented(extraction: Option<&surfsig_extraction>) -> std::ffi::c_int {
    extraction.is_some_and(|extraction| extraction.found.oriented).into()
}

columns! {
    EXTRACTION_COLUMNS of surfsig_extraction:
    /// Larger principal curvature by value, (size) floats per unit of length; a bump seen from the sensor is
    /// positive. Like every column it lives as long as the extraction; null where that is empty or null.
    surfsig_extraction_k1: f32 = |result| &result.found.k1;
    /// Smaller principal curvature by value, (size) floats per unit of length.
    surfsig_extraction_k2: f32 = |result| &result.found.k2;
    /// Unit normals of the fitted surface, towards the sensor: (size, 3) floats, row by row.
    surfsig_extraction_normals: [f32; 3] = |result| &result.found.normals;
    /// Unit tangents along k1, (size, 3) floats, row by row; the sign means nothing.
    surfsig_extraction_directions: [f32; 3] = |result| &result.found.directions;
    /// Root mean square of the points' distances from the fit along its height, (size) floats.
    surfsig_extraction_residual: f32 = |result| &result.found.residual;
    /// How much, at least, the worst determined coefficient suffers from the points' arrangement, (size)
    /// floats: the factor on its standard error, 1 for not at all, about 1.5 on a full disc.
    surfsig_extraction_condition: f32 = |result| &result.found.condition;
    /// Standard error of (k1 + k2) / 2, (size) floats; NaN in the sensor's axes and where no more than six
    /// points are in the ball.
    surfsig_extraction_mean_curvature_std: f32 = |result| &result.found.mean_curvature_std;
    /// Standard error of k1, (size) floats; right where k1 and k2 differ significantly.
    surfsig_extraction_k1_std: f32 = |result| &result.found.k1_std;
    /// Standard error of k2, (size) floats.
    surfsig_extraction_k2_std: f32 = |result| &result.found.k2_std;
    /// Points in the ball, the query itself included where it is one of them, (size) numbers.
    surfsig_extraction_count: u32 = |result| &result.found.count;
    /// What became of each query, (size) bytes.
    surfsig_extraction_status: Status = |result| &result.found.status;
    /// (l1 - l2) / l1 of the covariance's eigenvalues, (size) floats: 1 on a line.
    surfsig_extraction_linearity: f32 = |result| &result.found.linearity;
    /// (l2 - l3) / l1, (size) floats: 1 on a plane.
    surfsig_extraction_planarity: f32 = |result| &result.found.planarity;
    /// l3 / l1, (size) floats: 1 in a volume.
    surfsig_extraction_scattering: f32 = |result| &result.found.scattering;
    /// Radius of each query's neighbourhood, (size) floats: of nearest neighbours the distance to the farthest, or
    /// the radius that the query chose. Null where all have the same, surfsig_extraction_radius().
    surfsig_extraction_radii: f32 = |result| &result.found.radii;
    /// Whose curvature each query has, (size) bytes. Null where only paraboloids were fitted.
    surfsig_extraction_fit_used: FitUsed = |result| &result.found.fit_used;
    /// a, b, c, d, e, f of eq. (5) about each query, (size, 6) floats, row by row, with heights that grow away from
    /// the sensor. Null in the surface's axes.
    surfsig_extraction_coefficients: [f32; 6] = |result| &result.found.coefficients;
    /// Numbers of the queries in the cloud, (size). Null where the queries are all points in their order, or
    /// positions.
    surfsig_extraction_indices: u32 = |result| &result.indices;
}
