//! The points in and around a region, in one octree for each cell of the lattice.
//!
//! A region is a cube of cells at an absolute place. Its trees are built when a ball first reaches
//! them, and go when the next region comes: no table of the whole cloud is ever held.

use super::cube::Cube;
use crate::cell_index::{CellIndex, Row};
use crate::lattice::{CELLS_PER_ROW, PARTS_PER_CELL, RowKey};
use crate::moments::MOMENTS;
use crate::simd::select::{PADDING, Rows};
use std::ops::Range;

/// Cells along a region's edge; rows hold a whole number of them. Larger regions build fewer trees
/// twice, and hold more at a time.
pub(crate) const CELLS_PER_REGION: i64 = 8;

/// Cells around a region that balls can touch.
const MARGIN: i64 = 3;

/// Cells along the edge of a region with its margin.
const WIDTH: i64 = CELLS_PER_REGION + 2 * MARGIN;

/// Points up to which the sums of a cube are taken from them, one after the other; beyond, from its octants.
/// Queries of a cube with so few are compared with points, no longer with cubes.
const FEW: usize = 256;

/// A cube of a tree, and the points in it.
pub(super) struct Node {
    pub cube: Cube,
    /// Number of children, which stand side by side; none where the cube has not been cut.
    pub child_count: u8,
    /// In which of the forest's rows the points are.
    pub row: u16,
    pub first_child: u32,
    pub first_point: u32,
    pub end_point: u32,
}

impl Node {
    pub fn points(&self) -> Range<usize> {
        self.first_point as usize..self.end_point as usize
    }

    pub fn children(&self) -> Range<u32> {
        self.first_child..self.first_child + u32::from(self.child_count)
    }

    /// Whether the cube holds few points, or is as small as cubes get.
    pub fn is_small(&self) -> bool {
        self.points().len() <= FEW || self.cube.size == 1
    }
}

/// A row of the lattice that crosses the region or its margin, and its points.
struct ForestRow {
    key: RowKey,
    row: Option<Row>,
}

/// A cube of points, and where it stands in the forest.
#[derive(Clone, Copy)]
pub(super) struct Source {
    pub cube: Cube,
    pub node: u32,
}

/// What is known of a cell.
#[derive(Clone, Copy)]
enum Tree {
    NotBuilt,
    Empty,
    Root(u32),
}

pub(super) struct Forest<'a> {
    index: &'a CellIndex,
    scale: f64,
    /// The corner of the margin, in cells.
    corner: [i64; 3],
    rows: Vec<ForestRow>,
    trees: Vec<Tree>,
    pub nodes: Vec<Node>,
    /// Of each node, about the middle of the region, in units of the radius: sums of nodes can so be
    /// added up as they are.
    pub sums: Vec<[f64; MOMENTS]>,
    /// Offsets from the middle of each point's row, as the index has them, in the order of the trees, padded
    /// so that a vector may overrun the end.
    x: Vec<f32>,
    y: Vec<f32>,
    z: Vec<f32>,
    points: usize,
    /// Where each point is on the curve through its cell.
    places: Vec<u32>,
    /// Of the points of the tree that is being built: place along the curve, and number in the row.
    curve: Vec<u64>,
}

impl<'a> Forest<'a> {
    pub fn new(index: &'a CellIndex, scale: f32) -> Self {
        Self {
            index,
            scale: scale.into(),
            corner: [0; 3],
            rows: Vec::new(),
            trees: Vec::new(),
            nodes: Vec::new(),
            sums: Vec::new(),
            x: Vec::new(),
            y: Vec::new(),
            z: Vec::new(),
            points: 0,
            places: Vec::new(),
            curve: Vec::new(),
        }
    }

    /// Leaves the region that was, and goes to the one whose corner is this cell.
    pub fn enter(&mut self, region: [i64; 3]) {
        self.corner = region.map(|cell| cell - MARGIN);
        self.trees.clear();
        self.trees.resize((WIDTH * WIDTH * WIDTH) as usize, Tree::NotBuilt);
        self.nodes.clear();
        self.sums.clear();
        self.points = 0;
        self.places.clear();
        self.rows.clear();
        let [x, y, z] = self.corner;
        for z in z..z + WIDTH {
            for y in y..y + WIDTH {
                // The margin may reach into the next row along x.
                let first = x.div_euclid(CELLS_PER_ROW);
                for x in [first, first + 1] {
                    let key = RowKey { z, y, x };
                    self.rows.push(ForestRow { key, row: self.index.row(key).copied() });
                }
            }
        }
    }

