//! The walk over cubes of queries and cubes of points at once.
//!
//! What is inside all balls around the queries of a cube is added once for all of them; what is outside
//! all of them is dropped once; only the rest is looked at again for the cubes that the first is cut
//! into. A small cube of queries is left with the points on the rims of its balls, which are packed for
//! all its queries, and tested for each exactly as by the walk over the points themselves: the members
//! of every ball are the same.

use super::cube::{Cube, Relation};
use super::forest::{Forest, Source, add, octant, place_on_curve};
use crate::ball::{BallVisitor, finish, visit_members};
use crate::block_sums::BlockSums;
use crate::cell_index::{CellIndex, PARTS_PER_CELL, RowKey};
use crate::moments::{MOMENTS, Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::lanes::LANES;
use crate::simd::select::{BLOCK, Ball, Block, PIECE, Rows, Window};
use crate::simd::split::{QueryCube, Rim, split};
use std::ops::Range;

/// Points of a cube of queries that is not cut any further.
static SRC: std::sync::LazyLock<usize> = std::sync::LazyLock::new(|| std::env::var("SRC").map_or(12, |v| v.parse().unwrap()));
static QLEAFV: std::sync::LazyLock<usize> = std::sync::LazyLock::new(|| std::env::var("QLEAF").map_or(12, |v| v.parse().unwrap()));

/// A small cube of queries: what its balls share, and what each must look at.
struct QueryLeaf {
    /// Sums of the ball around the cube's centre, about it.
    base: Moments<f64>,
    /// The centre, from the middle of the queries' row, in units of the radius.
    centre: [f64; 3],
    /// Points about which the balls may disagree, row by row: those in the base, and those that are not.
    rims: [Rim; 2],
    windows: [Vec<Window>; 2],
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
    near: Vec<Source>,
    /// Cubes that have yet to be compared.
    compared: Vec<Source>,
    /// Nodes inside all balls of the present cube of queries.
    inside: Vec<u32>,
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
            inside: Vec::new(),
            leaves: std::array::from_fn(|_| QueryLeaf {
                base: Moments::default(),
                centre: [0.0; 3],
                rims: Default::default(),
                windows: Default::default(),
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
        self.inside.clear();
        self.forest.roots_around(place, &mut self.inside);
        self.near.extend(self.inside.iter().map(|&node| self.forest.source(node)));
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
            let cut = node.filter(|node| !node.is_leaf() && node.points().len() > *QLEAFV);
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

    /// Compares a cube of queries with what was near to the larger one. Cubes of points are cut until they are
    /// leaves, or smaller than `smallest`.
    fn compare(&mut self, frame: &mut Frame, smallest: i16) {
        let start = self.near.len();
        self.compared.clear();
        self.compared.extend_from_slice(&self.near[frame.near.clone()]);
        self.inside.clear();
        loop {
            self.sift(frame.cube);
            // Those that must be cut are replaced by their children, so that the order stays.
            let is_whole = |source: &Source| {
                source.cube.size < smallest || self.forest.nodes[source.node as usize].is_leaf() || self.forest.nodes[source.node as usize].points().len() <= *SRC
            };
            if self.near[start..].iter().all(is_whole) {
                break;
            }
            self.compared.clear();
            for source in &self.near[start..] {
                if is_whole(source) {
                    self.compared.push(*source);
                } else {
                    let children = self.forest.nodes[source.node as usize].children();
                    self.compared.extend(children.map(|node| self.forest.source(node)));
                }
            }
            self.near.truncate(start);
        }
        for &node in &self.inside {
            add(&mut frame.core, &self.forest.sums[node as usize]);
        }
        frame.near = start..self.near.len();
    }

    /// Appends what was compared with a cube of queries to what is near or inside. Which of the three it is can
    /// hardly be foreseen, so there is no branch: each is written to both, and the next overwrites it.
    fn sift(&mut self, cube: Cube) {
        let (mut near, mut inside) = (self.near.len(), self.inside.len());
        let count = self.compared.len();
        let Some(&any) = self.compared.first() else { return };
        self.near.resize(near + count, any);
        self.inside.resize(inside + count, 0);
        for source in &self.compared {
            let relation = cube.relation(source.cube);
            self.near[near] = *source;
            self.inside[inside] = source.node;
            near += usize::from(relation == Relation::Near);
            inside += usize::from(relation == Relation::Inside);
        }
        self.near.truncate(near);
        self.inside.truncate(inside);
    }

    /// Looks at the single points of what is near to a leaf: adds what is inside all balls, and packs the rest.
    fn pack(&mut self, frame: &Frame) -> usize {
        self.last = (self.last + 1) % LANES;
        let leaf = &mut self.leaves[self.last];
        let lattice = &self.index.lattice;
        let units = f64::from(self.scale);
        let half = 0.5 * f64::from(frame.cube.size);
        let from_region = frame.cube.low.map(|low| self.forest.from_middle(f64::from(low) + half));
        leaf.centre = [0, 1, 2].map(|axis| from_region[axis] - self.middle[axis]);
        leaf.base = Moments { sums: frame.core }.shifted(from_region.map(|c| -c));
        leaf.windows.iter_mut().for_each(Vec::clear);
        leaf.rims.iter_mut().for_each(|rim| rim.len = 0);
        let mut base = BlockSums::<f64>::new(self.set);
        self.block.len = 0;
        let points = self.forest.points();
        let near = &self.near[frame.near.clone()];
        let nodes = &self.forest.nodes;
        for row in near.chunk_by(|a, b| nodes[a.node as usize].row == nodes[b.node as usize].row) {
            let key = self.forest.key(nodes[row[0].node as usize].row);
            let between = lattice.between(self.key, key).map(|b| b * units);
            let cube = QueryCube {
                scale: self.scale,
                shift: [0, 1, 2].map(|axis| (between[axis] - leaf.centre[axis]) as f32),
                half: self.forest.units(half) as f32,
            };
            let first = [leaf.rims[0].len, leaf.rims[1].len];
            // Neighbouring leaves have neighbouring points.
            let adjoin = |a: &Source, b: &Source| nodes[a.node as usize].end_point == nodes[b.node as usize].first_point;
            for run in row.chunk_by(adjoin) {
                let (from, to) = (nodes[run[0].node as usize].points().start, nodes[run[run.len() - 1].node as usize].points().end);
                for start in (from..to).step_by(PIECE) {
                    let ranks = start..to.min(start + PIECE);
                    split(self.set, points, ranks, cube, &mut self.block, &mut leaf.rims);
                    while self.block.len >= BLOCK {
                        base.visit(&self.block, BLOCK);
                        self.block.carry_over();
                    }
                }
            }
            for (side, first) in first.into_iter().enumerate() {
                leaf.windows[side].push(Window { ranks: first..leaf.rims[side].len, between });
            }
        }
        finish(&mut self.block, &mut base);
        leaf.base += base.total;
        self.last
    }

    /// The moments of the ball around a query of a prepared leaf, about the query, in units of the radius.
    pub fn moments<S: Scalar>(&mut self, slot: usize, offset: [f32; 3]) -> Moments<f64> {
        let leaf = &self.leaves[slot];
        let ball = Ball::around(offset, self.scale, &self.index.lattice);
        let (mut less, mut more) = (BlockSums::<S>::new(self.set), BlockSums::<S>::new(self.set));
        let [inner, outer] = leaf.rims.each_ref().map(|rim| Rows { x: &rim.x, y: &rim.y, z: &rim.z });
        let (set, [in_base, others]) = (self.set, &leaf.windows);
        visit_members::<_, true>(set, inner, in_base, ball, &mut self.block, &mut less);
        visit_members::<_, false>(set, outer, others, ball, &mut self.block, &mut more);
        let mut moments = leaf.base.shifted([0, 1, 2].map(|axis| leaf.centre[axis] - ball.query[axis]));
        moments += more.total;
        moments -= less.total;
        moments
    }
}
