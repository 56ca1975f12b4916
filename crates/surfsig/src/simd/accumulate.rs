//! The 34 sums beyond the count, over a block of points in structure-of-arrays order.

use super::select::{BLOCK, Block};
use super::{InstructionSet, for_each_instruction_set};
use crate::moments::{MOMENTS, Scalar, slot};

/// Lanes that the points are dealt to, one after the other, on every instruction set.
const VIRTUAL_LANES: usize = 16;

const QUARTER: usize = VIRTUAL_LANES / 4;

/// What the virtual lanes have summed, a quarter of them after the other: quarters add up side by side.
type LaneSums<S> = [[[S; QUARTER]; MOMENTS]; VIRTUAL_LANES / QUARTER];

/// The sums over the first `len` points of the block. The slots beyond `len`, up to a multiple of 16,
/// must be zero: they then add nothing.
pub(crate) fn accumulate<S: Scalar>(set: InstructionSet, block: &Block, len: usize) -> [S; MOMENTS] {
    let mut lanes = [[[S::default(); QUARTER]; MOMENTS]; VIRTUAL_LANES / QUARTER];
    sum_lanes(set, block, len, &mut lanes);
    let mut sums = reduce_lanes(set, &lanes);
    sums[0] = S::from_f64(len as f64);
    sums
}

for_each_instruction_set! {
    /// The points dealt to lanes, and each lane summed.
    fn sum_lanes<S: Scalar>(block: &Block, len: usize, lanes: &mut LaneSums<S>) {
        plain: accumulate_in::<S, 16>,
        wide: accumulate_in::<S, 32>,
        widest: accumulate_in::<S, 64>,
    }
}

for_each_instruction_set! {
    /// The lanes of each sum added up. A function of its own: compiled together with the loops, the
    /// lanes would be taken out of their registers one by one.
    #[inline(never)]
    fn reduce_lanes<S: Scalar>(lanes: &LaneSums<S>) -> [S; MOMENTS] {
        plain: reduce,
        wide: reduce,
        widest: reduce,
    }
}

/// As many lanes at a time as a register of `BYTES` holds.
#[inline(always)]
fn accumulate_in<S: Scalar, const BYTES: usize>(block: &Block, len: usize, lanes: &mut LaneSums<S>) {
    match BYTES / size_of::<S>() {
        2 => accumulate_lanes::<S, 2>(block, len, lanes),
        4 => accumulate_lanes::<S, 4>(block, len, lanes),
        8 => accumulate_lanes::<S, 8>(block, len, lanes),
        _ => accumulate_lanes::<S, 16>(block, len, lanes),
    }
}

