//! Balls summed from cubes: what a point costs hardly grows with its number of neighbours.
//!
//! [`cube`] says in whole numbers what is inside and outside the balls around a cube's points, [`forest`]
//! holds the sums of the cubes in and around a region, [`patch`] those that a cube of queries shares, and
//! [`dual_walk`] puts balls together from them.

mod cube;
mod dual_walk;
mod forest;
mod patch;
#[cfg(test)]
mod tests;

pub(crate) use dual_walk::HierarchicalWalk;
pub(crate) use forest::CELLS_PER_REGION;

/// Points in a cell of the lattice from which on the balls around its points are walked by the hierarchy. On a
/// surface a ball then holds some 600: there both walks take the same time.
pub(crate) const DENSE: usize = 48;
