//! The selection of a ball's members with AVX2 and AVX-512: the same operations as `select_baseline`, and so the same
//! bits.

use super::select::{BALL_LIMIT, Ball, Block, Place, Placement, Rows, Window, gather_by};
use std::arch::x86_64::*;
use std::ops::Range;

/// For each mask of eight lanes, the lanes that are set, packed to the left.
pub(super) static PACK_LEFT: [[i32; 8]; 256] = {
    let mut table = [[0; 8]; 256];
    let mut mask = 0;
    while mask < 256 {
        let (mut lane, mut packed) = (0, 0_usize);
        while lane < 8 {
            if mask >> lane & 1 == 1 {
                table[mask][packed] = lane;
                packed += 1;
            }
            lane += 1;
        }
        mask += 1;
    }
    table
};

#[target_feature(enable = "avx2,fma,popcnt")]
pub(super) fn gather_avx2<const RANKS: bool>(
    rows: Rows<'_>,
    windows: &[Window],
    ball: Ball,
    block: &mut Block,
    place: &mut Place,
) -> bool {
    gather_by(rows, windows, ball, block, place, |rows, ranks, placement, block| {
        // SAFETY: `gather_by` checks that the rows are readable for 16 slots beyond the ranks, of
        // which it hands on at most `PIECE`, and only while the block holds less than `BLOCK`.
        unsafe { select_avx2::<RANKS>(rows, ranks, placement, block) }
    })
}

#[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
pub(super) fn gather_avx512<const RANKS: bool>(
    rows: Rows<'_>,
    windows: &[Window],
    ball: Ball,
    block: &mut Block,
    place: &mut Place,
) -> bool {
    gather_by(rows, windows, ball, block, place, |rows, ranks, placement, block| {
        // SAFETY: as in `gather_avx2`.
        unsafe { select_avx512::<RANKS>(rows, ranks, placement, block) }
    })
}

/// # Safety
/// The rows are readable for 16 slots beyond `ranks`, which are at most `PIECE`; `block.len <
/// BLOCK`, so that every store ends inside the block's arrays.
#[inline]
#[target_feature(enable = "avx2,fma,popcnt")]
unsafe fn select_avx2<const RANKS: bool>(
    rows: Rows<'_>,
    ranks: Range<usize>,
    placement: Placement,
    block: &mut Block,
) {
    let scale = _mm256_set1_ps(placement.scale);
    let [sx, sy, sz] = placement.shift.map(|s| _mm256_set1_ps(s));
    let limit = _mm256_set1_ps(BALL_LIMIT);
    let iota = _mm256_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7);
    let mut end = block.len;
    // SAFETY (of every call): start < ranks.end, and the rows are readable for 16 slots beyond
    // that; end < BLOCK + PIECE, since a block grows by at most the number of ranks, and its arrays
    // are 16 slots longer; a mask has eight bits, and the table 256 rows.
    let mut keep = |start: usize, valid: usize| unsafe {
        let x = _mm256_fmadd_ps(_mm256_loadu_ps(rows.x.as_ptr().add(start)), scale, sx);
        let y = _mm256_fmadd_ps(_mm256_loadu_ps(rows.y.as_ptr().add(start)), scale, sy);
        let z = _mm256_fmadd_ps(_mm256_loadu_ps(rows.z.as_ptr().add(start)), scale, sz);
        let square = _mm256_fmadd_ps(z, z, _mm256_fmadd_ps(y, y, _mm256_mul_ps(x, x)));
        let mask = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(square, limit)) as usize & valid;
        let pack = _mm256_loadu_si256(PACK_LEFT.get_unchecked(mask).as_ptr().cast());
        _mm256_storeu_ps(block.x.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(x, pack));
        _mm256_storeu_ps(block.y.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(y, pack));
        _mm256_storeu_ps(block.z.as_mut_ptr().add(end), _mm256_permutevar8x32_ps(z, pack));
        if RANKS {
            let rank = _mm256_add_epi32(_mm256_set1_epi32(start as i32), iota);
            let rank = _mm256_permutevar8x32_epi32(rank, pack);
            _mm256_storeu_si256(block.rank.as_mut_ptr().add(end).cast(), rank);
        }
        end += mask.count_ones() as usize;
    };
    let mut start = ranks.start;
    while start + 8 <= ranks.end {
        keep(start, 0xff);
        start += 8;
    }
    if start < ranks.end {
        keep(start, 0xff >> (start + 8 - ranks.end));
    }
    block.len = end;
}

/// # Safety
/// As [`select_avx2`].
#[inline]
#[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
unsafe fn select_avx512<const RANKS: bool>(
    rows: Rows<'_>,
    ranks: Range<usize>,
    placement: Placement,
    block: &mut Block,
) {
    let scale = _mm512_set1_ps(placement.scale);
    let [sx, sy, sz] = placement.shift.map(|s| _mm512_set1_ps(s));
    let limit = _mm512_set1_ps(BALL_LIMIT);
    let iota = _mm512_setr_epi32(0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15);
    let mut end = block.len;
    // SAFETY (of every call): as in `select_avx2`. Compressing in a register and storing all of it
    // is faster on some processors than a compressing store.
    let mut keep = |start: usize, valid: __mmask16| unsafe {
        let x = _mm512_fmadd_ps(_mm512_loadu_ps(rows.x.as_ptr().add(start)), scale, sx);
        let y = _mm512_fmadd_ps(_mm512_loadu_ps(rows.y.as_ptr().add(start)), scale, sy);
        let z = _mm512_fmadd_ps(_mm512_loadu_ps(rows.z.as_ptr().add(start)), scale, sz);
        let square = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x)));
        let mask = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, square, limit);
        _mm512_storeu_ps(block.x.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, x));
        _mm512_storeu_ps(block.y.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, y));
        _mm512_storeu_ps(block.z.as_mut_ptr().add(end), _mm512_maskz_compress_ps(mask, z));
        if RANKS {
            let rank = _mm512_add_epi32(_mm512_set1_epi32(start as i32), iota);
            let rank = _mm512_maskz_compress_epi32(mask, rank);
            _mm512_storeu_si512(block.rank.as_mut_ptr().add(end).cast(), rank);
        }
        end += mask.count_ones() as usize;
    };
    let mut start = ranks.start;
    while start + 16 <= ranks.end {
        keep(start, 0xffff);
        start += 16;
    }
    if start < ranks.end {
        keep(start, 0xffff >> (start + 16 - ranks.end));
    }
    block.len = end;
}
