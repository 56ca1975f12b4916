//! Points sorted into rows of cells, to be streamed: the sparse index of a cloud for one radius.

use crate::lattice::{Lattice, RowKey};
use crate::simd::select::PADDING;
use crate::{Error, Monitor, PointCloud, Radius};
use rayon::prelude::*;
use rustc_hash::FxHashMap;

/// Points after which it is looked whether the caller asked to stop.
const WATCH_INTERVAL: usize = 65_536;

/// A row: its key, and where its points begin. They end where the next row's begin.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Row {
    pub key: RowKey,
    pub start: usize,
    pub end: usize,
}

/// The points of a cloud in rows of an absolute lattice, each row in ascending x.
///
/// Only rows that hold points exist: an outlier a million metres away is one more row.
///
/// ```
/// use surfsig::{CellIndex, PointCloud, Radius};
/// let points = [[0.0_f32, 0.0, 0.0], [0.01, 0.0, 0.0], [f32::NAN, 0.0, 0.0], [1e6, 0.0, 0.0]];
/// let index = CellIndex::new(&PointCloud::new(&points), Radius::new(0.02)?)?;
/// assert_eq!(index.len(), 3);
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug)]
pub struct CellIndex {
    pub(crate) lattice: Lattice,
    pub(crate) rows: Vec<Row>,
    row_of_key: FxHashMap<RowKey, u32>,
    /// Offsets from the middle of the point's row, padded so that a vector may overrun the end.
    pub(crate) x: Vec<f32>,
    pub(crate) y: Vec<f32>,
    pub(crate) z: Vec<f32>,
    /// The cloud's own number of each point.
    pub(crate) point_of_rank: Vec<u32>,
}

/// Row of a point that is in none.
const NOWHERE: u32 = u32::MAX;

/// The rows that one thread has met among its share of the points, in that order, with their points.
struct RowsMet {
    counts: Vec<(RowKey, usize)>,
}

impl RowsMet {
    /// Fills in which of the rows met each point is in.
    fn among(
        rows: &mut [u32],
        position: impl Fn(usize) -> Option<[f64; 3]>,
        lattice: &Lattice,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let mut met: FxHashMap<RowKey, u32> = FxHashMap::default();
        let mut counts: Vec<(RowKey, usize)> = Vec::new();
        let mut last = None;
        for (i, row) in rows.iter_mut().enumerate() {
            if i % WATCH_INTERVAL == 0 {
                monitor.check()?;
            }
            let Some(p) = position(i) else { continue };
            let (key, _) = lattice.place(p)?;
            // Neighbours in a file are often neighbours in space.
            *row = match last {
                Some((last_key, last_row)) if last_key == key => last_row,
                _ => *met.entry(key).or_insert_with(|| {
                    counts.push((key, 0));
                    counts.len() as u32 - 1
                }),
            };
            last = Some((key, *row));
            counts[*row as usize].1 += 1;
        }
        Ok(Self { counts })
    }
}

impl CellIndex {
    /// Sorts the finite points of a cloud for balls of one radius.
    ///
    /// # Errors
    /// [`Error::RadiusBelowResolution`] where float64 cannot tell the lattice's cells apart at a
    /// point's coordinates; [`Error::TooManyPoints`] beyond 2^32 - 1 points.
    pub fn new(cloud: &PointCloud<'_>, radius: Radius) -> Result<Self, Error> {
        Self::of_positions(cloud.len(), |i| cloud.position(i), radius, &Monitor::default())
    }

