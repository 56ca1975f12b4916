//! The visitor that sums.

use crate::ball::{BallVisitor, DirectWalk};
use crate::moments::{Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::accumulate::accumulate;
use crate::simd::select::Block;
use std::marker::PhantomData;

/// Sums blocks in `S`, their totals in `f64`.
pub(crate) struct BlockSums<S> {
    set: InstructionSet,
    pub total: Moments<f64>,
    scalar: PhantomData<S>,
}

impl<S: Scalar> BlockSums<S> {
    pub fn new(set: InstructionSet) -> Self {
        Self { set, total: Moments::default(), scalar: PhantomData }
    }
}

impl<S: Scalar> BallVisitor for BlockSums<S> {
    const WANTS_RANKS: bool = false;

    fn visit(&mut self, block: &Block, len: usize) {
        add_block::<S>(&mut self.total, self.set, block, len);
    }
}

impl DirectWalk<'_> {
    /// The moments of the ball around the query at this offset from the row's middle, about the
    /// query, in units of the radius. `S` is what the sums within a block are kept in.
    pub fn moments<S: Scalar>(&mut self, offset: [f32; 3]) -> Moments<f64> {
        let mut sums = BlockSums::<S>::new(self.set);
        self.visit(offset, &mut sums);
        sums.total
    }
}

/// Adds the sums of a block's first `len` points, taken in `S`, to a total.
pub(crate) fn add_block<S: Scalar>(total: &mut Moments<f64>, set: InstructionSet, block: &Block, len: usize) {
    for (total, sum) in total.sums.iter_mut().zip(accumulate::<S>(set, block, len)) {
        *total += sum.to_f64();
    }
}
