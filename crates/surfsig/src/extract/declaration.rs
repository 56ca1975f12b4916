//! From one declaration of a result's columns: the result itself, the columns while threads write to them, and all that
//! is done to each column alike.

use crate::Status;
use crate::fit::FitUsed;

/// What stands in a column for one query.
pub(super) trait Entry: Copy + Send + Sync {
    /// Where there is no value.
    const MISSING: Self;
    /// Before anything is written: zeros cost nothing until they are written over, and then in many threads at once.
    const BLANK: Self;
}

macro_rules! entries {
    ($($type:ty: $missing:expr, $blank:expr;)*) => {
        $(impl Entry for $type {
            const MISSING: Self = $missing;
            const BLANK: Self = $blank;
        })*
    };
}

entries! {
    f32: f32::NAN, 0.0;
    u32: 0, 0;
    Status: Status::NotFinite, Status::NotFinite;
    FitUsed: FitUsed::None, FitUsed::None;
}

impl<const N: usize> Entry for [f32; N] {
    const MISSING: Self = [f32::NAN; N];
    const BLANK: Self = [0.0; N];
}

/// Declares an extraction: what belongs to all queries, and its columns.
///
/// A column is that of what was fitted (`of_fit`, which has no value where coordinates are too coarse) or not
/// (`of_points`), and may be there only under a condition, a field of [`super::columns::Conditions`].
macro_rules! extraction {
    (
        $(#[$about:meta])*
        pub struct Extraction {
            $($(#[$shared_about:meta])* $shared:ident: $shared_type:ty,)*
        }
        columns {
            $($(#[$column_about:meta])* $column:ident: $entry:ty, $origin:ident $(if $condition:ident)?;)*
        }
    ) => {
        $(#[$about])*
        #[derive(Debug, Clone)]
        pub struct Extraction {
            $($(#[$shared_about])* pub $shared: $shared_type,)*
            $($(#[$column_about])* pub $column: Vec<$entry>,)*
        }

        impl Extraction {
            /// Takes over values from another extraction: (number here, number there). A column that is not there on
            /// either side stays as it is.
            pub(crate) fn take_over(
                &mut self,
                numbers: impl Iterator<Item = (usize, usize)> + Clone,
                with: &Self,
            ) {
                $(if !self.$column.is_empty() && !with.$column.is_empty() {
                    numbers.clone().for_each(|(here, there)| self.$column[here] = with.$column[there]);
                })*
            }

            /// Takes away what was fitted to a query.
            fn clear_fit(&mut self, query: usize) {
                $(extraction!(@clear $origin self.$column, query);)*
            }

            /// The columns with their names, in the order of the fields; those that are not there are left out.
            ///
            /// ```
            /// use surfsig::{Column, ExtractOptions, PointCloud, Radius, extract};
            /// let found = extract(&PointCloud::new(&[[0.0; 3]]), Radius::new(1.0)?, &ExtractOptions::default())?;
            /// let columns: Vec<(&str, Column)> = found.into_columns().collect();
            /// assert!(matches!(&columns[0], ("k1", Column::Scalars(k1)) if k1[0].is_nan()));
            /// assert!(columns.iter().any(|(name, _)| *name == "count"));
            /// # Ok::<(), surfsig::Error>(())
            /// ```
            pub fn into_columns(self) -> impl Iterator<Item = (&'static str, Column)> {
                let conditions = Conditions::of(&self);
                let columns = [$((
                    extraction!(@is_there conditions $($condition)?),
                    stringify!($column),
                    Column::from(self.$column),
                )),*];
                columns.into_iter().filter(|column| column.0).map(|(_, name, column)| (name, column))
            }
        }

        /// The columns while threads write to them, in the order of the lattice: each thread then writes to memory of
        /// its own, one entry after the other.
        pub(super) struct Columns {
            pub(super) radius: f64,
            conditions: Conditions,
            $($column: Vec<$entry>,)*
        }

        impl Columns {
            pub fn new(len: usize, radius: f64, conditions: Conditions) -> Self {
                Self {
                    radius,
                    conditions,
                    $($column: {
                        let len = if extraction!(@is_there conditions $($condition)?) { len } else { 0 };
                        vec![<$entry>::BLANK; len]
                    },)*
                }
            }

            /// The columns cut into parts of these lengths.
            pub fn parts(&mut self, lengths: impl Iterator<Item = usize>) -> Vec<ColumnsPart<'_>> {
                let mut rest = ColumnsPart { radius: self.radius, $($column: &mut self.$column,)* };
                lengths.map(|len| rest.split_off(len)).collect()
            }

            /// The entries in the order of the queries, each at the place that `entries` gives.
            pub fn ordered(self, entries: &Entries, axes: FitAxes, oriented: bool) -> Extraction {
                let conditions = self.conditions;
                Extraction {
                    radius: self.radius,
                    axes,
                    oriented,
                    // One column after the other, so that hardly more than one is there twice.
                    $($column: if extraction!(@is_there conditions $($condition)?) {
                        entries.of(self.$column)
                    } else {
                        Vec::new()
                    },)*
                }
            }
        }

        /// Some neighbouring entries of the columns; of columns that are not there none.
        pub(super) struct ColumnsPart<'a> {
            pub(super) radius: f64,
            $(pub(super) $column: &'a mut [$entry],)*
        }

        impl ColumnsPart<'_> {
            /// Takes the first entries away, and returns them.
            fn split_off(&mut self, len: usize) -> Self {
                Self {
                    radius: self.radius,
                    $($column: self.$column.split_off_mut(..len).unwrap_or_default(),)*
                }
            }
        }
    };
    (@is_there $conditions:ident) => { true };
    (@is_there $conditions:ident $condition:ident) => { $conditions.$condition };
    (@clear of_points $self:ident.$column:ident, $query:ident) => {};
    (@clear of_fit $self:ident.$column:ident, $query:ident) => {
        if let Some(entry) = $self.$column.get_mut($query) {
            *entry = Entry::MISSING;
        }
    };
}

pub(super) use extraction;
