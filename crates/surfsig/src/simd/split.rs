//! Tells, for a cube of queries, which points are in the ball around its centre, and which of their balls
//! may disagree about.

use super::InstructionSet;
use super::instruction_set::Kind;
use super::select::{BLOCK, Block, PADDING, PIECE, Rows};
use std::ops::Range;

/// Farther than this from all points of the cube, the square in units of the radius: in no ball. The exact
/// test ends at 1 + 1e-5, and rounding moves a square by less than 5e-6.
const OUTSIDE: f32 = 1.0 + 2e-5;

/// Not farther than this from any point of the cube: in every ball, by the same margin. Not farther than this
/// from its centre: in the base.
const INSIDE: f32 = 1.0;

/// A cube of queries, from the middle of the row of the points that are looked at.
#[derive(Clone, Copy)]
pub(crate) struct QueryCube {
    /// One over the radius.
    pub scale: f32,
    /// What takes a scaled offset to the cube's centre.
    pub shift: [f32; 3],
    /// Half the cube's edge, in units of the radius.
    pub half: f32,
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

/// Appends those points of these ranks, at most [`PIECE`], that are in the ball around the cube's centre to
/// `base`, as offsets from the centre in units of the radius. Those about which the balls of the cube's
/// queries may disagree are appended to the rim too: to the first where they are in the base, to the second
/// where they are not.
pub(crate) fn split(
    set: InstructionSet,
    rows: Rows<'_>,
    ranks: Range<usize>,
    cube: QueryCube,
    base: &mut Block,
    rims: &mut [Rim; 2],
) {
    assert!(ranks.len() <= PIECE && base.len < BLOCK);
    assert!(ranks.end + PADDING <= rows.x.len().min(rows.y.len()).min(rows.z.len()));
    rims.iter_mut().for_each(|rim| rim.reserve(ranks.len()));
    match set.0 {
        Kind::Baseline => split_baseline(rows, ranks, cube, base, rims),
        // SAFETY: the value of `set` proves the instructions; what is read and written is checked above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx2 => unsafe { x86::split_avx2(rows, ranks, cube, base, rims) },
        // SAFETY: as above.
        #[cfg(target_arch = "x86_64")]
        Kind::Avx512 => unsafe { x86::split_avx512(rows, ranks, cube, base, rims) },
    }
}

/// A store of every point everywhere, of which the next overwrites those that do not belong.
fn split_baseline(rows: Rows<'_>, ranks: Range<usize>, cube: QueryCube, base: &mut Block, rims: &mut [Rim; 2]) {
    let QueryCube { scale, shift, half } = cube;
    let [inner, outer] = rims;
    for rank in ranks {
        let offset = [rows.x[rank], rows.y[rank], rows.z[rank]];
        let (mut place, mut square, mut nearest, mut farthest) = ([0.0_f32; 3], 0.0_f32, 0.0_f32, 0.0_f32);
        for axis in 0..3 {
            place[axis] = offset[axis].mul_add(scale, shift[axis]);
            let far = place[axis].abs() + half;
            let near = (place[axis].abs() - half).max(0.0);
            square = place[axis].mul_add(place[axis], square);
            nearest = near.mul_add(near, nearest);
            farthest = far.mul_add(far, farthest);
        }
        let in_base = square <= INSIDE;
        let in_rim = farthest > INSIDE && nearest <= OUTSIDE;
        [base.x[base.len], base.y[base.len], base.z[base.len]] = place;
        base.len += usize::from(in_base);
        for (rim, belongs) in [(&mut *inner, in_rim && in_base), (&mut *outer, in_rim && !in_base)] {
            [rim.x[rim.len], rim.y[rim.len], rim.z[rim.len]] = offset;
            rim.len += usize::from(belongs);
        }
    }
}

#[cfg(target_arch = "x86_64")]
mod x86 {
    use super::super::select::PACK_LEFT;
    use super::{Block, INSIDE, OUTSIDE, QueryCube, Rim, Rows};
    use std::arch::x86_64::*;
    use std::ops::Range;

    /// Where three coordinates are written.
    fn ends(rim: &mut Rim) -> [*mut f32; 3] {
        [rim.x.as_mut_ptr(), rim.y.as_mut_ptr(), rim.z.as_mut_ptr()]
    }

