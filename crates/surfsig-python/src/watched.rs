//! Long work of the core, watched from Python.

use crate::to_python;
use pyo3::prelude::*;
use std::sync::mpsc::{RecvTimeoutError, channel};
use std::time::Duration;
use surfsig::Monitor;

/// How often progress is told, and Ctrl-C is looked for.
const WATCH_INTERVAL: Duration = Duration::from_millis(50);

/// Does work without the interpreter, on a thread of its own. This thread tells `progress` what is done of `total`
/// meanwhile (what is done twice where the total is not known), and looks for Ctrl-C; what either raises stops the work, and is raised.
pub fn watched<T: Send>(
    py: Python<'_>,
    total: Option<usize>,
    progress: Option<&Py<PyAny>>,
    work: impl FnOnce(&Monitor) -> Result<T, surfsig::Error> + Send,
) -> PyResult<T> {
    let monitor = Monitor::default();
    let report = || -> PyResult<()> {
        Python::attach(|py| {
            py.check_signals()?;
            let done = monitor.done();
            progress.map_or(Ok(()), |call| call.call1(py, (done, total.unwrap_or(done))).map(|_| ()))
        })
    };
    let result = py.detach(|| {
        std::thread::scope(|scope| {
            let (sender, receiver) = channel();
            let monitor = &monitor;
            scope.spawn(move || {
                // Nobody listens only where the interpreter has already given up.
                let _ = sender.send(work(monitor));
            });
            loop {
                match receiver.recv_timeout(WATCH_INTERVAL) {
                    Ok(result) => return result.map_err(to_python),
                    Err(RecvTimeoutError::Timeout) => report().inspect_err(|_| monitor.cancel())?,
                    Err(RecvTimeoutError::Disconnected) => {
                        return Err(pyo3::exceptions::PyRuntimeError::new_err("the core's thread panicked"));
                    }
                }
            }
        })
    })?;
    report()?;
    Ok(result)
}
