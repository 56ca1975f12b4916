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

/// Members of a ball that are worked with side by side.
pub(crate) const LANES: usize = 16;

/// Some members of a ball: their places from its centre in units of its radius, and what they are. Zeros stand beyond
/// the last.
#[derive(Clone, Copy)]
#[repr(align(64))]
pub(crate) struct Members {
    pub place: [[f32; LANES]; 3],
    pub normal: [[f32; LANES]; 3],
    pub direction: [[f32; LANES]; 3],
    pub bend: [f32; LANES],
    pub difference: [f32; LANES],
}

impl Members {
    pub const NONE: Self = Self {
        place: [[0.0; LANES]; 3],
        normal: [[0.0; LANES]; 3],
        direction: [[0.0; LANES]; 3],
        bend: [0.0; LANES],
        difference: [0.0; LANES],
    };

    /// Says what one of them is.
    pub fn set(&mut self, lane: usize, member: &Curved) {
        for axis in 0..3 {
            self.normal[axis][lane] = member.normal[axis];
            self.direction[axis][lane] = member.direction[axis];
        }
        self.bend[lane] = member.bend;
        self.difference[lane] = member.difference;
    }
}

const BINS: usize = RINGS * HEIGHTS;

/// Sums of waves over the members of a ball, for each bin (ring by ring, in each by height) and quantity.
#[derive(Clone)]
#[repr(align(64))]
pub(crate) struct Pool {
    bins: [[[f32; WAVES]; QUANTITIES]; BINS],
    /// Bins that members share, a bit for each; all others are zero.
    occupied: u32,
}

impl Pool {
    pub const ZERO: Self = Self { bins: [[[0.0; WAVES]; QUANTITIES]; BINS], occupied: 0 };

    /// The waves of each feature.
    pub fn features(&self) -> &[[f32; WAVES]; FEATURES] {
        self.bins.as_flattened().try_into().expect("as many as there are")
    }
}

/// What a member adds to the four bins around it.
#[derive(Clone, Copy)]
#[repr(align(64))]
struct Share {
    waves: [f32; WAVES],
    quantities: [f32; QUANTITIES],
    /// Number of the first bin.
    cell: u32,
    weights: [f32; 4],
}

/// Adds members of balls to pools; what it needs for that is kept from ball to ball.
pub(crate) struct Pooling {
    shares: Vec<Share>,
    /// Numbers of the members, by the first bin of each.
    order: Vec<u32>,
}

impl Pooling {
    pub fn new() -> Self {
        Self { shares: Vec::new(), order: Vec::new() }
    }

    /// Adds a ball's members, of which there are `count`, to a pool that is zero. Of the axes, the last is the
    /// cylinder's.
    pub fn pool(
        &mut self,
        set: InstructionSet,
        members: &[Members],
        count: usize,
        axes: &[[f32; 3]; 3],
        pool: &mut Pool,
    ) {
        let none = Share { waves: [0.0; WAVES], quantities: [0.0; QUANTITIES], cell: 0, weights: [0.0; 4] };
        self.shares.resize(members.len() * LANES, none);
        share_out(set, members, axes, &mut self.shares);
        let shares = &self.shares[..count];
        // Members of one cell after the other, so that its bins stay in registers.
        let mut ends = [0_usize; BINS];
        for share in shares {
            ends[share.cell as usize] += 1;
        }
        let mut end = 0;
        let starts = ends.map(|members| {
            end += members;
            end - members
        });
        let mut next = starts;
        self.order.resize(count, 0);
        for (member, share) in (0..).zip(shares) {
            let place = &mut next[share.cell as usize];
            self.order[*place] = member;
            *place += 1;
        }
        for cell in 0..BINS {
            let members = &self.order[starts[cell]..next[cell]];
            if !members.is_empty() {
                let (ring, level) = (cell / HEIGHTS, cell % HEIGHTS);
                let (ring_above, level_above) = ((ring + 1).min(RINGS - 1), (level + 1).min(HEIGHTS - 1));
                let corners =
                    [(ring, level), (ring, level_above), (ring_above, level), (ring_above, level_above)];
                for (corner, (ring, level)) in corners.into_iter().enumerate() {
                    let bin = ring * HEIGHTS + level;
                    pool.occupied |= 1 << bin;
                    add(set, shares, members, corner, &mut pool.bins[bin]);
                }
            }
        }
    }
}

for_each_instruction_set! {
    /// The sum of what members' normals have along a vector, of those within a part of the ball's radius.
    pub(crate) fn along(members: &[Members], vector: &[f32; 3], within: f32) -> f32 {
        plain: along_in,
        wide: along_in,
        widest: along_in,
    }
}

#[inline(always)]
fn along_in(members: &[Members], vector: &[f32; 3], within: f32) -> f32 {
    let mut sums = [0.0_f32; LANES];
    for Members { place, normal, .. } in members {
        for l in 0..LANES {
            let square = dot(place, place, l);
            let along = turned(normal, vector, l);
            sums[l] += if square < within * within { along } else { 0.0 };
        }
    }
    sums.iter().sum()
}

