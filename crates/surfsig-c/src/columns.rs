//! Columns of results, each declared once: from the declaration come the C function, its place in the header, and the
//! header's list of columns, from which surfsig.hpp makes its methods.

use crate::kind::surfsig_surface_kind;
use crate::options::surfsig_fit_used;
use crate::status::surfsig_status;

/// What stands in a column: one number for each row, or several.
pub trait Entry {
    /// The numbers as C sees them.
    type Scalar;
    /// C's name of the type.
    const C_TYPE: &'static str;
    /// Numbers of a row.
    const WIDTH: usize = 1;
}

macro_rules! entries {
    ($($type:ty as $scalar:ty: $name:literal),* $(,)?) => {
        $(impl Entry for $type {
            type Scalar = $scalar;
            const C_TYPE: &'static str = $name;
        })*
    };
}

entries! {
    f32 as f32: "float",
    f64 as f64: "double",
    u32 as u32: "uint32_t",
    i32 as i32: "int32_t",
    surfsig::Status as surfsig_status: "surfsig_status",
    surfsig::FitUsed as surfsig_fit_used: "surfsig_fit_used",
    surfsig::SurfaceKind as surfsig_surface_kind: "surfsig_surface_kind",
}

impl<T: Entry, const N: usize> Entry for [T; N] {
    type Scalar = T::Scalar;
    const C_TYPE: &'static str = T::C_TYPE;
    const WIDTH: usize = N * T::WIDTH;
}

/// A column as the header lists it.
pub struct Declaration {
    /// The C function that gives it.
    pub function: &'static str,
    /// C's name of the type of its numbers.
    pub c_type: &'static str,
    /// Numbers of a row.
    pub width: usize,
    /// The function's comment, line by line.
    pub comment: &'static [&'static str],
}

/// The columns of a kind of result.
pub struct Table {
    /// C's name of the result's type.
    pub handle: &'static str,
    /// They, in the order of the header.
    pub columns: &'static [Declaration],
}

/// A column's first entry; null for an empty one, or where there is no result.
pub(crate) fn first_entry<H, T: Entry>(handle: Option<&H>, column: impl Fn(&H) -> &[T]) -> *const T::Scalar {
    let column = handle.map_or(&[][..], column);
    if column.is_empty() { std::ptr::null() } else { column.as_ptr().cast() }
}

/// Declares the columns of a result, in a constant table and as functions of C.
macro_rules! columns {
    ($table:ident of $handle:ident: $($(#[doc = $comment:literal])* $function:ident: $type:ty = $column:expr;)*) => {
        /// The columns as the header lists them.
        pub const $table: $crate::columns::Table = $crate::columns::Table {
            handle: stringify!($handle),
            columns: &[$($crate::columns::Declaration {
                function: stringify!($function),
                c_type: <$type as $crate::columns::Entry>::C_TYPE,
                width: <$type as $crate::columns::Entry>::WIDTH,
                comment: &[$($comment),*],
            }),*],
        };
        $(
            $(#[doc = $comment])*
            #[unsafe(no_mangle)]
            pub extern "C" fn $function(
                handle: Option<&$handle>,
            ) -> *const <$type as $crate::columns::Entry>::Scalar {
                $crate::columns::first_entry::<$handle, $type>(handle, $column)
            }
        )*
    };
}

/// The same for a result that the core gives row by row: also the struct that holds the columns, in a field `columns`
/// of the result.
macro_rules! columns_of_rows {
    (
        $table:ident of $handle:ident, $columns:ident of $row:ty:
        $($(#[doc = $comment:literal])* $function:ident: $type:ty = $value:expr;)*
    ) => {
        /// The columns, named by their functions.
        struct $columns {
            $($function: Vec<$type>,)*
        }

        impl $columns {
            fn of(rows: &[$row]) -> Self {
                fn column<T>(rows: &[$row], value: impl Fn(&$row) -> T) -> Vec<T> {
                    rows.iter().map(value).collect()
                }
                Self { $($function: column(rows, $value),)* }
            }
        }

        columns! {
            $table of $handle:
            $($(#[doc = $comment])* $function: $type = |result| &result.columns.$function;)*
        }
    };
}
