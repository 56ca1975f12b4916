//! One thread's share of the loop over points.

use super::columns::{ColumnsPart, Fit};
use super::robust::{self, Distances, without_outliers};
use super::{ExtractOptions, Monitor, Neighborhood};
use crate::Error;
use crate::ball::DirectWalk;
use crate::cell_index::{CellIndex, Row, RowKey};
use crate::fit::FitKind;
use crate::fit::paraboloid::{Paraboloids, Task, fit_paraboloids};
use crate::fit::quadric::fit_quadrics;
use crate::fit::tensor::{MomentBatch, Vector};
use crate::hierarchy::HierarchicalWalk;
use crate::members::Members;
use crate::moments::{Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::lanes::{LANES, Lanes};
use std::ops::Range;

/// Most queries that share their windows.
const RUN: usize = 32;

/// One thread's share of the loop: gathers moments until a batch is full, fits it, writes it.
pub(super) struct Worker<'a> {
    walk: DirectWalk<'a>,
    pub hierarchical: HierarchicalWalk<'a>,
    pub asked: &'a CellIndex,
    neighborhood: Neighborhood,
    options: &'a ExtractOptions<'a>,
    set: InstructionSet,
    pub pending: Vec<Pending>,
    pub moments: Vec<Moments<f64>>,
    /// Of each pending query, where its points are looked at more than once.
    members: Vec<Members>,
    distances: Distances,
}

/// A query whose moments wait for their batch.
#[derive(Clone, Copy)]
pub(super) struct Pending {
    pub key: RowKey,
    pub offset: [f32; 3],
    /// Where the hierarchical walk keeps what it shares with other queries.
    pub patch: Option<usize>,
    /// Where its values belong in the thread's part of the columns.
    pub entry: usize,
    /// Its number among the queries.
    pub query: u32,
    /// Radius of its neighbourhood, in units of the lattice's.
    pub radius: f64,
}

impl<'a> Worker<'a> {
    pub fn new(
        index: &'a CellIndex,
        asked: &'a CellIndex,
        neighborhood: Neighborhood,
        options: &'a ExtractOptions<'a>,
        set: InstructionSet,
    ) -> Self {
        let (walk, hierarchical) = (DirectWalk::new(index, set), HierarchicalWalk::new(index, set));
        let (pending, moments) = (Vec::with_capacity(LANES), Vec::with_capacity(LANES));
        let members = (0..LANES).map(|_| Members::new()).collect();
        let distances = Distances::default();
        Self { walk, hierarchical, asked, neighborhood, options, set, pending, moments, members, distances }
    }

    /// Fills a part of the columns with the queries of these runs of ranks, one after the other.
    pub fn extract(
        &mut self,
        runs: &[Range<usize>],
        part: &mut ColumnsPart<'_>,
        monitor: &Monitor,
    ) -> Result<(), Error> {
        let rows = &self.asked.rows;
        let mut entry = 0;
        for ranks in runs {
            let mut rank = ranks.start;
            let mut row = rows.partition_point(|row| row.end <= rank);
            while rank < ranks.end {
                let Row { key, end, .. } = rows[row];
                self.walk.enter_row(key);
                let end = end.min(ranks.end);
                while rank < end {
                    monitor.check()?;
                    let next = self.extract_run(key, rank..end, entry, part);
                    entry += next - rank;
                    rank = next;
                }
                row += 1;
            }
        }
        self.fit_pending(part);
        monitor.add(part.len());
        Ok(())
    }

    /// Takes those of the first queries in `ranks` that are close enough together to share their
    /// windows, and returns where the next run begins. Their first belongs at `entry`.
    fn extract_run(
        &mut self,
        key: RowKey,
        ranks: Range<usize>,
        entry: usize,
        part: &mut ColumnsPart<'_>,
    ) -> usize {
        let CellIndex { x, y, z, lattice, .. } = self.asked;
        let start = ranks.start;
        let last = x[start] + lattice.run_extent();
        let length = x[start..ranks.end.min(start + RUN)].iter().take_while(|x| **x <= last).count();
        let run = start..start + length;
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for rank in run.clone() {
            for (axis, value) in [x[rank], y[rank], z[rank]].into_iter().enumerate() {
                low[axis] = low[axis].min(value);
                high[axis] = high[axis].max(value);
            }
        }
        self.walk.enter_run(low, high);
        for rank in run.clone() {
            let offset = [x[rank], y[rank], z[rank]];
            let lane = self.pending.len();
            let (moments, radius) = if self.exact() {
                self.around::<f64>(offset, lane)
            } else {
                self.around::<f32>(offset, lane)
            };
            let query = self.asked.point_of_rank[rank];
            let entry = entry + rank - start;
            self.pending.push(Pending { key, offset, patch: None, entry, query, radius });
            self.moments.push(moments);
            if self.pending.len() == LANES && self.fit_pending(part) {
                // The walk went back to points of the batch.
                self.walk.enter_row(key);
                self.walk.enter_run(low, high);
            }
        }
        run.end
    }

