//! What order 2 says, free of charge: the normal to start from, and how flat or long a set of points is.

use crate::simd::lanes::{Lanes, Mask};
use crate::tensor::Vector;

/// Eigenvalues in descending order, and the directions of the largest and the smallest.
pub(crate) struct Spread {
    pub eigenvalues: [Lanes; 3],
    pub longest: Vector,
    pub normal: Vector,
}

/// Sweeps after which cyclic Jacobi has converged for any 3 x 3 matrix; three are usual.
const MAX_SWEEPS: usize = 8;

/// Off-diagonal part, relative to the trace, that no longer matters: the directions are right to as
/// much, and the eigenvalues to its square.
const NEGLIGIBLE: f64 = 1e-9;

/// Eigen-decomposition of covariances given as xx, xy, xz, yy, yz, zz, by cyclic Jacobi rotations.
#[inline(always)]
pub(crate) fn spread(covariance: [Lanes; 6]) -> Spread {
    let [xx, xy, xz, yy, yz, zz] = covariance;
    let mut diagonal = [xx, yy, zz];
    // off[k] couples the two axes other than k.
    let mut off = [yz, xz, xy];
    let (one, zero) = (Lanes::ONE, Lanes::ZERO);
    let mut vectors: [Vector; 3] = [[one, zero, zero], [zero, one, zero], [zero, zero, one]];
    let negligible = (xx + yy + zz) * Lanes::splat(NEGLIGIBLE);
    for _ in 0..MAX_SWEEPS {
        // A lane that has converged stays as it is, whatever its neighbours in the batch need.
        let active = negligible.lt(off[0].abs().max(off[1].abs()).max(off[2].abs()));
        if !active.any() {
            break;
        }
        rotate::<0, 1, 2>(&mut diagonal, &mut off, &mut vectors, active);
        rotate::<0, 2, 1>(&mut diagonal, &mut off, &mut vectors, active);
        rotate::<1, 2, 0>(&mut diagonal, &mut off, &mut vectors, active);
    }
    // Three exchanges sort three values.
    for (a, b) in [(0, 1), (1, 2), (0, 1)] {
        let swap = diagonal[a].lt(diagonal[b]);
        (diagonal[a], diagonal[b]) =
            (swap.select(diagonal[b], diagonal[a]), swap.select(diagonal[a], diagonal[b]));
        for axis in 0..3 {
            let (x, y) = (vectors[a][axis], vectors[b][axis]);
            (vectors[a][axis], vectors[b][axis]) = (swap.select(y, x), swap.select(x, y));
        }
    }
    Spread { eigenvalues: diagonal.map(|v| v.max(zero)), longest: vectors[0], normal: vectors[2] }
}

/// Turns axes P and Q so that they are no longer coupled; K is the third. Known when it is compiled,
/// so that everything stays in registers.
#[inline(always)]
fn rotate<const P: usize, const Q: usize, const K: usize>(
    diagonal: &mut [Lanes; 3],
    off: &mut [Lanes; 3],
    vectors: &mut [Vector; 3],
    active: Mask,
) {
    let (cosine, sine, tangent) = rotation(diagonal[P], diagonal[Q], off[K], active);
    let shift = tangent * off[K];
    diagonal[P] = diagonal[P] - shift;
    diagonal[Q] = diagonal[Q] + shift;
    off[K] = active.select(Lanes::ZERO, off[K]);
    // The other two couplings, of the third axis with P and with Q.
    let (with_p, with_q) = (off[Q], off[P]);
    off[Q] = cosine * with_p - sine * with_q;
    off[P] = sine * with_p + cosine * with_q;
    let (column_p, column_q) = (vectors[P], vectors[Q]);
    for axis in 0..3 {
        vectors[P][axis] = cosine * column_p[axis] - sine * column_q[axis];
        vectors[Q][axis] = sine * column_p[axis] + cosine * column_q[axis];
    }
}

/// Cosine, sine and tangent of the smaller angle that takes the coupling `off` of two axes away.
#[inline(always)]
pub(super) fn rotation(p: Lanes, q: Lanes, off: Lanes, active: Mask) -> (Lanes, Lanes, Lanes) {
    // Keeps 0 / 0 away where there is nothing to turn.
    let tiny = Lanes::splat(1e-300);
    let difference = q - p;
    let twice = off + off;
    let root = difference.mul_add(difference, twice * twice).sqrt() + tiny;
    let size = twice / (difference.abs() + root);
    let tangent = active.select(difference.lt(Lanes::ZERO).select(-size, size), Lanes::ZERO);
    let cosine = Lanes::ONE / tangent.mul_add(tangent, Lanes::ONE).sqrt();
    (cosine, tangent * cosine, tangent)
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    proptest! {
        #[test]
        fn agrees_with_a_general_eigen_decomposition(
            a in prop::array::uniform3(prop::array::uniform3(-1.0_f64..1.0)),
            thin in prop::sample::select(vec![1.0, 1e-3, 1e-8, 0.0]),
        ) {
            let mut a = nalgebra::Matrix3::from(a);
            a.column_mut(2).scale_mut(thin);
            let c = a * a.transpose();
            let spread = spread([c[(0, 0)], c[(0, 1)], c[(0, 2)], c[(1, 1)], c[(1, 2)], c[(2, 2)]].map(Lanes::splat));
            let mut expected: Vec<f64> = c.symmetric_eigenvalues().iter().copied().collect();
            expected.sort_by(|x, y| y.total_cmp(x));
            for (value, expected) in spread.eigenvalues.iter().zip(&expected) {
                prop_assert!((value.0[0] - expected.max(0.0)).abs() < 1e-13 * c.trace());
            }
            let normal = nalgebra::Vector3::from(spread.normal.map(|v| v.0[5]));
            prop_assert!((normal.norm() - 1.0).abs() < 1e-14);
            prop_assert!((c * normal - normal * expected[2]).norm() < 1e-8 * c.trace());
            let longest = nalgebra::Vector3::from(spread.longest.map(|v| v.0[5]));
            prop_assert!((c * longest - longest * expected[0]).norm() < 1e-8 * c.trace());
        }
    }

    #[test]
    fn nothing_to_turn_is_no_division_by_zero() {
        let zero = spread([Lanes::ZERO; 6]);
        assert_eq!(zero.eigenvalues, [Lanes::ZERO; 3]);
        assert_eq!(zero.normal[2], Lanes::ONE);
    }
}