for_each_instruction_set! {
    fn share_out(members: &[Members], axes: &[[f32; 3]; 3], shares: &mut [Share]) {
        plain: share_out_in,
        wide: share_out_in,
        widest: share_out_in,
    }
}

for_each_instruction_set! {
    /// Adds what some members add to one of the four bins around them.
    fn add(shares: &[Share], members: &[u32], corner: usize, bin: &mut [[f32; WAVES]; QUANTITIES]) {
        plain: add_in,
        wide: add_in,
        widest: add_in,
    }
}

/// The scalar product of a lane of two vectors.
#[inline(always)]
fn dot(a: &[[f32; LANES]; 3], b: &[[f32; LANES]; 3], l: usize) -> f32 {
    a[2][l].mul_add(b[2][l], a[1][l].mul_add(b[1][l], a[0][l] * b[0][l]))
}

/// The part of a lane of vectors along another.
#[inline(always)]
fn turned(vectors: &[[f32; LANES]; 3], along: &[f32; 3], l: usize) -> f32 {
    vectors[2][l].mul_add(along[2], vectors[1][l].mul_add(along[1], vectors[0][l] * along[0]))
}

/// The first of two bins that share a value, and the part of the second.
#[inline(always)]
fn shared(value: f32, bins: usize) -> (f32, f32) {
    let (place, last) = (value - 0.5, (bins - 1) as f32);
    let place = if place > 0.0 { place } else { 0.0 };
    let place = if place < last { place } else { last };
    let low = place.floor();
    (low, place - low)
}

#[inline(always)]
fn share_out_in(members: &[Members], [x, y, z]: &[[f32; 3]; 3], shares: &mut [Share]) {
    for (members, shares) in members.iter().zip(shares.chunks_exact_mut(LANES)) {
        let mut waves = [[0.0_f32; LANES]; WAVES];
        let mut quantities = [[0.0_f32; LANES]; QUANTITIES];
        let mut weights = [[0.0_f32; LANES]; 4];
        let mut cells = [0_u32; LANES];
        for l in 0..LANES {
            let (u, v) = (turned(&members.place, x, l), turned(&members.place, y, l));
            let height = turned(&members.place, z, l);
            let distance = v.mul_add(v, u * u).sqrt();
            // On the axis no direction is outwards.
            let inverse = if distance > 1e-6 { 1.0 / distance } else { 0.0 };
            let (cosine, sine) = (u * inverse, v * inverse);
            waves[0][l] = 1.0;
            waves[1][l] = cosine;
            waves[ORDERS + 1][l] = sine;
            let (a, b) = (turned(&members.normal, x, l), turned(&members.normal, y, l));
            quantities[0][l] = turned(&members.normal, z, l);
            quantities[1][l] = b.mul_add(sine, a * cosine);
            quantities[2][l] = b.mul_add(cosine, -a * sine);
            let (a, b) = (turned(&members.direction, x, l), turned(&members.direction, y, l));
            let (along, across) = (b.mul_add(sine, a * cosine), b.mul_add(cosine, -a * sine));
            let difference = members.difference[l];
            quantities[3][l] = members.bend[l];
            quantities[4][l] = difference;
            quantities[5][l] = difference * across.mul_add(-across, along * along);
            quantities[6][l] = difference * (2.0 * along * across);
            let (ring, outer) = shared(distance * RINGS as f32, RINGS);
            let (level, upper) = shared((height + 1.0) * (0.5 * HEIGHTS as f32), HEIGHTS);
            // From 2^23 on, the last bits are the whole number.
            cells[l] = (ring.mul_add(HEIGHTS as f32, level) + 8_388_608.0).to_bits() & 0xff;
            weights[0][l] = (1.0 - outer) * (1.0 - upper);
            weights[1][l] = (1.0 - outer) * upper;
            weights[2][l] = outer * (1.0 - upper);
            weights[3][l] = outer * upper;
        }
        for order in 2..ORDERS {
            for l in 0..LANES {
                let (cosine, sine) = (waves[1][l], waves[ORDERS + 1][l]);
                let (c, s) = (waves[order - 1][l], waves[ORDERS + order - 1][l]);
                waves[order][l] = s.mul_add(-sine, c * cosine);
                waves[ORDERS + order][l] = s.mul_add(cosine, c * sine);
            }
        }
        hand_out(&waves, &quantities, &weights, &cells, shares);
    }
}

