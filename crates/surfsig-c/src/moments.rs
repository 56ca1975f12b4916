//! Surfaces read off moments: a sphere, a cylinder, a general quadric.

use crate::arrays::{array, numbers, position, present, put, room};
use crate::cloud::{given, surfsig_cloud};
use crate::code::{Failure, guarded, surfsig_code};
use surfsig::{MOMENTS, Moments, Quadric, fit_cylinder, fit_quadric, fit_sphere};

/// Numbers of a set of moments.
pub const SURFSIG_MOMENTS: usize = 35;
const _: () = assert!(SURFSIG_MOMENTS == MOMENTS);

/// A sphere, in the coordinates of the moments.
#[repr(C)]
pub struct surfsig_sphere {
    /// x, y, z of the centre.
    pub centre: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// Root mean square of the points' distances, to first order.
    pub residual: f64,
}

/// A cylinder, in the coordinates of the moments.
#[repr(C)]
pub struct surfsig_cylinder {
    /// Unit vector along the axis; the sign means nothing.
    pub axis: [f64; 3],
    /// The point of the axis next to the points' mean.
    pub centre: [f64; 3],
    /// Radius.
    pub radius: f64,
    /// Root mean square of the points' distances, to first order.
    pub residual: f64,
}

/// The surface Q = 0 of a polynomial of second degree, in the coordinates of the moments.
#[repr(C)]
pub struct surfsig_quadric {
    /// Of 1, x, y, z, xx, xy, xz, yy, yz, zz. The mean square of the gradient over the points is 1, so that Q is about
    /// the distance from the surface.
    pub coefficients: [f64; 10],
    /// Root mean square of the points' distances, to first order.
    pub residual: f64,
    /// By how much the next best quadric's mean square exceeds this one's, less where points are few. Below 4, as on a
    /// plane, the points do not tell which quadric they lie on.
    pub gap: f64,
    /// Root mean square of the points' distances from their mean.
    pub extent: f64,
}

/// What a surface is at one of its points.
#[repr(C)]
pub struct surfsig_surface_point {
    /// Where it is.
    pub position: [f64; 3],
    /// Unit normal, along the gradient of Q.
    pub normal: [f64; 3],
    /// Larger principal curvature; positive where the surface falls away from the normal.
    pub k1: f64,
    /// Smaller principal curvature.
    pub k2: f64,
    /// Unit tangent along k1; the sign means nothing.
    pub direction: [f64; 3],
}

/// Sums x^i y^j z^k with i + j + k <= 4 over points, from which surfaces are read off. The moments of two sets of
/// points about one centre add, number by number. Points that are not finite are left out.
///
/// @param cloud The points.
/// @param centre x, y, z, finite, that are taken from each point before: near the points, for digits are lost with the
/// fourth power of its distance over their extent. Null for 0, 0, 0.
/// @param moments Where the sums are put, SURFSIG_MOMENTS doubles, by order, and within an order as 1, x, y, z are
/// multiplied out: 1, x, y, z, xx, xy, xz, yy, yz, zz, xxx, ...
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_moments(
    cloud: Option<&surfsig_cloud>,
    centre: *const f64,
    moments: *mut f64,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives room for the sums.
        let sums = unsafe { room(moments, MOMENTS, "moments") }?;
        // SAFETY: the caller gives three numbers, or null.
        let centre = unsafe { position(centre, "centre") }?.unwrap_or_default();
        let cloud = given(cloud)?.view();
        let positions = (0..cloud.len()).filter_map(|i| cloud.position(i));
        let local: Vec<[f64; 3]> = positions.map(|p| [0, 1, 2].map(|axis| p[axis] - centre[axis])).collect();
        sums.copy_from_slice(&Moments::<f64>::of_points(&local).sums);
        Ok(())
    })
}

/// Fits a sphere with Taubin's normalisation: exact on points of a sphere, and hardly biased by noise.
///
/// SURFSIG_CODE_UNDETERMINED for fewer than 4 points, for points of a circle, and for a plane.
///
/// @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
/// @param sphere Where the result is put, in coordinates about that centre.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_fit_sphere(
    moments: *const f64,
    sphere: *mut surfsig_sphere,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives the sums.
        let moments = unsafe { given_moments(moments) }?;
        let surfsig::Sphere { centre, radius, residual } =
            fit_sphere(&moments).ok_or_else(|| Failure::undetermined("sphere"))?;
        // SAFETY: the caller gives room for a sphere, or null.
        unsafe { put(sphere, surfsig_sphere { centre, radius, residual }, "sphere") }
    })
}

/// Fits a cylinder with Taubin's normalisation: exact on points of a cylinder, and hardly biased by noise.
///
/// SURFSIG_CODE_UNDETERMINED for fewer than 5 points, for points of a plane, and where no axis converges.
///
/// @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
/// @param cylinder Where the result is put, in coordinates about that centre.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_fit_cylinder(
    moments: *const f64,
    cylinder: *mut surfsig_cylinder,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives the sums.
        let moments = unsafe { given_moments(moments) }?;
        let surfsig::Cylinder { axis, centre, radius, residual } =
            fit_cylinder(&moments).ok_or_else(|| Failure::undetermined("cylinder"))?;
        // SAFETY: the caller gives room for a cylinder, or null.
        unsafe { put(cylinder, surfsig_cylinder { axis, centre, radius, residual }, "cylinder") }
    })
}

/// Fits a general quadric with Taubin's normalisation: exact on points that lie on a quadric.
///
/// SURFSIG_CODE_UNDETERMINED for fewer than 9 points, and where the fit does not converge.
///
/// @param moments SURFSIG_MOMENTS doubles, about a centre near the points.
/// @param quadric Where the result is put, in coordinates about that centre.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_fit_quadric(
    moments: *const f64,
    quadric: *mut surfsig_quadric,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives the sums.
        let moments = unsafe { given_moments(moments) }?;
        let Quadric { coefficients, residual, gap, extent } =
            fit_quadric(&moments).ok_or_else(|| Failure::undetermined("quadric"))?;
        // SAFETY: the caller gives room for a quadric, or null.
        unsafe { put(quadric, surfsig_quadric { coefficients, residual, gap, extent }, "quadric") }
    })
}

/// Says what a quadric's surface is where it is nearest to a position.
///
/// SURFSIG_CODE_UNDETERMINED where no point of the surface is the nearest, as from a sphere's centre.
///
/// @param quadric The quadric, with an extent above 0.
/// @param from x, y, z of the position, finite.
/// @param point Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_quadric_nearest(
    quadric: *const surfsig_quadric,
    from: *const f64,
    point: *mut surfsig_surface_point,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives a quadric and three numbers, or null.
        let (quadric, from) = unsafe { (array(quadric, 1, "quadric")?, position(from, "from")?) };
        let from = present(from, "from")?;
        let surfsig_quadric { coefficients, residual, gap, extent } = quadric[0];
        let surfsig::SurfacePoint { position, normal, k1, k2, direction } =
            Quadric { coefficients, residual, gap, extent }
                .nearest(from)
                .ok_or_else(|| Failure::undetermined("nearest point"))?;
        // SAFETY: the caller gives room for a point, or null.
        unsafe { put(point, surfsig_surface_point { position, normal, k1, k2, direction }, "point") }
    })
}

/// # Safety
/// `moments` is null or points to as many numbers as there are moments.
unsafe fn given_moments(moments: *const f64) -> Result<Moments<f64>, Failure> {
    // SAFETY: the condition is the same.
    let sums = unsafe { numbers::<MOMENTS>(moments) };
    Ok(Moments { sums: present(sums, "moments")? })
}
