//! Threads of a call's own.

use crate::Error;

/// Runs work on a pool of this many threads, or of one for each core, that ends with the work.
///
/// A pool that outlived its call would be missing in a forked child process, which would then wait for
/// it for ever; making one takes less than a tenth of a millisecond.
///
/// In WebAssembly, which has no threads, the work is done where it was called.
///
/// # Errors
/// [`Error::Threads`] where the system refuses the threads.
///
/// ```
/// assert_eq!(surfsig::with_threads(Some(2), || 6 * 7)?, 42);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn with_threads<T: Send>(threads: Option<usize>, work: impl FnOnce() -> T + Send) -> Result<T, Error> {
    if cfg!(target_family = "wasm") {
        return Ok(work());
    }
    let count = threads.unwrap_or(0);
    let pool = rayon::ThreadPoolBuilder::new().num_threads(count).build();
    let pool = pool.map_err(|e| Error::Threads { threads: count, reason: e.to_string() })?;
    Ok(pool.install(work))
}
