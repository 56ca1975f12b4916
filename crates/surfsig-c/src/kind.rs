//! Kinds of surfaces and curves, as C sees them.

use crate::code::Failure;
use std::ffi::{CString, c_char};
use std::sync::LazyLock;
use surfsig::SurfaceKind;

/// What a surface is, or a curve.
#[repr(u8)]
pub enum surfsig_surface_kind {
    /// A plane.
    Plane = 0,
    /// A sphere.
    Sphere = 1,
    /// A circular cylinder.
    Cylinder = 2,
    /// A circular cone, one nappe of it.
    Cone = 3,
    /// A torus.
    Torus = 4,
    /// A circle in space: only surfsig_fit_primitive() takes it.
    Circle = 5,
    /// A straight line: only surfsig_fit_primitive() takes it.
    Line = 6,
}

// Columns of the core's kinds are handed out as they are: the numbers must be the same.
const _: () = {
    assert!(SurfaceKind::ALL.len() == 5);
    assert!(surfsig_surface_kind::Plane as u8 == SurfaceKind::Plane as u8);
    assert!(surfsig_surface_kind::Sphere as u8 == SurfaceKind::Sphere as u8);
    assert!(surfsig_surface_kind::Cylinder as u8 == SurfaceKind::Cylinder as u8);
    assert!(surfsig_surface_kind::Cone as u8 == SurfaceKind::Cone as u8);
    assert!(surfsig_surface_kind::Torus as u8 == SurfaceKind::Torus as u8);
    assert!(surfsig_surface_kind::Circle as u8 == SurfaceKind::Circle as u8);
    assert!(surfsig_surface_kind::Line as u8 == SurfaceKind::Line as u8);
};

static NAMES: LazyLock<Vec<CString>> = LazyLock::new(|| {
    let names = SurfaceKind::ALL.into_iter().chain(SurfaceKind::CURVES).map(SurfaceKind::name);
    names.map(|name| CString::new(name).expect("a name holds no zero")).collect()
});

/// The kind of a number, which C may have from anywhere.
pub(crate) fn kind_of(number: u8) -> Result<SurfaceKind, Failure> {
    let kind = SurfaceKind::ALL.into_iter().chain(SurfaceKind::CURVES).nth(usize::from(number));
    kind.ok_or_else(|| Failure::invalid_input(format!("kind must be a surfsig_surface_kind, not {number}")))
}

/// The same, but no curve's.
pub(crate) fn surface_kind_of(number: u8) -> Result<SurfaceKind, Failure> {
    let kind = kind_of(number)?;
    if SurfaceKind::CURVES.contains(&kind) {
        return Err(Failure::invalid_input(format!(
            "kinds must be those of surfaces, not a {}",
            kind.name()
        )));
    }
    Ok(kind)
}

/// The name of a surfsig_surface_kind, such as "cylinder"; null for a number that is none. Never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_kind_name(kind: u8) -> *const c_char {
    NAMES.get(usize::from(kind)).map_or(std::ptr::null(), |name| name.as_ptr())
}

/// Number of a surface's parameters, 3 to 7, which its covariance has rows and columns; 0 for a number that is no
/// surfsig_surface_kind.
///
/// In the order of the covariance: a plane's offset along its normal and the normal's tilts; a sphere's centre and
/// radius; of all others the offsets of the point, the tilts of the axis, and then the radius (cylinder), the radius
/// and the half angle (cone), the offset along the axis, the major radius and the tube's radius (torus), the offset
/// along the axis and the radius (circle); a line has no more. Offsets and tilts are along the two directions across the
/// axis.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_kind_parameters(kind: u8) -> usize {
    kind_of(kind).map_or(0, SurfaceKind::parameters)
}
