//! The visitor that remembers: a ball's points, for what needs to look at them more than once.

use crate::ball::{BallVisitor, DirectWalk, finish};
use crate::block_sums::BlockSums;
use crate::moments::{Moments, Scalar};
use crate::multiply_add::MultiplyAdd;
use crate::simd::InstructionSet;
use crate::simd::select::{BLOCK, Block};

/// The members of a ball in the order of the lattice, from the query, in units of the radius.
pub(crate) struct Members {
    pub points: Vec<[f32; 3]>,
    sorted: Vec<(f32, u32)>,
    block: Box<Block>,
}

impl BallVisitor for Members {
    const WANTS_RANKS: bool = false;

    fn visit(&mut self, block: &Block, len: usize) {
        self.points.extend((0..len).map(|i| [block.x[i], block.y[i], block.z[i]]));
    }
}

impl Members {
    pub fn new() -> Self {
        Self { points: Vec::new(), sorted: Vec::new(), block: Box::new(Block::new()) }
    }

    /// Takes the ball around the query at this offset.
    pub fn take(&mut self, walk: &mut DirectWalk<'_>, offset: [f32; 3]) {
        self.points.clear();
        walk.visit(offset, self);
    }

    /// Keeps the `most` nearest and makes their radius the unit of length; returns it, in the unit before:
    /// the distance to the farthest of them, or `radius_of_fewer` where there are no more than that.
    pub fn keep_nearest(&mut self, most: usize, radius_of_fewer: Option<f64>) -> f64 {
        let square = |&[x, y, z]: &[f32; 3]| z.times_plus(z, y.times_plus(y, x * x));
        let farthest = if self.points.len() > most {
            self.sorted.clear();
            self.sorted.extend(self.points.iter().map(square).zip(0..));
            let order = |a: &(f32, u32), b: &(f32, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
            let last = *self.sorted.select_nth_unstable_by(most - 1, order).1;
            let mut number = 0;
            self.points.retain(|point| {
                let kept = order(&(square(point), number), &last).is_le();
                number += 1;
                kept
            });
            f64::from(last.0).sqrt()
        } else {
            radius_of_fewer
                .unwrap_or_else(|| f64::from(self.points.iter().map(square).fold(0.0, f32::max)).sqrt())
        };
        // Points at one place have no size; any unit does for them.
        if farthest > 0.0 {
            let scale = (1.0 / farthest) as f32;
            self.points.iter_mut().for_each(|point| *point = point.map(|c| c * scale));
        }
        farthest
    }

    /// The sums over those members that are `kept`.
    pub fn moments<S: Scalar>(
        &mut self,
        set: InstructionSet,
        mut kept: impl FnMut(&[f32; 3]) -> bool,
    ) -> Moments<f64> {
        let mut sums = BlockSums::<S>::new(set);
        let block = &mut self.block;
        let mut len = 0;
        for point in self.points.iter().filter(|point| kept(point)) {
            [block.x[len], block.y[len], block.z[len]] = *point;
            len += 1;
            if len == BLOCK {
                sums.visit(block, BLOCK);
                len = 0;
            }
        }
        block.len = len;
        finish(block, &mut sums);
        sums.total
    }
}