    /// Where a cell of a row is, from the corner of the margin, in cells.
    pub fn place(&self, key: RowKey, cell: i32) -> [i64; 3] {
        let [x, y, z] = self.corner;
        [key.x * CELLS_PER_ROW + i64::from(cell) - x, key.y - y, key.z - z]
    }

    /// All points, by the numbers that nodes give.
    pub fn points(&self) -> Rows<'_> {
        Rows { x: &self.x, y: &self.y, z: &self.z }
    }

    pub fn key(&self, row: u16) -> RowKey {
        self.rows[usize::from(row)].key
    }

    /// The middle of a row from the middle of the region, in units of the radius.
    pub fn middle_of(&self, key: RowKey) -> [f64; 3] {
        let middle = self.corner.map(|cell| cell + WIDTH / 2);
        self.index.lattice.middle_from_corner(middle, key).map(|length| length * self.scale)
    }

    /// Appends the roots of all trees that balls around points of the cell at this place can touch, row
    /// by row.
    pub fn roots_around(&mut self, [x, y, z]: [i64; 3], roots: &mut Vec<u32>) {
        for dz in -MARGIN..=MARGIN {
            for dy in -MARGIN..=MARGIN {
                for dx in -MARGIN..=MARGIN {
                    // Cells between the two; a radius is two of them.
                    let gap = |d: i64| (d.abs() - 1).max(0).pow(2);
                    if gap(dx) + gap(dy) + gap(dz) <= 4 {
                        roots.extend(self.root([x + dx, y + dy, z + dz]));
                    }
                }
            }
        }
    }

    /// A length in parts, in units of the radius.
    pub fn units(&self, parts: f64) -> f64 {
        2.0 * self.index.lattice.half_step() * self.scale / f64::from(PARTS_PER_CELL) * parts
    }

    /// A place along an axis, in parts from the corner of the margin, from the middle of the region, in units
    /// of the radius.
    pub fn place_from_middle(&self, parts: f64) -> f64 {
        self.units(parts - (WIDTH * i64::from(PARTS_PER_CELL) / 2) as f64)
    }

    pub fn source(&self, node: u32) -> Source {
        Source { cube: self.nodes[node as usize].cube, node }
    }

    /// The root of the tree of the cell at this place, if there are points in it.
    pub fn root(&mut self, place: [i64; 3]) -> Option<u32> {
        let [x, y, z] = place;
        let slot = ((z * WIDTH + y) * WIDTH + x) as usize;
        if let Tree::NotBuilt = self.trees[slot] {
            self.trees[slot] = self.build(place);
        }
        match self.trees[slot] {
            Tree::Root(root) => Some(root),
            _ => None,
        }
    }

    fn build(&mut self, place: [i64; 3]) -> Tree {
        let CellIndex { lattice, x, y, z, .. } = self.index;
        let along = self.corner[0] + place[0];
        let second = along.div_euclid(CELLS_PER_ROW) - self.corner[0].div_euclid(CELLS_PER_ROW);
        let number = (place[2] * WIDTH + place[1]) * 2 + second;
        let Some(row) = self.rows[number as usize].row else { return Tree::Empty };
        let cell = along.rem_euclid(CELLS_PER_ROW) as i32;
        let start = row.start + x[row.start..row.end].partition_point(|&x| lattice.cell(x) < cell);
        let end = start + x[start..row.end].partition_point(|&x| lattice.cell(x) == cell);
        if start == end {
            return Tree::Empty;
        }
        self.curve.clear();
        let offset = |rank: usize| [x[rank], y[rank], z[rank]];
        // Points of one part keep the order of the row.
        self.curve.extend(
            (start..end).map(|rank| {
                u64::from(place_on_curve(lattice.part(offset(rank)))) << 32 | (rank - start) as u64
            }),
        );
        self.curve.sort_unstable();
        let first_point = self.points as u32;
        for (column, values) in [(&mut self.x, x), (&mut self.y, y), (&mut self.z, z)] {
            column.truncate(self.points);
            column.extend(self.curve.iter().map(|&point| values[start + (point as u32) as usize]));
            column.extend([0.0; PADDING]);
        }
        self.points += self.curve.len();
        self.places.extend(self.curve.iter().map(|&point| (point >> 32) as u32));
        let root = self.nodes.len();
        let low = place.map(|cell| (cell * i64::from(PARTS_PER_CELL)) as i16);
        self.nodes.push(Node {
            cube: Cube { low, size: PARTS_PER_CELL as i16 },
            child_count: 0,
            row: number as u16,
            first_child: 0,
            first_point,
            end_point: self.points as u32,
        });
        // Children are appended, and so are cut in their turn.
        let mut node = root;
        while node < self.nodes.len() {
            if !self.nodes[node].is_small() {
                self.cut(node);
            }
            node += 1;
        }
        self.sum(root);
        Tree::Root(root as u32)
    }

    /// The children of a node, which is cut if it has not been. How far a cube is cut does not follow from the
    /// number of its points alone: a tile may hold only some of them, and must add up the same cubes.
    pub fn children(&mut self, node: u32) -> Range<u32> {
        if self.nodes[node as usize].child_count == 0 {
            let first = self.nodes.len();
            self.cut(node as usize);
            self.sum(first);
        }
        self.nodes[node as usize].children()
    }

    /// Gives a node its children.
    fn cut(&mut self, node: usize) {
        let Node { cube, row, first_point: first, end_point: end, .. } = self.nodes[node];
        let first_child = self.nodes.len() as u32;
        let mut start = first;
        while start < end {
            let rest = &self.places[start as usize..end as usize];
            let octant = octant(rest[0], cube.size);
            let count = rest.partition_point(|&place| self::octant(place, cube.size) == octant);
            self.nodes.push(Node {
                cube: cube.octant(octant),
                child_count: 0,
                row,
                first_child: 0,
                first_point: start,
                end_point: start + count as u32,
            });
            start += count as u32;
        }
        self.nodes[node].first_child = first_child;
        self.nodes[node].child_count = (self.nodes.len() as u32 - first_child) as u8;
    }

    /// The sums of all nodes from `first` on, children before parents.
    fn sum(&mut self, first: usize) {
        self.sums.resize(self.nodes.len(), [0.0; MOMENTS]);
        let middle = self.middle_of(self.key(self.nodes[first].row));
        for number in (first..self.nodes.len()).rev() {
            let node = &self.nodes[number];
            let mut sums = [0.0; MOMENTS];
            if node.is_small() {
                for point in node.points() {
                    let offset = [self.x[point], self.y[point], self.z[point]];
                    add_point(&mut sums, [0, 1, 2].map(|a| f64::from(offset[a]) * self.scale + middle[a]));
                }
            } else {
                for child in node.children() {
                    add(&mut sums, &self.sums[child as usize]);
                }
            }
            self.sums[number] = sums;
        }
    }
}

