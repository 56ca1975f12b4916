//! Keeps the points of a row that lie in the ball, side by side, in the order of the row.
//!
//! The accumulator then works on full vectors of points that count. Since only members of the ball
//! are passed on, and always in the order of the lattice, the sums do not depend on which rows or
//! pieces of rows were looked at: a tile gives the same bits as the whole cloud.

use super::InstructionSet;
use super::instruction_set::Kind;

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

/// Members of a ball: offsets from its centre, divided by its radius.
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
}

/// A piece of a row: at most [`PIECE`] points, readable for [`PADDING`] slots beyond `len`.
#[derive(Clone, Copy)]
pub(crate) struct RowPiece<'a> {
    pub x: &'a [f32],
    pub y: &'a [f32],
    pub z: &'a [f32],
    pub len: usize,
    pub first_rank: u32,
}

/// How a row's offsets become offsets from the ball's centre in units of its radius: `scale * offset + shift`.
#[derive(Clone, Copy)]
pub(crate) struct Placement {
    pub scale: f32,
    pub shift: [f32; 3],
}

/// Appends the piece's points that lie in the ball to `block`.
#[inline]
pub(crate) fn select<const RANKS: bool>(
    set: InstructionSet,
    piece: RowPiece<'_>,
    placement: Placement,
    block: &mut Block,
) {
    assert!(piece.len <= PIECE && block.len < BLOCK);
    let readable = piece.x.len().min(piece.y.len()).min(piece.z.len());
    assert!(readable >= piece.len + PADDING);
    match set.0 {
        Kind::Baseline => select_baseline::<RANKS>(piece, placement, block),
        // SAFETY: the value of `set` proves AVX2 and FMA; the two asserts above are its other conditions.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2 => unsafe { x86::select_avx2::<RANKS>(piece, placement, block) },
        // SAFETY: the value of `set` proves AVX-512 F; the two asserts above are its other conditions.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx512 => unsafe { x86::select_avx512::<RANKS>(piece, placement, block) },
    }
}

