//! Tells, for a box of queries, which points are in all of their balls, and which may be in some.

use super::InstructionSet;
use super::instruction_set::Kind;
use super::select::{BLOCK, Block, PADDING, PIECE, Rows};
use crate::multiply_add::MultiplyAdd;
use std::ops::Range;

/// Farther than this from all points of the box, the square in units of the radius: in no ball. The exact
/// test ends at 1 + 1e-5, and rounding moves a square by less than 5e-6.
const OUTSIDE: f32 = 1.0 + 2e-5;

/// Not farther than this from any point of the box: in every ball, by the same margin.
const INSIDE: f32 = 1.0;

/// A box of queries, from the middle of the row of the points that are looked at.
#[derive(Clone, Copy)]
pub(crate) struct QueryBox {
    /// One over the radius.
    pub scale: f32,
    /// What takes a scaled offset to the box's centre.
    pub shift: [f32; 3],
    /// Half the box's edges, in units of the radius.
    pub half: [f32; 3],
}

/// Points that may be in some balls, as the rows have them; each array is [`PADDING`] longer than `len`.
#[derive(Default)]
pub(crate) struct Rim {
    pub x: Vec<f32>,
    pub y: Vec<f32>,
    pub z: Vec<f32>,
    pub len: usize,
}

impl Rim {
    pub fn rows(&self) -> Rows<'_> {
        Rows { x: &self.x, y: &self.y, z: &self.z }
    }

    /// Makes room for so many points, and what a vector may overrun.
    fn reserve(&mut self, points: usize) {
        let wanted = self.len + points + PADDING;
        if self.x.len() < wanted {
            for column in [&mut self.x, &mut self.y, &mut self.z] {
                column.resize(wanted.next_power_of_two(), 0.0);
            }
        }
    }
}

/// Appends the points of these ranks, at most [`PIECE`], to `inside` (offsets from the box's centre in
/// units of the radius), to `rim`, or to neither.
pub(crate) fn split(
    set: InstructionSet,
    rows: Rows<'_>,
    ranks: Range<usize>,
    queries: QueryBox,
    inside: &mut Block,
    rim: &mut Rim,
) {
    assert!(ranks.len() <= PIECE && inside.len < BLOCK);
    assert!(ranks.end + PADDING <= rows.x.len().min(rows.y.len()).min(rows.z.len()));
    rim.reserve(ranks.len());
    match set.0 {
        Kind::Baseline => split_baseline(rows, ranks, queries, inside, rim),
        // SAFETY: the value of `set` proves the instructions; what is read and written is checked above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2 => unsafe { x86::split_avx2(rows, ranks, queries, inside, rim) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx512 => unsafe { x86::split_avx512(rows, ranks, queries, inside, rim) },
    }
}

