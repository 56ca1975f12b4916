//! The walk over cubes of queries and cubes of points at once.
//!
//! What is inside all balls around the queries of a cube is added once for all of them; what is outside
//! all of them is dropped once; only the rest is looked at again for the cubes that the first is cut
//! into. A small cube of queries is left with the points on the rims of its balls, which are packed for
//! all its queries, and tested for each exactly as by the walk over the points themselves: the members
//! of every ball are the same.

use super::cube::{Cube, Relation};
use super::forest::{Forest, add, octant, place_on_curve};
use crate::ball::visit_members;
use crate::block_sums::BlockSums;
use crate::cell_index::{CellIndex, PARTS_PER_CELL, RowKey};
use crate::moments::{MOMENTS, Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::lanes::LANES;
use crate::simd::select::{Ball, Block, PADDING, Rows, Window};
use std::ops::Range;

/// Points of a cube of queries that is not cut any further.
const QUERY_LEAF: usize = 12;

/// A small cube of queries: what its balls share, and what each must look at.
pub(crate) struct QueryLeaf {
    /// Sums of what is inside all balls, about the middle of the region.
    core: Moments<f64>,
    /// The middle of the queries' row from there, in units of the radius.
    middle: [f64; 3],
    /// The points on the rims, row by row.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    windows: Vec<Window>,
}

/// A cube of queries that waits to be walked.
struct Frame {
    cube: Cube,
    /// The same cube in the tree of points, where it holds any.
    node: Option<u32>,
    queries: Range<usize>,
    /// Which cubes of points are near, as of the larger cube that this one was cut from.
    near: Range<usize>,
    core: [f64; MOMENTS],
}

/// Walks over the queries of one cell after the other.
pub(crate) struct HierarchicalWalk<'a> {
    index: &'a CellIndex,
    set: InstructionSet,
    scale: f32,
    forest: Forest<'a>,
    /// The row of the present cell, and its middle from that of the region, in units of the radius.
    key: RowKey,
    middle: [f64; 3],
    /// Of each query of the present cell: place along the curve, and the number that the caller gave it.
    queries: Vec<u64>,
    frames: Vec<Frame>,
    /// Cubes of points that are near to those cubes of queries that are being walked.
    near: Vec<u32>,
    /// Cubes that have yet to be compared.
    compared: Vec<u32>,
    /// The last leaves: as many as a batch of fits may come back to.
    leaves: [QueryLeaf; LANES],
    last: usize,
    block: Box<Block>,
}

impl<'a> HierarchicalWalk<'a> {
    pub fn new(index: &'a CellIndex, set: InstructionSet) -> Self {
        let scale = (1.0 / index.lattice.radius) as f32;
        let key = RowKey { z: 0, y: 0, x: 0 };
        Self {
            index,
            set,
            scale,
            forest: Forest::new(index, scale),
            key,
            middle: [0.0; 3],
            queries: Vec::new(),
            frames: Vec::new(),
            near: Vec::new(),
            compared: Vec::new(),
            leaves: std::array::from_fn(|_| QueryLeaf {
                core: Moments::default(),
                middle: [0.0; 3],
                x: Vec::new(),
                y: Vec::new(),
                z: Vec::new(),
                windows: Vec::new(),
            }),
            last: 0,
            block: Box::new(Block::new()),
        }
    }

    /// The cells that follow are in the region with this corner.
    pub fn enter_region(&mut self, corner: [i64; 3]) {
        self.forest.enter(corner);
    }

    /// The leaves that follow are of this cell and hold queries with these offsets from its row's middle,
    /// numbered as they come.
    pub fn enter_cell(&mut self, key: RowKey, cell: i32, offsets: impl Iterator<Item = [f32; 3]>) {
        self.key = key;
        self.middle = self.forest.middle_of(key);
        self.queries.clear();
        self.queries.extend((0..).zip(offsets).map(|(number, offset)| {
            u64::from(place_on_curve(self.index.lattice.part(offset))) << 32 | number
        }));
        self.queries.sort_unstable();
        let place = self.forest.place(key, cell);
        self.near.clear();
        self.forest.roots_around(place, &mut self.near);
        self.frames.clear();
        self.frames.push(Frame {
            cube: Cube {
                low: place.map(|cell| (cell * i64::from(PARTS_PER_CELL)) as i16),
                size: PARTS_PER_CELL as i16,
            },
            node: self.forest.root(place),
            queries: 0..self.queries.len(),
            near: 0..self.near.len(),
            core: [0.0; MOMENTS],
        });
    }