/// Each pass keeps only as many sums as there are registers.
#[inline(always)]
fn accumulate_lanes<S: Scalar, const WIDTH: usize>(block: &Block, len: usize, lanes: &mut LaneSums<S>) {
    assert!(len <= BLOCK);
    pass::<S, WIDTH, 9>(block, len, lanes, &PLANE, |x, y, _, sums| {
        let [sx, sy, sxx, sxy, syy, sxxx, sxxy, sxyy, sxxyy] = sums;
        let (xx, xy, yy) = (mul(x, x), mul(x, y), mul(y, y));
        add(sx, x);
        add(sy, y);
        add_product(sxx, x, x);
        add_product(sxy, x, y);
        add_product(syy, y, y);
        add_product(sxxx, xx, x);
        add_product(sxxy, xx, y);
        add_product(sxyy, x, yy);
        add_product(sxxyy, xy, xy);
    });
    pass::<S, WIDTH, 9>(block, len, lanes, &HEIGHT, |x, y, z, sums| {
        let [syyy, sxxxx, sxxxy, sxyyy, syyyy, sz, sxxz, sxyz, syyz] = sums;
        let (xx, xy, yy) = (mul(x, x), mul(x, y), mul(y, y));
        add_product(syyy, yy, y);
        add_product(sxxxx, xx, xx);
        add_product(sxxxy, xx, xy);
        add_product(sxyyy, xy, yy);
        add_product(syyyy, yy, yy);
        add(sz, z);
        add_product(sxxz, xx, z);
        add_product(sxyz, xy, z);
        add_product(syyz, yy, z);
    });
    pass::<S, WIDTH, 8>(block, len, lanes, &HEIGHT_CUBIC, |x, y, z, sums| {
        let [sxz, syz, sxxxz, sxxyz, sxyyz, syyyz, szz, sxxzz] = sums;
        let (xx, yy, xz, yz) = (mul(x, x), mul(y, y), mul(x, z), mul(y, z));
        add_product(sxz, x, z);
        add_product(syz, y, z);
        add_product(sxxxz, xx, xz);
        add_product(sxxyz, xx, yz);
        add_product(sxyyz, yy, xz);
        add_product(syyyz, yy, yz);
        add_product(szz, z, z);
        add_product(sxxzz, xz, xz);
    });
    pass::<S, WIDTH, 8>(block, len, lanes, &HEIGHT_SQUARE, |x, y, z, sums| {
        let [sxzz, syzz, sxyzz, syyzz, szzz, sxzzz, syzzz, szzzz] = sums;
        let (zz, xz, yz) = (mul(z, z), mul(x, z), mul(y, z));
        add_product(sxzz, zz, x);
        add_product(syzz, zz, y);
        add_product(sxyzz, xz, yz);
        add_product(syyzz, yz, yz);
        add_product(szzz, zz, z);
        add_product(sxzzz, xz, zz);
        add_product(syzzz, yz, zz);
        add_product(szzzz, zz, zz);
    });
}

/// Slots of the sums that each pass takes, in the order in which its terms stand above.
const PLANE: [usize; 9] = [
    slot(1, 0, 0),
    slot(0, 1, 0),
    slot(2, 0, 0),
    slot(1, 1, 0),
    slot(0, 2, 0),
    slot(3, 0, 0),
    slot(2, 1, 0),
    slot(1, 2, 0),
    slot(2, 2, 0),
];
const HEIGHT: [usize; 9] = [
    slot(0, 3, 0),
    slot(4, 0, 0),
    slot(3, 1, 0),
    slot(1, 3, 0),
    slot(0, 4, 0),
    slot(0, 0, 1),
    slot(2, 0, 1),
    slot(1, 1, 1),
    slot(0, 2, 1),
];
const HEIGHT_CUBIC: [usize; 8] = [
    slot(1, 0, 1),
    slot(0, 1, 1),
    slot(3, 0, 1),
    slot(2, 1, 1),
    slot(1, 2, 1),
    slot(0, 3, 1),
    slot(0, 0, 2),
    slot(2, 0, 2),
];
const HEIGHT_SQUARE: [usize; 8] = [
    slot(1, 0, 2),
    slot(0, 1, 2),
    slot(1, 1, 2),
    slot(0, 2, 2),
    slot(0, 0, 3),
    slot(1, 0, 3),
    slot(0, 1, 3),
    slot(0, 0, 4),
];

/// One pass over the block: `terms` adds the products of `WIDTH` points to their sums. It names each of these: a loop
/// over them is not unrolled in WebAssembly, and took four times as long.
///
/// `WIDTH` hardware lanes take their share of the virtual ones in turn, which keeps the sums in
/// registers.
#[inline(always)]
fn pass<S: Scalar, const WIDTH: usize, const TERMS: usize>(
    block: &Block,
    len: usize,
    lanes: &mut LaneSums<S>,
    slots: &[usize; TERMS],
    terms: impl Fn([S; WIDTH], [S; WIDTH], [S; WIDTH], &mut [[S; WIDTH]; TERMS]),
) {
    for part in 0..VIRTUAL_LANES / WIDTH {
        let first = part * WIDTH;
        let mut totals = [[S::default(); WIDTH]; TERMS];
        for step in 0..len.div_ceil(VIRTUAL_LANES) {
            let at = step * VIRTUAL_LANES + first;
            terms(load(&block.x, at), load(&block.y, at), load(&block.z, at), &mut totals);
        }
        for (total, &slot) in totals.iter().zip(slots) {
            for (l, piece) in
                (first..).step_by(QUARTER.min(WIDTH)).zip(total.chunks_exact(QUARTER.min(WIDTH)))
            {
                lanes[l / QUARTER][slot][l % QUARTER..][..piece.len()].copy_from_slice(piece);
            }
        }
    }
}

