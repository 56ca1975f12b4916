//! Every function of the header, called with what C can give by mistake: null pointers, counts of zero, coordinates
//! that are not finite, counts that no memory holds, numbers that no enum has. Each must return, and say what is wrong.

#![allow(
    clippy::undocumented_unsafe_blocks,
    reason = "mistakes on purpose, which the functions must survive"
)]

use std::collections::BTreeSet;
use std::ffi::{CStr, c_int, c_void};
use std::path::Path;
use std::ptr::{null, null_mut};
use surfsig_c::*;

const OK: surfsig_code = surfsig_code::Ok;
const INVALID: surfsig_code = surfsig_code::InvalidInput;
const UNDETERMINED: surfsig_code = surfsig_code::Undetermined;

/// Counts of which no array is that long.
const HUGE: [usize; 4] = [usize::MAX, usize::MAX / 8, usize::MAX / 24 + 1, u32::MAX as usize + 1];

/// Numbers of which one is none.
const BAD: [f64; 16] = [f64::NAN; 16];

/// Points of a wavy surface, so that all fits have something to do.
fn wave() -> Vec<[f64; 3]> {
    let place = |i: i32| (0.1 * f64::from(i % 20), 0.1 * f64::from(i / 20));
    (0..400).map(place).map(|(x, y)| [x, y, 0.05 * (3.0 * x).sin() * (2.0 * y).cos()]).collect()
}

/// Points of a sphere of radius 1 about (1, 2, 3).
fn sphere() -> Vec<[f64; 3]> {
    (0..400)
        .map(|i| (1.0 - (2.0 * f64::from(i) + 1.0) / 400.0, 2.4 * f64::from(i)))
        .map(|(z, t)| {
            let away = (1.0 - z * z).sqrt();
            [1.0 + away * t.cos(), 2.0 + away * t.sin(), 3.0 + z]
        })
        .collect()
}

/// A cloud, freed at its end, with the points that it refers to.
struct Cloud(*mut surfsig_cloud, #[expect(dead_code, reason = "the cloud refers to them")] Vec<[f64; 3]>);

impl Cloud {
    fn of(points: &[[f64; 3]]) -> Self {
        let (mut made, points) = (null_mut(), points.to_vec());
        let code =
            unsafe { surfsig_cloud_new_f64(points.as_ptr().cast(), points.len(), 24, null(), &mut made) };
        assert_eq!(code, OK);
        Self(made, points)
    }

    fn get(&self) -> Option<&surfsig_cloud> {
        unsafe { self.0.as_ref() }
    }
}

impl Drop for Cloud {
    fn drop(&mut self) {
        surfsig_cloud_free(owned(self.0));
    }
}

/// A progress function that stops at once.
unsafe extern "C" fn stop(_data: *mut c_void, _done: usize, _total: usize) -> c_int {
    1
}

/// What C gives to a function that frees.
fn owned<T>(object: *mut T) -> Option<Box<T>> {
    (!object.is_null()).then(|| unsafe { Box::from_raw(object) })
}

fn last_error() -> String {
    unsafe { CStr::from_ptr(surfsig_last_error()) }.to_str().unwrap().to_owned()
}

/// The names of the functions that a test has called.
struct Called(BTreeSet<&'static str>);

/// Checks what a call returns, and that the text of a failure is one line of words.
macro_rules! call {
    ($called:ident, $function:ident($($argument:expr),* $(,)?) gives $expected:expr) => {{
        $called.0.insert(stringify!($function));
        #[allow(unused_unsafe)]
        let code = unsafe { $function($($argument),*) };
        assert_eq!(code, $expected, "{}: {}", stringify!($function($($argument),*)), last_error());
        if code != OK {
            let text = last_error();
            assert!(!text.is_empty() && !text.contains('\n') && !text.contains("internal"), "{text}");
        }
    }};
    ($called:ident, $function:ident($($argument:expr),* $(,)?)) => {{
        $called.0.insert(stringify!($function));
        #[allow(unused_unsafe)]
        unsafe { $function($($argument),*) }
    }};
}

/// Functions that give a column, or another first entry, of a result.
macro_rules! null_of_null {
    ($called:ident: $($function:ident),* $(,)?) => {
        $(assert!(call!($called, $function(None)).is_null(), "{}", stringify!($function));)*
    };
}

// After the macros, which they use.
mod arguments;
mod finding;
mod fits;
mod poses;
mod results;

#[test]
fn no_function_of_the_header_fails_but_by_a_code() {
    let mut called = Called(BTreeSet::new());
    arguments::texts(&mut called);
    arguments::clouds(&mut called);
    arguments::options(&mut called);
    results::extractions(&mut called);
    results::surfaces(&mut called);
    fits::primitives(&mut called);
    fits::moments(&mut called);
    fits::transforms(&mut called);
    poses::registration_options(&mut called);
    poses::registrations(&mut called);
    poses::odometries(&mut called);
    poses::deskewing(&mut called);
    finding::options(&mut called);
    finding::models(&mut called);
    finding::instances(&mut called);

    let header = Path::new(env!("CARGO_MANIFEST_DIR")).join("include/surfsig.h");
    let text = std::fs::read_to_string(header).unwrap();
    let listed = functions_of(&text);
    assert!(listed.len() > 60);
    let missing: Vec<_> = listed.difference(&called.0).collect();
    assert!(missing.is_empty(), "functions that this test does not call: {missing:?}");
    let gone: Vec<_> = called.0.difference(&listed).collect();
    assert!(gone.is_empty(), "functions that the header does not have: {gone:?}");
}

/// The names before an opening bracket in declarations, which are the lines of code that no comment is.
fn functions_of(header: &str) -> BTreeSet<&str> {
    let code = header.lines().filter(|line| !line.starts_with([' ', '/', '#', '}']));
    code.filter_map(|line| {
        let (before, _) = line.split_once('(')?;
        let name = before.rsplit([' ', '*']).next()?;
        name.starts_with("surfsig_").then_some(name)
    })
    .collect()
}

/// Clouds that are odd but no mistake: no point, one, points in one place, points that are not finite, and all sizes of
/// coordinates.
fn odd_clouds() -> Vec<Vec<[f64; 3]>> {
    let mut some_are_none = wave();
    some_are_none[7] = [f64::NAN, 0.0, 0.0];
    some_are_none[8] = [f64::INFINITY, f64::NEG_INFINITY, 0.0];
    let large = wave().into_iter().map(|p| p.map(|c| 1e300 * c)).collect();
    let far = vec![[f64::MAX; 3], [f64::MIN; 3], [0.0; 3]];
    vec![
        vec![],
        vec![[0.0; 3]],
        vec![[1.0, 2.0, 3.0]; 30],
        vec![[f64::NAN; 3]; 30],
        (0..30).map(|i| [f64::from(i), 0.0, 0.0]).collect(),
        some_are_none,
        large,
        far,
    ]
}
