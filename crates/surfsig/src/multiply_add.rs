//! A product and a sum: rounded once where the hardware can, in two roundings in WebAssembly.
//!
//! WebAssembly has no fused multiply-add, and one in software takes fifty times as long as the two operations. So
//! results there differ from those of other targets by rounding; on one target they always have the same bits.

/// `self * factor + term`.
pub(crate) trait MultiplyAdd {
    /// Rounded once, except in WebAssembly.
    fn times_plus(self, factor: Self, term: Self) -> Self;
}

macro_rules! multiply_add {
    ($float:ty) => {
        impl MultiplyAdd for $float {
            #[inline(always)]
            fn times_plus(self, factor: Self, term: Self) -> Self {
                #[cfg(not(target_family = "wasm"))]
                return self.mul_add(factor, term);
                #[cfg(target_family = "wasm")]
                return self * factor + term;
            }
        }
    };
}
multiply_add!(f32);
multiply_add!(f64);

#[cfg(test)]
mod tests {
    use super::MultiplyAdd;

    #[test]
    fn a_product_and_a_sum_are_rounded_once() {
        // (1 + e)(1 - e) - 1 = -e^2, which a product that is rounded by itself loses.
        let e = f32::EPSILON;
        assert_eq!((1.0 + e).times_plus(1.0 - e, -1.0), -e * e);
        let e = f64::EPSILON;
        assert_eq!((1.0 + e).times_plus(1.0 - e, -1.0), -e * e);
    }
}
