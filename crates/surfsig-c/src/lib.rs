//! The C interface: checks what C cannot promise, calls the core, maps the error; nothing else.
//!
//! `include/surfsig.h` is generated from the comments and types here, whose names are therefore C's; what a call needs
//! of its pointers stands in its comment there.

#![allow(non_camel_case_types, reason = "the names are those of the C header")]
#![allow(clippy::missing_safety_doc, reason = "the header's comments say what each pointer must be")]

mod arrays;
mod cloud;
mod code;
#[macro_use]
mod columns;
mod extraction;
mod find_options;
mod finding;
mod kind;
#[cfg(target_family = "wasm")]
mod memory;
mod moments;
mod odometry;
mod options;
mod primitive;
mod primitive_options;
mod progress;
mod registration;
mod signatures;
mod status;
mod surface_options;
mod surfaces;
mod transform;

// For the tests, which call what C calls.
pub use cloud::*;
pub use code::*;
pub use columns::{Declaration, Table};
pub use extraction::*;
pub use find_options::*;
pub use finding::*;
pub use kind::*;
pub use moments::*;
pub use odometry::*;
pub use options::*;
pub use primitive::*;
pub use primitive_options::*;
pub use progress::*;
pub use registration::*;
pub use signatures::*;
pub use status::*;
pub use surface_options::*;
pub use surfaces::*;
pub use transform::*;

use std::ffi::{CStr, c_char};

/// The library's version, "major.minor.patch"; null-terminated, never to be freed.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_version() -> *const c_char {
    const VERSION: &CStr =
        match CStr::from_bytes_with_nul(concat!(env!("CARGO_PKG_VERSION"), "\0").as_bytes()) {
            Ok(version) => version,
            Err(_) => panic!("a version holds no zero"),
        };
    VERSION.as_ptr()
}
