//! Eight numbers that are computed with at once: one for each of eight points whose fits run side by side.
//!
//! Plain arrays and loops of fixed length: inlined into a function that is compiled for AVX2 or
//! AVX-512, each becomes one or two instructions. No lane ever looks at another, so a point's result
//! does not depend on its neighbours in the batch.

use crate::multiply_add::MultiplyAdd;
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
use std::arch::wasm32::v128;
use std::ops::{Add, BitAnd, BitOr, Div, Mul, Neg, Not, Sub};

/// `[f(0), f(1), ...]` by a plain loop: a closure handed to a library function would be compiled on
/// its own, without the instructions of the function around it.
macro_rules! each_lane {
    ($lane:ident => $value:expr) => {{
        let mut lanes = [Default::default(); LANES];
        for $lane in 0..LANES {
            lanes[$lane] = $value;
        }
        lanes
    }};
}

/// Number of points whose fits run side by side.
pub(crate) const LANES: usize = 8;

/// One `f64` for each point of a batch. Aligned as the widest registers are: half of all loads would
/// otherwise touch two cache lines.
#[repr(align(64))]
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Lanes(pub [f64; LANES]);

/// One yes or no for each point of a batch, all bits of a lane alike.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Mask([u64; LANES]);

impl Lanes {
    pub const ZERO: Self = Self([0.0; LANES]);
    pub const ONE: Self = Self([1.0; LANES]);

    #[inline(always)]
    pub fn splat(value: f64) -> Self {
        Self([value; LANES])
    }

    /// `self * factor + term`, rounded once where the hardware can.
    #[inline(always)]
    pub fn mul_add(self, factor: Self, term: Self) -> Self {
        if cfg!(target_family = "wasm") {
            return self * factor + term;
        }
        Self(each_lane!(l => self.0[l].times_plus(factor.0[l], term.0[l])))
    }

    #[inline(always)]
    pub fn sqrt(self) -> Self {
        Self(each_lane!(l => self.0[l].sqrt()))
    }

    #[inline(always)]
    pub fn abs(self) -> Self {
        Self(each_lane!(l => self.0[l].abs()))
    }

    /// The larger one; `other` where `self` is not a number.
    #[inline(always)]
    pub fn max(self, other: Self) -> Self {
        Self(each_lane!(l => if self.0[l] > other.0[l] { self.0[l] } else { other.0[l] }))
    }

    /// The smaller one; `other` where `self` is not a number.
    #[inline(always)]
    pub fn min(self, other: Self) -> Self {
        Self(each_lane!(l => if self.0[l] < other.0[l] { self.0[l] } else { other.0[l] }))
    }

    #[inline(always)]
    pub fn lt(self, other: Self) -> Mask {
        Mask(each_lane!(l => if self.0[l] < other.0[l] { u64::MAX } else { 0 }))
    }

    #[inline(always)]
    pub fn le(self, other: Self) -> Mask {
        Mask(each_lane!(l => if self.0[l] <= other.0[l] { u64::MAX } else { 0 }))
    }
}

/// WebAssembly's vectors of two: of the plain loops the compiler leaves some as they are.
#[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
impl Lanes {
    #[inline(always)]
    fn with(self, other: Self, operation: impl Fn(v128, v128) -> v128) -> Self {
        let (mine, others) = (self.vectors(), other.vectors());
        let mut vectors = mine;
        for i in 0..vectors.len() {
            vectors[i] = operation(mine[i], others[i]);
        }
        // SAFETY: four vectors are eight numbers, of which every bit pattern is one.
        Self(unsafe { std::mem::transmute::<[v128; LANES / 2], [f64; LANES]>(vectors) })
    }

    #[inline(always)]
    fn vectors(self) -> [v128; LANES / 2] {
        // SAFETY: as above.
        unsafe { std::mem::transmute::<[f64; LANES], [v128; LANES / 2]>(self.0) }
    }
}

impl Mask {
    pub const ALL: Self = Self([u64::MAX; LANES]);

    /// `yes` where the mask is set, `no` elsewhere.
    #[inline(always)]
    pub fn select(self, yes: Lanes, no: Lanes) -> Lanes {
        Lanes(
            each_lane!(l => f64::from_bits(yes.0[l].to_bits() & self.0[l] | no.0[l].to_bits() & !self.0[l])),
        )
    }

    #[inline(always)]
    pub fn any(self) -> bool {
        self.0 != [0; LANES]
    }

    #[inline(always)]
    pub fn get(self, lane: usize) -> bool {
        self.0[lane] != 0
    }
}

macro_rules! lanewise {
    ($trait:ident, $method:ident, $op:tt, $vector:ident) => {
        impl $trait for Lanes {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
                return self.with(other, |a, b| std::arch::wasm32::$vector(a, b));
                #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
                Self(each_lane!(l => self.0[l] $op other.0[l]))
            }
        }
    };
}
lanewise!(Add, add, +, f64x2_add);
lanewise!(Sub, sub, -, f64x2_sub);
lanewise!(Mul, mul, *, f64x2_mul);
lanewise!(Div, div, /, f64x2_div);

impl Neg for Lanes {
    type Output = Self;
    #[inline(always)]
    fn neg(self) -> Self {
        Self(each_lane!(l => -self.0[l]))
    }
}

impl BitAnd for Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        Self(each_lane!(l => self.0[l] & other.0[l]))
    }
}

impl BitOr for Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        Self(each_lane!(l => self.0[l] | other.0[l]))
    }
}

impl Not for Mask {
    type Output = Self;
    #[inline(always)]
    fn not(self) -> Self {
        Self(each_lane!(l => !self.0[l]))
    }
}
