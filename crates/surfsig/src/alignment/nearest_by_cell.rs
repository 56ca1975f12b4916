//! The nearest of some points, kept for every cell of space that was asked for.
//!
//! Where many transforms of one surface are tried, the same places are asked for again and again: then a look into a table
//! takes a small part of the time of a search in a tree.

use crate::depth_image::SurfacePlace;
use crate::kd_tree::KdTree;
use rustc_hash::FxHashMap;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicU32, Ordering};

/// Cells along the edge of a block: cells are kept in blocks, as most of space is far from every point.
const BLOCK: i32 = 8;
const CELLS_OF_BLOCK: usize = (BLOCK * BLOCK * BLOCK) as usize;
/// Half the diagonal of a cell, in its edge: the farthest that a place is from its cell's middle.
const HALF_DIAGONAL: f64 = 0.87;
/// In a cell with no point near it.
const NONE: u32 = u32::MAX;
/// In a cell that nobody asked for yet.
const UNKNOWN: u32 = u32::MAX - 1;

/// Of a unit normal along an axis, from which on a point is among those that face that way.
const TOWARDS: f32 = 0.2;

/// The cells of a block: whoever asks for one first searches for its point. All find the same one, so that it does not
/// matter who is first.
type Block = OnceLock<Box<[AtomicU32; CELLS_OF_BLOCK]>>;

/// For each cell of a lattice and each of six directions the number of the point that is nearest to the cell's middle, of
/// those that face about that way.
#[derive(Debug)]
pub(crate) struct NearestByCell {
    edge: f64,
    reach: f64,
    ways: [Facing; 6],
}

/// The points that face about one of the six directions of the axes.
#[derive(Debug)]
struct Facing {
    /// Their numbers among all points.
    numbers: Vec<u32>,
    tree: KdTree,
    /// All that are near a point.
    blocks: FxHashMap<[i32; 3], Block>,
}

impl NearestByCell {
    /// Of points with finite coordinates, for places up to a distance from them.
    pub fn new(points: &[SurfacePlace], edge: f64, distance: f64) -> Self {
        let ways = [0, 1, 2, 3, 4, 5].map(|way| {
            let is_facing = |&number: &u32| along(&points[number as usize].normal, way) > TOWARDS;
            let numbers: Vec<u32> = (0..points.len() as u32).filter(is_facing).collect();
            let places: Vec<[f64; 3]> =
                numbers.iter().map(|&number| points[number as usize].place.map(f64::from)).collect();
            let mut blocks = FxHashMap::default();
            for place in &places {
                let [first, last] =
                    [-distance, distance].map(|far| block_of(cell_of(place.map(|x| x + far), edge)).0);
                for x in first[0]..=last[0] {
                    for y in first[1]..=last[1] {
                        for z in first[2]..=last[2] {
                            blocks.entry([x, y, z]).or_default();
                        }
                    }
                }
            }
            Facing { numbers, tree: KdTree::new(&places), blocks }
        });
        Self { edge, reach: distance + HALF_DIAGONAL * edge, ways }
    }

    /// The number of the point that is nearest to the middle of a place's cell, if any is near, of those that face about the
    /// same way.
    pub fn nearest(&self, point: &SurfacePlace) -> Option<usize> {
        let size = |way: usize| along(&point.normal, way);
        let way = (1..6).fold(0, |best, way| if size(way) > size(best) { way } else { best });
        let facing = &self.ways[way];
        let cell = cell_of(point.place.map(f64::from), self.edge);
        let (block, offset) = block_of(cell);
        let cells = facing.blocks.get(&block)?;
        let known =
            &cells.get_or_init(|| Box::new([const { AtomicU32::new(UNKNOWN) }; CELLS_OF_BLOCK]))[offset];
        // A number stands for itself: nothing else has to be seen by another thread.
        let mut number = known.load(Ordering::Relaxed);
        if number == UNKNOWN {
            let middle = cell.map(|x| (f64::from(x) + 0.5) * self.edge);
            let found = facing.tree.nearest(middle, self.reach);
            number = found.map_or(NONE, |(nearest, _)| facing.numbers[nearest as usize]);
            known.store(number, Ordering::Relaxed);
        }
        (number != NONE).then_some(number as usize)
    }
}

