//! The larger and the smaller of two numbers, by one comparison.
//!
//! `f32::max` gives the other number where one is NaN. WebAssembly has no instruction for that, so that it calls a
//! function there, which is slow in loops over points.

/// The larger of two numbers that are not NaN.
#[inline(always)]
pub(crate) fn larger(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}

/// The smaller of two numbers that are not NaN.
#[inline(always)]
pub(crate) fn smaller(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}
