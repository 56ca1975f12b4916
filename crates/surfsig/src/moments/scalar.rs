//! The numbers that sums are kept in.

use crate::multiply_add::MultiplyAdd;
use std::fmt::Debug;
use std::ops::{Add, AddAssign, Mul, Sub};

/// A floating-point number that moments can be kept in: `f32` or `f64`.
///
/// The paraboloid tolerates sums in `f32`; an implicit quadric, and the residual of a surface that is
/// smooth to a few thousandths of the radius, need `f64`.
///
/// ```
/// use surfsig::Scalar;
/// assert_eq!(<f32 as Scalar>::from_f64(0.5).to_f64(), 0.5);
/// ```
pub trait Scalar:
    Copy
    + Debug
    + Default
    + PartialEq
    + Add<Output = Self>
    + AddAssign
    + Sub<Output = Self>
    + Mul<Output = Self>
    + Send
    + Sync
{
    /// Nearest value.
    fn from_f64(value: f64) -> Self;
    /// Exact value.
    fn from_f32(value: f32) -> Self;
    /// Exact value.
    fn to_f64(self) -> f64;
    /// `self * factor + term`, rounded once; in WebAssembly, which has no such instruction, twice.
    fn mul_add(self, factor: Self, term: Self) -> Self;
}

macro_rules! scalar {
    ($float:ty) => {
        impl Scalar for $float {
            #[inline(always)]
            fn from_f64(value: f64) -> Self {
                value as Self
            }
            #[inline(always)]
            fn from_f32(value: f32) -> Self {
                value.into()
            }
            #[inline(always)]
            fn to_f64(self) -> f64 {
                self.into()
            }
            #[inline(always)]
            fn mul_add(self, factor: Self, term: Self) -> Self {
                self.times_plus(factor, term)
            }
        }
    };
}
scalar!(f32);
scalar!(f64);
