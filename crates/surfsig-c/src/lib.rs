//! The C interface: checks what C cannot promise, calls the core, maps the error; nothing else.
//!
//! `include/surfsig.h` is generated from the comments and types here, whose names are therefore C's.

#![allow(non_camel_case_types, reason = "the names are those of the C header")]

mod arrays;
mod code;
mod extraction;
mod options;
mod signatures;
mod status;

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
