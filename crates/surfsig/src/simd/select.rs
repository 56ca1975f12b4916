//! Keeps the points of a row that lie in the ball, side by side, in the order of the row.
//!
//! The accumulator then works on full vectors of points that count. Since only members of the ball
//! are passed on, and always in the order of the lattice, the sums do not depend on which rows or
//! pieces of rows were looked at: a tile gives the same bits as the whole cloud.

use super::InstructionSet;
use super::instruction_set::Kind;
use crate::extremes::larger;
use crate::lattice::Lattice;
use crate::multiply_add::MultiplyAdd;

/// The ball is d^2 <= r^2 (1 + 1e-5), in units of r: float32 offsets cannot decide a tie, and on a
/// regular grid many points lie exactly on the sphere.
pub(crate) const BALL_LIMIT: f32 = 1.0 + 1e-5;

/// Points that a block hands on at a time.
pub(crate) const BLOCK: usize = 512;

/// Points that one call of [`select`] may look at.
pub(crate) const PIECE: usize = 512;

/// Slots that a vector may overrun: the widest vector.
pub(crate) const PADDING: usize = 16;

const CAPACITY: usize = BLOCK + PIECE + PADDING;

/// Members of a ball: offsets from its centre, divided by its radius. Vectors of them lie in one cache line.
#[repr(align(64))]
pub(crate) struct Block {
    pub x: [f32; CAPACITY],
    pub y: [f32; CAPACITY],
    pub z: [f32; CAPACITY],
    /// Ranks in the index; filled only when asked for.
    pub rank: [u32; CAPACITY],
    pub len: usize,
}

impl Block {
    pub fn new() -> Self {
        Self { x: [0.0; CAPACITY], y: [0.0; CAPACITY], z: [0.0; CAPACITY], rank: [0; CAPACITY], len: 0 }
    }

    /// Moves what is left after the first `BLOCK` points to the front.
    pub fn carry_over(&mut self) {
        let rest = BLOCK..self.len;
        self.x.copy_within(rest.clone(), 0);
        self.y.copy_within(rest.clone(), 0);
        self.z.copy_within(rest.clone(), 0);
        self.rank.copy_within(rest, 0);
        self.len -= BLOCK;
    }

    /// Zeros from the last point to the end of its vector.
    pub fn pad(&mut self) {
        let padding = self.len..self.len.next_multiple_of(PADDING);
        self.x[padding.clone()].fill(0.0);
        self.y[padding.clone()].fill(0.0);
        self.z[padding].fill(0.0);
    }

    /// Takes over the places of another's first `len` points.
    pub fn append(&mut self, other: &Self, len: usize) {
        let to = self.len..self.len + len;
        self.x[to.clone()].copy_from_slice(&other.x[..len]);
        self.y[to.clone()].copy_from_slice(&other.y[..len]);
        self.z[to].copy_from_slice(&other.z[..len]);
        self.len += len;
    }
}

/// The coordinates of all points in rows, each array readable for [`PADDING`] slots beyond the last.
#[derive(Clone, Copy)]
pub(crate) struct Rows<'a> {
    pub x: &'a [f32],
    pub y: &'a [f32],
    pub z: &'a [f32],
}

/// A part of a row that a ball may reach, by ranks, and where the row is.
#[derive(Clone)]
pub(crate) struct Window {
    pub ranks: std::ops::Range<usize>,
    /// The middle of the row's cells, from the middle of the query's row, in units of the radius.
    pub between: [f64; 3],
}

/// The ball that is being walked through.
#[derive(Clone, Copy)]
pub(crate) struct Ball {
    /// The query, from the middle of its row, in units of the radius.
    pub query: [f64; 3],
    /// One over the radius.
    pub scale: f32,
    /// Half the size of a row along y and z, in units of the radius.
    pub half_step: f32,
}

impl Ball {
    /// The ball around the query at this offset from its row's middle; `scale` is one over the radius.
    pub fn around(offset: [f32; 3], scale: f32, lattice: &Lattice) -> Self {
        let units = f64::from(scale);
        Self {
            query: offset.map(|o| f64::from(o) * units),
            scale,
            half_step: (lattice.half_step() * units) as f32,
        }
    }
}

/// How far a walk has come: the window, and the rank within it.
#[derive(Clone, Copy, Default)]
pub(crate) struct Place {
    window: usize,
    rank: usize,
}

/// How a row's offsets become offsets from the ball's centre in units of its radius: `scale * offset + shift`.
#[derive(Clone, Copy)]
pub(super) struct Placement {
    pub(super) scale: f32,
    pub(super) shift: [f32; 3],
}

/// Appends members of the ball to `block`, from `place` on, until the block holds [`BLOCK`] of them or
/// more (`false`) or the windows are at their end (`true`).
#[inline]
pub(crate) fn gather<const RANKS: bool>(
    set: InstructionSet,
    rows: Rows<'_>,
    windows: &[Window],
    ball: Ball,
    block: &mut Block,
    place: &mut Place,
) -> bool {
    match set.0 {
        #[cfg(not(all(target_arch = "wasm32", target_feature = "simd128")))]
        Kind::Baseline => gather_by(rows, windows, ball, block, place, select_baseline::<RANKS>),
        #[cfg(all(target_arch = "wasm32", target_feature = "simd128"))]
        Kind::Baseline => gather_by(rows, windows, ball, block, place, |rows, ranks, placement, block| {
            // SAFETY: `gather_by` checks that the rows are readable for 16 slots beyond the ranks, of which it hands on
            // at most `PIECE`, and only while the block holds less than `BLOCK`.
            unsafe { super::select_wasm::select_simd128::<RANKS>(rows, ranks, placement, block) }
        }),
        // SAFETY: the value of `set` proves AVX2, FMA and POPCNT.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2 => unsafe { super::select_x86::gather_avx2::<RANKS>(rows, windows, ball, block, place) },
        // SAFETY: the value of `set` proves AVX-512 F and POPCNT.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx512 => unsafe {
            super::select_x86::gather_avx512::<RANKS>(rows, windows, ball, block, place)
        },
    }
}

