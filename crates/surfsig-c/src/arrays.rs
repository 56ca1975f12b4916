//! Arrays as C gives them.

use crate::code::Failure;
use std::borrow::Cow;
use std::mem::size_of;

/// An array of the caller's.
///
/// # Safety
/// `first` is null or points to `count` values, which nobody changes while the slice lives.
pub unsafe fn array<'a, T>(first: *const T, count: usize, name: &str) -> Result<&'a [T], Failure> {
    if count == 0 {
        return Ok(&[]);
    }
    check_aligned(first, count, name)?;
    // SAFETY: checked, and valid by this function's condition.
    Ok(unsafe { std::slice::from_raw_parts(first, count) })
}

/// Room of the caller's, filled with zeros: what stood there may have had no value.
///
/// # Safety
/// `first` is null or points to room for `count` values, of which zeros must be one, and which nobody else
/// uses while the slice lives.
pub unsafe fn room<'a, T>(first: *mut T, count: usize, name: &str) -> Result<&'a mut [T], Failure> {
    if count == 0 {
        return Ok(&mut []);
    }
    check_aligned(first, count, name)?;
    // SAFETY: checked, and valid by this function's condition; the slice is made of what was written.
    Ok(unsafe {
        first.write_bytes(0, count);
        std::slice::from_raw_parts_mut(first, count)
    })
}

/// Points that stand `stride` bytes apart: borrowed where they are packed, copied otherwise.
///
/// # Safety
/// `first` is null or points to `count` points at that distance, which nobody changes while the slice lives.
pub unsafe fn points<'a, T: Copy>(
    first: *const T,
    count: usize,
    stride: usize,
) -> Result<Cow<'a, [[T; 3]]>, Failure> {
    let packed = size_of::<[T; 3]>();
    if count == 0 {
        return Ok(Cow::Borrowed(&[]));
    }
    if stride < packed {
        return Err(Failure::invalid_input(format!("stride must be at least {packed} bytes, not {stride}")));
    }
    check(first, count, stride, "points")?;
    let first = first.cast::<[T; 3]>();
    if stride == packed && first.is_aligned() {
        // SAFETY: checked, and valid by this function's condition.
        return Ok(Cow::Borrowed(unsafe { std::slice::from_raw_parts(first, count) }));
    }
    // SAFETY: each point is valid by this function's condition; the bytes of a message may have any
    // alignment.
    let point = |i: usize| unsafe { first.byte_add(i * stride).read_unaligned() };
    Ok(Cow::Owned((0..count).map(point).collect()))
}

/// Refuses what cannot be the first of an array.
fn check<T>(first: *const T, count: usize, stride: usize, name: &str) -> Result<(), Failure> {
    if first.is_null() {
        return Err(Failure::invalid_input(format!("{name} must not be null")));
    }
    if count.checked_mul(stride).is_none_or(|size| size > isize::MAX as usize) {
        let message = format!("{name}: {count} entries of {stride} bytes are more than memory can hold");
        return Err(Failure::invalid_input(message));
    }
    Ok(())
}

fn check_aligned<T>(first: *const T, count: usize, name: &str) -> Result<(), Failure> {
    check(first, count, size_of::<T>(), name)?;
    if first.is_aligned() {
        return Ok(());
    }
    Err(Failure::invalid_input(format!("{name} must be aligned as its type")))
}
