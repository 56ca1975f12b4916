//! Work of the core on all cores.

use crate::to_python;
use pyo3::prelude::*;

/// Does work without the interpreter, on a pool of threads that ends with it: one that outlived the call would be missing
/// in a forked child process, which would wait for it for ever.
pub fn on_all_cores<T: Send>(py: Python<'_>, work: impl FnOnce() -> T + Send) -> PyResult<T> {
    py.detach(|| surfsig::with_threads(None, work)).map_err(to_python)
}
