//! The walk over the points of a ball, and the trait of those who look at them.
//!
//! A [`BallVisitor`] is told the members of a ball, block by block; what it makes of them is its own
//! affair: moments today, a robust re-weighting or a pooled descriptor as well.

use crate::cell_index::{CellIndex, Row};
use crate::extremes::larger;
use crate::lattice::RowKey;
use crate::simd::InstructionSet;
use crate::simd::select::{BLOCK, Ball, Block, Place, Rows, Window, gather};

/// Sees every point of a ball once, in the order of the lattice.
pub(crate) trait BallVisitor {
    /// Whether [`Block::rank`] must be filled.
    const WANTS_RANKS: bool;

    /// The first `len` members of the block: offsets from the query in units of the radius. The
    /// slots from there to the next multiple of 16 are zero.
    fn visit(&mut self, block: &Block, len: usize);
}

/// A row that balls around the present row's queries may reach.
struct NearRow {
    row: Row,
    /// From the middle of the present row to the middle of this one, in units of the radius.
    between: [f64; 3],
    /// Where the row's cells begin and end along y and z, from the middle of the present row.
    low: [f32; 2],
    high: [f32; 2],
    /// The same along x, from the middle of this row: its first and last point.
    ends: [f32; 2],
    /// From the middle of the present row to the middle of this one, along x.
    along: f32,
    /// Where the last run's window was: the next is near to it.
    window: std::ops::Range<usize>,
}

/// Walks over the points themselves: the plain way, and the reference of every other.
pub(crate) struct DirectWalk<'a> {
    index: &'a CellIndex,
    pub set: InstructionSet,
    scale: f32,
    /// The present row, so that coming back to it costs nothing.
    row: Option<RowKey>,
    near: Vec<NearRow>,
    /// What the present run's balls may reach.
    windows: Vec<Window>,
    block: Box<Block>,
}

impl<'a> DirectWalk<'a> {
    pub fn new(index: &'a CellIndex, set: InstructionSet) -> Self {
        let scale = (1.0 / index.lattice.radius) as f32;
        Self {
            index,
            set,
            scale,
            row: None,
            near: Vec::new(),
            windows: Vec::new(),
            block: Box::new(Block::new()),
        }
    }

    /// Shows a visitor the members of the ball around the query at this offset.
    pub fn visit<V: BallVisitor>(&mut self, offset: [f32; 3], visitor: &mut V) {
        let CellIndex { x, y, z, lattice, .. } = self.index;
        let ball = Ball::around(offset, self.scale, lattice);
        visit_members(self.set, Rows { x, y, z }, &self.windows, ball, &mut self.block, visitor);
    }
}

/// Shows a visitor those points of the windows that are in the ball.
pub(crate) fn visit_members<V: BallVisitor>(
    set: InstructionSet,
    rows: Rows<'_>,
    windows: &[Window],
    ball: Ball,
    block: &mut Block,
    visitor: &mut V,
) {
    let mut place = Place::default();
    block.len = 0;
    loop {
        let finished = if V::WANTS_RANKS {
            gather::<true>(set, rows, windows, ball, block, &mut place)
        } else {
            gather::<false>(set, rows, windows, ball, block, &mut place)
        };
        while block.len >= BLOCK {
            visitor.visit(block, BLOCK);
            block.carry_over();
        }
        if finished {
            break;
        }
    }
    finish(block, visitor);
}

/// Shows a visitor what is left in a block.
pub(crate) fn finish<V: BallVisitor>(block: &mut Block, visitor: &mut V) {
    block.pad();
    visitor.visit(block, block.len);
}

/// Queries come in runs: [`enter_row`](Self::enter_row), then [`enter_run`](Self::enter_run) for
/// some queries near to each other in that row, then [`moments`](Self::moments) for each. What
/// queries share is so prepared once.
impl DirectWalk<'_> {
    /// The queries that follow are in this row of the lattice.
    pub fn enter_row(&mut self, key: RowKey) {
        if self.row.replace(key) == Some(key) {
            return;
        }
        self.near.clear();
        let (reach, reach_along_row) = self.index.lattice.reach();
        for dz in -reach..=reach {
            for dy in -reach..=reach {
                for dx in -reach_along_row..=reach_along_row {
                    let near = RowKey { z: key.z + dz, y: key.y + dy, x: key.x + dx };
                    if let Some(&row) = self.index.row(near) {
                        let between = self.index.lattice.between(key, near);
                        let half_step = self.index.lattice.half_step();
                        self.near.push(NearRow {
                            row,
                            between: between.map(|b| b * f64::from(self.scale)),
                            low: [1, 2].map(|axis| (between[axis] - half_step) as f32),
                            high: [1, 2].map(|axis| (between[axis] + half_step) as f32),
                            ends: [self.index.x[row.start], self.index.x[row.end - 1]],
                            along: between[0] as f32,
                            window: row.start..row.start,
                        });
                    }
                }
            }
        }
    }

    /// The queries that follow have their offsets from the row's middle in this box.
    pub fn enter_run(&mut self, low: [f32; 3], high: [f32; 3]) {
        // A window may be too long, never too short: a little more than the ball's own slack, and
        // than float32 can lose over the length of a row.
        let reach = self.index.lattice.radius as f32 * (1.0 + 2e-5);
        let x = &self.index.x;
        self.windows.clear();
        for near in &mut self.near {
            // Distance along y and z from the run's box to the row's cells.
            let gap_y = larger(larger(near.low[0] - high[1], low[1] - near.high[0]), 0.0);
            let gap_z = larger(larger(near.low[1] - high[2], low[2] - near.high[1]), 0.0);
            let square = reach * reach - gap_y * gap_y - gap_z * gap_z;
            if square < 0.0 {
                continue;
            }
            let chord = square.sqrt() + 1e-5 * reach;
            let (from, to) = (low[0] - near.along - chord, high[0] - near.along + chord);
            if from > near.ends[1] || to < near.ends[0] {
                continue;
            }
            let row = near.row.start..near.row.end;
            let start = seek(x, row.clone(), near.window.start, |v| v < from);
            let end = seek(x, start..row.end, near.window.end.max(start), |v| v <= to);
            near.window = start..end;
            if start < end {
                self.windows.push(Window { ranks: start..end, between: near.between });
            }
        }
    }
}