/// A store of every point to both, of which the next overwrites those that do not belong.
fn split_baseline(rows: Rows<'_>, ranks: Range<usize>, queries: QueryBox, inside: &mut Block, rim: &mut Rim) {
    let QueryBox { scale, shift, half } = queries;
    for rank in ranks {
        let offset = [rows.x[rank], rows.y[rank], rows.z[rank]];
        let (mut place, mut nearest, mut farthest) = ([0.0; 3], 0.0_f32, 0.0_f32);
        for axis in 0..3 {
            place[axis] = offset[axis].times_plus(scale, shift[axis]);
            let far = place[axis].abs() + half[axis];
            let near = (place[axis].abs() - half[axis]).max(0.0);
            nearest = near.times_plus(near, nearest);
            farthest = far.times_plus(far, farthest);
        }
        [inside.x[inside.len], inside.y[inside.len], inside.z[inside.len]] = place;
        [rim.x[rim.len], rim.y[rim.len], rim.z[rim.len]] = offset;
        let is_inside = farthest <= INSIDE;
        inside.len += usize::from(is_inside);
        rim.len += usize::from(!is_inside && nearest <= OUTSIDE);
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::select_x86::PACK_LEFT;
    use super::{Block, INSIDE, OUTSIDE, QueryBox, Rim, Rows};
    use std::arch::x86_64::*;
    use std::ops::Range;

    /// # Safety
    /// The rows are readable for 16 slots beyond `ranks`; `rim` and `inside` are writable for as many points
    /// as there are ranks, and 16 slots beyond.
    #[target_feature(enable = "avx2,fma,popcnt")]
    pub(super) unsafe fn split_avx2(
        rows: Rows<'_>,
        ranks: Range<usize>,
        queries: QueryBox,
        inside: &mut Block,
        rim: &mut Rim,
    ) {
        let scale = _mm256_set1_ps(queries.scale);
        let shift = queries.shift.map(|s| _mm256_set1_ps(s));
        let half = queries.half.map(|h| _mm256_set1_ps(h));
        let sign = _mm256_set1_ps(-0.0);
        let (zero, outside_limit, inside_limit) =
            (_mm256_setzero_ps(), _mm256_set1_ps(OUTSIDE), _mm256_set1_ps(INSIDE));
        let rows = [rows.x.as_ptr(), rows.y.as_ptr(), rows.z.as_ptr()];
        let inside_to = [inside.x.as_mut_ptr(), inside.y.as_mut_ptr(), inside.z.as_mut_ptr()];
        let rim_to = [rim.x.as_mut_ptr(), rim.y.as_mut_ptr(), rim.z.as_mut_ptr()];
        for start in ranks.clone().step_by(8) {
            let valid = if start + 8 <= ranks.end { 0xff } else { 0xff >> (start + 8 - ranks.end) };
            let (mut offset, mut place) = ([zero; 3], [zero; 3]);
            let (mut nearest, mut farthest) = (zero, zero);
            for axis in 0..3 {
                // SAFETY: start < ranks.end, beyond which 16 slots are readable.
                offset[axis] = unsafe { _mm256_loadu_ps(rows[axis].add(start)) };
                place[axis] = _mm256_fmadd_ps(offset[axis], scale, shift[axis]);
                let size = _mm256_andnot_ps(sign, place[axis]);
                let far = _mm256_add_ps(size, half[axis]);
                let near = _mm256_max_ps(_mm256_sub_ps(size, half[axis]), zero);
                nearest = _mm256_fmadd_ps(near, near, nearest);
                farthest = _mm256_fmadd_ps(far, far, farthest);
            }
            let is_inside =
                _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(farthest, inside_limit)) as usize & valid;
            let is_near = _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(nearest, outside_limit)) as usize;
            let is_rim = is_near & !is_inside & valid;
            // SAFETY: both grow by no more than the number of ranks, for which and 16 slots there is
            // room; a mask has eight bits, and the table 256 rows.
            unsafe {
                let pack_inside = _mm256_loadu_si256(PACK_LEFT.get_unchecked(is_inside).as_ptr().cast());
                let pack_rim = _mm256_loadu_si256(PACK_LEFT.get_unchecked(is_rim).as_ptr().cast());
                for axis in 0..3 {
                    let packed = _mm256_permutevar8x32_ps(place[axis], pack_inside);
                    _mm256_storeu_ps(inside_to[axis].add(inside.len), packed);
                    let packed = _mm256_permutevar8x32_ps(offset[axis], pack_rim);
                    _mm256_storeu_ps(rim_to[axis].add(rim.len), packed);
                }
            }
            inside.len += is_inside.count_ones() as usize;
            rim.len += is_rim.count_ones() as usize;
        }
    }

    /// # Safety
    /// As [`split_avx2`].
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
    pub(super) unsafe fn split_avx512(
        rows: Rows<'_>,
        ranks: Range<usize>,
        queries: QueryBox,
        inside: &mut Block,
        rim: &mut Rim,
    ) {
        let scale = _mm512_set1_ps(queries.scale);
        let shift = queries.shift.map(|s| _mm512_set1_ps(s));
        let half = queries.half.map(|h| _mm512_set1_ps(h));
        let (zero, outside_limit, inside_limit) =
            (_mm512_setzero_ps(), _mm512_set1_ps(OUTSIDE), _mm512_set1_ps(INSIDE));
        let rows = [rows.x.as_ptr(), rows.y.as_ptr(), rows.z.as_ptr()];
        let inside_to = [inside.x.as_mut_ptr(), inside.y.as_mut_ptr(), inside.z.as_mut_ptr()];
        let rim_to = [rim.x.as_mut_ptr(), rim.y.as_mut_ptr(), rim.z.as_mut_ptr()];
        for start in ranks.clone().step_by(16) {
            let valid: __mmask16 =
                if start + 16 <= ranks.end { 0xffff } else { 0xffff >> (start + 16 - ranks.end) };
            let (mut offset, mut place) = ([zero; 3], [zero; 3]);
            let (mut nearest, mut farthest) = (zero, zero);
            for axis in 0..3 {
                // SAFETY: start < ranks.end, beyond which 16 slots are readable.
                offset[axis] = unsafe { _mm512_loadu_ps(rows[axis].add(start)) };
                place[axis] = _mm512_fmadd_ps(offset[axis], scale, shift[axis]);
                let size = _mm512_abs_ps(place[axis]);
                let far = _mm512_add_ps(size, half[axis]);
                let near = _mm512_max_ps(_mm512_sub_ps(size, half[axis]), zero);
                nearest = _mm512_fmadd_ps(near, near, nearest);
                farthest = _mm512_fmadd_ps(far, far, farthest);
            }
            let is_inside = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, farthest, inside_limit);
            let is_near = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, nearest, outside_limit);
            let is_rim = is_near & !is_inside;
            for axis in 0..3 {
                // SAFETY: both grow by no more than the number of ranks, for which and 16 slots there is
                // room.
                unsafe {
                    let packed = _mm512_maskz_compress_ps(is_inside, place[axis]);
                    _mm512_storeu_ps(inside_to[axis].add(inside.len), packed);
                    let packed = _mm512_maskz_compress_ps(is_rim, offset[axis]);
                    _mm512_storeu_ps(rim_to[axis].add(rim.len), packed);
                }
            }
            inside.len += is_inside.count_ones() as usize;
            rim.len += is_rim.count_ones() as usize;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_instruction_set_deals_the_points_alike() {
        let value = |i: usize, seed: u32| {
            let bits =
                (3 * i as u32 + seed).wrapping_mul(2_654_435_761).rotate_left(13).wrapping_mul(2_246_822_519);
            (bits >> 8) as f32 / (1 << 24) as f32 * 2.4 - 1.2
        };
        let [x, y, z] =
            [0, 1, 2].map(|seed| (0..PIECE + PADDING).map(|i| value(i, seed)).collect::<Vec<f32>>());
        let queries = QueryBox { scale: 0.9, shift: [0.1, -0.2, 0.05], half: [0.125, 0.25, 0.0625] };
        let square = |i: usize, side: f32| -> f32 {
            let place = [x[i] * 0.9 + 0.1, y[i] * 0.9 - 0.2, z[i] * 0.9 + 0.05];
            [0, 1, 2].map(|a| (place[a].abs() + side * queries.half[a]).max(0.0).powi(2)).iter().sum()
        };
        for set in InstructionSet::available() {
            for len in [0, 1, 7, 8, 9, 15, 16, 17, 100, PIECE] {
                let (mut inside, mut rim) = (Block::new(), Rim::default());
                let rows = Rows { x: &x, y: &y, z: &z };
                split(set, rows, 0..len, queries, &mut inside, &mut rim);
                let all: Vec<usize> = (0..len).filter(|&i| square(i, 1.0) <= 1.0).collect();
                let some: Vec<usize> =
                    (0..len).filter(|&i| square(i, 1.0) > 1.0 && square(i, -1.0) <= 1.0).collect();
                assert_eq!((inside.len, rim.len), (all.len(), some.len()), "{} {len}", set.name());
                for (slot, i) in all.into_iter().enumerate() {
                    assert_eq!(inside.x[slot], x[i].times_plus(0.9, 0.1));
                    assert_eq!(inside.y[slot], y[i].times_plus(0.9, -0.2));
                    assert_eq!(inside.z[slot], z[i].times_plus(0.9, 0.05));
                }
                for (slot, i) in some.into_iter().enumerate() {
                    assert_eq!([rim.x[slot], rim.y[slot], rim.z[slot]], [x[i], y[i], z[i]]);
                }
            }
        }
    }
}
