//! Deals members of a ball to a smaller ball around the same centre, and to the shell that is left.

use super::InstructionSet;
use super::instruction_set::Kind;
use super::select::{BLOCK, Block, PIECE};
use crate::multiply_add::MultiplyAdd;

/// Appends the first `len` members of a block, at most [`PIECE`], to `inner` where the square of their distance
/// from the centre is at most `limit`, and to `outer` where it is more.
pub(crate) fn partition(
    set: InstructionSet,
    members: &Block,
    len: usize,
    limit: f32,
    inner: &mut Block,
    outer: &mut Block,
) {
    assert!(len <= PIECE && inner.len < BLOCK && outer.len < BLOCK);
    match set.0 {
        Kind::Baseline => partition_baseline(members, len, limit, inner, outer),
        // SAFETY: the value of `set` proves the instructions; the lengths are checked above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2 => unsafe { x86::partition_avx2(members, len, limit, inner, outer) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx512 => unsafe { x86::partition_avx512(members, len, limit, inner, outer) },
    }
}

/// A store of every point to both, of which the next overwrites those that do not belong.
fn partition_baseline(members: &Block, len: usize, limit: f32, inner: &mut Block, outer: &mut Block) {
    for i in 0..len {
        let [x, y, z] = [members.x[i], members.y[i], members.z[i]];
        let is_inner = z.times_plus(z, y.times_plus(y, x * x)) <= limit;
        for (block, belongs) in [(&mut *inner, is_inner), (&mut *outer, !is_inner)] {
            (block.x[block.len], block.y[block.len], block.z[block.len]) = (x, y, z);
            block.len += usize::from(belongs);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::select_x86::PACK_LEFT;
    use super::Block;
    use std::arch::x86_64::*;

    /// # Safety
    /// `len` is at most `PIECE`, and both blocks hold less than `BLOCK`: each has room for as many points, and
    /// 16 slots more.
    #[target_feature(enable = "avx2,fma,popcnt")]
    pub(super) unsafe fn partition_avx2(
        members: &Block,
        len: usize,
        limit: f32,
        inner: &mut Block,
        outer: &mut Block,
    ) {
        let limit = _mm256_set1_ps(limit);
        let from = [members.x.as_ptr(), members.y.as_ptr(), members.z.as_ptr()];
        for start in (0..len).step_by(8) {
            let valid = if start + 8 <= len { 0xff } else { 0xff >> (start + 8 - len) };
            // SAFETY: start < len <= PIECE, and a block's arrays are longer by more than 16.
            let place = from.map(|axis| unsafe { _mm256_loadu_ps(axis.add(start)) });
            let [x, y, z] = place;
            let square = _mm256_fmadd_ps(z, z, _mm256_fmadd_ps(y, y, _mm256_mul_ps(x, x)));
            let below = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(square, limit)) as usize;
            for (block, mask) in [(&mut *inner, below & valid), (&mut *outer, !below & valid)] {
                let to = [block.x.as_mut_ptr(), block.y.as_mut_ptr(), block.z.as_mut_ptr()];
                // SAFETY: a block grows by no more than `len`, for which and 16 slots there is room; a mask
                // has eight bits, and the table 256 rows.
                unsafe {
                    let pack = _mm256_loadu_si256(PACK_LEFT.get_unchecked(mask).as_ptr().cast());
                    for axis in 0..3 {
                        let packed = _mm256_permutevar8x32_ps(place[axis], pack);
                        _mm256_storeu_ps(to[axis].add(block.len), packed);
                    }
                }
                block.len += mask.count_ones() as usize;
            }
        }
    }

    /// # Safety
    /// As [`partition_avx2`].
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
    pub(super) unsafe fn partition_avx512(
        members: &Block,
        len: usize,
        limit: f32,
        inner: &mut Block,
        outer: &mut Block,
    ) {
        let limit = _mm512_set1_ps(limit);
        let from = [members.x.as_ptr(), members.y.as_ptr(), members.z.as_ptr()];
        for start in (0..len).step_by(16) {
            let valid: __mmask16 = if start + 16 <= len { 0xffff } else { 0xffff >> (start + 16 - len) };
            // SAFETY: start < len <= PIECE, and a block's arrays are longer by more than 16.
            let place = from.map(|axis| unsafe { _mm512_loadu_ps(axis.add(start)) });
            let [x, y, z] = place;
            let square = _mm512_fmadd_ps(z, z, _mm512_fmadd_ps(y, y, _mm512_mul_ps(x, x)));
            let below = _mm512_cmp_ps_mask::<_CMP_LE_OQ>(square, limit);
            for (block, mask) in [(&mut *inner, below & valid), (&mut *outer, !below & valid)] {
                let to = [block.x.as_mut_ptr(), block.y.as_mut_ptr(), block.z.as_mut_ptr()];
                for axis in 0..3 {
                    let packed = _mm512_maskz_compress_ps(mask, place[axis]);
                    // SAFETY: a block grows by no more than `len`, for which and 16 slots there is room.
                    unsafe { _mm512_storeu_ps(to[axis].add(block.len), packed) };
                }
                block.len += mask.count_ones() as usize;
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_deals_each_member_to_one_side_in_order() {
        let mut members = Block::new();
        for i in 0..PIECE {
            let t = i as f32;
            (members.x[i], members.y[i], members.z[i]) =
                ((0.7 * t).sin(), 0.6 * (1.3 * t).cos(), 0.2 * (2.1 * t).sin());
        }
        let limit = 0.4;
        let inside = |i: usize| {
            let [x, y, z] = [members.x[i], members.y[i], members.z[i]];
            z.times_plus(z, y.times_plus(y, x * x)) <= limit
        };
        for set in InstructionSet::available() {
            for len in [0, 1, 7, 8, 9, 15, 16, 17, 100, PIECE] {
                let (mut inner, mut outer) = (Block::new(), Block::new());
                partition(set, &members, len, limit, &mut inner, &mut outer);
                for (block, side) in [(&inner, true), (&outer, false)] {
                    let expected: Vec<usize> = (0..len).filter(|&i| inside(i) == side).collect();
                    assert_eq!(block.len, expected.len(), "{} {len}", set.name());
                    for (slot, i) in expected.into_iter().enumerate() {
                        let (found, given) = (
                            [block.x[slot], block.y[slot], block.z[slot]],
                            [members.x[i], members.y[i], members.z[i]],
                        );
                        assert_eq!(found, given);
                    }
                }
            }
        }
    }
}
