//! Bindings.
use pyo3::prelude::*;
/// The compiled module.
#[pymodule]
fn _surfsig(_m: &Bound<'_, PyModule>) -> PyResult<()> {
    Ok(())
}
