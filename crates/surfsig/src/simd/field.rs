//! The two kernels of field signatures: members of a ball pooled into harmonics, and harmonics seen in a frame.

use super::for_each_instruction_set;

/// Rings of the cylindrical grid, from the axis to the ball's radius.
pub(crate) const RINGS: usize = 5;
/// Heights of the grid, over the ball's diameter.
pub(crate) const HEIGHTS: usize = 6;
/// What is pooled: the normal along the axis, outwards and around; the bend; its difference between the two
/// principal directions, and that times cosine and sine of twice the angle to the outward direction.
pub(crate) const QUANTITIES: usize = 7;
/// Angular Fourier orders, 0 included.
pub(crate) const ORDERS: usize = 8;
/// Cosines of all orders, then sines.
pub(crate) const WAVES: usize = 2 * ORDERS;
/// Numbers that each order has: one complex number per bin and quantity.
pub(crate) const FEATURES: usize = RINGS * HEIGHTS * QUANTITIES;

/// What is known at a point of the surface.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Curved {
    pub normal: [f32; 3],
    /// Along k1.
    pub direction: [f32; 3],
    /// Of the mean curvature, between -1 and 1.
    pub bend: f32,
    /// Of half the difference between the principal curvatures, between 0 and 1.
    pub difference: f32,
}

/// Sums of waves over the members of a ball, for each bin (ring by ring, in each by height) and quantity.
#[repr(align(64))]
pub(crate) struct Pool(pub [[f32; WAVES]; FEATURES]);

for_each_instruction_set! {
    /// Adds members of a ball to a pool that is zero: their places from its centre in units of its radius, what
    /// they are, and the patch's axes, of which the last is the cylinder's.
    pub(crate) fn pool(places: &[[f32; 3]], members: &[Curved], axes: &[[f32; 3]; 3], pool: &mut Pool) {
        plain: pool_in,
        wide: pool_in,
        widest: pool_in,
    }
}

#[inline(always)]
fn dot(a: &[f32; 3], b: &[f32; 3]) -> f32 {
    a[2].mul_add(b[2], a[1].mul_add(b[1], a[0] * b[0]))
}

/// The two bins that share a value, the weight of the second, and so of the first.
#[inline(always)]
fn shared(value: f32, bins: usize) -> [(usize, f32); 2] {
    let place = (value - 0.5).clamp(0.0, (bins - 1) as f32);
    let low = place as usize;
    let part = place - low as f32;
    [(low, 1.0 - part), ((low + 1).min(bins - 1), part)]
}

#[inline(always)]
fn pool_in(places: &[[f32; 3]], members: &[Curved], axes: &[[f32; 3]; 3], pool: &mut Pool) {
    let [x, y, z] = axes;
    for (place, member) in places.iter().zip(members) {
        let (u, v, height) = (dot(place, x), dot(place, y), dot(place, z));
        let distance = v.mul_add(v, u * u).sqrt();
        // On the axis no direction is outwards.
        let (cosine, sine) = if distance > 1e-6 { (u / distance, v / distance) } else { (0.0, 0.0) };
        let outwards = |vector: &[f32; 3]| {
            let (a, b) = (dot(vector, x), dot(vector, y));
            [b.mul_add(sine, a * cosine), b.mul_add(cosine, -a * sine)]
        };
        let [out, around] = outwards(&member.normal);
        let [along, across] = outwards(&member.direction);
        let quantities = [
            dot(&member.normal, z),
            out,
            around,
            member.bend,
            member.difference,
            member.difference * across.mul_add(-across, along * along),
            member.difference * (2.0 * along * across),
        ];
        let mut waves = [0.0_f32; WAVES];
        waves[0] = 1.0;
        for order in 1..ORDERS {
            let (c, s) = (waves[order - 1], waves[ORDERS + order - 1]);
            waves[order] = s.mul_add(-sine, c * cosine);
            waves[ORDERS + order] = s.mul_add(cosine, c * sine);
        }
        for (ring, ring_weight) in shared(distance * RINGS as f32, RINGS) {
            for (level, level_weight) in shared((height + 1.0) * (0.5 * HEIGHTS as f32), HEIGHTS) {
                let weight = ring_weight * level_weight;
                let first = (ring * HEIGHTS + level) * QUANTITIES;
                for (sums, quantity) in pool.0[first..first + QUANTITIES].iter_mut().zip(quantities) {
                    let factor = weight * quantity;
                    for (sum, wave) in sums.iter_mut().zip(waves) {
                        *sum = factor.mul_add(wave, *sum);
                    }
                }
            }
        }
    }
}