/// Eight distances at a time, which the compiler vectorises; then a store of every point, of which
/// the next overwrites those that are outside.
fn select_baseline<const RANKS: bool>(piece: RowPiece<'_>, placement: Placement, block: &mut Block) {
    const WIDTH: usize = 8;
    let Placement { scale, shift } = placement;
    for start in (0..piece.len).step_by(WIDTH) {
        let lane = |row: &[f32], l: usize, axis: usize| row[start + l].mul_add(scale, shift[axis]);
        let x: [f32; WIDTH] = std::array::from_fn(|l| lane(piece.x, l, 0));
        let y: [f32; WIDTH] = std::array::from_fn(|l| lane(piece.y, l, 1));
        let z: [f32; WIDTH] = std::array::from_fn(|l| lane(piece.z, l, 2));
        let inside: [bool; WIDTH] = std::array::from_fn(|l| {
            let square = z[l].mul_add(z[l], y[l].mul_add(y[l], x[l] * x[l]));
            square <= BALL_LIMIT && start + l < piece.len
        });
        for l in 0..WIDTH {
            block.x[block.len] = x[l];
            block.y[block.len] = y[l];
            block.z[block.len] = z[l];
            if RANKS {
                block.rank[block.len] = piece.first_rank + (start + l) as u32;
            }
            block.len += usize::from(inside[l]);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::{BALL_LIMIT, Block, Placement, RowPiece};
    use std::arch::x86_64::*;

    /// For each mask of eight lanes, the lanes that are set, packed to the left.
    static PACK_LEFT: [[i32; 8]; 256] = {
        let mut table = [[0; 8]; 256];
        let mut mask = 0;
        while mask < 256 {
            let (mut lane, mut packed) = (0, 0);
            while lane < 8 {
                if mask >> lane & 1 == 1 {
                    table[mask][packed] = lane as i32;
                    packed += 1;
                }
                lane += 1;
            }
            mask += 1;
        }
        table
    };

    /// # Safety
    /// The processor has AVX2 and FMA; `piece` is readable for 16 slots beyond its length, which is
    /// at most `PIECE`; `block.len < BLOCK`, so that every store ends inside the block's arrays.
    #[target_feature(enable = "avx2,fma")]
    pub(super) unsafe fn select_avx2<const RANKS: bool>(
        piece: RowPiece<'_>,
        placement: Placement,
        block: &mut Block,
    ) {
        let scale = _mm256_set1_ps(placement.scale);
        let [sx, sy, sz] = placement.shift.map(|s| _mm256_set1_ps(s));
        let limit = _mm256_set1_ps(BALL_LIMIT);
        let iota = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
        let mut end = block.len;
        for start in (0..piece.len).step_by(8) {
            // SAFETY: start < piece.len, and the rows are readable for 16 slots beyond that.
            let (x, y, z) = unsafe {
                (
                    _mm256_fmadd_ps(_mm256_loadu_ps(piece.x.as_ptr().add(start)), scale, sx),
                    _mm256_fmadd_ps(_mm256_loadu_ps(piece.y.as_ptr().add(start)), scale, sy),
                    _mm256_fmadd_ps(_mm256_loadu_ps(piece.z.as_ptr().add(start)), scale, sz),
                )
            };
            let square = _mm256_fmadd_ps(z, z, _mm256_fmadd_ps(y, y, _mm256_mul_ps(x, x)));
            let inside = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(square, limit)) as usize;
            let valid = 0xff >> 8usize.saturating_sub(piece.len - start);
            let mask = inside & valid;
            // SAFETY: end < BLOCK + PIECE, since a block grows by at most the piece's length, and the
            // arrays are 16 slots longer; a mask has eight bits, the table 256 rows.
            unsafe {
                let pack = _mm256_loadu_si256(PACK_LEFT.get_unchecked(mask).as_ptr().cast());
                _mm256_storeu_ps(block.x.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(x, pack));
                _mm256_storeu_ps(block.y.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(y, pack));
                _mm256_storeu_ps(block.z.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(z, pack));
                if RANKS {
                    let first = _mm256_set1_epi32((piece.first_rank + start as u32) as i32);
                    let rank = _mm256_permutevar8x32_epi32(_mm256_add_epi32(first, iota), pack);
                    _mm256_storeu_si256(block.rank.as_mut_ptr().add(end).cast(), rank);
                }
            }
            end += mask.count_ones() as usize;
        }
        block.len = end;
    }

    /// # Safety
    /// The processor has AVX-512 F; otherwise as [`select_avx2`].
    #[target_feature(enable = "avx512f")]
    pub(super) unsafe fn select_avx512<const RANKS: bool>(
        piece: RowPiece<'_>,
        placement: Placement,
        block: &mut Block,
    ) {
        let scale = _mm512_set1_ps(placement.scale);
        let [sx, sy, sz] = placement.shift.map(|s| _mm512_set1_ps(s));
        let limit = _mm512_set1_ps(BALL_LIMIT);
        let iota = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
        let mut end = block.len;
        for start in (0..piece.len).step_by(16) {
            // SAFETY: start < piece.len, and the rows are readable for 16 slots beyond that.
            let (x, y, z) = unsafe {
                (
                    _mm512_fmadd_ps(_mm512_loadu_ps(piece.x.as_ptr().add(start)), scale, sx),
                    _mm512_fmadd_ps(_mm512_loadu_ps(piece.y.as_ptr().add(start)), scale, sy),
                    _mm512_fmadd_ps(_mm512_loadu_ps(piece.z.as_ptr().add(start)), scale, sz),
                )
            };
            let square = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x)));
            let valid = (0xffff_u32 >> 16usize.saturating_sub(piece.len - start)) as __mmask16;
            let mask = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, square, limit);
            // SAFETY: end < BLOCK + PIECE, since a block grows by at most the piece's length, and the
            // arrays are 16 slots longer. Compressing in a register and storing all of it is faster
            // on some processors than a compressing store.
            unsafe {
                _mm512_storeu_ps(block.x.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, x));
                _mm512_storeu_ps(block.y.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, y));
                _mm512_storeu_ps(block.z.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, z));
                if RANKS {
                    let first = _mm512_set1_epi32((piece.first_rank + start as u32) as i32);
                    let rank = _mm512_maskz_compress_epi32(mask, _mm512_add_epi32(first, iota));
                    _mm512_storeu_si512(block.rank.as_mut_ptr().add(end).cast(), rank);
                }
            }
            end += mask.count_ones() as usize;
        }
        block.len = end;
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
        let placement = Placement { scale: 0.7, shift: [0.1, -0.2, 0.05] };
        for set in InstructionSet::available() {
            for len in [0, 1, 7, 8, 9, 15, 16, 17, 100, PIECE] {
                let mut block = Block::new();
                let piece = RowPiece { x: &x, y: &y, z: &z, len, first_rank: 40 };
                select::<true>(set, piece, placement, &mut block);
                let expected: Vec<usize> = (0..len)
                    .filter(|&i| {
                        let p = [x[i] * 0.7 + 0.1, y[i] * 0.7 - 0.2, z[i] * 0.7 + 0.05];
                        p.iter().map(|c| c * c).sum::<f32>() <= BALL_LIMIT
                    })
                    .collect();
                let ranks: Vec<usize> = block.rank[..block.len].iter().map(|&k| k as usize - 40).collect();
                assert_eq!(ranks, expected, "{} {len}", set.name());
                for (slot, &i) in expected.iter().enumerate() {
                    assert_eq!(block.x[slot], x[i].mul_add(0.7, 0.1));
                    assert_eq!(block.y[slot], y[i].mul_add(0.7, -0.2));
                    assert_eq!(block.z[slot], z[i].mul_add(0.7, 0.05));
                }
            }
        }
    }
}