    /// Prepares the cell's next leaf. Gives its slot, good until [`LANES`] more leaves are prepared, and
    /// which of the cell's queries are in it.
    pub fn next_leaf(&mut self) -> Option<(usize, Range<usize>)> {
        while let Some(mut frame) = self.frames.pop() {
            // What lies beyond belongs to cubes that are done.
            self.near.truncate(frame.near.end);
            let node = frame.node.map(|node| &self.forest.nodes[node as usize]);
            let cut = node.filter(|node| !node.is_leaf() && node.points().len() > QUERY_LEAF);
            let children = cut.map(|node| node.children());
            // A last cube leaves nothing that could be cut.
            let smallest = if children.is_some() { frame.cube.size } else { 1 };
            self.compare(&mut frame, smallest);
            let Some(children) = children else {
                let slot = self.pack(&frame);
                return Some((slot, frame.queries));
            };
            let (size, mut end) = (frame.cube.size, frame.queries.end);
            while end > frame.queries.start {
                let octant_of = |query: u64| octant(query >> 32, size);
                let number = octant_of(self.queries[end - 1]);
                let before = self.queries[frame.queries.start..end].partition_point(|&q| octant_of(q) < number);
                let start = frame.queries.start + before;
                let cube = frame.cube.octant(number);
                let node = children.clone().find(|&child| self.forest.nodes[child as usize].cube == cube);
                let (near, core) = (frame.near.clone(), frame.core);
                self.frames.push(Frame { cube, node, queries: start..end, near, core });
                end = start;
            }
        }
        None
    }

    /// The number that the caller gave to a query of the present cell.
    pub fn number(&self, query: usize) -> usize {
        self.queries[query] as u32 as usize
    }

    /// Compares a cube of queries with what was near to the larger one, cut down to `smallest`.
    fn compare(&mut self, frame: &mut Frame, smallest: i16) {
        let start = self.near.len();
        for place in frame.near.clone() {
            self.compared.push(self.near[place]);
            while let Some(number) = self.compared.pop() {
                let node = &self.forest.nodes[number as usize];
                match frame.cube.relation(node.cube) {
                    Relation::Inside => add(&mut frame.core, &self.forest.sums[number as usize]),
                    Relation::Outside => {}
                    Relation::Near if node.is_leaf() || node.cube.size < smallest => self.near.push(number),
                    Relation::Near => self.compared.extend(node.children().rev()),
                }
            }
        }
        frame.near = start..self.near.len();
    }

    /// Packs what is on the rims of a leaf's balls.
    fn pack(&mut self, frame: &Frame) -> usize {
        self.last = (self.last + 1) % LANES;
        let leaf = &mut self.leaves[self.last];
        let lattice = &self.index.lattice;
        leaf.core.sums = frame.core;
        leaf.middle = self.middle;
        leaf.windows.clear();
        leaf.x.clear();
        leaf.y.clear();
        leaf.z.clear();
        let mut row = None;
        for &number in &self.near[frame.near.clone()] {
            let node = &self.forest.nodes[number as usize];
            if row.replace(node.row) != Some(node.row) {
                let between = lattice.between(self.key, self.forest.key(node.row));
                let between = between.map(|b| b * f64::from(self.scale));
                leaf.windows.push(Window { ranks: leaf.x.len()..leaf.x.len(), between });
            }
            let points = node.points();
            leaf.x.extend_from_slice(&self.forest.x[points.clone()]);
            leaf.y.extend_from_slice(&self.forest.y[points.clone()]);
            leaf.z.extend_from_slice(&self.forest.z[points]);
            if let Some(window) = leaf.windows.last_mut() {
                window.ranks.end = leaf.x.len();
            }
        }
        for column in [&mut leaf.x, &mut leaf.y, &mut leaf.z] {
            column.resize(column.len() + PADDING, 0.0);
        }
        self.last
    }

    /// The moments of the ball around a query of a prepared leaf, about the query, in units of the radius.
    pub fn moments<S: Scalar>(&mut self, slot: usize, offset: [f32; 3]) -> Moments<f64> {
        let leaf = &self.leaves[slot];
        let ball = Ball::around(offset, self.scale, &self.index.lattice);
        let mut rim = BlockSums::<S>::new(self.set);
        let rows = Rows { x: &leaf.x, y: &leaf.y, z: &leaf.z };
        visit_members(self.set, rows, &leaf.windows, ball, &mut self.block, &mut rim);
        leaf.core.shifted([0, 1, 2].map(|axis| -leaf.middle[axis] - ball.query[axis])) + rim.total
    }
}
