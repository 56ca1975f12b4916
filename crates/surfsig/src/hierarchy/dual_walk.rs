//! The walk over cubes of queries and cubes of points at once.
//!
//! What is inside all balls around the queries of a cube is added once for all of them; what is outside
//! all of them is dropped once; only the rest is looked at again for the octants of the cube. Large cubes
//! are compared with cubes of points, small ones, drawn in to the bounds of their own points, with single
//! points. In the end each query is left
//! with the points near the rim of its ball, which are tested exactly as by the walk over all points: the
//! members of every ball are the same.
//!
//! Whatever is added belongs to the balls of all queries for which it is added, and how far cubes are cut
//! follows from the queries' cell. So the sums of a ball do not depend on what lies outside of it, nor on
//! the other queries: a tile with a margin of one radius gives the same bits as the whole cloud.

use super::cube::{Cube, Relation};
use super::forest::{Forest, Source, add, octant, place_on_curve};
use super::patch::{Patch, Splitter};
use crate::ball::visit_members;
use crate::block_sums::BlockSums;
use crate::cell_index::CellIndex;
use crate::lattice::{PARTS_PER_CELL, RowKey};
use crate::moments::{MOMENTS, Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::lanes::LANES;
use crate::simd::select::{Ball, Block, Rows, Window};
use std::ops::Range;

/// Points in a cube of queries beyond which its patch is not handed out, but those of its octants.
const MANY: usize = 8;

/// A cube of queries whose patch must be prepared from that of the cube around it.
struct Octant {
    /// How many cubes with patches are around it.
    level: usize,
    cube: Cube,
    /// The same cube in the tree of points, where it holds any.
    node: Option<u32>,
    queries: Range<usize>,
}

/// The bounds of some points, from the middle of their row.
#[derive(Clone, Copy)]
struct Bounds {
    low: [f32; 3],
    high: [f32; 3],
}

impl Bounds {
    fn of(points: Rows<'_>, range: Range<usize>) -> Self {
        let mut bounds = Self { low: [f32::INFINITY; 3], high: [f32::NEG_INFINITY; 3] };
        for point in range {
            for (axis, value) in [points.x[point], points.y[point], points.z[point]].into_iter().enumerate() {
                bounds.low[axis] = bounds.low[axis].min(value);
                bounds.high[axis] = bounds.high[axis].max(value);
            }
        }
        bounds
    }

    fn hold(&self, offset: [f32; 3]) -> bool {
        (0..3).all(|axis| self.low[axis] <= offset[axis] && offset[axis] <= self.high[axis])
    }
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
    /// Their offsets from the row's middle, by number.
    offsets: Vec<[f32; 3]>,
    /// Queries that are outside the bounds of their octants' points: they have the patch of the whole cube.
    strays: Vec<u64>,
    frames: Vec<Frame>,
    /// Cubes of points that are near to those cubes of queries that are being walked.
    near: Vec<Source>,
    /// Cubes that have yet to be compared.
    compared: Vec<Source>,
    /// Nodes inside all balls of the present cube of queries.
    inside: Vec<u32>,
    /// The present patches, each of an octant of the one before.
    patches: Vec<Patch>,
    octants: Vec<Octant>,
    /// The last patches that were handed out: as many as a batch of fits may come back to.
    last_patches: [Patch; LANES],
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
            offsets: Vec::new(),
            strays: Vec::new(),
            frames: Vec::new(),
            near: Vec::new(),
            compared: Vec::new(),
            inside: Vec::new(),
            patches: Vec::new(),
            octants: Vec::new(),
            last_patches: std::array::from_fn(|_| Patch::new()),
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
        self.offsets.clear();
        self.offsets.extend(offsets);
        self.queries.extend(self.offsets.iter().zip(0..).map(|(&offset, number)| {
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

    /// Prepares the cell's next patch. Gives its slot, good until [`LANES`] more are prepared, and which of the
    /// cell's queries are in it.
    pub fn next_patch(&mut self) -> Option<(usize, Range<usize>)> {
        while self.octants.is_empty() && self.strays.is_empty() {
            self.walk_to_patch()?;
        }
        while let Some(Octant { level, cube, node, queries }) = self.octants.pop() {
            let points = node.map(|node| self.forest.nodes[node as usize].points());
            let bounds = points.clone().map(|points| Bounds::of(self.forest.points(), points));
            let queries = match bounds {
                Some(bounds) if level > 0 => self.within(bounds, queries),
                None if level > 0 => self.within(Bounds::of(self.forest.points(), 0..0), queries),
                _ => queries,
            };
            if queries.is_empty() {
                continue;
            }
            if let (Some(bounds), true) = (bounds, level > 0) {
                self.refine(level, bounds);
            }
            let many = points.is_some_and(|points| points.len() > MANY) && cube.size > 1;
            match node.filter(|_| many) {
                Some(node) => self.cut(level + 1, cube, node, queries),
                None => return Some((self.hand_out(level), queries)),
            }
        }
        let first = self.queries.len();
        self.queries.append(&mut self.strays);
        Some((self.hand_out(0), first..self.queries.len()))
    }

    /// Keeps a patch for its queries.
    fn hand_out(&mut self, level: usize) -> usize {
        self.last = (self.last + 1) % LANES;
        std::mem::swap(&mut self.patches[level], &mut self.last_patches[self.last]);
        self.last
    }

    /// Those of some queries that are within bounds, side by side; the others stray.
    fn within(&mut self, bounds: Bounds, queries: Range<usize>) -> Range<usize> {
        let mut end = queries.start;
        for query in queries.clone() {
            let query = self.queries[query];
            if bounds.hold(self.offsets[query as u32 as usize]) {
                self.queries[end] = query;
                end += 1;
            } else {
                self.strays.push(query);
            }
        }
        queries.start..end
    }

    /// Walks on until a cube of queries holds few points, and prepares its patch.
    fn walk_to_patch(&mut self) -> Option<()> {
        while let Some(mut frame) = self.frames.pop() {
            // What lies beyond belongs to cubes that are done.
            self.near.truncate(frame.near.end);
            self.compare(&mut frame);
            match frame.node.filter(|&node| !self.forest.nodes[node as usize].is_small()) {
                Some(node) => {
                    self.cut(0, frame.cube, node, frame.queries);
                    let Frame { near, core, .. } = frame;
                    self.frames.extend(self.octants.drain(..).map(
                        |Octant { cube, node, queries, .. }| Frame {
                            cube,
                            node,
                            queries,
                            near: near.clone(),
                            core,
                        },
                    ));
                }
                None => {
                    self.prepare(&frame);
                    let Frame { cube, node, queries, .. } = frame;
                    self.octants.push(Octant { level: 0, cube, node, queries });
                    return Some(());
                }
            }
        }
        None
    }

    /// Cuts a cube of queries into those octants that hold some, the last first.
    fn cut(&mut self, level: usize, cube: Cube, node: u32, queries: Range<usize>) {
        let children = self.forest.children(node);
        let octant_of = |query: &u64| octant((query >> 32) as u32, cube.size);
        let mut end = queries.end;
        while let Some(number) = self.queries[queries.start..end].last().map(octant_of) {
            let before = self.queries[queries.start..end].partition_point(|query| octant_of(query) < number);
            let start = queries.start + before;
            let cube = cube.octant(number);
            let node = children.clone().find(|&child| self.forest.nodes[child as usize].cube == cube);
            self.octants.push(Octant { level, cube, node, queries: start..end });
            end = start;
        }
    }

    /// The number that the caller gave to a query of the present cell.
    pub fn number(&self, query: usize) -> usize {
        self.queries[query] as u32 as usize
    }

    /// Compares a cube of queries with what was near to the larger one. Cubes of points are cut until they are
    /// no larger than this one.
    fn compare(&mut self, frame: &mut Frame) {
        let start = self.near.len();
        self.compared.clear();
        self.compared.extend_from_slice(&self.near[frame.near.clone()]);
        self.inside.clear();
        loop {
            self.sift(frame.cube);
            let is_whole = |source: &Source| source.cube.size <= frame.cube.size;
            if self.near[start..].iter().all(is_whole) {
                break;
            }
            // Those that must be cut are replaced by their children, so that the order stays.
            self.compared.clear();
            for source in &self.near[start..] {
                if is_whole(source) {
                    self.compared.push(*source);
                } else {
                    for child in self.forest.children(source.node) {
                        self.compared.push(self.forest.source(child));
                    }
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

    /// Looks at the single points of the cubes that are near to one of queries.
    fn prepare(&mut self, frame: &Frame) {
        let (forest, nodes, lattice) = (&self.forest, &self.forest.nodes, &self.index.lattice);
        let half = 0.5 * f64::from(frame.cube.size);
        let centre = frame.cube.low.map(|low| forest.place_from_middle(f64::from(low) + half));
        if self.patches.is_empty() {
            self.patches.push(Patch::new());
        }
        let patch = &mut self.patches[0];
        let shared = Moments { sums: frame.core }.shifted(centre.map(|c| -c));
        patch.enter([0, 1, 2].map(|axis| centre[axis] - self.middle[axis]), shared);
        let mut splitter = Splitter::new(self.set, self.scale, [forest.units(half); 3], &mut self.block);
        let node = |source: &Source| &nodes[source.node as usize];
        let near = &self.near[frame.near.clone()];
        for row in near.chunk_by(|a, b| node(a).row == node(b).row) {
            let between = lattice.between(self.key, forest.key(node(&row[0]).row));
            let between = between.map(|length| length * f64::from(self.scale));
            // Neighbouring cubes have neighbouring points.
            let runs = row
                .chunk_by(|a, b| node(a).end_point == node(b).first_point)
                .map(|run| node(&run[0]).points().start..node(&run[run.len() - 1]).points().end);
            splitter.split(forest.points(), runs, between, patch);
        }
        splitter.finish(patch);
    }

    /// Looks at the rim of the patch before this level for queries within the bounds of some of its points.
    fn refine(&mut self, level: usize, Bounds { low, high }: Bounds) {
        if self.patches.len() == level {
            self.patches.push(Patch::new());
        }
        let (before, after) = self.patches.split_at_mut(level);
        let (larger, patch) = (&before[level - 1], &mut after[0]);
        let half_scale = 0.5 * f64::from(self.scale);
        let centre = [0, 1, 2].map(|axis| (f64::from(low[axis]) + f64::from(high[axis])) * half_scale);
        let half = [0, 1, 2].map(|axis| (f64::from(high[axis]) - f64::from(low[axis])) * half_scale);
        let shift = [0, 1, 2].map(|axis| larger.centre[axis] - centre[axis]);
        patch.enter(centre, larger.shared.shifted(shift));
        let mut splitter = Splitter::new(self.set, self.scale, half, &mut self.block);
        for Window { ranks, between } in &larger.windows {
            splitter.split(larger.rim.rows(), std::iter::once(ranks.clone()), *between, patch);
        }
        splitter.finish(patch);
    }

    /// The moments of the ball around a query of a prepared patch, about the query, in units of the radius.
    pub fn moments<S: Scalar>(&mut self, slot: usize, offset: [f32; 3]) -> Moments<f64> {
        let patch = &self.last_patches[slot];
        let ball = Ball::around(offset, self.scale, &self.index.lattice);
        let mut rim = BlockSums::<S>::new(self.set);
        visit_members(self.set, patch.rim.rows(), &patch.windows, ball, &mut self.block, &mut rim);
        patch.shared.shifted([0, 1, 2].map(|axis| patch.centre[axis] - ball.query[axis])) + rim.total
    }
}
