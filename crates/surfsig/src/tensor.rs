//! Moments of many points at once, seen along given axes.

use crate::moments::{MOMENTS, Moments};
use crate::simd::lanes::{LANES, Lanes, Mask};

/// A vector for each point of a batch.
pub(crate) type Vector = [Lanes; 3];

#[inline(always)]
pub(crate) fn dot(a: &Vector, b: &Vector) -> Lanes {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

#[inline(always)]
pub(crate) fn cross(a: &Vector, b: &Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// `a + s b`
#[inline(always)]
pub(crate) fn add_scaled(a: &Vector, s: Lanes, b: &Vector) -> Vector {
    [s.mul_add(b[0], a[0]), s.mul_add(b[1], a[1]), s.mul_add(b[2], a[2])]
}

#[inline(always)]
pub(crate) fn normalised(a: &Vector) -> Vector {
    let inverse = Lanes::ONE / dot(a, a).sqrt();
    [a[0] * inverse, a[1] * inverse, a[2] * inverse]
}

/// `a` where the mask is set, `b` elsewhere.
#[inline(always)]
pub(crate) fn chosen(mask: Mask, a: &Vector, b: &Vector) -> Vector {
    [mask.select(a[0], b[0]), mask.select(a[1], b[1]), mask.select(a[2], b[2])]
}

/// `-a` where the mask is set, `a` elsewhere.
#[inline(always)]
pub(crate) fn inverted(a: &Vector, mask: Mask) -> Vector {
    chosen(mask, &[-a[0], -a[1], -a[2]], a)
}

/// Right-handed axes for each point of a batch: two in the patch, one along its height.
#[derive(Clone, Copy)]
pub(crate) struct Axes {
    pub u: Vector,
    pub v: Vector,
    pub w: Vector,
}

impl Axes {
    /// The cloud's own.
    #[inline(always)]
    pub fn of_cloud() -> Self {
        let (one, zero) = (Lanes::ONE, Lanes::ZERO);
        Self { u: [one, zero, zero], v: [zero, one, zero], w: [zero, zero, one] }
    }

    /// These axes where `mask` is set, and the others elsewhere.
    #[inline(always)]
    pub fn chosen(&self, mask: Mask, others: &Self) -> Self {
        Self {
            u: chosen(mask, &self.u, &others.u),
            v: chosen(mask, &self.v, &others.v),
            w: chosen(mask, &self.w, &others.w),
        }
    }

    /// With `w` along a new direction and `u` turned as little as possible.
    #[inline(always)]
    pub fn tilted_to(&self, w: &Vector) -> Self {
        let w = normalised(w);
        let u = normalised(&add_scaled(&self.u, -dot(&self.u, &w), &w));
        Self { u, v: cross(&w, &u), w }
    }
}

/// The moments of a batch of balls, each normalised by its number of points.
pub(crate) struct MomentBatch {
    pub count: Lanes,
    sums: [Lanes; MOMENTS],
}

/// The normalised moments that a paraboloid over (u, v) with heights along w needs.
pub(crate) struct PatchMoments {
    /// u^i v^j, in the order 1, u, v, uu, uv, vv, uuu, uuv, uvv, vvv, uuuu, uuuv, uuvv, uvvv, vvvv.
    pub plane: [Lanes; 15],
    /// w times 1, u, v, uu, uv, vv.
    pub height: [Lanes; 6],
    /// w^2.
    pub height_square: Lanes,
}

impl MomentBatch {
    /// Lanes beyond those given repeat the last, so that they cost and break nothing.
    pub fn new(moments: &[Moments<f64>]) -> Self {
        assert!((1..=LANES).contains(&moments.len()));
        let lane = |l: usize| &moments[l.min(moments.len() - 1)];
        let count = Lanes(std::array::from_fn(|l| lane(l).sums[0]));
        let inverse = count.0.map(|n| if n > 0.0 { 1.0 / n } else { 0.0 });
        let sums = std::array::from_fn(|k| Lanes(std::array::from_fn(|l| lane(l).sums[k] * inverse[l])));
        Self { count, sums }
    }

    fn order<const N: usize>(&self, first: usize) -> &[Lanes; N] {
        self.sums[first..first + N].try_into().expect("a slice of that length")
    }

    /// The mean of the monomial that stands in a slot.
    #[inline(always)]
    pub fn monomial(&self, slot: usize) -> Lanes {
        self.sums[slot]
    }

    #[inline(always)]
    pub fn mean(&self) -> &Vector {
        self.order::<3>(1)
    }

    /// xx, xy, xz, yy, yz, zz about the origin.
    #[inline(always)]
    pub fn second(&self) -> &[Lanes; 6] {
        self.order::<6>(4)
    }

    /// xx, xy, xz, yy, yz, zz about the mean.
    #[inline(always)]
    pub fn covariance(&self) -> [Lanes; 6] {
        let [x, y, z] = *self.mean();
        let m = self.second();
        [m[0] - x * x, m[1] - x * y, m[2] - x * z, m[3] - y * y, m[4] - y * z, m[5] - z * z]
    }

    #[inline(always)]
    pub fn along(&self, axes: &Axes) -> PatchMoments {
        let Axes { u, v, w } = axes;
        let (first, second) = (self.mean(), self.second());
        let (third, fourth) = (self.order::<10>(10), self.order::<15>(20));
        let (second_u, second_v, second_w) =
            (contract::<6, 3>(second, u), contract::<6, 3>(second, v), contract::<6, 3>(second, w));
        let (third_u, third_v) = (contract::<10, 6>(third, u), contract::<10, 6>(third, v));
        let (third_uu, third_uv, third_vv) =
            (contract::<6, 3>(&third_u, u), contract::<6, 3>(&third_u, v), contract::<6, 3>(&third_v, v));
        let (fourth_u, fourth_v) = (contract::<15, 10>(fourth, u), contract::<15, 10>(fourth, v));
        let (fourth_uu, fourth_uv, fourth_vv) = (
            contract::<10, 6>(&fourth_u, u),
            contract::<10, 6>(&fourth_u, v),
            contract::<10, 6>(&fourth_v, v),
        );
        let fourth_uuu = contract::<6, 3>(&fourth_uu, u);
        PatchMoments {
            plane: [
                Lanes::ONE,
                dot(first, u),
                dot(first, v),
                dot(&second_u, u),
                dot(&second_u, v),
                dot(&second_v, v),
                dot(&third_uu, u),
                dot(&third_uu, v),
                dot(&third_uv, v),
                dot(&third_vv, v),
                dot(&fourth_uuu, u),
                dot(&fourth_uuu, v),
                dot(&contract::<6, 3>(&fourth_uu, v), v),
                dot(&contract::<6, 3>(&fourth_uv, v), v),
                dot(&contract::<6, 3>(&fourth_vv, v), v),
            ],
            height: [
                dot(first, w),
                dot(&second_u, w),
                dot(&second_v, w),
                dot(&third_uu, w),
                dot(&third_uv, w),
                dot(&third_vv, w),
            ],
            height_square: dot(&second_w, w),
        }
    }
}

/// A symmetric tensor with one of its indices taken along `a`.
///
/// A tensor's components stand in the order of [`crate::EXPONENTS`]: a triangle, of which row `r`
/// holds the monomials with r factors other than x. One more factor x keeps the place, one more y
/// or z moves it a row down.
#[inline(always)]
fn contract<const IN: usize, const OUT: usize>(tensor: &[Lanes; IN], a: &Vector) -> [Lanes; OUT] {
    let mut taken = [Lanes::ZERO; OUT];
    // Written out: of a loop the compiler makes vectors across places, with a gather for each operand.
    macro_rules! take {
        ($($place:literal in row $row:literal),*) => {
            $(if $place < OUT {
                let below = $place + $row + 1;
                let y = tensor[below].mul_add(a[1], tensor[$place] * a[0]);
                taken[$place] = tensor[below + 1].mul_add(a[2], y);
            })*
        };
    }
    take!(0 in row 0, 1 in row 1, 2 in row 1, 3 in row 2, 4 in row 2, 5 in row 2);
    take!(6 in row 3, 7 in row 3, 8 in row 3, 9 in row 3);
    taken
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn moments_along_turned_axes_are_those_of_the_turned_points() {
        let points: Vec<[f64; 3]> = (0..40)
            .map(f64::from)
            .map(|t| [(0.7 * t).sin(), (1.3 * t + 1.0).cos(), 0.3 * (0.31 * t).sin() + 0.2])
            .collect();
        let w = [0.48, -0.6, 0.64];
        let axes = Axes::of_cloud().tilted_to(&w.map(Lanes::splat));
        let rows = [axes.u, axes.v, axes.w].map(|a| a.map(|c| c.0[3]));
        let turned = Moments::<f64>::of_points(&points).rotated(&rows);
        let patch = MomentBatch::new(&[Moments::of_points(&points); LANES]).along(&axes);
        let expect = |value: Lanes, i, j, k| {
            let expected = turned.get(i, j, k) / 40.0;
            assert!((value.0[3] - expected).abs() < 1e-14, "{i} {j} {k}: {} {expected}", value.0[3]);
        };
        let mut slot = 0;
        for order in 0..=4 {
            for j in 0..=order {
                expect(patch.plane[slot], order - j, j, 0);
                if order <= 2 {
                    expect(patch.height[slot], order - j, j, 1);
                }
                slot += 1;
            }
        }
        expect(patch.height_square, 0, 0, 2);
    }
}