/// The walk from window to window; `select` appends the members among some ranks of one row.
#[inline(always)]
pub(super) fn gather_by(
    rows: Rows<'_>,
    windows: &[Window],
    ball: Ball,
    block: &mut Block,
    place: &mut Place,
    select: impl Fn(Rows<'_>, std::ops::Range<usize>, Placement, &mut Block),
) -> bool {
    let readable = rows.x.len().min(rows.y.len()).min(rows.z.len());
    while let Some(window) = windows.get(place.window) {
        let mut shift = [0.0; 3];
        for axis in 0..3 {
            shift[axis] = (window.between[axis] - ball.query[axis]) as f32;
        }
        let gap_y = larger(shift[1].abs() - ball.half_step, 0.0);
        let gap_z = larger(shift[2].abs() - ball.half_step, 0.0);
        if gap_y * gap_y + gap_z * gap_z <= BALL_LIMIT {
            let placement = Placement { scale: ball.scale, shift };
            let mut start = window.ranks.start.max(place.rank);
            while start < window.ranks.end {
                if block.len >= BLOCK {
                    place.rank = start;
                    return false;
                }
                let end = window.ranks.end.min(start + PIECE);
                assert!(end + PADDING <= readable);
                select(rows, start..end, placement, block);
                start = end;
            }
        }
        *place = Place { window: place.window + 1, rank: 0 };
    }
    true
}

/// Eight distances at a time, which the compiler vectorises; then a store of every point, of which
/// the next overwrites those that are outside.
#[cfg_attr(all(target_arch = "wasm32", target_feature = "simd128"), allow(dead_code))]
#[inline(always)]
fn select_baseline<const RANKS: bool>(
    rows: Rows<'_>,
    ranks: std::ops::Range<usize>,
    placement: Placement,
    block: &mut Block,
) {
    const WIDTH: usize = 8;
    let Placement { scale, shift } = placement;
    for start in ranks.clone().step_by(WIDTH) {
        let lane = |row: &[f32], l: usize, axis: usize| row[start + l].times_plus(scale, shift[axis]);
        let x: [f32; WIDTH] = std::array::from_fn(|l| lane(rows.x, l, 0));
        let y: [f32; WIDTH] = std::array::from_fn(|l| lane(rows.y, l, 1));
        let z: [f32; WIDTH] = std::array::from_fn(|l| lane(rows.z, l, 2));
        let inside: [bool; WIDTH] = std::array::from_fn(|l| {
            let square = z[l].times_plus(z[l], y[l].times_plus(y[l], x[l] * x[l]));
            square <= BALL_LIMIT && start + l < ranks.end
        });
        for l in 0..WIDTH {
            block.x[block.len] = x[l];
            block.y[block.len] = y[l];
            block.z[block.len] = z[l];
            if RANKS {
                block.rank[block.len] = (start + l) as u32;
            }
            block.len += usize::from(inside[l]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A reproducible value in [-1.2, 1.2).
    fn noise(i: usize) -> f32 {
        let bits = (i as u32).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519);
        (bits >> 8) as f32 / (1 << 24) as f32 * 2.4 - 1.2
    }

    #[test]
    fn every_instruction_set_keeps_exactly_the_members_in_their_order() {
        let row = |seed: usize| (0..PIECE + PADDING).map(|i| noise(3 * i + seed)).collect::<Vec<_>>();
        let (x, y, z) = (row(0), row(1), row(2));
        let rows = Rows { x: &x, y: &y, z: &z };
        let ball = Ball { query: [-0.1, 0.2, -0.05], scale: 0.7, half_step: 10.0 };
        for set in InstructionSet::available() {
            for len in [0, 1, 7, 8, 9, 15, 16, 17, 100, PIECE] {
                let mut block = Block::new();
                let windows = [Window { ranks: 0..len, between: [0.0; 3] }];
                assert!(gather::<true>(set, rows, &windows, ball, &mut block, &mut Place::default()));
                let expected: Vec<usize> = (0..len)
                    .filter(|&i| {
                        let p = [x[i] * 0.7 + 0.1, y[i] * 0.7 - 0.2, z[i] * 0.7 + 0.05];
                        p.iter().map(|c| c * c).sum::<f32>() <= BALL_LIMIT
                    })
                    .collect();
                let ranks: Vec<usize> = block.rank[..block.len].iter().map(|&k| k as usize).collect();
                assert_eq!(ranks, expected, "{} {len}", set.name());
                for (slot, &i) in expected.iter().enumerate() {
                    assert_eq!(block.x[slot], x[i].times_plus(0.7, 0.1));
                    assert_eq!(block.y[slot], y[i].times_plus(0.7, -0.2));
                    assert_eq!(block.z[slot], z[i].times_plus(0.7, 0.05));
                }
            }
        }
    }
}
