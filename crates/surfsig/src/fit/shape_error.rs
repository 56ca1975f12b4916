//! How sure a paraboloid's curvature is: from the actual normal equations, not from a textbook's disc.

use super::paraboloid::UNKNOWNS;
use crate::simd::lanes::Lanes;
use crate::tensor::{Axes, Vector, dot};

/// What is left of L D L^T for the unknowns a, e, b, which stand last: its last three rows.
pub(crate) struct ShapeFactor {
    /// L of (e, a), (b, a), (b, e).
    pub lower: [Lanes; 3],
    /// 1 / D of a, e, b.
    pub inverse_pivot: [Lanes; 3],
}

/// Covariance of the shape tensor's entries k11, k12, k22 along the principal directions, of which k11 =
/// k1 and k22 = k2: the upper triangle 11 11, 11 12, 11 22, 12 12, 12 22, 22 22.
///
/// Theory of linear least squares: the noise's variance times the inverse of the normal matrix. At an
/// umbilic the fitted directions follow the noise: k1 and k2 are then biased apart by 0.7 to 0.8 of their
/// standard errors, and those of the tensor and of H stay right.
#[inline(always)]
pub(crate) fn shape_covariance(
    factor: &ShapeFactor,
    axes: &Axes,
    direction: &Vector,
    residual_square: Lanes,
    count: Lanes,
) -> [Lanes; 6] {
    let (cosine, sine) = (dot(direction, &axes.u), dot(direction, &axes.v));
    let (cc, cs, ss) = (cosine * cosine, cosine * sine, sine * sine);
    // Entries of the tensor by a, e, b: [[2 a, e], [e, 2 b]], turned.
    let by_unknowns =
        [[cc + cc, cs + cs, ss + ss], [-(cs + cs), cc - ss, cs + cs], [ss + ss, -(cs + cs), cc + cc]];
    let [ea, ba, be] = factor.lower;
    let mut solved = by_unknowns;
    for [a, e, b] in &mut solved {
        *e = (-ea).mul_add(*a, *e);
        *b = (-be).mul_add(*e, (-ba).mul_add(*a, *b));
    }
    // Unbiased: of the points' freedom, six have gone into the unknowns.
    let freedom = count - Lanes::splat(UNKNOWNS as f64);
    let some = Lanes::ZERO.lt(freedom);
    let variance = some.select(residual_square.max(Lanes::ZERO) / freedom, Lanes::splat(f64::NAN));
    // By loops and functions: closures would be compiled without the wide instructions.
    const TRIANGLE: [(usize, usize); 6] = [(0, 0), (0, 1), (0, 2), (1, 1), (1, 2), (2, 2)];
    let mut covariance = [Lanes::ZERO; 6];
    for (entry, (p, q)) in covariance.iter_mut().zip(TRIANGLE) {
        *entry = variance * weighted_product(&solved[p], &solved[q], &factor.inverse_pivot);
    }
    covariance
}

#[inline(always)]
fn weighted_product(p: &Vector, q: &Vector, weights: &Vector) -> Lanes {
    (p[0] * q[0]).mul_add(weights[0], (p[1] * q[1]).mul_add(weights[1], p[2] * q[2] * weights[2]))
}

#[cfg(test)]
mod tests {
    use super::super::paraboloid::turn_until_flat;
    use super::*;
    use crate::moments::Moments;
    use crate::simd::lanes::{LANES, Mask};
    use crate::tensor::MomentBatch;

    const SEED: u64 = 5;

    /// Uniform numbers in 0..1, by the 64-bit mix of SplitMix.
    struct Uniform(u64);

    impl Uniform {
        fn next(&mut self) -> f64 {
            self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
            let mut z = self.0;
            z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
            z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
            ((z ^ (z >> 31)) >> 11) as f64 / (1_u64 << 53) as f64
        }

        fn normal(&mut self) -> f64 {
            (-2.0 * (1.0 - self.next()).ln()).sqrt() * (std::f64::consts::TAU * self.next()).cos()
        }
    }

    /// A height over the unit disc, radius of curvature 10, and its shape tensor 11, 12, 22.
    type Surface = (fn(f64, f64) -> f64, [f64; 3]);

    const SURFACES: [Surface; 4] = [
        (|_, _| 0.0, [0.0, 0.0, 0.0]),
        (|u, v| (100.0 - u * u - v * v).sqrt() - 10.0, [0.1, 0.0, 0.1]),
        (|u, v| (100.0 - 0.5 * (u + v).powi(2)).sqrt() - 10.0, [0.05, 0.05, 0.05]),
        (|u, v| -u * v / 10.0, [0.0, 0.1, 0.0]),
    ];

    #[test]
    fn the_errors_of_h_and_of_the_shape_tensor_are_as_large_as_they_are_said_to_be() {
        println!("seed {SEED}");
        let mut random = Uniform(SEED);
        for (surface, truth) in SURFACES {
            for (half, noise, count) in [
                (false, 0.01, 60),
                (false, 0.03, 500),
                (false, 0.1, 500),
                (true, 0.003, 60),
                (true, 0.01, 500),
                (true, 0.03, 500),
            ] {
                // Squares of (estimate - truth) / std of H, 11, 12, 22.
                let mut squares = [0.0; 4];
                const DRAWS: usize = 1000;
                for _ in 0..DRAWS / LANES {
                    let draws: Vec<Moments<f64>> = (0..LANES)
                        .map(|_| {
                            let points: Vec<[f64; 3]> = (0..count)
                                .map(|_| {
                                    let (radius, turn) = (random.next().sqrt(), random.next());
                                    let angle = std::f64::consts::TAU * if half { 0.5 * turn } else { turn };
                                    let (u, v) = (radius * angle.cos(), radius * angle.sin());
                                    [u, v, surface(u, v) + noise * random.normal()]
                                })
                                .collect();
                            Moments::of_points(&points)
                        })
                        .collect();
                    let batch = MomentBatch::new(&draws);
                    let (axes, solution, _, _) = turn_until_flat(&batch, Axes::of_cloud(), Mask::ALL);
                    let covariance = shape_covariance(
                        &solution.shape,
                        &axes,
                        &axes.u,
                        solution.residual_square,
                        batch.count,
                    );
                    let [a, b, _, _, e, _] = solution.coefficients;
                    for lane in 0..LANES {
                        let [c11, _, c1122, c12, _, c22] = covariance.map(|c| c.0[lane]);
                        let found = [-2.0 * a.0[lane], -e.0[lane], -2.0 * b.0[lane]];
                        let errors: [f64; 3] = std::array::from_fn(|i| found[i] - truth[i]);
                        let mean = 0.5 * (errors[0] + errors[2]);
                        squares[0] += mean * mean / (0.25 * (c11 + 2.0 * c1122 + c22));
                        squares[1] += errors[0] * errors[0] / c11;
                        squares[2] += errors[1] * errors[1] / c12;
                        squares[3] += errors[2] * errors[2] / c22;
                    }
                }
                for square in squares {
                    let spread = (square / DRAWS as f64).sqrt();
                    assert!((0.9..1.1).contains(&spread), "{truth:?} {half} {noise} {count}: {squares:?}");
                }
            }
        }
    }
}
