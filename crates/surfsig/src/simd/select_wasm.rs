//! The selection of a ball's members with WebAssembly's vectors of four: the same operations as `select_baseline`, and
//! so the same bits.

use super::select::{BALL_LIMIT, Block, Placement, Rows};
use std::arch::wasm32::*;
use std::ops::Range;

/// For each mask of four lanes, the bytes of the lanes that are set, packed to the left.
static PACK_LEFT: [[u8; 16]; 16] = {
    let mut table = [[0; 16]; 16];
    let mut mask = 0;
    while mask < 16 {
        let (mut lane, mut packed) = (0, 0_usize);
        while lane < 4 {
            if mask >> lane & 1 == 1 {
                let mut byte = 0;
                while byte < 4 {
                    table[mask][4 * packed + byte] = (4 * lane + byte) as u8;
                    byte += 1;
                }
                packed += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

/// # Safety
/// The rows are readable for 16 slots beyond `ranks`, which are at most `PIECE`; `block.len < BLOCK`, so that every
/// store ends inside the block's arrays.
#[inline(always)]
pub(super) unsafe fn select_simd128<const RANKS: bool>(
    rows: Rows<'_>,
    ranks: Range<usize>,
    placement: Placement,
    block: &mut Block,
) {
    let scale = f32x4_splat(placement.scale);
    #[allow(clippy::redundant_closure)] // Functions of an instruction set are no `Fn`.
    let [sx, sy, sz] = placement.shift.map(|s| f32x4_splat(s));
    let limit = f32x4_splat(BALL_LIMIT);
    let iota = u32x4(0, 1, 2, 3);
    let mut end = block.len;
    // SAFETY (of every call): start < ranks.end, and the rows are readable for 16 slots beyond that; end < BLOCK +
    // PIECE, since a block grows by at most the number of ranks, and its arrays are 16 slots longer; a mask has four
    // bits, and the table 16 rows.
    let mut keep = |start: usize, valid: u8| unsafe {
        let place = |row: &[f32], shift: v128| {
            f32x4_add(f32x4_mul(v128_load(row.as_ptr().add(start).cast()), scale), shift)
        };
        let (x, y, z) = (place(rows.x, sx), place(rows.y, sy), place(rows.z, sz));
        let square = f32x4_add(f32x4_mul(z, z), f32x4_add(f32x4_mul(y, y), f32x4_mul(x, x)));
        let mask = i32x4_bitmask(f32x4_le(square, limit)) & valid;
        let pack = v128_load(PACK_LEFT.get_unchecked(mask as usize).as_ptr().cast());
        v128_store(block.x.as_mut_ptr().add(end).cast(), i8x16_swizzle(x, pack));
        v128_store(block.y.as_mut_ptr().add(end).cast(), i8x16_swizzle(y, pack));
        v128_store(block.z.as_mut_ptr().add(end).cast(), i8x16_swizzle(z, pack));
        if RANKS {
            let rank = i32x4_add(u32x4_splat(start as u32), iota);
            v128_store(block.rank.as_mut_ptr().add(end).cast(), i8x16_swizzle(rank, pack));
        }
        end += mask.count_ones() as usize;
    };
    let mut start = ranks.start;
    while start + 4 <= ranks.end {
        keep(start, 0xf);
        start += 4;
    }
    if start < ranks.end {
        keep(start, 0xf >> (start + 4 - ranks.end));
    }
    block.len = end;
}
