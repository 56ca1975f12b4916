//! The status of a point, as C sees it.

use std::ffi::{CString, c_char};
use std::sync::LazyLock;
use surfsig::Status;

/// What became of a point. Everything but SURFSIG_STATUS_OK says why values are missing or weak.
#[repr(u8)]
pub enum surfsig_status {
    /// All values are there.
    Ok = 0,
    /// A coordinate of the point is not finite: no values.
    NotFinite = 1,
    /// Fewer than six points in the ball: no curvature; a normal where three points span a plane.
    TooFewPoints = 2,
    /// The points lie on a line, or on a conic, and determine no paraboloid: no curvature.
    Degenerate = 3,
    /// The axes did not converge: the values are those of the last iteration. Typical of edges, corners and
    /// patches that are large against the radius of curvature.
    NotConverged = 4,
    /// The surface is more curved than any atom of the frame: curvature, but no signature.
    OutsideVocabulary = 5,
    /// The points lie mostly on one side, as at the rim of a scan: all values are there, with the standard
    /// errors of such a patch, and a bias where the surface is not a paraboloid.
    OneSided = 6,
    /// Coordinates come in steps too large for the radius: no curvature, and a normal of the points as they are.
    TooCoarse = 7,
}

// Columns of the core's statuses are handed out as they are: the numbers must be the same.
const _: () = {
    assert!(Status::ALL.len() == 8);
    assert!(surfsig_status::Ok as u8 == Status::Ok as u8);
    assert!(surfsig_status::NotFinite as u8 == Status::NotFinite as u8);
    assert!(surfsig_status::TooFewPoints as u8 == Status::TooFewPoints as u8);
    assert!(surfsig_status::Degenerate as u8 == Status::Degenerate as u8);
    assert!(surfsig_status::NotConverged as u8 == Status::NotConverged as u8);
    assert!(surfsig_status::OutsideVocabulary as u8 == Status::OutsideVocabulary as u8);
    assert!(surfsig_status::OneSided as u8 == Status::OneSided as u8);
    assert!(surfsig_status::TooCoarse as u8 == Status::TooCoarse as u8);
};

static NAMES: LazyLock<[CString; Status::ALL.len()]> =
    LazyLock::new(|| Status::ALL.map(|status| CString::new(status.name()).expect("a name holds no zero")));

/// The name of a surfsig_status, such as "too_few_points"; null for a number that is none. Never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_status_name(status: u8) -> *const c_char {
    NAMES.get(usize::from(status)).map_or(std::ptr::null(), |name| name.as_ptr())
}
