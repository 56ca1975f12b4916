//! The queries cut into shares, each for one thread at a time.

use crate::cell_index::{CellIndex, Row};
use crate::hierarchy::CELLS_PER_REGION;
use crate::lattice::{CELLS_PER_ROW, RowKey};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::ops::Range;

/// Queries of a share that is walked directly.
const CHUNK: usize = 512;

/// Some queries, by their ranks.
pub(super) enum Share {
    /// Runs of ranks whose balls are walked point by point.
    Direct(Vec<Range<usize>>),
    /// The queries of dense cells in one region, whose corner is this cell.
    Region { corner: [i64; 3], cells: Vec<DenseCell> },
}

/// The queries of a cell whose balls are walked by the hierarchy.
pub(super) struct DenseCell {
    pub key: RowKey,
    pub cell: i32,
    pub ranks: Range<usize>,
}

impl Share {
    /// Its queries, in the order of its entries in the columns.
    pub fn ranks(&self) -> impl Iterator<Item = usize> + '_ {
        let (runs, cells) = match self {
            Self::Direct(runs) => (&runs[..], &[][..]),
            Self::Region { cells, .. } => (&[][..], &cells[..]),
        };
        runs.iter().chain(cells.iter().map(|cell| &cell.ranks)).cloned().flatten()
    }

    pub fn len(&self) -> usize {
        match self {
            Self::Direct(runs) => runs.iter().map(ExactSizeIterator::len).sum(),
            Self::Region { cells, .. } => cells.iter().map(|cell| cell.ranks.len()).sum(),
        }
    }
}

/// All queries in shares, the largest first. Cells of the lattice with so many points or more go to the hierarchy.
pub(super) fn shares(index: &CellIndex, asked: &CellIndex, dense: Option<usize>) -> Vec<Share> {
    let dense: Vec<DenseCell> = match dense {
        Some(dense) => {
            asked.rows.par_iter().flat_map_iter(|row| dense_cells(index, asked, row, dense)).collect()
        }
        None => Vec::new(),
    };
    let mut direct = Vec::new();
    let mut chunk = Chunk { runs: Vec::new(), room: CHUNK };
    let mut start = 0;
    for cell in &dense {
        chunk.take(start..cell.ranks.start, &mut direct);
        start = cell.ranks.end;
    }
    chunk.take(start..asked.len(), &mut direct);
    if !chunk.runs.is_empty() {
        direct.push(Share::Direct(chunk.runs));
    }

    let mut regions: FxHashMap<[i64; 3], Vec<DenseCell>> = FxHashMap::default();
    for cell in dense {
        let RowKey { z, y, x } = cell.key;
        let corner = [x * CELLS_PER_ROW + i64::from(cell.cell), y, z]
            .map(|cell| cell.div_euclid(CELLS_PER_REGION) * CELLS_PER_REGION);
        regions.entry(corner).or_default().push(cell);
    }
    let mut shares: Vec<Share> =
        regions.into_iter().map(|(corner, cells)| Share::Region { corner, cells }).collect();
    shares.sort_by_cached_key(|share| std::cmp::Reverse(share.len()));
    shares.extend(direct);
    shares
}

/// The dense cells of a row in which there are queries. What is dense follows from a cell's own points: a tile
/// decides as the whole cloud does, and for some queries as for all.
fn dense_cells(index: &CellIndex, asked: &CellIndex, row: &Row, dense: usize) -> Vec<DenseCell> {
    let lattice = &index.lattice;
    let mut cells = Vec::new();
    let Some(points) = index.row(row.key) else { return cells };
    let (mut query, mut point) = (row.start, points.start);
    while query < row.end {
        let cell = lattice.cell(asked.x[query]);
        let after = |x: &[f32], from: usize, end: usize, cell: i32| {
            from + x[from..end].partition_point(|&x| lattice.cell(x) <= cell)
        };
        let ranks = query..after(&asked.x, query, row.end, cell);
        point = after(&index.x, point, points.end, cell - 1);
        let end = after(&index.x, point, points.end, cell);
        if end - point >= dense {
            cells.push(DenseCell { key: row.key, cell, ranks: ranks.clone() });
        }
        (query, point) = (ranks.end, end);
    }
    cells
}

/// A direct share that has room left.
struct Chunk {
    runs: Vec<Range<usize>>,
    room: usize,
}

impl Chunk {
    fn take(&mut self, mut ranks: Range<usize>, full: &mut Vec<Share>) {
        while !ranks.is_empty() {
            let end = ranks.end.min(ranks.start + self.room);
            self.runs.push(ranks.start..end);
            self.room -= end - ranks.start;
            ranks.start = end;
            if self.room == 0 {
                full.push(Share::Direct(std::mem::take(&mut self.runs)));
                self.room = CHUNK;
            }
        }
    }
}
