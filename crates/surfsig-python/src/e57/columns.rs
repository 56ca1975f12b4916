//! Columns of numbers in the smallest type that holds what a record may be.

use e57::{RecordDataType, RecordValue};
use numpy::IntoPyArray;
use pyo3::prelude::*;

macro_rules! columns {
    ($($kind:ident: $number:ty),*) => {
        /// One value of every point.
        pub enum Column {
            $($kind(Vec<$number>)),*
        }

        impl Column {
            pub fn reserve(&mut self, count: usize) -> bool {
                match self {
                    $(Self::$kind(values) => values.try_reserve(count).is_ok()),*
                }
            }

            pub fn into_array(self, py: Python<'_>) -> Bound<'_, PyAny> {
                match self {
                    $(Self::$kind(values) => values.into_pyarray(py).into_any()),*
                }
            }

            /// Appends a value; `kind` is the one that the column was made for.
            pub fn push(&mut self, value: &RecordValue, kind: &RecordDataType) {
                let double = match (value, kind) {
                    (RecordValue::Double(value), _) => *value,
                    (RecordValue::Single(value), _) => f64::from(*value),
                    (RecordValue::ScaledInteger(value), RecordDataType::ScaledInteger { scale, offset, .. }) => {
                        *value as f64 * scale + offset
                    }
                    (RecordValue::Integer(value) | RecordValue::ScaledInteger(value), _) => {
                        return match self {
                            $(Self::$kind(values) => values.push(*value as $number)),*
                        };
                    }
                };
                match self {
                    $(Self::$kind(values) => values.push(double as $number)),*
                }
            }
        }
    };
}

columns!(I8: i8, U8: u8, I16: i16, U16: u16, I32: i32, U32: u32, I64: i64, F32: f32, F64: f64);

impl Column {
    /// An empty column for such records: floats as they are, scaled integers as float64.
    pub fn new(kind: &RecordDataType) -> Self {
        let (min, max) = match kind {
            RecordDataType::Single { .. } => return Self::F32(Vec::new()),
            RecordDataType::Double { .. } | RecordDataType::ScaledInteger { .. } => {
                return Self::F64(Vec::new());
            }
            // The stored bits can say more than the stated maximum.
            RecordDataType::Integer { min, .. } => (i128::from(*min), i128::from(*min) + largest(kind)),
        };
        let fits = |low: i128, high: i128| low <= min && max <= high;
        match () {
            () if fits(0, u8::MAX.into()) => Self::U8(Vec::new()),
            () if fits(i8::MIN.into(), i8::MAX.into()) => Self::I8(Vec::new()),
            () if fits(0, u16::MAX.into()) => Self::U16(Vec::new()),
            () if fits(i16::MIN.into(), i16::MAX.into()) => Self::I16(Vec::new()),
            () if fits(0, u32::MAX.into()) => Self::U32(Vec::new()),
            () if fits(i32::MIN.into(), i32::MAX.into()) => Self::I32(Vec::new()),
            () => Self::I64(Vec::new()),
        }
    }
}

/// The largest number in the bits of an integer record.
fn largest(kind: &RecordDataType) -> i128 {
    (1_i128 << bits(kind)) - 1
}

/// Bits of one value in the file.
pub fn bits(kind: &RecordDataType) -> u32 {
    match kind {
        RecordDataType::Single { .. } => 32,
        RecordDataType::Double { .. } => 64,
        RecordDataType::Integer { min, max } | RecordDataType::ScaledInteger { min, max, .. } => {
            (i128::from(*max) - i128::from(*min)).checked_ilog2().map_or(0, |highest| highest + 1)
        }
    }
}
