//! Arrays as C gives them.

use crate::code::Failure;
use std::borrow::Cow;
use std::mem::size_of;

/// Most entries of an array: points are numbered by 32 bits, and what is longer is a mistake.
const MOST_ENTRIES: usize = u32::MAX as usize;

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
    let mut copy = Vec::new();
    let refused = |_| Failure::system(format!("no memory for a copy of {count} points"));
    copy.try_reserve_exact(count).map_err(refused)?;
    copy.extend((0..count).map(point));
    Ok(Cow::Owned(copy))
}

/// Where a result is put.
///
/// # Safety
/// `result` is null or points to where a value can be written.
pub unsafe fn put<T>(result: *mut T, value: T, name: &str) -> Result<(), Failure> {
    if result.is_null() {
        return Err(Failure::invalid_input(format!("{name} must not be null")));
    }
    // SAFETY: not null, and the caller's to be written; what stood there may have had no value.
    unsafe { result.write_unaligned(value) };
    Ok(())
}

/// Where a new object is put: null until the work that makes it has succeeded.
///
/// # Safety
/// `result` is null or points to where a pointer can be written.
pub unsafe fn put_new<T>(
    result: *mut *mut T,
    name: &str,
    work: impl FnOnce() -> Result<T, Failure>,
) -> Result<(), Failure> {
    // SAFETY: the condition is the same.
    unsafe { put(result, std::ptr::null_mut(), name) }?;
    let made = Box::new(work()?);
    // SAFETY: the condition is the same.
    unsafe { put(result, Box::into_raw(made), name) }
}

/// Numbers of a fixed count, such as x, y, z; `None` for null.
///
/// # Safety
/// `first` is null or points to `N` numbers, of any alignment.
pub unsafe fn numbers<const N: usize>(first: *const f64) -> Option<[f64; N]> {
    // SAFETY: not null, and valid by this function's condition.
    (!first.is_null()).then(|| unsafe { first.cast::<[f64; N]>().read_unaligned() })
}

/// A point in the cloud's coordinates, `None` for null.
///
/// # Safety
/// `position` is null or points to three numbers.
pub unsafe fn position(position: *const f64, name: &str) -> Result<Option<[f64; 3]>, Failure> {
    // SAFETY: the condition is the same.
    let position = unsafe { numbers(position) };
    match position {
        Some(p) if !p.iter().all(|c| c.is_finite()) => {
            Err(Failure::invalid_input(format!("{name} must be finite, not {p:?}")))
        }
        _ => Ok(position),
    }
}

/// What must not be null.
pub fn present<T>(object: Option<T>, name: &str) -> Result<T, Failure> {
    object.ok_or_else(|| Failure::invalid_input(format!("{name} must not be null")))
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
    if count > MOST_ENTRIES {
        let message = format!("{name}: {count} entries are too many: at most {MOST_ENTRIES} are numbered");
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
