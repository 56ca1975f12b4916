//! The bindings: release the interpreter, call the core, map the error; nothing else.

mod all_cores;
mod e57;
mod extract;
mod field;
mod finding;
mod frame;
mod fused_map;
mod neighbor_distances;
mod odometry;
mod primitive;
mod python_file;
mod recurrences;
mod registration;
mod settings;
mod surfaces;
mod visibility;
mod watched;

use numpy::{PyReadonlyArray2, PyUntypedArrayMethods};
use pyo3::prelude::*;
use pyo3::types::PyString;

/// The core's errors are mistakes that the caller can mend.
fn to_python(error: surfsig::Error) -> PyErr {
    invalid_input(&error.to_string())
}

/// A `surfsig.InvalidInputError`.
fn invalid_input(message: &str) -> PyErr {
    error_of_class("InvalidInputError", message)
}

/// A `surfsig.FileFormatError`.
fn file_format(message: &str) -> PyErr {
    error_of_class("FileFormatError", message)
}

fn error_of_class(name: &str, message: &str) -> PyErr {
    Python::attach(|py| {
        let class = py.import("surfsig.errors").and_then(|module| module.getattr(name));
        match class.and_then(|class| class.call1((PyString::new(py, message),))) {
            Ok(exception) => PyErr::from_value(exception),
            Err(failed) => failed,
        }
    })
}

/// The rows of an (n, N) array that stands row by row in memory.
fn rows<'a, T: numpy::Element, const N: usize>(array: &'a PyReadonlyArray2<'_, T>) -> PyResult<&'a [[T; N]]> {
    let wrong = || invalid_input(&format!("expected a C-contiguous array of shape (n, {N})"));
    if !array.is_c_contiguous() || array.shape()[1] != N {
        return Err(wrong());
    }
    let (rows, rest) = array.as_slice()?.as_chunks::<N>();
    if rest.is_empty() { Ok(rows) } else { Err(wrong()) }
}

/// The compiled core of surfsig.
#[pymodule]
mod _surfsig {
    #[pymodule_export]
    use crate::e57::{E57Reader, write_e57};
    #[pymodule_export]
    use crate::extract::{
        coordinate_resolution, coordinate_steps, different_places, distance_to_nearest, extract,
        sampled_numbers, voxel_representatives,
    };
    #[pymodule_export]
    use crate::field::{field_keypoints, field_signatures, match_fields};
    #[pymodule_export]
    use crate::finding::{FindSettings, brief_model, find_instances, point_spacing, prepare_model};
    #[pymodule_export]
    use crate::frame::Frame;
    #[pymodule_export]
    use crate::fused_map::FusedMap;
    #[pymodule_export]
    use crate::neighbor_distances::mean_neighbor_distances;
    #[pymodule_export]
    use crate::odometry::{Odometry, OdometrySettings, deskewed_points, spin_times, time_range};
    #[pymodule_export]
    use crate::primitive::{Primitive, fit_primitive};
    #[pymodule_export]
    use crate::recurrences::{
        PieceView, RecurrenceSettings, align_pieces, examine_poses, judge_poses, refine_poses,
    };
    #[pymodule_export]
    use crate::registration::{
        RegistrationSettings, consistent_directions, free_directions, free_space_share, register,
    };
    #[pymodule_export]
    use crate::surfaces::{added_sums, find_surfaces, join_surface_pieces, surface_of_sums, surface_sums};
    #[pymodule_export]
    use crate::visibility::{estimated_viewpoint, hidden_from, measured_from_origin};

    use pyo3::prelude::*;
    use pyo3::types::IntoPyDict;

    #[pymodule_init]
    fn init(module: &Bound<'_, PyModule>) -> PyResult<()> {
        module.add("__version__", env!("CARGO_PKG_VERSION"))?;
        module.add("STATUS_NAMES", surfsig::Status::ALL.map(surfsig::Status::name).to_vec())?;
        module.add("SCAN_STATUS_NAMES", surfsig::ScanStatus::ALL.map(surfsig::ScanStatus::name).to_vec())?;
        let kinds = surfsig::SurfaceKind::ALL.into_iter().chain(surfsig::SurfaceKind::CURVES);
        let parameters: Vec<(&str, usize)> = kinds.map(|kind| (kind.name(), kind.parameters())).collect();
        module.add("KIND_PARAMETERS", parameters.into_py_dict(module.py())?)?;
        module.add("FEWEST_SURFACE_POINTS", surfsig::FEWEST_SURFACE_POINTS)?;
        module.add("FEWEST_AUTO_POINTS", surfsig::FEWEST_AUTO_POINTS)?;
        module.add("RESOLUTION_SAMPLES", surfsig::RESOLUTION_SAMPLES)?;
        module.add("COARSEST_STEP", surfsig::COARSEST_STEP)?;
        module.add("INSTRUCTION_SET", surfsig::InstructionSet::detect().name())?;
        module.add("FLAT_ATOM_NOISES", surfsig::FLAT_ATOM_NOISES)?;
        module.add("INSTANCE_SCORE", surfsig::FindSettings::default().min_score)?;
        module.add("OPTIMAL", surfsig::OPTIMAL)?;
        module.add("GOOD", surfsig::GOOD)
    }
}
