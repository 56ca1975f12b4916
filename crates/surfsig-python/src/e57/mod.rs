//! E57 files, for Python: through the crate `e57`.

mod columns;
mod reader;
mod writer;

pub use reader::E57Reader;
pub use writer::write_e57;

use e57::RecordName;
use pyo3::prelude::*;
use std::error::Error as StdError;
use std::panic::{AssertUnwindSafe, catch_unwind};

/// Longer messages repeat a broken file.
const MESSAGE_CHARS: usize = 200;

/// The values of a point that the standard knows, by the names that it gives them.
const STANDARD: [(RecordName, &str); 20] = [
    (RecordName::CartesianX, "cartesianX"),
    (RecordName::CartesianY, "cartesianY"),
    (RecordName::CartesianZ, "cartesianZ"),
    (RecordName::CartesianInvalidState, "cartesianInvalidState"),
    (RecordName::SphericalRange, "sphericalRange"),
    (RecordName::SphericalAzimuth, "sphericalAzimuth"),
    (RecordName::SphericalElevation, "sphericalElevation"),
    (RecordName::SphericalInvalidState, "sphericalInvalidState"),
    (RecordName::Intensity, "intensity"),
    (RecordName::IsIntensityInvalid, "isIntensityInvalid"),
    (RecordName::ColorRed, "colorRed"),
    (RecordName::ColorGreen, "colorGreen"),
    (RecordName::ColorBlue, "colorBlue"),
    (RecordName::IsColorInvalid, "isColorInvalid"),
    (RecordName::RowIndex, "rowIndex"),
    (RecordName::ColumnIndex, "columnIndex"),
    (RecordName::ReturnCount, "returnCount"),
    (RecordName::ReturnIndex, "returnIndex"),
    (RecordName::TimeStamp, "timeStamp"),
    (RecordName::IsTimeStampInvalid, "isTimeStampInvalid"),
];

/// A value's name as it stands in the file: an extension's has its prefix before a colon.
fn name_of(record: &RecordName) -> String {
    if let RecordName::Unknown { namespace, name } = record {
        return if namespace.is_empty() { name.clone() } else { format!("{namespace}:{name}") };
    }
    STANDARD.iter().find(|(known, _)| known == record).map(|(_, name)| (*name).to_owned()).unwrap_or_default()
}

/// The inverse of `name_of`.
fn record_of(name: &str) -> RecordName {
    if let Some((record, _)) = STANDARD.iter().find(|(_, known)| *known == name) {
        return record.clone();
    }
    let (namespace, name) = name.split_once(':').unwrap_or(("", name));
    RecordName::Unknown { namespace: namespace.to_owned(), name: name.to_owned() }
}

/// Makes a panic of the library, which a broken file might find, an error like any other.
fn guarded<T>(work: impl FnOnce() -> e57::Result<T>) -> e57::Result<T> {
    catch_unwind(AssertUnwindSafe(work)).unwrap_or_else(|_| e57::Error::internal("the E57 library panicked"))
}

/// What Python raised while the library worked (a full disk, Ctrl-C), or the library's words on one line.
fn error_of(error: &e57::Error) -> Result<PyErr, String> {
    let mut cause: Option<&(dyn StdError + 'static)> = Some(error);
    while let Some(current) = cause {
        let inner = current.downcast_ref::<std::io::Error>().and_then(std::io::Error::get_ref);
        if let Some(raised) = inner.and_then(|inner| inner.downcast_ref::<PyErr>()) {
            return Ok(Python::attach(|py| raised.clone_ref(py)));
        }
        cause = current.source();
    }
    let text = error.to_string();
    let line = text.split_whitespace().collect::<Vec<_>>().join(" ");
    Err(line.chars().take(MESSAGE_CHARS).collect())
}
