//! How surfaces are found.

use crate::arrays::array;
use crate::code::{Failure, set, surfsig_code};
use crate::kind::surface_kind_of;
use crate::options::thread_count;
use crate::progress::{Progress, surfsig_progress};
use std::ffi::c_void;
use surfsig::SurfaceOptions;

/// How surfaces are found. Made by surfsig_surface_options_new(), freed by surfsig_surface_options_free().
#[derive(Default)]
pub struct surfsig_surface_options {
    pub(crate) search: SurfaceOptions,
    pub(crate) progress: Progress,
}

/// Makes options of the default values: all kinds, noise estimated around each point, all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_options_new() -> Box<surfsig_surface_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_options_free(options: Option<Box<surfsig_surface_options>>) {
    drop(options);
}

/// Chooses the fewest points of a surface.
///
/// @param options The options to change.
/// @param points At least 1; 0 for the default: a five-hundredth of all, from 20 to 1,000, and
/// fewer of surfaces that end at edges.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_options_set_min_points(
    options: Option<&mut surfsig_surface_options>,
    points: u32,
) -> surfsig_code {
    set(options, |options| {
        options.search.fewest = (points > 0).then_some(points as usize);
        Ok(())
    })
}

/// Says how far points are from their surfaces.
///
/// @param options The options to change.
/// @param noise Standard deviation of the distances, in the cloud's unit, finite; 0 to have it estimated around each
/// point.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_options_set_noise(
    options: Option<&mut surfsig_surface_options>,
    noise: f64,
) -> surfsig_code {
    set(options, |options| {
        if !(noise >= 0.0 && noise.is_finite()) {
            return Err(Failure::invalid_input(format!("noise must be finite and not below 0, not {noise}")));
        }
        options.search.noise = (noise > 0.0).then_some(noise);
        Ok(())
    })
}

/// Chooses which kinds of surfaces are looked for.
///
/// @param options The options to change.
/// @param kinds Each a surfsig_surface_kind; any other number is SURFSIG_CODE_INVALID_INPUT. Null only if count is 0.
/// @param count How many they are; 0 for all kinds.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_surface_options_set_kinds(
    options: Option<&mut surfsig_surface_options>,
    kinds: *const u8,
    count: usize,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives `count` bytes.
        let kinds = unsafe { array(kinds, count, "kinds") }?;
        options.search.kinds = kinds.iter().map(|&kind| surface_kind_of(kind)).collect::<Result<_, _>>()?;
        Ok(())
    })
}

/// Chooses the number of threads. The result is the same, bit for bit.
///
/// @param options The options to change.
/// @param threads 1 to 1024; 0 for all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_surface_options_set_threads(
    options: Option<&mut surfsig_surface_options>,
    threads: u32,
) -> surfsig_code {
    set(options, |options| {
        options.search.threads = thread_count(threads)?;
        Ok(())
    })
}

/// Chooses a function that is told the progress, and may stop the search.
///
/// @param options The options to change.
/// @param progress Called with the number of points that have a surface, and of all; null for none.
/// @param data Given to it; must live as long as the options are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_surface_options_set_progress(
    options: Option<&mut surfsig_surface_options>,
    progress: surfsig_progress,
    data: *mut c_void,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives a function that takes the data.
        options.progress = unsafe { Progress::new(progress, data) };
        Ok(())
    })
}
