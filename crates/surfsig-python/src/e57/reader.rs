//! Scans of an E57 file as columns.

use super::columns::{Column, bits};
use super::{error_of, guarded, name_of};
use crate::file_format;
use crate::python_file::PythonFile;
use e57::{Error, PointCloud, Result};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::io::Seek;
use std::sync::Mutex;

/// The library unpacks a whole packet (64 KiB) at once, however few points are promised: of each column that
/// needs no bits, because all its values are equal, as many as the widest of the others has.
const PACKET_BITS: u128 = 8 << 16;
const MAX_CONSTANTS_PER_PACKET: u128 = 1 << 22;
/// More values per byte of the file than any measurement has: it is a broken promise, or a trap.
const MAX_VALUES_PER_BYTE: u128 = 64;

const MAX_COLUMNS: usize = 4096;
/// The XML parser's time grows with the square of an element's attributes, and with the cube of the
/// namespaces that are declared one inside the other.
const MAX_ATTRIBUTES: usize = 1 << 14;
const MAX_NAMESPACES: usize = 1 << 10;

/// A scan's rotation (a quaternion, w first) and translation into the file's frame.
type Pose = ([f64; 4], [f64; 3]);

/// An E57 file that is open in Python.
#[pyclass(frozen, module = "surfsig")]
pub struct E57Reader {
    reader: Mutex<e57::E57Reader<PythonFile>>,
    scans: Vec<PointCloud>,
    size: u64,
    source: String,
}

#[pymethods]
impl E57Reader {
    #[new]
    fn new(py: Python<'_>, file: Py<PyAny>, source: String, progress: Py<PyAny>) -> PyResult<Self> {
        let open = || {
            let mut file = PythonFile::new(file, Some(progress)).map_err(seek_error)?;
            let size = file.len();
            check_xml(&e57::E57Reader::raw_xml(&mut file)?)?;
            file.rewind().map_err(seek_error)?;
            Ok((e57::E57Reader::new(file)?, size))
        };
        let (reader, size) = py.detach(|| guarded(open)).map_err(|error| failure(&error, &source))?;
        Ok(Self { scans: reader.pointclouds(), reader: Mutex::new(reader), size, source })
    }

    fn __len__(&self) -> usize {
        self.scans.len()
    }

    /// The columns of scan `number` by their names in the file (an extension's with its prefix before a
    /// colon), and its pose: a quaternion, w first, and a translation.
    fn scan<'py>(&self, py: Python<'py>, number: usize) -> PyResult<(Bound<'py, PyDict>, Option<Pose>)> {
        let scan = self.scans.get(number).ok_or_else(|| crate::invalid_input("there is no such scan"))?;
        let columns =
            py.detach(|| guarded(|| self.columns(scan))).map_err(|error| failure(&error, &self.source))?;
        let named = PyDict::new(py);
        for (record, column) in scan.prototype.iter().zip(columns) {
            let name = name_of(&record.name);
            if named.contains(&name)? {
                return Err(file_format(&format!(
                    "{}: two values of a point are called '{name}'",
                    self.source
                )));
            }
            named.set_item(name, column.into_array(py))?;
        }
        let pose = scan.transform.as_ref().map(|pose| {
            let (turn, shift) = (&pose.rotation, &pose.translation);
            ([turn.w, turn.x, turn.y, turn.z], [shift.x, shift.y, shift.z])
        });
        Ok((named, pose))
    }
}

impl E57Reader {
    fn columns(&self, scan: &PointCloud) -> Result<Vec<Column>> {
        let count = self.check_promise(scan)?;
        let mut columns: Vec<Column> =
            scan.prototype.iter().map(|record| Column::new(&record.data_type)).collect();
        if !columns.iter_mut().all(|column| column.reserve(count)) {
            return Error::invalid(format!("{count} points are too many for the memory"));
        }
        let Ok(mut reader) = self.reader.lock() else {
            return Error::internal("the E57 library panicked before");
        };
        // The library looks for a first packet even where there need not be any.
        if count > 0 {
            for point in reader.pointcloud_raw(scan)? {
                for ((column, record), value) in columns.iter_mut().zip(&scan.prototype).zip(&point?) {
                    column.push(value, &record.data_type);
                }
            }
        }
        Ok(columns)
    }

    /// The number of points, if the file is large enough for them.
    fn check_promise(&self, scan: &PointCloud) -> Result<usize> {
        let widths = scan.prototype.iter().map(|record| u128::from(bits(&record.data_type)));
        let point_bits: u128 = widths.clone().sum();
        let widest = widths.clone().max().unwrap_or(0);
        let constant = widths.filter(|width| *width == 0).count() as u128;
        let (points, size) = (u128::from(scan.records), u128::from(self.size));
        let values = points * scan.prototype.len() as u128;
        if scan.prototype.len() > MAX_COLUMNS
            || constant * PACKET_BITS > MAX_CONSTANTS_PER_PACKET * widest.max(1)
        {
            return Error::invalid(format!(
                "a point has {} values, {constant} of them the same everywhere",
                scan.prototype.len()
            ));
        }
        if points > 0
            && (point_bits == 0 || points * point_bits > size * 8 || values > size * MAX_VALUES_PER_BYTE)
        {
            return Error::invalid(format!(
                "cut off: it promises {points} points of {point_bits} bits, more than its {size} bytes hold"
            ));
        }
        Ok(scan.records as usize)
    }
}

/// Refuses an XML section that would keep its parser busy for minutes.
fn check_xml(xml: &[u8]) -> Result<()> {
    let namespaces = xml.windows(5).filter(|bytes| bytes == b"xmlns").count();
    // What begins with an exclamation mark is text or a comment.
    let elements = xml.split(|byte| *byte == b'<').filter(|element| !element.starts_with(b"!"));
    let attributes = elements.map(|element| element.iter().filter(|byte| **byte == b'=').count()).max();
    if namespaces > MAX_NAMESPACES || attributes.unwrap_or(0) > MAX_ATTRIBUTES {
        return Error::invalid("its XML has too many namespaces or attributes");
    }
    Ok(())
}

fn seek_error(error: std::io::Error) -> Error {
    Error::Read { desc: "seeking".to_owned(), source: Some(error.into()) }
}

fn failure(error: &Error, source: &str) -> PyErr {
    error_of(error).unwrap_or_else(|text| file_format(&format!("{source}: {text}")))
}
