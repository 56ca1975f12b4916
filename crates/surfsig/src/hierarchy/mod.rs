//! Balls summed from cubes: the cost of a point hardly grows with its number of neighbours.

mod cube;
mod density;
mod dual_walk;
mod forest;

pub(crate) use density::is_dense;
pub(crate) use dual_walk::HierarchicalWalk;
pub(crate) use forest::CELLS_PER_REGION;
