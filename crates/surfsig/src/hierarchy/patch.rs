//! What the balls of a small cube of queries share, and what each must look at.

use crate::ball::{BallVisitor, finish};
use crate::block_sums::BlockSums;
use crate::moments::Moments;
use crate::simd::InstructionSet;
use crate::simd::select::{BLOCK, Block, PIECE, Rows, Window};
use crate::simd::split::{QueryBox, Rim, split};
use std::ops::Range;

/// A box of queries: what its balls share, and what each must look at.
pub(super) struct Patch {
    /// The box's centre, from the middle of the queries' row, in units of the radius.
    pub centre: [f64; 3],
    /// Sums of the points that are in all balls, about the centre.
    pub shared: Moments<f64>,
    /// The points that may be in some, row by row.
    pub rim: Rim,
    pub windows: Vec<Window>,
}

impl Patch {
    pub fn new() -> Self {
        Self { centre: [0.0; 3], shared: Moments::default(), rim: Rim::default(), windows: Vec::new() }
    }

    /// Empties the patch for a box around this centre, with sums that are shared about it.
    pub fn enter(&mut self, centre: [f64; 3], shared: Moments<f64>) {
        (self.centre, self.shared) = (centre, shared);
        self.rim.len = 0;
        self.windows.clear();
    }
}

/// Deals points to the shared sums and to the rim of a patch.
pub(super) struct Splitter<'a> {
    set: InstructionSet,
    scale: f32,
    half: [f32; 3],
    block: &'a mut Block,
    shared: BlockSums<f64>,
}

impl<'a> Splitter<'a> {
    /// For a box with half these edges, in units of the radius; `scale` is one over it.
    pub fn new(set: InstructionSet, scale: f32, half: [f64; 3], block: &'a mut Block) -> Self {
        block.len = 0;
        let half = half.map(|h| h as f32);
        Self { set, scale, half, block, shared: BlockSums::new(set) }
    }

    /// Deals runs of points of one row, whose middle is so far from that of the queries' row.
    pub fn split(
        &mut self,
        rows: Rows<'_>,
        runs: impl Iterator<Item = Range<usize>>,
        between: [f64; 3],
        patch: &mut Patch,
    ) {
        let shift = [0, 1, 2].map(|axis| (between[axis] - patch.centre[axis]) as f32);
        let queries = QueryBox { scale: self.scale, shift, half: self.half };
        let first = patch.rim.len;
        for run in runs {
            for start in run.clone().step_by(PIECE) {
                let ranks = start..run.end.min(start + PIECE);
                split(self.set, rows, ranks, queries, self.block, &mut patch.rim);
                while self.block.len >= BLOCK {
                    self.shared.visit(self.block, BLOCK);
                    self.block.carry_over();
                }
            }
        }
        if patch.rim.len > first {
            patch.windows.push(Window { ranks: first..patch.rim.len, between });
        }
    }

    pub fn finish(mut self, patch: &mut Patch) {
        finish(self.block, &mut self.shared);
        patch.shared += self.shared.total;
    }
}
