//! How the caller watches long work, and stops it.

use crate::code::Failure;
use std::ffi::{c_int, c_void};
#[cfg(not(target_family = "wasm"))]
use std::{
    sync::mpsc::{RecvTimeoutError, channel},
    thread::{Builder, scope},
    time::Duration,
};
use surfsig::Monitor;

/// How often the caller is told the progress: often enough for a display, seldom enough to cost nothing.
#[cfg(not(target_family = "wasm"))]
const WATCH_INTERVAL: Duration = Duration::from_millis(50);

/// Told how far work is, some twenty times a second, by the thread that called surfsig; the work itself is done by
/// others meanwhile. Must return, neither by an exception nor by longjmp().
///
/// @param data What was given with the function.
/// @param done How much is done.
/// @param total Of how much; the same for all calls.
/// @return 0 to go on; anything else stops the work, whose function then returns SURFSIG_CODE_CANCELLED.
pub type surfsig_progress =
    Option<unsafe extern "C" fn(data: *mut c_void, done: usize, total: usize) -> c_int>;

/// One that there is.
type Function = unsafe extern "C" fn(data: *mut c_void, done: usize, total: usize) -> c_int;

/// A progress function with its data.
#[derive(Clone, Copy)]
pub(crate) struct Progress {
    function: surfsig_progress,
    data: *mut c_void,
}

impl Default for Progress {
    fn default() -> Self {
        Self { function: None, data: std::ptr::null_mut() }
    }
}

impl Progress {
    /// # Safety
    /// The function may be called with the data for as long as this lives.
    pub unsafe fn new(function: surfsig_progress, data: *mut c_void) -> Self {
        Self { function, data }
    }

    /// Does the work, on a thread of its own where somebody watches.
    pub fn watched<T: Send>(
        self,
        total: usize,
        work: impl FnOnce(&Monitor) -> Result<T, surfsig::Error> + Send,
    ) -> Result<T, Failure> {
        let Some(function) = self.function else { return Ok(work(&Monitor::default())?) };
        #[cfg(target_family = "wasm")]
        return self.watched_in_this_thread(function, total, work);
        #[cfg(not(target_family = "wasm"))]
        self.watched_from_outside(function, total, work)
    }

    /// Does the work where it was called, and reports between its parts.
    #[cfg(target_family = "wasm")]
    fn watched_in_this_thread<T>(
        self,
        function: Function,
        total: usize,
        work: impl FnOnce(&Monitor) -> Result<T, surfsig::Error>,
    ) -> Result<T, Failure> {
        /// The caller's data, which WebAssembly's only thread alone uses.
        struct Data(*mut c_void);
        // SAFETY: there is one thread.
        unsafe impl Send for Data {}
        // SAFETY: there is one thread.
        unsafe impl Sync for Data {}
        impl Data {
            fn pointer(&self) -> *mut c_void {
                self.0
            }
        }
        let data = Data(self.data);
        // SAFETY: by the condition of `new`; it is the caller's thread that calls.
        let report = move |done| unsafe { function(data.pointer(), done, total) } == 0;
        Ok(work(&Monitor::watched_by(report))?)
    }

    /// Does the work on a thread of its own, and reports from this one.
    #[cfg(not(target_family = "wasm"))]
    fn watched_from_outside<T: Send>(
        self,
        function: Function,
        total: usize,
        work: impl FnOnce(&Monitor) -> Result<T, surfsig::Error> + Send,
    ) -> Result<T, Failure> {
        let monitor = Monitor::default();
        // SAFETY: by the condition of `new`; it is the caller's thread that calls.
        let report = || unsafe { function(self.data, monitor.done(), total) };
        scope(|scope| {
            let (sender, receiver) = channel();
            let monitor = &monitor;
            let run = move || {
                // Somebody listens until this has been sent.
                let _ = sender.send(work(monitor));
            };
            let worker = Builder::new()
                .spawn_scoped(scope, run)
                .map_err(|e| Failure::system(format!("cannot start a thread: {e}")))?;
            loop {
                match receiver.recv_timeout(WATCH_INTERVAL) {
                    Ok(result) => {
                        let result = result?;
                        report();
                        return Ok(result);
                    }
                    Err(RecvTimeoutError::Timeout) if report() != 0 => monitor.cancel(),
                    Err(RecvTimeoutError::Timeout) => {}
                    Err(RecvTimeoutError::Disconnected) => {
                        let payload = worker.join().err().unwrap_or_else(|| Box::new("no result"));
                        return Err(Failure::panicked(payload.as_ref()));
                    }
                }
            }
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::code::{guarded, surfsig_code};
    use std::sync::atomic::{AtomicUsize, Ordering::SeqCst};

    unsafe extern "C" fn stop(data: *mut c_void, done: usize, total: usize) -> c_int {
        assert!(done <= total);
        // SAFETY: each test gives a counter.
        unsafe { &*data.cast::<AtomicUsize>() }.fetch_add(1, SeqCst);
        1
    }

    fn progress(calls: &AtomicUsize) -> Progress {
        Progress { function: Some(stop), data: std::ptr::from_ref(calls).cast_mut().cast() }
    }

    #[test]
    fn work_that_is_stopped_says_so() {
        let calls = AtomicUsize::new(0);
        let code = guarded(|| {
            progress(&calls).watched(7, |_| {
                while calls.load(SeqCst) == 0 {
                    std::thread::yield_now();
                }
                Err::<(), _>(surfsig::Error::Cancelled)
            })
        });
        assert_eq!(code, surfsig_code::Cancelled);
        assert!(calls.into_inner() >= 1);
    }

    #[test]
    fn a_panic_of_watched_work_becomes_a_failure() {
        let calls = AtomicUsize::new(0);
        let code = guarded(|| progress(&calls).watched(1, |_| -> Result<(), _> { panic!("in the worker") }));
        assert_eq!(code, surfsig_code::Internal);
    }

    #[test]
    fn the_last_call_follows_the_work() {
        let calls = AtomicUsize::new(0);
        assert_eq!(progress(&calls).watched(0, |_| Ok(5)).unwrap(), 5);
        assert!(calls.into_inner() >= 1);
    }
}
