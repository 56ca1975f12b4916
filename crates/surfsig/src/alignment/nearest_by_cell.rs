//! The nearest of some points, kept for every cell of space near them.
//!
//! Where many transforms of one surface are tried, the same places are asked for again and again: then a look into a table
//! takes a small part of the time of a search in a tree.

use crate::depth_image::SurfacePlace;
use rustc_hash::FxHashMap;

/// Cells along the edge of a block: cells are kept in blocks, as most of space is far from every point.
const BLOCK: i32 = 8;
const CELLS_OF_BLOCK: usize = (BLOCK * BLOCK * BLOCK) as usize;
/// Layers of cells for a distance of one edge: layers grow along the axes, and other directions take longer.
const DETOUR: f32 = 1.75;
/// In a cell with no point near it.
const NONE: u32 = u32::MAX;

/// Of a unit normal along an axis, from which on a point is among those that face that way.
const TOWARDS: f32 = 0.2;

/// A cell, and one of the six directions of the axes.
type Cell = ([i32; 3], u8);

/// For each cell of a lattice and each of six directions the number of the point that is nearest to the cell's middle, of
/// those that face about that way.
#[derive(Debug, Clone)]
pub(crate) struct NearestByCell {
    edge: f32,
    blocks: FxHashMap<Cell, u32>,
    cells: Vec<[u32; CELLS_OF_BLOCK]>,
}

impl NearestByCell {
    /// Fills the cells up to a distance from those with points; coordinates are finite.
    ///
    /// Cells take the points of their neighbours, one layer after the other: where points are an edge apart, one cell in
    /// eight has another one that is less than half an edge farther.
    pub fn new(points: &[SurfacePlace], edge: f32, distance: f32) -> Self {
        let mut all = Self { edge, blocks: FxHashMap::default(), cells: Vec::new() };
        let mut layer: Vec<Cell> = Vec::new();
        for (number, point) in (0..).zip(points) {
            let cell = all.cell(&point.place);
            for way in (0..6).filter(|&way| along(&point.normal, way) > TOWARDS) {
                if all.offer((cell, way), number, points) {
                    layer.push((cell, way));
                }
            }
        }
        for _ in 0..(DETOUR * distance / edge).ceil() as usize {
            let mut next = Vec::new();
            for (cell, way) in layer {
                let number = all.at((cell, way));
                for step in 0..6 {
                    let mut other = cell;
                    other[step / 2] = other[step / 2].saturating_add(if step % 2 == 0 { 1 } else { -1 });
                    if all.offer((other, way), number, points) {
                        next.push((other, way));
                    }
                }
            }
            layer = next;
        }
        all
    }

    /// The number of the point that is nearest to the middle of a place's cell, if any is near, of those that face about the
    /// same way.
    pub fn nearest(&self, point: &SurfacePlace) -> Option<usize> {
        let size = |way: u8| along(&point.normal, way);
        let way = (1..6).fold(0, |best, way| if size(way) > size(best) { way } else { best });
        let number = self.at((self.cell(&point.place), way));
        (number != NONE).then_some(number as usize)
    }

    fn cell(&self, place: &[f32; 3]) -> [i32; 3] {
        place.map(|x| (x / self.edge).floor() as i32)
    }

    fn at(&self, (cell, way): Cell) -> u32 {
        let (block, offset) = block_of(cell);
        self.blocks.get(&(block, way)).map_or(NONE, |&block| self.cells[block as usize][offset])
    }

    /// Lets a cell have a point if that is nearer than the one it has, of two as near the one with the lower number; whether
    /// it took it.
    fn offer(&mut self, (cell, way): Cell, number: u32, points: &[SurfacePlace]) -> bool {
        let (block, offset) = block_of(cell);
        let block = *self.blocks.entry((block, way)).or_insert_with(|| {
            self.cells.push([NONE; CELLS_OF_BLOCK]);
            self.cells.len() as u32 - 1
        });
        let has = &mut self.cells[block as usize][offset];
        let edge = self.edge;
        let square = |number: u32| -> f32 {
            let place = &points[number as usize].place;
            (0..3).map(|k| (place[k] - (cell[k] as f32 + 0.5) * edge).powi(2)).sum()
        };
        let is_nearer = *has == NONE || (*has != number && (square(number), number) < (square(*has), *has));
        if is_nearer {
            *has = number;
        }
        is_nearer
    }
}

/// The part of a normal along one of the six directions of the axes.
fn along(normal: &[f32; 3], way: u8) -> f32 {
    let part = normal[usize::from(way / 2)];
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
        let (mut asked, mut same) = (0, 0);
        for i in 0..5000 {
            let place = [0, 1, 2].map(|k| (40.0 * uniform(i, k as u64 + 7) - [5.0, 20.0, 20.0][k]) as f32);
            let side = if i % 2 == 0 { 1.0 } else { -1.0 };
            let square = |point: &SurfacePlace| {
                (0..3).map(|k| (point.place[k] - place[k].floor() - 0.5).powi(2)).sum::<f32>()
            };
            let on_side = points.iter().filter(|point| point.normal[2] * side > 0.0);
            let nearest = on_side.map(square).fold(f32::INFINITY, f32::min);
            let found = cells.nearest(&SurfacePlace { place, normal: [0.0, 0.0, side] });
            assert!(found.is_none_or(|number| points[number].normal[2] * side > 0.0));
            if nearest < 16.0 {
                let found = square(&points[found.expect("one is near")]);
                asked += 1;
                same += usize::from(found == nearest);
                assert!(found.sqrt() < nearest.sqrt() + 0.5, "{place:?} {found} {nearest}");
            }
        }
        assert!(asked > 500 && same as f64 > 0.85 * f64::from(asked), "{same} of {asked}");
    }

    #[test]
    fn far_from_all_points_and_of_none_there_is_nothing() {
        let at = |place| SurfacePlace { place, normal: [0.0, 0.0, 1.0] };
        assert_eq!(NearestByCell::new(&[], 1.0, 3.0).nearest(&at([0.0; 3])), None);
        let cells = NearestByCell::new(&[at([0.5; 3])], 1.0, 1.0);
        assert_eq!(cells.nearest(&at([2.9, 0.5, 0.0])), Some(0));
        assert_eq!(cells.nearest(&at([3.1, 0.0, 0.0])), None);
        assert_eq!(cells.nearest(&at([1e30, 0.0, -1e30])), None);
        assert_eq!(cells.nearest(&SurfacePlace { place: [0.5; 3], normal: [0.0, 0.0, -1.0] }), None);
    }
}
