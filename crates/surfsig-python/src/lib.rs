//! The bindings: release the interpreter, call the core, map the error; nothing else.

mod extract;
mod frame;

use pyo3::prelude::*;
use pyo3::types::PyString;

/// The core's errors are mistakes that the caller can mend.
fn to_python(error: surfsig::Error) -> PyErr {
    Python::attach(|py| {
        let class = py.import("surfsig.errors").and_then(|module| module.getattr("InvalidInputError"));
        match class.and_then(|class| class.call1((PyString::new(py, &error.to_string()),))) {
            Ok(exception) => PyErr::from_value(exception),
            Err(failed) => failed,
        }
    })
}

/// The compiled core of surfsig.
#[pymodule]
mod _surfsig {
    #[pymodule_export]
    use crate::extract::{extract, voxel_representatives};
    #[pymodule_export]
    use crate::frame::Frame;

    use pyo3::prelude::*;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("STATUS_NAMES", surfsig::Status::ALL.map(surfsig::Status::name).to_vec())?;
        module.add("INSTRUCTION_SET", surfsig::InstructionSet::detect().name())?;
        module.add("OPTIMAL", surfsig::OPTIMAL)?;
        module.add("GOOD", surfsig::GOOD)
    }
}
