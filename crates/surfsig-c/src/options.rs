//! How an extraction is done. The object is opaque, so that it can grow without a new binary interface.

use crate::arrays::array;
use crate::code::{Failure, guarded, surfsig_code};
use std::ffi::c_int;
use surfsig::{ExtractOptions, FitAxes, Queries};

/// Most threads that can be asked for.
const MAX_THREADS: u32 = 1024;

/// In which axes the paraboloid's height is measured.
#[repr(C)]
pub enum surfsig_axes {
    /// The surface's own: results turn with the object, and do not depend on where the sensor stood.
    Surface = 0,
    /// The cloud's, as the paper fits: z runs away from the sensor.
    Sensor = 1,
}

// C may give any number, which an enum of Rust's must not hold.
const SURFACE: c_int = surfsig_axes::Surface as c_int;
const SENSOR: c_int = surfsig_axes::Sensor as c_int;

/// How an extraction is done. Made by surfsig_options_new(), freed by surfsig_options_free().
#[derive(Default)]
pub struct surfsig_options {
    pub extract: ExtractOptions<'static>,
    indices: Option<Vec<u32>>,
}

impl surfsig_options {
    pub fn queries(&self) -> Queries<'_> {
        self.indices.as_deref().map_or(Queries::All, Queries::Indices)
    }
}

/// Makes options of the default values: the surface's axes, no viewpoint, all cores, every point.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_new() -> Box<surfsig_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_free(options: Option<Box<surfsig_options>>) {
    drop(options);
}

/// Chooses the axes in which the paraboloids are fitted.
///
/// @param options The options to change.
/// @param axes A surfsig_axes; any other number is SURFSIG_CODE_INVALID_INPUT.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_axes(
    options: Option<&mut surfsig_options>,
    axes: c_int,
) -> surfsig_code {
    guarded(|| {
        present(options)?.extract.axes = match axes {
            SURFACE => FitAxes::Surface,
            SENSOR => FitAxes::Sensor,
            other => return Err(Failure::invalid_input(format!("axes must be a surfsig_axes, not {other}"))),
        };
        Ok(())
    })
}

/// Says where the sensor stood; normals then point to it, and a bump seen from there has a positive
/// curvature. Without a viewpoint the side of each normal is a convention: its z is positive (in the
/// sensor's axes negative).
///
/// @param options The options to change.
/// @param viewpoint x, y, z in the cloud's coordinates, finite; null for none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_viewpoint(
    options: Option<&mut surfsig_options>,
    viewpoint: *const f64,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives three numbers, or null.
        let viewpoint = unsafe { position(viewpoint, "viewpoint") }?;
        present(options)?.extract.viewpoint = viewpoint;
        Ok(())
    })
}

/// Chooses the number of threads. The result is the same, bit for bit.
///
/// @param options The options to change.
/// @param threads 1 to 1024; 0 for all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_threads(
    options: Option<&mut surfsig_options>,
    threads: u32,
) -> surfsig_code {
    guarded(|| {
        if threads > MAX_THREADS {
            return Err(Failure::invalid_input(format!("threads must be 0 to {MAX_THREADS}, not {threads}")));
        }
        present(options)?.extract.threads = (threads > 0).then_some(threads as usize);
        Ok(())
    })
}

/// Chooses the points at which curvature is asked for; the others are neighbours only. An index that the
/// cloud does not have is an error of the extraction.
///
/// @param options The options to change.
/// @param indices Numbers of points, from 0; they are copied. Null only if count is 0.
/// @param count How many they are; 0 asks for no place at all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_indices(
    options: Option<&mut surfsig_options>,
    indices: *const u32,
    count: usize,
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the caller gives `count` numbers.
        let indices = unsafe { array(indices, count, "indices") }?.to_vec();
        present(options)?.indices = Some(indices);
        Ok(())
    })
}

/// What the caller must have given.
fn present(options: Option<&mut surfsig_options>) -> Result<&mut surfsig_options, Failure> {
    options.ok_or_else(|| Failure::invalid_input("options must not be null"))
}

/// A place in the cloud's coordinates, `None` for null.
///
/// # Safety
/// `position` is null or points to three numbers.
pub unsafe fn position(position: *const f64, name: &str) -> Result<Option<[f64; 3]>, Failure> {
    if position.is_null() {
        return Ok(None);
    }
    // SAFETY: by this function's own condition; nothing is said about alignment.
    let place = unsafe { position.cast::<[f64; 3]>().read_unaligned() };
    if place.iter().all(|c| c.is_finite()) {
        return Ok(Some(place));
    }
    Err(Failure::invalid_input(format!("{name} must be finite, not {place:?}")))
}
