//! A file that Python has opened, as Rust's readers and writers want one.

use pyo3::prelude::*;
use pyo3::types::PyBytes;
use std::io::{Error, ErrorKind, Read, Result, Seek, SeekFrom, Write};

/// The interpreter is asked for so many bytes at a time.
const BLOCK: u64 = 1 << 20;

/// A seekable binary file of Python's, through one block that is kept in memory.
///
/// Whoever reads pages of a kilobyte so takes the interpreter's lock once per megabyte. An exception that
/// Python raises travels inside the `std::io::Error`.
pub struct PythonFile {
    file: Py<PyAny>,
    /// Called with the number of bytes whenever some have been read.
    progress: Option<Py<PyAny>>,
    len: u64,
    position: u64,
    /// Where `block` begins in the file: a multiple of `BLOCK`.
    start: u64,
    block: Vec<u8>,
    changed: bool,
}

impl PythonFile {
    pub fn new(file: Py<PyAny>, progress: Option<Py<PyAny>>) -> Result<Self> {
        let len = Python::attach(|py| file.call_method1(py, "seek", (0, 2))?.extract(py))?;
        // A block that can never be asked for stands for none.
        Ok(Self { file, progress, len, position: 0, start: u64::MAX, block: Vec::new(), changed: false })
    }

    pub fn len(&self) -> u64 {
        self.len
    }

    /// Makes the block that holds the position the one in memory, and gives the position's place in it.
    fn seek_in_block(&mut self) -> Result<usize> {
        let start = self.position / BLOCK * BLOCK;
        if start != self.start {
            self.save()?;
            self.block = Python::attach(|py| -> PyResult<Vec<u8>> {
                py.check_signals()?;
                self.file.call_method1(py, "seek", (start,))?;
                let read: Vec<u8> = self
                    .file
                    .call_method1(py, "read", (BLOCK,))?
                    .cast_bound::<PyBytes>(py)?
                    .as_bytes()
                    .to_vec();
                if let Some(progress) = &self.progress {
                    progress.call1(py, (read.len(),))?;
                }
                Ok(read)
            })?;
            self.start = start;
        }
        Ok((self.position - start) as usize)
    }

    fn save(&mut self) -> Result<()> {
        if self.changed {
            Python::attach(|py| -> PyResult<()> {
                py.check_signals()?;
                self.file.call_method1(py, "seek", (self.start,))?;
                self.file.call_method1(py, "write", (PyBytes::new(py, &self.block),))?;
                Ok(())
            })?;
            self.changed = false;
        }
        Ok(())
    }
}

impl Read for PythonFile {
    fn read(&mut self, buffer: &mut [u8]) -> Result<usize> {
        let place = self.seek_in_block()?;
        let there = self.block.get(place..).unwrap_or_default();
        let count = there.len().min(buffer.len());
        buffer[..count].copy_from_slice(&there[..count]);
        self.position += count as u64;
        Ok(count)
    }
}

impl Write for PythonFile {
    fn write(&mut self, bytes: &[u8]) -> Result<usize> {
        let place = self.seek_in_block()?;
        let count = bytes.len().min(BLOCK as usize - place);
        if self.block.len() < place + count {
            self.block.resize(place + count, 0);
        }
        self.block[place..place + count].copy_from_slice(&bytes[..count]);
        self.changed = true;
        self.position += count as u64;
        self.len = self.len.max(self.position);
        Ok(count)
    }

    fn flush(&mut self) -> Result<()> {
        self.save()
    }
}

impl Seek for PythonFile {
    fn seek(&mut self, to: SeekFrom) -> Result<u64> {
        let position = match to {
            SeekFrom::Start(position) => Some(position),
            SeekFrom::End(offset) => self.len.checked_add_signed(offset),
            SeekFrom::Current(offset) => self.position.checked_add_signed(offset),
        };
        self.position = position.ok_or_else(|| Error::from(ErrorKind::InvalidInput))?;
        Ok(self.position)
    }
}
