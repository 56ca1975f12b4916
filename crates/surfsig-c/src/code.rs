//! What a call returns, and the text that goes with it.

use crate::arrays::present;
use std::any::Any;
use std::cell::RefCell;
use std::ffi::{CString, c_char};
use std::panic::{AssertUnwindSafe, catch_unwind};

/// What became of a call.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum surfsig_code {
    /// It did what was asked for.
    Ok = 0,
    /// An argument has no meaning: a mistake that the caller can mend.
    InvalidInput = 1,
    /// The operating system refused threads or memory.
    System = 2,
    /// A bug in surfsig: please report it with the text of surfsig_last_error().
    Internal = 3,
    /// The points do not determine what was to be fitted: they are too few, or lie on a curve.
    Undetermined = 4,
    /// The progress function asked to stop.
    Cancelled = 5,
}

/// Why a call failed.
#[derive(Debug)]
pub(crate) struct Failure {
    code: surfsig_code,
    message: String,
}

impl Failure {
    pub fn invalid_input(message: impl Into<String>) -> Self {
        Self { code: surfsig_code::InvalidInput, message: message.into() }
    }

    pub fn system(message: impl Into<String>) -> Self {
        Self { code: surfsig_code::System, message: message.into() }
    }

    pub fn undetermined(what: &str) -> Self {
        Self { code: surfsig_code::Undetermined, message: format!("the points determine no {what}") }
    }

    /// The same of an argument with a name.
    pub fn of(self, name: &str) -> Self {
        Self { message: format!("{name}: {}", self.message), ..self }
    }

    pub fn panicked(payload: &(dyn Any + Send)) -> Self {
        let text = payload.downcast_ref::<&str>().copied();
        let text = text.or_else(|| payload.downcast_ref::<String>().map(String::as_str));
        let message = format!("internal error: {}", text.unwrap_or("no text"));
        Self { code: surfsig_code::Internal, message }
    }
}

impl From<surfsig::TransformError> for Failure {
    fn from(error: surfsig::TransformError) -> Self {
        Self::invalid_input(error.to_string())
    }
}

impl From<surfsig::Error> for Failure {
    fn from(error: surfsig::Error) -> Self {
        let code = match error {
            surfsig::Error::Threads { .. } => surfsig_code::System,
            surfsig::Error::Cancelled => surfsig_code::Cancelled,
            _ => surfsig_code::InvalidInput,
        };
        Self { code, message: error.to_string() }
    }
}

thread_local! {
    static LAST_ERROR: RefCell<CString> = RefCell::default();
}

/// Runs the body of a call: neither an error nor a panic leaves it but as a code and a text.
pub(crate) fn guarded(body: impl FnOnce() -> Result<(), Failure>) -> surfsig_code {
    // A body that panics leaves nothing behind but what the caller gave it to fill.
    let result = catch_unwind(AssertUnwindSafe(body))
        .unwrap_or_else(|payload| Err(Failure::panicked(payload.as_ref())));
    let Err(failure) = result else { return surfsig_code::Ok };
    let text = CString::new(failure.message.replace('\0', " ")).unwrap_or_default();
    LAST_ERROR.with_borrow_mut(|last| *last = text);
    failure.code
}

/// Changes options that must not be null.
pub(crate) fn set<T>(
    options: Option<&mut T>,
    change: impl FnOnce(&mut T) -> Result<(), Failure>,
) -> surfsig_code {
    guarded(|| change(present(options, "options")?))
}

/// One line about the last call of this thread that failed; empty where none has. Never to be freed; valid
/// until the thread's next call that fails.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_last_error() -> *const c_char {
    LAST_ERROR.with_borrow(|last| last.as_ptr())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::ffi::CStr;

    fn last_error() -> String {
        // SAFETY: a null-terminated string that lives until the next failure.
        unsafe { CStr::from_ptr(surfsig_last_error()) }.to_str().unwrap().to_owned()
    }

    #[test]
    fn a_panic_becomes_a_code_and_a_text() {
        assert_eq!(guarded(|| panic!("row {} of 2", 3)), surfsig_code::Internal);
        assert_eq!(last_error(), "internal error: row 3 of 2");
    }

    #[test]
    fn threads_are_the_systems_fault_and_all_else_the_callers() {
        let refused = surfsig::Error::Threads { threads: 2, reason: "no memory".into() };
        assert_eq!(guarded(|| Err(refused.into())), surfsig_code::System);
        assert_eq!(last_error(), "cannot start 2 threads: no memory");
        let radius = surfsig::Error::InvalidRadius(-1.0);
        assert_eq!(guarded(|| Err(radius.into())), surfsig_code::InvalidInput);
    }

    #[test]
    fn each_thread_has_its_own_text() {
        guarded(|| Err(Failure::invalid_input("here")));
        assert_eq!(std::thread::spawn(last_error).join().unwrap(), "");
        assert_eq!(last_error(), "here");
    }
}