/// First place in `range` at which `before` no longer holds, sought from a place that is near to it.
#[inline]
fn seek(x: &[f32], range: std::ops::Range<usize>, from: usize, before: impl Fn(f32) -> bool) -> usize {
    let (mut low, mut high) = (range.start, range.end);
    let mut probe = from.clamp(low, high);
    // Gallop away from the last place until the answer lies between.
    let mut stride = 4;
    if probe < high && before(x[probe]) {
        while probe < high && before(x[probe]) {
            low = probe + 1;
            probe += stride;
            stride *= 2;
        }
        high = probe.min(high);
    } else {
        while probe > low && !before(x[probe - 1]) {
            high = probe - 1;
            probe = probe.saturating_sub(stride).max(low);
            stride *= 2;
        }
        low = probe;
    }
    low + x[low..high].partition_point(|&v| before(v))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{PointCloud, Radius};
    use proptest::prelude::*;

    struct Collect<'a>(&'a CellIndex, Vec<u32>);

    impl BallVisitor for Collect<'_> {
        const WANTS_RANKS: bool = true;
        fn visit(&mut self, block: &Block, len: usize) {
            self.1.extend(block.rank[..len].iter().map(|&rank| self.0.point_of_rank[rank as usize]));
        }
    }

    fn members(cloud: &PointCloud<'_>, radius: f64, query: [f64; 3]) -> Vec<u32> {
        let index = CellIndex::new(cloud, Radius::new(radius).unwrap()).unwrap();
        let (key, offset) = index.lattice.place(query).unwrap();
        let mut walk = DirectWalk::new(&index, InstructionSet::detect());
        walk.enter_row(key);
        walk.enter_run(offset, offset);
        let mut found = Collect(&index, Vec::new());
        walk.visit(offset, &mut found);
        found.1.sort_unstable();
        found.1
    }

    proptest! {
        #[test]
        fn the_ball_holds_exactly_the_points_within_the_radius(
            points in prop::collection::vec(prop::array::uniform3(-1.0_f64..1.0), 0..400),
            radius in 0.01_f64..3.0,
            origin in prop::array::uniform3(-5e6_f64..5e6),
        ) {
            let query = origin;
            let points: Vec<[f64; 3]> = points.iter().map(|p| [0, 1, 2].map(|a| p[a] + origin[a])).collect();
            let square = |p: &[f64; 3]| (0..3).map(|a| (p[a] - query[a]).powi(2)).sum::<f64>() / (radius * radius);
            // Between the two limits, float32 may decide either way.
            prop_assume!(points.iter().all(|p| (square(p) - 1.00001).abs() > 5e-6));
            let expected: Vec<u32> = (0..points.len()).filter(|&i| square(&points[i]) < 1.00001).map(|i| i as u32).collect();
            prop_assert_eq!(members(&PointCloud::new_f64(&points), radius, query), expected);
        }
    }

    #[test]
    fn points_of_a_grid_that_lie_on_the_sphere_belong_to_the_ball_wherever_the_grid_is() {
        // 4 mm grid, 20 mm ball: (12, 16) and its like lie exactly on the circle.
        for origin in [[0.0, 0.0, 0.0], [500_000.0, 4_500_000.0, 100.0], [0.0013, -0.0007, 1e6]] {
            let points: Vec<[f64; 3]> = (-8..=8)
                .flat_map(|i| (-8..=8).map(move |j| [0.004 * f64::from(i), 0.004 * f64::from(j), 0.0]))
                .map(|p| [0, 1, 2].map(|a| p[a] + origin[a]))
                .collect();
            let centre = points[8 * 17 + 8];
            assert_eq!(members(&PointCloud::new_f64(&points), 0.02, centre).len(), 81);
        }
    }

    #[test]
    fn seek_finds_the_first_place_from_anywhere() {
        let x: Vec<f32> = (0..200).map(|i| (i / 3) as f32).collect();
        for target in [-1.0, 0.0, 0.5, 20.0, 66.0, 70.0] {
            let expected = 10 + x[10..190].iter().filter(|v| **v < target).count();
            for from in [0, 10, 11, 50, 100, 189, 190, 500] {
                assert_eq!(seek(&x, 10..190, from, |v| v < target), expected);
            }
        }
    }
}
