//! How models are prepared and looked for.

use crate::code::{Failure, set, surfsig_code};
use crate::options::thread_count;
use crate::progress::{Progress, surfsig_progress};
use std::ffi::c_void;
use surfsig::FindSettings;

/// How models are prepared and looked for. Made by surfsig_find_options_new(), freed by surfsig_find_options_free().
#[derive(Default)]
pub struct surfsig_find_options {
    pub(crate) settings: FindSettings,
    pub(crate) progress: Progress,
}

/// Makes options of the default values: instances with a score of 0.5 at least, all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_find_options_new() -> Box<surfsig_find_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_find_options_free(options: Option<Box<surfsig_find_options>>) {
    drop(options);
}

/// Chooses the least score of an instance.
///
/// @param options The options to change.
/// @param score The probability that the instance's pose is right, above 0 and up to 1; 0 for the default.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_find_options_set_score(
    options: Option<&mut surfsig_find_options>,
    score: f64,
) -> surfsig_code {
    set(options, |options| {
        if !(0.0..=1.0).contains(&score) {
            return Err(Failure::invalid_input(format!("score must be from 0 to 1, not {score}")));
        }
        let default = FindSettings::default().min_score;
        options.settings.min_score = if score == 0.0 { default } else { score };
        Ok(())
    })
}

/// Chooses how many instances of all models are given at most: the most probable ones.
///
/// @param options The options to change.
/// @param at_most How many; 0 for all.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_find_options_set_at_most(
    options: Option<&mut surfsig_find_options>,
    at_most: usize,
) -> surfsig_code {
    set(options, |options| {
        options.settings.at_most = if at_most == 0 { FindSettings::default().at_most } else { at_most };
        Ok(())
    })
}

/// Chooses the number of threads. The result is the same, bit for bit.
///
/// @param options The options to change.
/// @param threads 1 to 1024; 0 for all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_find_options_set_threads(
    options: Option<&mut surfsig_find_options>,
    threads: u32,
) -> surfsig_code {
    set(options, |options| {
        options.settings.threads = thread_count(threads)?;
        Ok(())
    })
}

/// Chooses a function that is told the progress, and may stop the preparation or the search.
///
/// @param options The options to change.
/// @param progress Called with the number of steps done, and of all; null for none.
/// @param data Given to it; must live as long as the options are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_find_options_set_progress(
    options: Option<&mut surfsig_find_options>,
    progress: surfsig_progress,
    data: *mut c_void,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives a function that takes the data.
        options.progress = unsafe { Progress::new(progress, data) };
        Ok(())
    })
}