/// Gives each member its own. A function of its own: for AVX-512 the compiler would scatter single numbers, which takes
/// three times as long.
#[inline(never)]
fn hand_out(
    waves: &[[f32; LANES]; WAVES],
    quantities: &[[f32; LANES]; QUANTITIES],
    weights: &[[f32; LANES]; 4],
    cells: &[u32; LANES],
    shares: &mut [Share],
) {
    for (l, share) in shares.iter_mut().enumerate() {
        for w in 0..WAVES {
            share.waves[w] = waves[w][l];
        }
        for q in 0..QUANTITIES {
            share.quantities[q] = quantities[q][l];
        }
        for corner in 0..4 {
            share.weights[corner] = weights[corner][l];
        }
        share.cell = cells[l];
    }
}

#[inline(always)]
fn add_in(shares: &[Share], members: &[u32], corner: usize, bin: &mut [[f32; WAVES]; QUANTITIES]) {
    let [mut along, mut out, mut around, mut bend, mut difference, mut even, mut odd] = *bin;
    for &member in members {
        let share = &shares[member as usize];
        let mut waves = share.waves;
        for w in 0..WAVES {
            waves[w] *= share.weights[corner];
        }
        // One by one: a loop over them would be made into vectors across, whose numbers are far apart.
        add_waves(&mut along, share.quantities[0], &waves);
        add_waves(&mut out, share.quantities[1], &waves);
        add_waves(&mut around, share.quantities[2], &waves);
        add_waves(&mut bend, share.quantities[3], &waves);
        add_waves(&mut difference, share.quantities[4], &waves);
        add_waves(&mut even, share.quantities[5], &waves);
        add_waves(&mut odd, share.quantities[6], &waves);
    }
    *bin = [along, out, around, bend, difference, even, odd];
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
                        real[l] = s.mul_add(-im[l], c.mul_add(re[l], real[l]));
                        imaginary[l] = s.mul_add(re[l], c.mul_add(im[l], imaginary[l]));
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
            sums[w] = value.mul_add(value, sums[w]);
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

    #[test]
    fn every_set_gives_the_same_bits_and_the_sums_are_those_of_angles() {
        let number = |i: usize, k: usize| ((i * 7 + k * 3) as f32 * 0.37).sin();
        let places: Vec<[f32; 3]> = (0..200).map(|i| [0, 1, 2].map(|k| 0.55 * number(i, k))).collect();
        let curved: Vec<Curved> = (0..200)
            .map(|i| Curved {
                normal: [3, 4, 5].map(|k| number(i, k)),
                direction: [6, 7, 8].map(|k| number(i, k)),
                bend: number(i, 9),
                difference: number(i, 10).abs(),
            })
            .collect();
        let mut members = vec![Members::NONE; 13];
        for i in 0..200 {
            for axis in 0..3 {
                members[i / LANES].place[axis][i % LANES] = places[i][axis];
            }
            members[i / LANES].set(i % LANES, &curved[i]);
        }
        let axes = [[0.0, 1.0, 0.0], [0.0, 0.0, 1.0], [1.0, 0.0, 0.0]];
        let pools: Vec<Pool> = InstructionSet::available()
            .into_iter()
            .map(|set| {
                let mut sums = Pool::ZERO;
                Pooling::new().pool(set, &members, places.len(), &axes, &mut sums);
                sums
            })
            .collect();
        assert!(pools.iter().all(|other| other.bins == pools[0].bins));
        // Summed over the bins, the normal along the axis times the waves of the angle from y to z.
        for order in 0..ORDERS {
            let expected: f32 = places
                .iter()
                .zip(&curved)
                .map(|(p, m)| m.normal[0] * (order as f32 * p[2].atan2(p[1])).cos())
                .sum();
            let sum: f32 = pools[0].bins.iter().map(|bin| bin[0][order]).sum();
            assert!((sum - expected).abs() < 1e-3, "{order}: {sum} {expected}");
        }
        let atoms: AtomBlock =
            std::array::from_fn(|f| [0, 1].map(|k| std::array::from_fn(|l| number(f, k + l))));
        // More than go together in any set, and not a multiple of it.
        let mut several = vec![pools[0].clone(); 11];
        for (factor, pool) in (1_u8..).zip(&mut several) {
            pool.bins.as_flattened_mut().iter_mut().flatten().for_each(|sum| *sum *= f32::from(factor));
        }
        let projected = |set| {
            let mut found = [[[0.0; ATOMS]; 2]; 11];
            project(set, &several, 3, &atoms, &mut found);
            (found, several.iter().map(|pool| length(set, pool)).collect::<Vec<_>>())
        };
        let plain = projected(InstructionSet::available()[0]);
        for set in InstructionSet::available() {
            assert_eq!(projected(set), plain, "{}", set.name());
        }
        let products = pools[0].features().iter().zip(&atoms);
        let expected: f32 = products.map(|(f, [re, im])| f[3] * re[2] - f[ORDERS + 3] * im[2]).sum();
        for (factor, found) in (1_u8..).zip(plain.0) {
            assert!((found[0][2] / f32::from(factor) - expected).abs() < 1e-3, "{factor}");
        }
    }
}
