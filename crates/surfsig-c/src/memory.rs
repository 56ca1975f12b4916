//! Memory for callers in a browser, who have no allocator of their own in WebAssembly's memory.

use std::alloc::{Layout, alloc, dealloc};

/// Alignment of all that is allocated: that of the widest number.
const ALIGNMENT: usize = 16;

fn layout(bytes: usize) -> Option<Layout> {
    Layout::from_size_align(bytes, ALIGNMENT).ok().filter(|layout| layout.size() > 0)
}

/// Gives so many bytes; null where there are none to be had.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_allocate(bytes: usize) -> *mut u8 {
    // SAFETY: the size is not 0.
    layout(bytes).map_or(std::ptr::null_mut(), |layout| unsafe { alloc(layout) })
}

/// Takes bytes back.
///
/// # Safety
/// `first` is null, or was given for as many bytes and has not been taken back.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_release(first: *mut u8, bytes: usize) {
    if let (false, Some(layout)) = (first.is_null(), layout(bytes)) {
        // SAFETY: by the function's condition.
        unsafe { dealloc(first, layout) };
    }
}
