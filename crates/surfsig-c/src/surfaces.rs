//! The surfaces of a scan, and the columns that describe them.

use crate::arrays::put_new;
use crate::cloud::{given, surfsig_cloud};
use crate::code::{guarded, surfsig_code};
use crate::surface_options::surfsig_surface_options;
use surfsig::{FoundSurface, SurfaceKind, find_surfaces};

/// The surfaces of a scan, the one with most points first: columns of one length, and for each point of the cloud the
/// number of its surface. Made by surfsig_find_surfaces(), freed by surfsig_surfaces_free(). It refers to nothing of
/// the caller's.
pub struct surfsig_surfaces {
    columns: SurfaceColumns,
    covariances: Vec<Vec<f64>>,
    labels: Vec<i32>,
}

/// Finds the planes, spheres, cylinders, cones and tori of a scan.
///
/// Surfaces grow from the smoothest points on, over neighbouring points that are within the noise around them; the
/// simplest kind that explains its points wins. The result is always the same.
///
/// @param cloud The points.
/// @param options How; null for the default.
/// @param surfaces Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_find_surfaces(
    cloud: Option<&surfsig_cloud>,
    options: Option<&surfsig_surface_options>,
    surfaces: *mut *mut surfsig_surfaces,
) -> surfsig_code {
    let made = || {
        let cloud = given(cloud)?.view();
        let default = surfsig_surface_options::default();
        let surfsig_surface_options { search, progress } = options.unwrap_or(&default);
        let found = progress.watched(cloud.len(), |monitor| find_surfaces(&cloud, search, monitor))?;
        let columns = SurfaceColumns::of(&found.surfaces);
        let covariances = found.surfaces.into_iter().map(|surface| surface.covariance).collect();
        Ok(surfsig_surfaces { columns, covariances, labels: found.labels })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(surfaces, "surfaces", made) })
}

/// Frees surfaces and their columns; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surfaces_free(surfaces: Option<Box<surfsig_surfaces>>) {
    drop(surfaces);
}

/// Number of surfaces, which is the length of each column; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surfaces_size(surfaces: Option<&surfsig_surfaces>) -> usize {
    surfaces.map_or(0, |surfaces| surfaces.covariances.len())
}

/// Number of points of the cloud, which is the length of the labels; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surfaces_label_count(surfaces: Option<&surfsig_surfaces>) -> usize {
    surfaces.map_or(0, |surfaces| surfaces.labels.len())
}

/// Of each point of the cloud the number of its surface, or -1, (label count) numbers; null where there is no point.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surfaces_labels(surfaces: Option<&surfsig_surfaces>) -> *const i32 {
    crate::columns::first_entry(surfaces, |surfaces| &surfaces.labels)
}

/// Covariance of a surface's parameters, row by row: (p, p) doubles, with p and the parameters as
/// surfsig_surface_kind_parameters() says. Null where the points do not determine it, and for a surface that is none.
///
/// @param surfaces The surfaces.
/// @param index Number of a surface, from 0.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surfaces_covariance(
    surfaces: Option<&surfsig_surfaces>,
    index: usize,
) -> *const f64 {
    crate::columns::first_entry(surfaces, |surfaces| {
        surfaces.covariances.get(index).map_or(&[], Vec::as_slice)
    })
}

columns_of_rows! {
    SURFACE_COLUMNS of surfsig_surfaces, SurfaceColumns of FoundSurface:
    /// What each surface is, (size) bytes. Like every column it lives as long as the surfaces; null where there are
    /// none.
    surfsig_surfaces_kind: SurfaceKind = |surface| surface.kind;
    /// On the plane or the axis, near the points; the centre of a sphere or torus: (size, 3) doubles, row by row.
    surfsig_surfaces_point: [f64; 3] = |surface| surface.point;
    /// Unit vectors: a plane's normal, the axis of all others, along which a cone widens, (size, 3) doubles; NaN for a
    /// sphere.
    surfsig_surfaces_axis: [f64; 3] = |surface| surface.axis;
    /// Of a sphere or cylinder, of a cone at its point, of a torus's tube, (size) doubles; NaN for a plane.
    surfsig_surfaces_radius: f64 = |surface| surface.radius;
    /// Of a torus, from its axis to the middle of its tube, (size) doubles; NaN for others.
    surfsig_surfaces_major_radius: f64 = |surface| surface.major_radius;
    /// Of a cone, between its axis and its side, in radians, (size) doubles; NaN for others.
    surfsig_surfaces_half_angle: f64 = |surface| surface.half_angle;
    /// Standard deviation of a point's distance, (size) doubles.
    surfsig_surfaces_deviation: f64 = |surface| surface.deviation;
    /// Number of points, (size) numbers.
    surfsig_surfaces_count: u32 = |surface| surface.count as u32;
    /// Standard error of the radius, (size) doubles; NaN where the points do not determine it.
    surfsig_surfaces_radius_std: f64 = |surface| surface.radius_std;
    /// Standard error of the major radius, (size) doubles.
    surfsig_surfaces_major_radius_std: f64 = |surface| surface.major_radius_std;
    /// Standard error of the half angle, (size) doubles.
    surfsig_surfaces_half_angle_std: f64 = |surface| surface.half_angle_std;
    /// Two unit vectors across the axis, along which the covariance counts offsets and tilts, (size, 2, 3) doubles.
    surfsig_surfaces_across: [[f64; 3]; 2] = |surface| surface.across;
    /// Degrees of freedom behind the standard errors, for Student's t, (size) doubles.
    surfsig_surfaces_freedom: f64 = |surface| surface.freedom;
}
