//! The absolute lattice: anchored at 0, its step fixed by the radius alone.
//!
//! A point's cell, and its offset within it, depend on nothing but its own coordinates and the
//! radius. So a tile, a whole scan, and a scan at UTM coordinates agree about who is in a ball.

use crate::{Error, Radius};

/// Cells per radius. More cells follow the ball more closely, and make rows that are too short for
/// wide registers; two was the fastest from 50 to 2,800 neighbours.
const CELLS_PER_RADIUS: f64 = 2.0;

/// Cells along a row before the next row begins. Offsets are float32 from the middle of the row, so
/// this bounds their rounding: 24 cells are 12 radii, which is 5e-7 of a radius.
pub(crate) const CELLS_PER_ROW: i64 = 48;

/// Parts into which the hierarchy may cut a cell along each axis.
pub(crate) const PARTS_PER_CELL: i32 = 64;

/// Float64 can still tell neighbouring cells apart, with a thousandth of a cell to spare.
const MAX_CELLS: f64 = (1_u64 << 43) as f64;

/// Which row of cells a point is in: its cell along z and y, and its run of cells along x.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub(crate) struct RowKey {
    pub z: i64,
    pub y: i64,
    pub x: i64,
}

/// The lattice that belongs to a radius.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Lattice {
    pub radius: f64,
    step: f64,
    row_length: f64,
}

impl Lattice {
    pub fn new(radius: Radius) -> Self {
        let step = radius.get() / CELLS_PER_RADIUS;
        Self { radius: radius.get(), step, row_length: step * CELLS_PER_ROW as f64 }
    }

    /// The row of a position, and its offset from the row's middle.
    #[inline]
    pub fn place(&self, position: [f64; 3]) -> Result<(RowKey, [f32; 3]), Error> {
        let [x, y, z] = position;
        if let Some(coordinate) = position.into_iter().find(|c| c.abs() > MAX_CELLS * self.step) {
            return Err(Error::RadiusBelowResolution { radius: self.radius, coordinate });
        }
        let key = RowKey {
            z: (z / self.step).floor() as i64,
            y: (y / self.step).floor() as i64,
            x: (x / self.row_length).floor() as i64,
        };
        let middle = self.middle(key);
        Ok((key, [0, 1, 2].map(|axis| (position[axis] - middle[axis]) as f32)))
    }

    /// The middle of a row, from which its points' offsets are taken.
    #[inline]
    pub fn middle(&self, key: RowKey) -> [f64; 3] {
        [
            (key.x as f64 + 0.5) * self.row_length,
            (key.y as f64 + 0.5) * self.step,
            (key.z as f64 + 0.5) * self.step,
        ]
    }

    /// From the middle of one row to that of another: exact differences of keys, so that it is the
    /// same wherever the two rows are.
    #[inline]
    pub fn between(&self, from: RowKey, to: RowKey) -> [f64; 3] {
        [
            (to.x - from.x) as f64 * self.row_length,
            (to.y - from.y) as f64 * self.step,
            (to.z - from.z) as f64 * self.step,
        ]
    }

    /// From a corner of cells, numbered along x, y, z, to the middle of a row: exact likewise.
    pub fn middle_from_corner(&self, [x, y, z]: [i64; 3], row: RowKey) -> [f64; 3] {
        let cells = |twice: i64| twice as f64 * self.half_step();
        [
            cells((2 * row.x + 1) * CELLS_PER_ROW - 2 * x),
            cells(2 * (row.y - y) + 1),
            cells(2 * (row.z - z) + 1),
        ]
    }

    /// Which part of its row a point at this offset from the row's middle is in: cells are cut into
    /// [`PARTS_PER_CELL`] along each axis. An offset that was rounded out of its row counts as its edge.
    #[inline]
    pub fn part(&self, offset: [f32; 3]) -> [i32; 3] {
        let parts_per_length = f64::from(PARTS_PER_CELL) / self.step;
        let place = |offset: f32, parts: i32| {
            let part = (f64::from(offset) * parts_per_length + f64::from(parts / 2)) as i32;
            part.clamp(0, parts - 1)
        };
        let along = CELLS_PER_ROW as i32 * PARTS_PER_CELL;
        [place(offset[0], along), place(offset[1], PARTS_PER_CELL), place(offset[2], PARTS_PER_CELL)]
    }

    /// Which of its row's cells a point is in.
    #[inline]
    pub fn cell(&self, x: f32) -> i32 {
        self.part([x, 0.0, 0.0])[0] / PARTS_PER_CELL
    }

    /// Half the size of a row along y and z.
    #[inline]
    pub fn half_step(&self) -> f64 {
        0.5 * self.step
    }

    /// How many rows away along y and z, and along x, a ball around a point can reach.
    pub fn reach(&self) -> (i64, i64) {
        // One more than the radius has cells is out of reach: its near side is a whole radius away.
        // The slack of the ball (1e-5) must not be lost on points that lie on a cell's very side.
        (CELLS_PER_RADIUS as i64 + 1, 1)
    }

    /// Longest extent along x of queries that share their windows: a cell. Longer runs prepare less
    /// often, and look at more points that are in no ball.
    #[inline]
    pub fn run_extent(&self) -> f32 {
        self.step as f32
    }
}