/// Adds other sums to some.
#[inline(always)]
pub(super) fn add(sums: &mut [f64; MOMENTS], more: &[f64; MOMENTS]) {
    for k in 0..MOMENTS {
        sums[k] += more[k];
    }
}

/// Adds the monomials of a point, in the order of [`crate::EXPONENTS`]: each order is x times the one
/// before, then y times its end without x, then z times its last.
#[inline(always)]
fn add_point(sums: &mut [f64; MOMENTS], [x, y, z]: [f64; 3]) {
    let mut monomials = [1.0; MOMENTS];
    let (mut before, mut slot) = (0, 1);
    for order in 1..=4 {
        let count = order * (order + 1) / 2;
        for k in 0..count {
            monomials[slot + k] = x * monomials[before + k];
        }
        for k in 0..order {
            monomials[slot + count + k] = y * monomials[before + count - order + k];
        }
        monomials[slot + count + order] = z * monomials[before + count - 1];
        before = slot;
        slot += count + order + 1;
    }
    add(sums, &monomials);
}

/// A part's place on the Morton curve through its cell.
#[inline]
pub(super) fn place_on_curve(part: [i32; 3]) -> u32 {
    let [x, y, z] = part.map(|part| spread_bits((part % PARTS_PER_CELL) as u32));
    x << 2 | y << 1 | z
}

/// Of a cube of this size, the octant that a place on the curve is in.
#[inline]
pub(super) fn octant(place: u32, size: i16) -> usize {
    let level = size.trailing_zeros() - 1;
    (place >> (3 * level)) as usize & 7
}

/// Six bits, each followed by two zeros.
#[inline]
fn spread_bits(value: u32) -> u32 {
    let value = (value | value << 8) & 0x300f;
    let value = (value | value << 4) & 0x30c3;
    (value | value << 2) & 0x9249
}