    /// # Safety
    /// The rows are readable for 16 slots beyond `ranks`; `base` and `rims` are writable for as many points
    /// as there are ranks, and 16 slots beyond.
    #[target_feature(enable = "avx2,fma,popcnt")]
    pub(super) unsafe fn split_avx2(
        rows: Rows<'_>,
        ranks: Range<usize>,
        cube: QueryCube,
        base: &mut Block,
        rims: &mut [Rim; 2],
    ) {
        let scale = _mm256_set1_ps(cube.scale);
        let shift = cube.shift.map(|s| _mm256_set1_ps(s));
        let half = _mm256_set1_ps(cube.half);
        let sign = _mm256_set1_ps(-0.0);
        let (zero, outside, inside) = (_mm256_setzero_ps(), _mm256_set1_ps(OUTSIDE), _mm256_set1_ps(INSIDE));
        let rows = [rows.x.as_ptr(), rows.y.as_ptr(), rows.z.as_ptr()];
        let base_to = [base.x.as_mut_ptr(), base.y.as_mut_ptr(), base.z.as_mut_ptr()];
        let [inner, outer] = rims;
        let (inner_to, outer_to) = (ends(inner), ends(outer));
        for start in ranks.clone().step_by(8) {
            let valid = if start + 8 <= ranks.end { 0xff } else { 0xff >> (start + 8 - ranks.end) };
            let (mut offset, mut place) = ([zero; 3], [zero; 3]);
            let (mut square, mut nearest, mut farthest) = (zero, zero, zero);
            for axis in 0..3 {
                // SAFETY: start < ranks.end, beyond which 16 slots are readable.
                offset[axis] = unsafe { _mm256_loadu_ps(rows[axis].add(start)) };
                place[axis] = _mm256_fmadd_ps(offset[axis], scale, shift[axis]);
                let size = _mm256_andnot_ps(sign, place[axis]);
                let far = _mm256_add_ps(size, half);
                let near = _mm256_max_ps(_mm256_sub_ps(size, half), zero);
                square = _mm256_fmadd_ps(size, size, square);
                nearest = _mm256_fmadd_ps(near, near, nearest);
                farthest = _mm256_fmadd_ps(far, far, farthest);
            }
            let not_beyond =
                |square, limit| _mm256_movemask_ps(_mm256_cmp_ps::<_CMP_LE_OQ>(square, limit)) as usize;
            let in_base = not_beyond(square, inside) & valid;
            let in_rim = not_beyond(nearest, outside) & !not_beyond(farthest, inside) & valid;
            let (in_inner, in_outer) = (in_rim & in_base, in_rim & !in_base);
            // SAFETY: each grows by no more than the number of ranks, for which and 16 slots there is room; a
            // mask has eight bits, and the table 256 rows.
            unsafe {
                let pack = |mask: usize| _mm256_loadu_si256(PACK_LEFT.get_unchecked(mask).as_ptr().cast());
                let (pack_base, pack_inner, pack_outer) = (pack(in_base), pack(in_inner), pack(in_outer));
                for axis in 0..3 {
                    let packed = _mm256_permutevar8x32_ps(place[axis], pack_base);
                    _mm256_storeu_ps(base_to[axis].add(base.len), packed);
                    let packed = _mm256_permutevar8x32_ps(offset[axis], pack_inner);
                    _mm256_storeu_ps(inner_to[axis].add(inner.len), packed);
                    let packed = _mm256_permutevar8x32_ps(offset[axis], pack_outer);
                    _mm256_storeu_ps(outer_to[axis].add(outer.len), packed);
                }
            }
            base.len += in_base.count_ones() as usize;
            inner.len += in_inner.count_ones() as usize;
            outer.len += in_outer.count_ones() as usize;
        }
    }

    /// # Safety
    /// As [`split_avx2`].
    #[target_feature(enable = "avx512f,avx512vl,avx2,fma,popcnt")]
    pub(super) unsafe fn split_avx512(
        rows: Rows<'_>,
        ranks: Range<usize>,
        cube: QueryCube,
        base: &mut Block,
        rims: &mut [Rim; 2],
    ) {
        let scale = _mm512_set1_ps(cube.scale);
        let shift = cube.shift.map(|s| _mm512_set1_ps(s));
        let half = _mm512_set1_ps(cube.half);
        let (zero, outside, inside) = (_mm512_setzero_ps(), _mm512_set1_ps(OUTSIDE), _mm512_set1_ps(INSIDE));
        let rows = [rows.x.as_ptr(), rows.y.as_ptr(), rows.z.as_ptr()];
        let base_to = [base.x.as_mut_ptr(), base.y.as_mut_ptr(), base.z.as_mut_ptr()];
        let [inner, outer] = rims;
        let (inner_to, outer_to) = (ends(inner), ends(outer));
        for start in ranks.clone().step_by(16) {
            let valid: __mmask16 =
                if start + 16 <= ranks.end { 0xffff } else { 0xffff >> (start + 16 - ranks.end) };
            let (mut offset, mut place) = ([zero; 3], [zero; 3]);
            let (mut square, mut nearest, mut farthest) = (zero, zero, zero);
            for axis in 0..3 {
                // SAFETY: start < ranks.end, beyond which 16 slots are readable.
                offset[axis] = unsafe { _mm512_loadu_ps(rows[axis].add(start)) };
                place[axis] = _mm512_fmadd_ps(offset[axis], scale, shift[axis]);
                let size = _mm512_abs_ps(place[axis]);
                let far = _mm512_add_ps(size, half);
                let near = _mm512_max_ps(_mm512_sub_ps(size, half), zero);
                square = _mm512_fmadd_ps(size, size, square);
                nearest = _mm512_fmadd_ps(near, near, nearest);
                farthest = _mm512_fmadd_ps(far, far, farthest);
            }
            let in_base = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, square, inside);
            let is_near = _mm512_mask_cmp_ps_mask::<_CMP_LE_OQ>(valid, nearest, outside);
            let in_rim = _mm512_mask_cmp_ps_mask::<_CMP_GT_OQ>(is_near, farthest, inside);
            let (in_inner, in_outer) = (in_rim & in_base, in_rim & !in_base);
            for axis in 0..3 {
                // SAFETY: each grows by no more than the number of ranks, for which and 16 slots there is room.
                unsafe {
                    let packed = _mm512_maskz_compress_ps(in_base, place[axis]);
                    _mm512_storeu_ps(base_to[axis].add(base.len), packed);
                    let packed = _mm512_maskz_compress_ps(in_inner, offset[axis]);
                    _mm512_storeu_ps(inner_to[axis].add(inner.len), packed);
                    let packed = _mm512_maskz_compress_ps(in_outer, offset[axis]);
                    _mm512_storeu_ps(outer_to[axis].add(outer.len), packed);
                }
            }
            base.len += in_base.count_ones() as usize;
            inner.len += in_inner.count_ones() as usize;
            outer.len += in_outer.count_ones() as usize;
        }
    }
}