fn cell_of(place: [f64; 3], edge: f64) -> [i32; 3] {
    place.map(|x| (x / edge).floor() as i32)
}

/// The part of a normal along one of the six directions of the axes.
fn along(normal: &[f32; 3], way: usize) -> f32 {
    let part = normal[way / 2];
    if way & 1 == 0 { part } else { -part }
}

/// The block that a cell is in, and its place there.
fn block_of(cell: [i32; 3]) -> ([i32; 3], usize) {
    let within = cell.map(|x| x.rem_euclid(BLOCK));
    (cell.map(|x| x.div_euclid(BLOCK)), ((within[0] * BLOCK + within[1]) * BLOCK + within[2]) as usize)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// A wavy surface, about one between points, from both sides.
    fn waves() -> Vec<SurfacePlace> {
        let point = |i: usize| {
            let side = if i < 900 { 1.0 } else { -1.0 };
            let i = i % 900;
            let [x, y] = [(i % 30) as f32 + 0.5 * uniform(i, 1) as f32, (i / 30) as f32 - 15.0];
            let slope = 0.9 * (0.3 * x).cos();
            let size = side / (1.0 + slope * slope).sqrt();
            let place = [x, y, 3.0 * (0.3 * x).sin() - 1.0 + 0.2 * side];
            SurfacePlace { place, normal: [-slope * size, 0.0, size] }
        };
        (0..1800).map(point).collect()
    }

    #[test]
    fn a_cell_has_the_point_that_is_nearest_to_its_middle_of_those_on_a_side() {
        let points = waves();
        let cells = NearestByCell::new(&points, 1.0, 4.0);
        let mut asked = 0;
        for i in 0..5000 {
            let place = [0, 1, 2].map(|k| (40.0 * uniform(i, k as u64 + 7) - [5.0, 20.0, 20.0][k]) as f32);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let square = |point: &SurfacePlace| {
                (0..3).map(|k| (point.place[k] - place[k].floor() - 0.5).powi(2)).sum::<f32>()
            };
            let on_side = points.iter().filter(|point| point.normal[2] * side > 0.0);
            let nearest = on_side.map(square).fold(f32::INFINITY, f32::min);
            let asked_for = SurfacePlace { place, normal: [0.0, 0.0, side] };
            let found = cells.nearest(&asked_for);
            assert_eq!(cells.nearest(&asked_for), found);
            assert!(found.is_none_or(|number| points[number].normal[2] * side > 0.0));
            if nearest < 16.0 {
                let found = square(&points[found.expect("one is near")]);
                asked += 1;
                assert!(found.sqrt() < nearest.sqrt() + 1e-4, "{place:?} {found} {nearest}");
            }
        }
        assert!(asked > 500, "{asked}");
    }

    #[test]
    fn far_from_all_points_and_of_none_there_is_nothing() {
        let at = |place| SurfacePlace { place, normal: [0.0, 0.0, 1.0] };
        assert_eq!(NearestByCell::new(&[], 1.0, 3.0).nearest(&at([0.0; 3])), None);
        let cells = NearestByCell::new(&[at([0.5; 3])], 1.0, 1.0);
        // Of the cell from 1 to 2 the middle is 1 away, of the next one 2.
        assert_eq!(cells.nearest(&at([1.9, 0.5, 0.0])), Some(0));
        assert_eq!(cells.nearest(&at([2.1, 0.0, 0.0])), None);
        assert_eq!(cells.nearest(&at([1e30, 0.0, -1e30])), None);
        assert_eq!(cells.nearest(&SurfacePlace { place: [0.5; 3], normal: [0.0, 0.0, -1.0] }), None);
    }
}
