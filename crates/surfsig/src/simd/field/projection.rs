//! Harmonics seen in a frame.

use super::{BINS, FEATURES, ORDERS, Pool, QUANTITIES, WAVES};
use crate::multiply_add::MultiplyAdd;
use crate::simd::for_each_instruction_set;

/// Atoms of one order that are worked with at a time.
pub(crate) const ATOMS: usize = 16;

/// For each feature, real and imaginary parts of some atoms.
pub(crate) type AtomBlock = [[[f32; ATOMS]; 2]; FEATURES];

/// Real and imaginary parts of the products of a pool's features of one order with some atoms.
pub(crate) type Coefficients = [[f32; ATOMS]; 2];

for_each_instruction_set! {
    /// The coefficients of each pool.
    pub(crate) fn project(pools: &[Pool], order: usize, atoms: &AtomBlock, found: &mut [Coefficients]) {
        plain: project_in::<1>,
        wide: project_in::<2>,
        widest: project_in::<8>,
    }
}

/// `TOGETHER` pools at a time, so that atoms are fetched once for them: as many as there are registers for.
#[inline(always)]
fn project_in<const TOGETHER: usize>(
    pools: &[Pool],
    order: usize,
    atoms: &AtomBlock,
    found: &mut [Coefficients],
) {
    assert!(order < ORDERS);
    for (pools, found) in pools.chunks(TOGETHER).zip(found.chunks_mut(TOGETHER)) {
        let mut together = [&pools[0]; TOGETHER];
        let mut occupied = 0;
        for (t, pool) in pools.iter().enumerate() {
            together[t] = pool;
            occupied |= pool.occupied;
        }
        let mut sums = [[[0.0_f32; ATOMS]; 2]; TOGETHER];
        for bin in 0..BINS {
            if (occupied >> bin) & 1 == 0 {
                continue;
            }
            for q in 0..QUANTITIES {
                let [re, im] = &atoms[bin * QUANTITIES + q];
                for t in 0..TOGETHER {
                    let waves = &together[t].bins[bin][q];
                    let (c, s) = (waves[order], waves[ORDERS + order]);
                    let [real, imaginary] = &mut sums[t];
                    for l in 0..ATOMS {
                        real[l] = s.times_plus(-im[l], c.times_plus(re[l], real[l]));
                        imaginary[l] = s.times_plus(re[l], c.times_plus(im[l], imaginary[l]));
                    }
                }
            }
        }
        for (t, coefficients) in found.iter_mut().enumerate() {
            *coefficients = sums[t];
        }
    }
}

for_each_instruction_set! {
    /// The length of a pool as a vector.
    pub(crate) fn length(pool: &Pool) -> f64 {
        plain: length_in,
        wide: length_in,
        widest: length_in,
    }
}

#[inline(always)]
fn length_in(pool: &Pool) -> f64 {
    let mut sums = [0.0_f64; WAVES];
    for feature in pool.features() {
        for w in 0..WAVES {
            let value = f64::from(feature[w]);
            sums[w] = value.times_plus(value, sums[w]);
        }
    }
    let mut sum = 0.0;
    for w in 0..WAVES {
        sum += sums[w];
    }
    sum.sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::InstructionSet;

    #[test]
    fn every_set_gives_the_same_bits_and_the_products_of_features_and_atoms() {
        let number = |i: usize, k: usize| ((i * 7 + k * 3) as f32 * 0.37).sin();
        let atoms: AtomBlock =
            std::array::from_fn(|f| [0, 1].map(|k| std::array::from_fn(|l| number(f, k + l))));
        // More than go together in any set, and not a multiple of it; each with bins of its own.
        let mut pools = vec![Pool::ZERO; 11];
        for (p, pool) in pools.iter_mut().enumerate() {
            pool.occupied = 0b1011 << p;
            for bin in (0..BINS).filter(|bin| (pool.occupied >> bin) & 1 == 1) {
                for q in 0..QUANTITIES {
                    pool.bins[bin][q] = std::array::from_fn(|w| number(bin + p, q + w));
                }
            }
        }
        let projected = |set| {
            let mut found = [[[0.0; ATOMS]; 2]; 11];
            project(set, &pools, 3, &atoms, &mut found);
            (found, pools.iter().map(|pool| length(set, pool)).collect::<Vec<_>>())
        };
        let plain = projected(InstructionSet::available()[0]);
        for set in InstructionSet::available() {
            assert_eq!(projected(set), plain, "{}", set.name());
        }
        for (pool, (found, length)) in pools.iter().zip(plain.0.iter().zip(plain.1)) {
            let product = |[c, s]: [usize; 2], sign: f32| -> f32 {
                let pairs = pool.features().iter().zip(&atoms);
                pairs
                    .map(|(waves, parts)| waves[3] * parts[c][2] + sign * waves[ORDERS + 3] * parts[s][2])
                    .sum()
            };
            assert!((found[0][2] - product([0, 1], -1.0)).abs() < 1e-4);
            assert!((found[1][2] - product([1, 0], 1.0)).abs() < 1e-4);
            let square: f64 = pool.features().iter().flatten().map(|&sum| f64::from(sum).powi(2)).sum();
            assert!((length - square.sqrt()).abs() < 1e-9);
        }
    }
}
