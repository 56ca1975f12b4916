//! One surface fitted to points by orthogonal distance.

use crate::arrays::{present, put, put_new, room};
use crate::cloud::{given, surfsig_cloud};
use crate::code::{Failure, guarded, surfsig_code};
use crate::kind::{kind_of, surfsig_surface_kind};
use crate::primitive_options::{surfsig_primitive_options, surfsig_primitive_options_set_start};
use surfsig::{Primitive, SurfaceKind, fit_primitive_with, with_threads};

/// A plane, sphere, cylinder, cone or torus without a boundary, a circle or a line. Made by surfsig_fit_primitive(),
/// freed by surfsig_primitive_free(). It refers to nothing of the caller's.
pub struct surfsig_primitive {
    fitted: Primitive,
    point: [f64; 3],
    axis: [f64; 3],
}

impl surfsig_primitive {
    pub(crate) fn fitted(&self) -> Primitive {
        self.fitted
    }
}

/// Fits a surface to points: the sum of squared orthogonal distances is least.
///
/// SURFSIG_CODE_UNDETERMINED where the points are no more than the surface's parameters, do not determine all of them
/// (those of a circle no sphere), or are not all finite.
///
/// @param cloud The points.
/// @param kind A surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT.
/// @param start A surface of the same kind near the points, from which the fit begins; null to begin from what the
/// points tell.
/// @param primitive Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_fit_primitive(
    cloud: Option<&surfsig_cloud>,
    kind: u8,
    start: Option<&surfsig_primitive>,
    primitive: *mut *mut surfsig_primitive,
) -> surfsig_code {
    let mut options = surfsig_primitive_options::default();
    surfsig_primitive_options_set_start(Some(&mut options), start);
    // SAFETY: the conditions are the same.
    unsafe { surfsig_fit_primitive_with(cloud, kind, Some(&options), primitive) }
}

/// Fits a surface of which something is known, or to points that do not count alike: the sum of weighted squared
/// orthogonal distances is least.
///
/// SURFSIG_CODE_UNDETERMINED as for surfsig_fit_primitive(); points without weight do not count.
///
/// @param cloud The points.
/// @param kind A surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT.
/// @param options What is known; null for nothing.
/// @param primitive Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_fit_primitive_with(
    cloud: Option<&surfsig_cloud>,
    kind: u8,
    options: Option<&surfsig_primitive_options>,
    primitive: *mut *mut surfsig_primitive,
) -> surfsig_code {
    let made = || {
        let (cloud, kind) = (given(cloud)?, kind_of(kind)?);
        let (positions, nothing) = (cloud.positions(), surfsig_primitive_options::default());
        let options = options.unwrap_or(&nothing).of(kind, positions.len())?;
        let found = with_threads(None, || fit_primitive_with(&positions, kind, &options))?;
        let fitted = found.ok_or_else(|| Failure::undetermined(kind.name()))?;
        Ok(surfsig_primitive { fitted, point: fitted.point(), axis: fitted.axis() })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(primitive, "primitive", made) })
}

/// Frees a surface; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_free(primitive: Option<Box<surfsig_primitive>>) {
    drop(primitive);
}

/// What it is; SURFSIG_SURFACE_KIND_PLANE for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_kind(primitive: Option<&surfsig_primitive>) -> surfsig_surface_kind {
    match primitive.map(|primitive| primitive.fitted.kind()) {
        None | Some(SurfaceKind::Plane) => surfsig_surface_kind::Plane,
        Some(SurfaceKind::Sphere) => surfsig_surface_kind::Sphere,
        Some(SurfaceKind::Cylinder) => surfsig_surface_kind::Cylinder,
        Some(SurfaceKind::Cone) => surfsig_surface_kind::Cone,
        Some(SurfaceKind::Torus) => surfsig_surface_kind::Torus,
        Some(SurfaceKind::Circle) => surfsig_surface_kind::Circle,
        Some(SurfaceKind::Line) => surfsig_surface_kind::Line,
    }
}

/// On the plane or the axis, next to the mean of the points; the centre of a sphere or torus: 3 doubles, which live as
/// long as the surface; null for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_point(primitive: Option<&surfsig_primitive>) -> *const f64 {
    primitive.map_or(std::ptr::null(), |primitive| primitive.point.as_ptr())
}

/// Unit vector, 3 doubles: a plane's normal, the axis of all others; with a positive z (else y, else x), but along a
/// cone its radius grows. NaN for a sphere; null for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_axis(primitive: Option<&surfsig_primitive>) -> *const f64 {
    primitive.map_or(std::ptr::null(), |primitive| primitive.axis.as_ptr())
}

