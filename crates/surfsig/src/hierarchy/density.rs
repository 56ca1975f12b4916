//! Where the hierarchy pays.

use crate::cell_index::{CellIndex, PARTS_PER_CELL};
use std::ops::Range;

/// Points that a cell must hold: on a surface, about a thirteenth of a ball's.
const LEAST: usize = 100;

/// Edge of the cubes in which points are counted, in parts: a sixteenth of the radius.
const EDGE: i32 = 8;

const CUBES: i32 = PARTS_PER_CELL / EDGE;

/// Points per occupied cube, times two. Where there are fewer, cubes that hold enough points to be worth
/// a sum are large, and most of a ball is its rim: in a volume that is so until far higher densities than
/// on a surface.
const TWICE_PER_CUBE: usize = 3;

/// Whether the balls around points of a cell are walked by the hierarchy, from the points of the cell
/// alone: a tile decides as the whole cloud does.
pub(crate) fn is_dense(index: &CellIndex, ranks: Range<usize>) -> bool {
    if ranks.len() < LEAST {
        return false;
    }
    let mut occupied = [0_u64; (CUBES * CUBES * CUBES) as usize / 64];
    for rank in ranks.clone() {
        let part = index.lattice.part([index.x[rank], index.y[rank], index.z[rank]]);
        let [x, y, z] = part.map(|part| (part % PARTS_PER_CELL / EDGE) as usize);
        occupied[x] |= 1 << (CUBES as usize * y + z);
    }
    let occupied: u32 = occupied.iter().map(|cubes| cubes.count_ones()).sum();
    2 * ranks.len() >= TWICE_PER_CUBE * occupied as usize
}
