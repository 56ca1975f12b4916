//! The two kernels of field signatures: members of a ball pooled into harmonics, and harmonics seen in a frame.

use super::{InstructionSet, for_each_instruction_set};

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
const _: () = assert!(FEATURES.is_multiple_of(2));

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
pub(crate) struct Pool(pub [[[f32; WAVES]; QUANTITIES]; RINGS * HEIGHTS]);

impl Pool {
    pub const ZERO: Self = Self([[[0.0; WAVES]; QUANTITIES]; RINGS * HEIGHTS]);

    /// The waves of each feature.
    pub fn features(&self) -> &[[f32; WAVES]; FEATURES] {
        self.0.as_flattened().try_into().expect("as many as there are")
    }
}

/// What a member adds to the four bins around it.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Share {
    waves: [f32; WAVES],
    factors: [[f32; QUANTITIES]; 4],
    bins: [u32; 4],
}

/// Members whose shares are held at a time.
const HELD: usize = 64;

/// Adds members of a ball to a pool that is zero: their places from its centre in units of its radius, what they
/// are, and the patch's axes, of which the last is the cylinder's.
pub(crate) fn pool(
    set: InstructionSet,
    places: &[[f32; 3]],
    members: &[Curved],
    axes: &[[f32; 3]; 3],
    pool: &mut Pool,
) {
    let none = Share { waves: [0.0; WAVES], factors: [[0.0; QUANTITIES]; 4], bins: [0; 4] };
    let mut shares = [none; HELD];
    for (places, members) in places.chunks(HELD).zip(members.chunks(HELD)) {
        share_out(set, places, members, axes, &mut shares);
        add(set, &shares[..places.len()], pool);
    }
}

for_each_instruction_set! {
    fn share_out(places: &[[f32; 3]], members: &[Curved], axes: &[[f32; 3]; 3], shares: &mut [Share; HELD]) {
        plain: share_out_in,
        wide: share_out_in,
        widest: share_out_in,
    }
}

for_each_instruction_set! {
    /// A function of its own: compiled together with what makes the shares, sums would be taken apart.
    #[inline(never)]
    fn add(shares: &[Share], pool: &mut Pool) {
        plain: add_in,
        wide: add_in,
        widest: add_in,
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

/// The parts of a vector outwards from the axis and around it.
#[inline(always)]
fn outwards(vector: &[f32; 3], [x, y, _]: &[[f32; 3]; 3], cosine: f32, sine: f32) -> [f32; 2] {
    let (a, b) = (dot(vector, x), dot(vector, y));
    [b.mul_add(sine, a * cosine), b.mul_add(cosine, -a * sine)]
}

#[inline(always)]
fn share_out_in(places: &[[f32; 3]], members: &[Curved], axes: &[[f32; 3]; 3], shares: &mut [Share; HELD]) {
    let [x, y, z] = axes;
    for ((place, member), share) in places.iter().zip(members).zip(shares) {
        let (u, v, height) = (dot(place, x), dot(place, y), dot(place, z));
        let distance = v.mul_add(v, u * u).sqrt();
        // On the axis no direction is outwards.
        let (cosine, sine) = if distance > 1e-6 { (u / distance, v / distance) } else { (0.0, 0.0) };
        let [out, around] = outwards(&member.normal, axes, cosine, sine);
        let [along, across] = outwards(&member.direction, axes, cosine, sine);
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
        let rings = shared(distance * RINGS as f32, RINGS);
        let levels = shared((height + 1.0) * (0.5 * HEIGHTS as f32), HEIGHTS);
        share.waves = waves;
        for corner in 0..4 {
            let ((ring, ring_weight), (level, level_weight)) = (rings[corner / 2], levels[corner % 2]);
            let weight = ring_weight * level_weight;
            share.bins[corner] = (ring * HEIGHTS + level) as u32;
            for q in 0..QUANTITIES {
                share.factors[corner][q] = weight * quantities[q];
            }
        }
    }
}

#[inline(always)]
fn add_in(shares: &[Share], pool: &mut Pool) {
    for share in shares {
        let waves = share.waves;
        for corner in 0..4 {
            let factors = &share.factors[corner];
            // One by one: a loop over them would be made into vectors across, whose numbers are far apart.
            let [along, out, around, bend, difference, even, odd] = &mut pool.0[share.bins[corner] as usize];
            add_waves(along, factors[0], &waves);
            add_waves(out, factors[1], &waves);
            add_waves(around, factors[2], &waves);
            add_waves(bend, factors[3], &waves);
            add_waves(difference, factors[4], &waves);
            add_waves(even, factors[5], &waves);
            add_waves(odd, factors[6], &waves);
        }
    }
}

#[inline(always)]
fn add_waves(sums: &mut [f32; WAVES], factor: f32, waves: &[f32; WAVES]) {
    for w in 0..WAVES {
        sums[w] = factor.mul_add(waves[w], sums[w]);
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
    let features = pool.features();
    // Eight sums that do not wait for each other: products of cosines and sines with both parts, of every other
    // feature.
    let mut sums = [[[0.0_f32; ATOMS]; 4]; 2];
    for pair in 0..FEATURES / 2 {
        for which in 0..2 {
            let f = 2 * pair + which;
            let (c, s) = (features[f][order], features[f][ORDERS + order]);
            let [re, im] = &atoms[f];
            let [c_re, s_im, c_im, s_re] = &mut sums[which];
            for l in 0..ATOMS {
                c_re[l] = c.mul_add(re[l], c_re[l]);
                s_im[l] = s.mul_add(im[l], s_im[l]);
                c_im[l] = c.mul_add(im[l], c_im[l]);
                s_re[l] = s.mul_add(re[l], s_re[l]);
            }
        }
    }
    let [even, odd] = sums;
    let (mut real, mut imaginary) = ([0.0; ATOMS], [0.0; ATOMS]);
    for l in 0..ATOMS {
        real[l] = (even[0][l] + odd[0][l]) - (even[1][l] + odd[1][l]);
        imaginary[l] = (even[2][l] + odd[2][l]) + (even[3][l] + odd[3][l]);
    }
    [real, imaginary]
}

#[cfg(test)]
mod tests {
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
                let mut sums = Pool::ZERO;
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
            let sum: f32 = pools[0].0.iter().map(|bin| bin[0][order]).sum();
            assert!((sum - expected).abs() < 1e-3, "{order}: {sum} {expected}");
        }
        let atoms: AtomBlock =
            std::array::from_fn(|f| [0, 1].map(|k| std::array::from_fn(|l| number(f, k + l))));
        let plain = project(InstructionSet::available()[0], &pools[0], 3, &atoms);
        for set in InstructionSet::available() {
            assert_eq!(project(set, &pools[0], 3, &atoms), plain, "{}", set.name());
        }
    }
}