#[inline(always)]
fn load<S: Scalar, const WIDTH: usize>(row: &[f32], at: usize) -> [S; WIDTH] {
    let row: &[f32; WIDTH] = row[at..at + WIDTH].try_into().expect("a slice of that length");
    let mut lanes = [S::default(); WIDTH];
    for l in 0..WIDTH {
        lanes[l] = S::from_f32(row[l]);
    }
    lanes
}

#[inline(always)]
fn mul<S: Scalar, const WIDTH: usize>(a: [S; WIDTH], b: [S; WIDTH]) -> [S; WIDTH] {
    let mut product = [S::default(); WIDTH];
    for l in 0..WIDTH {
        product[l] = a[l] * b[l];
    }
    product
}

#[inline(always)]
fn add<S: Scalar, const WIDTH: usize>(sum: &mut [S; WIDTH], term: [S; WIDTH]) {
    for l in 0..WIDTH {
        sum[l] = term[l] + sum[l];
    }
}

#[inline(always)]
fn add_product<S: Scalar, const WIDTH: usize>(sum: &mut [S; WIDTH], a: [S; WIDTH], b: [S; WIDTH]) {
    for l in 0..WIDTH {
        sum[l] = a[l].mul_add(b[l], sum[l]);
    }
}

/// Sums each row's lanes in a fixed order, the same tree on every instruction set.
#[inline(always)]
fn reduce<S: Scalar>(lanes: &LaneSums<S>) -> [S; MOMENTS] {
    let [first, second, third, fourth] = lanes;
    let mut quarters = [[S::default(); QUARTER]; MOMENTS];
    for (slot, quarter) in quarters.iter_mut().enumerate() {
        for (l, sum) in quarter.iter_mut().enumerate() {
            *sum = (first[slot][l] + third[slot][l]) + (second[slot][l] + fourth[slot][l]);
        }
    }
    let mut sums = [S::default(); MOMENTS];
    for (sum, quarter) in sums.iter_mut().zip(&quarters) {
        *sum = (quarter[0] + quarter[2]) + (quarter[1] + quarter[3]);
    }
    sums
}

#[cfg(test)]
mod tests {
    use super::super::select::BLOCK;
    use super::*;
    use crate::moments::Moments;

    fn block_of(len: usize) -> (Block, Vec<[f64; 3]>) {
        let mut block = Block::new();
        let mut points = Vec::new();
        for i in 0..len {
            let t = i as f32;
            (block.x[i], block.y[i], block.z[i]) = ((0.7 * t).sin(), (1.3 * t).cos(), (0.31 * t + 1.0).sin());
            points.push([block.x[i].into(), block.y[i].into(), block.z[i].into()]);
        }
        (block, points)
    }

    #[test]
    fn every_slot_is_the_sum_that_it_names_and_every_set_gives_the_same_bits() {
        for len in [1, 15, 16, 17, 240, BLOCK] {
            let (block, points) = block_of(len);
            let reference = Moments::<f64>::of_points(&points);
            let plain32 = accumulate::<f32>(InstructionSet::available()[0], &block, len);
            let plain64 = accumulate::<f64>(InstructionSet::available()[0], &block, len);
            for set in InstructionSet::available() {
                assert_eq!(accumulate::<f32>(set, &block, len), plain32, "{}", set.name());
                assert_eq!(accumulate::<f64>(set, &block, len), plain64, "{}", set.name());
            }
            for (k, expected) in reference.sums.into_iter().enumerate() {
                assert!((f64::from(plain32[k]) - expected).abs() < 1e-6 * len as f64, "{len} {k}");
                assert!((plain64[k] - expected).abs() < 1e-14 * len as f64, "{len} {k}");
            }
        }
    }
}