    /// An implicit quadric needs sums in f64 from the start.
    pub fn exact(&self) -> bool {
        self.options.fit != FitKind::Paraboloid
    }

    /// The moments around a query in units of its neighbourhood's radius, and that radius in units of the
    /// lattice's.
    fn around<S: Scalar>(&mut self, offset: [f32; 3], lane: usize) -> (Moments<f64>, f64) {
        let (most, radius_of_fewer) = match self.neighborhood {
            Neighborhood::Ball(_) if !self.options.robust => return (self.walk.moments::<S>(offset), 1.0),
            Neighborhood::Ball(_) => (usize::MAX, Some(1.0)),
            Neighborhood::Nearest(k) => (k, None),
            Neighborhood::Hybrid { most, .. } => (most, Some(1.0)),
        };
        let members = &mut self.members[lane];
        members.take(&mut self.walk, offset);
        let radius = members.keep_nearest(most, radius_of_fewer);
        (members.moments::<S>(self.set, |_| true), radius)
    }

    /// Fits and writes the pending queries; says whether the walk has moved for it.
    pub fn fit_pending(&mut self, part: &mut ColumnsPart<'_>) -> bool {
        if self.pending.is_empty() {
            return false;
        }
        let mut fits = self.fit(fit_paraboloids);
        let weak = |lane: &usize| !self.exact() && fits.needs_f64.get(*lane);
        let again: Vec<usize> = (0..self.pending.len()).filter(weak).collect();
        for &lane in &again {
            let Pending { key, offset, patch, .. } = self.pending[lane];
            self.moments[lane] = match patch {
                Some(patch) => self.hierarchical.moments::<f64>(patch, offset),
                None => {
                    self.walk.enter_row(key);
                    self.walk.enter_run(offset, offset);
                    self.around::<f64>(offset, lane).0
                }
            };
        }
        if !again.is_empty() {
            fits = self.fit(fit_paraboloids);
        }
        if self.options.robust {
            fits = self.fit_without_outliers(fits);
        }
        let quadrics = self.exact().then(|| self.fit(fit_quadrics));
        for (lane, (query, moments)) in self.pending.iter().zip(&self.moments).enumerate() {
            let quadric = quadrics.as_ref().filter(|quadrics| match self.options.fit {
                FitKind::Auto => quadrics.preferred.get(lane),
                _ => quadrics.trusted.get(lane),
            });
            let fit = Fit { paraboloid: &fits, quadric, lane };
            part.write(query.entry, moments.sums[0], query.radius, &fit);
        }
        self.pending.clear();
        self.moments.clear();
        !again.is_empty()
    }

    /// Fits again, without the points that are far from the fits, until the choice of points stands.
    fn fit_without_outliers(&mut self, mut fits: Paraboloids) -> Paraboloids {
        for _ in 0..robust::MAX_PASSES {
            let mut changed = false;
            for lane in 0..self.pending.len() {
                let (members, distances) = (&mut self.members[lane], &mut self.distances);
                let moments = without_outliers(members, &fits, lane, self.set, distances);
                if let Some(moments) = moments.filter(|moments| *moments != self.moments[lane]) {
                    self.moments[lane] = moments;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
            fits = self.fit(fit_paraboloids);
        }
        fits
    }

    /// Fits one kind of surface to all pending queries.
    fn fit<T>(&self, fit: fn(InstructionSet, &Task<'_>) -> T) -> T {
        let moments = &MomentBatch::new(&self.moments);
        fit(self.set, &Task { moments, axes: self.options.axes, to_sensor: self.to_sensor() })
    }

    /// From each pending query to the side from which it was seen, where somebody knows.
    fn to_sensor(&self) -> Option<Vector> {
        let pending = |lane: usize| self.pending[lane.min(self.pending.len() - 1)];
        let each = |towards: &dyn Fn(Pending, usize) -> f64| {
            [0, 1, 2].map(|axis| Lanes(std::array::from_fn(|lane| towards(pending(lane), axis))))
        };
        match (self.options.viewpoint, self.options.directions) {
            (Some(viewpoint), _) => Some(each(&|Pending { key, offset, .. }, axis| {
                viewpoint[axis] - self.asked.lattice.middle(key)[axis] - f64::from(offset[axis])
            })),
            (None, Some(directions)) => {
                Some(each(&|Pending { query, .. }, axis| f64::from(directions[query as usize][axis])))
            }
            (None, None) => None,
        }
    }
}
