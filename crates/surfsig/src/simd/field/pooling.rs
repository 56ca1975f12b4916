//! Members of a ball pooled into harmonics.

use super::{BINS, HEIGHTS, LANES, Members, ORDERS, Pool, QUANTITIES, RINGS, WAVES};
use crate::multiply_add::MultiplyAdd;
use crate::simd::{InstructionSet, for_each_instruction_set};

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
    a[2][l].times_plus(b[2][l], a[1][l].times_plus(b[1][l], a[0][l] * b[0][l]))
}

/// The part of a lane of vectors along another.
#[inline(always)]
fn turned(vectors: &[[f32; LANES]; 3], along: &[f32; 3], l: usize) -> f32 {
    vectors[2][l].times_plus(along[2], vectors[1][l].times_plus(along[1], vectors[0][l] * along[0]))
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
            let distance = v.times_plus(v, u * u).sqrt();
            // On the axis no direction is outwards.
            let inverse = if distance > 1e-6 { 1.0 / distance } else { 0.0 };
            let (cosine, sine) = (u * inverse, v * inverse);
            waves[0][l] = 1.0;
            waves[1][l] = cosine;
            waves[ORDERS + 1][l] = sine;
            let (a, b) = (turned(&members.normal, x, l), turned(&members.normal, y, l));
            quantities[0][l] = turned(&members.normal, z, l);
            quantities[1][l] = b.times_plus(sine, a * cosine);
            quantities[2][l] = b.times_plus(cosine, -a * sine);
            let (a, b) = (turned(&members.direction, x, l), turned(&members.direction, y, l));
            let (along, across) = (b.times_plus(sine, a * cosine), b.times_plus(cosine, -a * sine));
            let difference = members.difference[l];
            quantities[3][l] = members.bend[l];
            quantities[4][l] = difference;
            quantities[5][l] = difference * across.times_plus(-across, along * along);
            quantities[6][l] = difference * (2.0 * along * across);
            let (ring, outer) = shared(distance * RINGS as f32, RINGS);
            let (level, upper) = shared((height + 1.0) * (0.5 * HEIGHTS as f32), HEIGHTS);
            // From 2^23 on, the last bits are the whole number.
            cells[l] = (ring.times_plus(HEIGHTS as f32, level) + 8_388_608.0).to_bits() & 0xff;
            weights[0][l] = (1.0 - outer) * (1.0 - upper);
            weights[1][l] = (1.0 - outer) * upper;
            weights[2][l] = outer * (1.0 - upper);
            weights[3][l] = outer * upper;
        }
        for order in 2..ORDERS {
            for l in 0..LANES {
                let (cosine, sine) = (waves[1][l], waves[ORDERS + 1][l]);
                let (c, s) = (waves[order - 1][l], waves[ORDERS + order - 1][l]);
                waves[order][l] = s.times_plus(-sine, c * cosine);
                waves[ORDERS + order][l] = s.times_plus(cosine, c * sine);
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
        sums[w] = factor.times_plus(waves[w], sums[w]);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simd::field::Curved;

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
    }
}