    /// As [`CellIndex::new`], for positions that are computed, of which `None` is left out, and a caller
    /// who may ask to stop.
    pub(crate) fn of_positions(
        len: usize,
        position: impl Fn(usize) -> Option<[f64; 3]> + Sync,
        radius: Radius,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        if len >= NOWHERE as usize {
            return Err(Error::TooManyPoints(len));
        }
        let lattice = Lattice::new(radius);

        // Which row each point is in. Threads number the rows that they meet, each for itself.
        let mut row_of_point = vec![NOWHERE; len];
        let share = len.div_ceil(rayon::current_num_threads()).max(1);
        let shares: Vec<RowsMet> = row_of_point
            .par_chunks_mut(share)
            .enumerate()
            .map(|(number, rows)| RowsMet::among(rows, |i| position(number * share + i), &lattice, monitor))
            .collect::<Result<_, Error>>()?;
        let mut met: FxHashMap<RowKey, u32> = FxHashMap::default();
        let mut keys: Vec<(RowKey, usize)> = Vec::new();
        let renumbered: Vec<Vec<u32>> = shares
            .into_iter()
            .map(|share| {
                let number = |(key, count): (RowKey, usize)| {
                    let row = *met.entry(key).or_insert_with(|| {
                        keys.push((key, 0));
                        keys.len() as u32 - 1
                    });
                    keys[row as usize].1 += count;
                    row
                };
                share.counts.into_iter().map(number).collect()
            })
            .collect();
        row_of_point.par_chunks_mut(share).zip(&renumbered).for_each(|(rows, renumbered)| {
            for row in rows.iter_mut().filter(|row| **row != NOWHERE) {
                *row = renumbered[*row as usize];
            }
        });

        // Rows in the order of their keys, which is that of the lattice.
        let mut order: Vec<u32> = (0..keys.len() as u32).collect();
        order.par_sort_unstable_by_key(|&row| keys[row as usize].0);
        let mut rows = Vec::with_capacity(keys.len());
        let mut cursor = vec![0; keys.len()];
        let mut start = 0;
        for (sorted, &row) in order.iter().enumerate() {
            let (key, count) = keys[row as usize];
            rows.push(Row { key, start, end: start + count });
            cursor[row as usize] = start;
            start += count;
            met.insert(key, sorted as u32);
        }

        // Deal the points to their rows, then sort each row along x; equal x keep the cloud's order.
        let mut point_of_rank = vec![0_u32; start];
        for (i, &row) in row_of_point.iter().enumerate().filter(|(_, row)| **row != NOWHERE) {
            let slot = &mut cursor[row as usize];
            point_of_rank[*slot] = i as u32;
            *slot += 1;
        }
        drop(row_of_point);
        let [mut x, mut y, mut z] = std::array::from_fn(|_| vec![0.0_f32; start + PADDING]);
        let mut work = Vec::with_capacity(rows.len());
        let (mut px, mut py, mut pz, mut pr) = (&mut x[..], &mut y[..], &mut z[..], &mut point_of_rank[..]);
        for row in &rows {
            let split = row.end - row.start;
            work.push((
                px.split_off_mut(..split).expect("as many slots as points"),
                py.split_off_mut(..split).expect("as many slots as points"),
                pz.split_off_mut(..split).expect("as many slots as points"),
                pr.split_off_mut(..split).expect("as many slots as points"),
            ));
        }
        work.into_par_iter().with_min_len(16).try_for_each_init(Vec::new, |offsets, (x, y, z, ranks)| {
            monitor.check()?;
            offsets.clear();
            offsets.extend(ranks.iter().map(|&i| {
                let place = position(i as usize).map(|p| lattice.place(p));
                let Some(Ok((_, offset))) = place else { unreachable!("placed a moment ago") };
                (offset, i)
            }));
            offsets.sort_unstable_by(|(a, i), (b, j)| a[0].total_cmp(&b[0]).then(i.cmp(j)));
            for (slot, &(offset, i)) in offsets.iter().enumerate() {
                ([x[slot], y[slot], z[slot]], ranks[slot]) = (offset, i);
            }
            Ok(())
        })?;
        Ok(Self { lattice, rows, row_of_key: met, x, y, z, point_of_rank })
    }

    /// The same index with at most so many points in one place, the first ones; `None` where no place has more.
    ///
    /// Thousands of equal points, such as missing returns at (0, 0, 0), would else be looked at for each of them.
    pub(crate) fn with_copies(&self, most: usize) -> Option<Self> {
        let place = |rank: usize| [self.x[rank], self.y[rank], self.z[rank]].map(f32::to_bits);
        let mut kept = vec![true; self.len()];
        let mut counts: FxHashMap<[u32; 3], usize> = FxHashMap::default();
        let mut surplus = false;
        for row in &self.rows {
            let x = &self.x[row.start..row.end];
            let mut start = row.start;
            // Rows ascend in x: equal points are among those of equal x.
            for run in x.chunk_by(|a, b| a == b) {
                let ranks = start..start + run.len();
                start = ranks.end;
                if ranks.len() <= most {
                    continue;
                }
                counts.clear();
                for rank in ranks {
                    let count = counts.entry(place(rank)).or_default();
                    *count += 1;
                    kept[rank] = *count <= most;
                    surplus |= *count > most;
                }
            }
        }
        surplus.then(|| self.with_only(&kept))
    }

    /// The same index with some of its points; no row ends without one.
    fn with_only(&self, kept: &[bool]) -> Self {
        let ranks = |range: std::ops::Range<usize>| range.filter(|&rank| kept[rank]);
        let column = |values: &[f32]| {
            let mut column: Vec<f32> = ranks(0..self.len()).map(|rank| values[rank]).collect();
            column.resize(column.len() + PADDING, 0.0);
            column
        };
        let mut end = 0;
        let rows = self.rows.iter().map(|row| {
            let start = end;
            end += ranks(row.start..row.end).count();
            Row { key: row.key, start, end }
        });
        Self {
            lattice: self.lattice,
            rows: rows.collect(),
            row_of_key: self.row_of_key.clone(),
            x: column(&self.x),
            y: column(&self.y),
            z: column(&self.z),
            point_of_rank: ranks(0..self.len()).map(|rank| self.point_of_rank[rank]).collect(),
        }
    }

    /// Number of points, those that are not finite left out.
    ///
    /// ```
    /// # use surfsig::{CellIndex, PointCloud, Radius};
    /// let index = CellIndex::new(&PointCloud::new(&[[f32::NAN; 3]]), Radius::new(1.0)?)?;
    /// assert_eq!(index.len(), 0);
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn len(&self) -> usize {
        self.point_of_rank.len()
    }

    /// Whether no point is finite.
    ///
    /// ```
    /// # use surfsig::{CellIndex, PointCloud, Radius};
    /// assert!(CellIndex::new(&PointCloud::new(&[]), Radius::new(1.0)?)?.is_empty());
    /// # Ok::<(), surfsig::Error>(())
    /// ```
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// The row with this key, if it holds points.
    pub(crate) fn row(&self, key: RowKey) -> Option<&Row> {
        self.row_of_key.get(&key).map(|&row| &self.rows[row as usize])
    }
}
