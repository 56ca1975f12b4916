//! Blocks of columns into an E57 file.

use super::{error_of, guarded, record_of};
use crate::invalid_input;
use crate::python_file::PythonFile;
use e57::{
    E57Writer, Error, Extension, PointCloudWriter, Record, RecordDataType, RecordValue, Result, Transform,
    Translation,
};
use numpy::PyReadonlyArray1;
use pyo3::prelude::*;

/// A packet (64 KiB) holds whole points only; this leaves room for its head, three bytes per column.
const MAX_POINT_BYTES: usize = 40_000;
const MAX_COLUMNS: usize = 4096;

/// Some points' values of one record.
enum Block {
    Single(Vec<f32>),
    Double(Vec<f64>),
    Integer(Vec<i64>),
}

impl Block {
    fn len(&self) -> usize {
        match self {
            Self::Single(values) => values.len(),
            Self::Double(values) => values.len(),
            Self::Integer(values) => values.len(),
        }
    }

    fn value(&self, row: usize) -> RecordValue {
        match self {
            Self::Single(values) => RecordValue::Single(values[row]),
            Self::Double(values) => RecordValue::Double(values[row]),
            Self::Integer(values) => RecordValue::Integer(values[row]),
        }
    }
}

/// A column as Python hands it over.
#[derive(FromPyObject)]
enum Values<'py> {
    Single(PyReadonlyArray1<'py, f32>),
    Double(PyReadonlyArray1<'py, f64>),
    Integer(PyReadonlyArray1<'py, i64>),
}

impl Values<'_> {
    fn block(&self) -> PyResult<Block> {
        Ok(match self {
            Self::Single(array) => Block::Single(array.as_slice()?.to_vec()),
            Self::Double(array) => Block::Double(array.as_slice()?.to_vec()),
            Self::Integer(array) => Block::Integer(array.as_slice()?.to_vec()),
        })
    }
}

/// A record: its name in the file, its type ("f4", "f8" or "i8"), and the limits of whole numbers.
type Described = (String, String, i64, i64);
/// A scan: its GUID, where its scanner stood, and an iterator of blocks (one array per record).
type Scan = (String, Option<[f64; 3]>, Py<PyAny>);

/// Write scans, block by block, into an empty file that is open for reading and writing.
#[pyfunction]
#[pyo3(signature = (file, *, guid, description, extensions, records, scans))]
pub fn write_e57(
    py: Python<'_>,
    file: Py<PyAny>,
    guid: &str,
    description: Option<&str>,
    extensions: Vec<(String, String)>,
    records: Vec<Described>,
    scans: Py<PyAny>,
) -> PyResult<()> {
    let prototype: Vec<Record> = records.iter().map(record).collect::<PyResult<_>>()?;
    let bytes: usize = records.iter().map(|(_, kind, ..)| if kind == "f4" { 4 } else { 8 }).sum();
    if bytes > MAX_POINT_BYTES || records.len() > MAX_COLUMNS {
        return Err(invalid_input(&format!(
            "E57 holds at most {MAX_POINT_BYTES} bytes and {MAX_COLUMNS} numbers per point, not {bytes} and {}",
            records.len()
        )));
    }
    let write =
        || -> Result<()> {
            let file = PythonFile::new(file, None).map_err(|error| write_error(error.into()))?;
            let mut writer = E57Writer::new(file, guid)?;
            for (namespace, url) in &extensions {
                writer.register_extension(Extension::new(namespace, url))?;
            }
            let scans = iterator(&scans)?;
            while let Some((guid, place, blocks)) = next::<Scan>(&scans)? {
                let mut points = writer.add_pointcloud(&guid, prototype.clone())?;
                points.set_description(description.map(str::to_owned));
                points.set_transform(place.map(|[x, y, z]| Transform {
                    translation: Translation { x, y, z },
                    ..Transform::default()
                }));
                let blocks = iterator(&blocks)?;
                while let Some(block) = next_block(&blocks)? {
                    add(&mut points, &block)?;
                }
                points.finalize()?;
            }
            writer.finalize()
        };
    py.detach(|| guarded(write)).map_err(|error| error_of(&error).unwrap_or_else(|text| invalid_input(&text)))
}

fn add(points: &mut PointCloudWriter<'_, PythonFile>, block: &[Block]) -> Result<()> {
    let count = block.first().map_or(0, Block::len);
    if block.iter().any(|values| values.len() != count) {
        return Error::invalid("the columns of a block differ in length");
    }
    for row in 0..count {
        points.add_point(block.iter().map(|values| values.value(row)).collect())?;
    }
    Ok(())
}

fn record((name, kind, min, max): &Described) -> PyResult<Record> {
    let data_type = match kind.as_str() {
        "f4" => RecordDataType::F32,
        "f8" => RecordDataType::F64,
        "i8" => RecordDataType::Integer { min: *min, max: *max },
        other => return Err(invalid_input(&format!("unknown type '{other}'"))),
    };
    Ok(Record { name: record_of(name), data_type })
}

fn iterator(iterable: &Py<PyAny>) -> Result<Py<PyAny>> {
    Python::attach(|py| iterable.bind(py).try_iter().map(|iterator| iterator.into_any().unbind()))
        .map_err(write_error)
}

fn next<T>(iterator: &Py<PyAny>) -> Result<Option<T>>
where
    T: for<'a, 'py> FromPyObject<'a, 'py, Error = PyErr>,
{
    Python::attach(|py| iterator.bind(py).try_iter()?.next().map(|item| item?.extract()).transpose())
        .map_err(write_error)
}

fn next_block(iterator: &Py<PyAny>) -> Result<Option<Vec<Block>>> {
    Python::attach(|py| {
        let item = iterator.bind(py).try_iter()?.next();
        let values = item.map(|item| item?.extract::<Vec<Values<'_>>>()).transpose()?;
        values.map(|values| values.iter().map(Values::block).collect()).transpose()
    })
    .map_err(write_error)
}

/// Carries an exception of Python's through the library.
fn write_error(error: PyErr) -> Error {
    Error::Write { desc: "an exception".to_owned(), source: Some(Box::new(std::io::Error::from(error))) }
}