/// Atoms of one order that are worked with at a time.
pub(crate) const ATOMS: usize = 16;

/// For each feature, real and imaginary parts of some atoms.
pub(crate) type AtomBlock = [[[f32; ATOMS]; 2]; FEATURES];

for_each_instruction_set! {
    /// Real and imaginary parts of the products of a pool's features of one order with atoms.
    pub(crate) fn project(pool: &Pool, order: usize, atoms: &AtomBlock) -> [[f32; ATOMS]; 2] {
        plain: project_in,
        wide: project_in,
        widest: project_in,
    }
}

#[inline(always)]
fn project_in(pool: &Pool, order: usize, atoms: &AtomBlock) -> [[f32; ATOMS]; 2] {
    let (mut real, mut imaginary) = ([0.0_f32; ATOMS], [0.0_f32; ATOMS]);
    for (waves, [re, im]) in pool.0.iter().zip(atoms) {
        let (c, s) = (waves[order], waves[ORDERS + order]);
        for l in 0..ATOMS {
            real[l] = s.mul_add(-im[l], c.mul_add(re[l], real[l]));
            imaginary[l] = s.mul_add(re[l], c.mul_add(im[l], imaginary[l]));
        }
    }
    [real, imaginary]
}

#[cfg(test)]
mod tests {
    use super::super::InstructionSet;
    use super::*;

    #[test]
    fn every_set_gives_the_same_bits_and_the_sums_are_those_of_angles() {
        let number = |i: usize, k: usize| ((i * 7 + k * 3) as f32 * 0.37).sin();
        let places: Vec<[f32; 3]> = (0..200).map(|i| [0, 1, 2].map(|k| 0.55 * number(i, k))).collect();
        let members: Vec<Curved> = (0..200)
            .map(|i| Curved {
                normal: [3, 4, 5].map(|k| number(i, k)),
                direction: [6, 7, 8].map(|k| number(i, k)),
                bend: number(i, 9),
                difference: number(i, 10).abs(),
            })
            .collect();
        let axes = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let pools: Vec<Pool> = InstructionSet::available()
            .into_iter()
            .map(|set| {
                let mut sums = Pool([[0.0; WAVES]; FEATURES]);
                pool(set, &places, &members, &axes, &mut sums);
                sums
            })
            .collect();
        assert!(pools.iter().all(|other| other.0 == pools[0].0));
        // Summed over the bins, the normal along the axis times the waves of the angle from y to z.
        for order in 0..ORDERS {
            let expected: f32 = places
                .iter()
                .zip(&members)
                .map(|(p, m)| m.normal[0] * (order as f32 * p[2].atan2(p[1])).cos())
                .sum();
            let sum: f32 = pools[0].0.iter().step_by(QUANTITIES).map(|waves| waves[order]).sum();
            assert!((sum - expected).abs() < 1e-3, "{order}: {sum} {expected}");
        }
        let atoms: AtomBlock = std::array::from_fn(|f| [0, 1].map(|k| std::array::from_fn(|l| number(f, k + l))));
        let plain = project(InstructionSet::available()[0], &pools[0], 3, &atoms);
        for set in InstructionSet::available() {
            assert_eq!(project(set, &pools[0], 3, &atoms), plain, "{}", set.name());
        }
    }
}
