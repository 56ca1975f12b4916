//! The visitor that sums.

use crate::ball::BallVisitor;
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
        let sums = accumulate::<S>(self.set, block, len);
        for (total, sum) in self.total.sums.iter_mut().zip(sums) {
            *total += sum.to_f64();
        }
    }
}