/// Of a sphere, cylinder or circle; of a cone at its point; of a torus's tube; NaN for a plane, a line and for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_radius(primitive: Option<&surfsig_primitive>) -> f64 {
    primitive.map_or(f64::NAN, |primitive| primitive.fitted.radius())
}

/// Of a torus, from the axis to the middle of the tube; NaN for others and for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_major_radius(primitive: Option<&surfsig_primitive>) -> f64 {
    primitive.map_or(f64::NAN, |primitive| primitive.fitted.major_radius())
}

/// Half the angle at a cone's apex, in radians; NaN for others and for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_half_angle(primitive: Option<&surfsig_primitive>) -> f64 {
    primitive.map_or(f64::NAN, |primitive| primitive.fitted.half_angle())
}

/// Measures how far points are from a surface.
///
/// @param primitive The surface.
/// @param cloud The points.
/// @param distances Where the signed distances are put, (surfsig_cloud_size()) doubles: positive outside, or where a
/// plane's normal points; NaN for points that are not finite.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_primitive_distances(
    primitive: Option<&surfsig_primitive>,
    cloud: Option<&surfsig_cloud>,
    distances: *mut f64,
) -> surfsig_code {
    guarded(|| {
        let primitive = present(primitive, "primitive")?;
        let positions = given(cloud)?.positions();
        // SAFETY: the caller gives room for as many distances as points.
        let room = unsafe { room(distances, positions.len(), "distances") }?;
        room.copy_from_slice(&primitive.fitted.distances(&positions));
        Ok(())
    })
}

/// Says how sure a surface's parameters are, from blocks of neighbouring points, for those of a scanner err alike.
///
/// @param primitive The surface.
/// @param cloud The points that it was fitted to.
/// @param covariance Where the covariance is put, row by row: (p, p) doubles, with p and the parameters as
/// surfsig_surface_kind_parameters() says, so that 49 are enough for all; NaN where one block of the points is all that
/// determines some.
/// @param across Where two unit vectors across the axis are put, (2, 3) doubles; null if nobody asks.
/// @param freedom Where the degrees of freedom of the radius's variance (a plane's: of the offset's) are put, for
/// Student's t; null if nobody asks.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_primitive_uncertainty(
    primitive: Option<&surfsig_primitive>,
    cloud: Option<&surfsig_cloud>,
    covariance: *mut f64,
    across: *mut f64,
    freedom: *mut f64,
) -> surfsig_code {
    // SAFETY: the conditions are the same.
    unsafe { surfsig_primitive_uncertainty_with(primitive, cloud, None, covariance, across, freedom) }
}

/// The same of a surface that surfsig_fit_primitive_with() fitted: what it kept has no variance and no covariance.
///
/// @param primitive The surface.
/// @param cloud The points that it was fitted to.
/// @param options Those of the fit; null for none. The start means nothing here.
/// @param covariance As for surfsig_primitive_uncertainty().
/// @param across As for surfsig_primitive_uncertainty().
/// @param freedom As for surfsig_primitive_uncertainty().
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_primitive_uncertainty_with(
    primitive: Option<&surfsig_primitive>,
    cloud: Option<&surfsig_cloud>,
    options: Option<&surfsig_primitive_options>,
    covariance: *mut f64,
    across: *mut f64,
    freedom: *mut f64,
) -> surfsig_code {
    guarded(|| {
        let primitive = present(primitive, "primitive")?;
        let (positions, nothing) = (given(cloud)?.positions(), surfsig_primitive_options::default());
        let options = options.unwrap_or(&nothing).of(primitive.fitted.kind(), positions.len())?;
        let found = primitive.fitted.uncertainty_with(&positions, &options);
        // SAFETY: the caller gives room for the rows of the covariance.
        let room = unsafe { room(covariance, found.covariance.len(), "covariance") }?;
        room.copy_from_slice(&found.covariance);
        if !across.is_null() {
            // SAFETY: the caller gives room for two vectors.
            unsafe { put(across.cast(), found.across, "across") }?;
        }
        if !freedom.is_null() {
            // SAFETY: the caller gives room for a number.
            unsafe { put(freedom, found.freedom, "freedom") }?;
        }
        Ok(())
    })
}

/// The standard error of a surface's radius (of a plane's offset) that the points' number promises if none err alike;
/// NaN where they do not determine the surface, and for null.
///
/// @param primitive The surface.
/// @param cloud The points that it was fitted to.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_independent_error(
    primitive: Option<&surfsig_primitive>,
    cloud: Option<&surfsig_cloud>,
) -> f64 {
    let mut error = f64::NAN;
    guarded(|| {
        error = present(primitive, "primitive")?.fitted.independent_error(&given(cloud)?.positions());
        Ok(())
    });
    error
}
