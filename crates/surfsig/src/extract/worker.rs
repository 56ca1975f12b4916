//! One thread's share of the loop over points.

use super::columns::Fit;
use super::extraction::ColumnsPart;
use super::robust::{self, Distances, without_outliers};
use super::{ExtractOptions, Neighborhood};
use crate::ball::DirectWalk;
use crate::cell_index::{CellIndex, Row};
use crate::extremes::{larger, smaller};
use crate::fit::FitKind;
use crate::fit::paraboloid::{Paraboloids, Task, fit_paraboloids};
use crate::fit::quadric::fit_quadrics;
use crate::hierarchy::HierarchicalWalk;
use crate::lattice::RowKey;
use crate::members::Members;
use crate::moments::{Moments, Scalar};
use crate::shells::Shells;
use crate::simd::InstructionSet;
use crate::simd::lanes::{LANES, Lanes, Mask};
use crate::tensor::{Axes, MomentBatch, Vector};
use crate::{Error, Monitor};
use std::ops::Range;

/// Most queries that share their windows.
const RUN: usize = 32;

/// One thread's share of the loop: gathers moments until a batch is full, fits it, writes it.
pub(super) struct Worker<'a> {
    walk: DirectWalk<'a>,
    pub hierarchical: HierarchicalWalk<'a>,
    pub asked: &'a CellIndex,
    neighborhood: Neighborhood,
    /// Points of a neighbourhood that needs no larger ball.
    enough: usize,
    options: &'a ExtractOptions<'a>,
    set: InstructionSet,
    pub pending: Vec<Pending>,
    /// Of each ball around the pending queries, the largest first: the moments of each query.
    pub moments: Vec<Vec<Moments<f64>>>,
    /// What tells several balls around a query apart, where there are several.
    shells: Option<Shells>,
    /// Of each pending query, where its points are looked at more than once.
    members: Vec<Members>,
    distances: Distances,
    /// Queries with fewer than the nearest points that were asked for, of the runs at work.
    short: Vec<u32>,
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
    /// Radius of its neighbourhood, in units of the ball's.
    pub radius: f64,
}

impl<'a> Worker<'a> {
    /// For balls of these radii around each query, in units of the lattice's: 1, or 1 and smaller ones.
    pub fn new(
        index: &'a CellIndex,
        asked: &'a CellIndex,
        neighborhood: Neighborhood,
        radii: &[f64],
        options: &'a ExtractOptions<'a>,
        set: InstructionSet,
    ) -> Self {
        Self {
            walk: DirectWalk::new(index, set),
            hierarchical: HierarchicalWalk::new(index, set),
            asked,
            neighborhood,
            enough: neighborhood.most().unwrap_or(0).min(index.len()),
            options,
            set,
            pending: Vec::with_capacity(LANES),
            moments: radii.iter().map(|_| Vec::with_capacity(LANES)).collect(),
            shells: (radii.len() > 1).then(|| Shells::new(set, radii)),
            members: (0..LANES).map(|_| Members::new()).collect(),
            distances: Distances::default(),
            short: Vec::new(),
        }
    }

    /// Fills a part of each ball's columns with the queries of these runs of ranks, one after the other. Returns
    /// the queries whose balls hold fewer points than are wanted, and than there are.
    pub fn extract(
        &mut self,
        runs: &[Range<usize>],
        parts: &mut [ColumnsPart<'_>],
        monitor: &Monitor,
    ) -> Result<Vec<u32>, Error> {
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
                    let next = self.extract_run(key, rank..end, entry, parts);
                    entry += next - rank;
                    rank = next;
                }
                row += 1;
            }
        }
        self.fit_pending(parts);
        monitor.add(parts.iter().map(|part| part.len()).sum());
        Ok(std::mem::take(&mut self.short))
    }

    /// Takes those of the first queries in `ranks` that are close enough together to share their
    /// windows, and returns where the next run begins. Their first belongs at `entry`.
    fn extract_run(
        &mut self,
        key: RowKey,
        ranks: Range<usize>,
        entry: usize,
        parts: &mut [ColumnsPart<'_>],
    ) -> usize {
        let CellIndex { x, y, z, lattice, .. } = self.asked;
        let start = ranks.start;
        let last = x[start] + lattice.run_extent();
        let length = x[start..ranks.end.min(start + RUN)].iter().take_while(|x| **x <= last).count();
        let run = start..start + length;
        let (mut low, mut high) = ([f32::INFINITY; 3], [f32::NEG_INFINITY; 3]);
        for rank in run.clone() {
            for (axis, value) in [x[rank], y[rank], z[rank]].into_iter().enumerate() {
                low[axis] = smaller(low[axis], value);
                high[axis] = larger(high[axis], value);
            }
        }
        self.walk.enter_run(low, high);
        for rank in run.clone() {
            let offset = [x[rank], y[rank], z[rank]];
            let lane = self.pending.len();
            let radius = if self.exact() {
                self.around::<f64>(offset, lane, |_| true)
            } else {
                self.around::<f32>(offset, lane, |_| true)
            };
            let query = self.asked.point_of_rank[rank];
            // Before outliers leave, who would else be looked for again in larger and larger balls.
            if matches!(self.neighborhood, Neighborhood::Nearest(_))
                && self.members[lane].points.len() < self.enough
            {
                self.short.push(query);
            }
            let entry = entry + rank - start;
            self.pending.push(Pending { key, offset, patch: None, entry, query, radius });
            if self.pending.len() == LANES && self.fit_pending(parts) {
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

    /// Takes the moments around a query as those of a lane, in units of its neighbourhood's radius; returns that
    /// radius in units of the ball's. Of several balls, those that are `wanted`.
    fn around<S: Scalar>(&mut self, offset: [f32; 3], lane: usize, wanted: impl Fn(usize) -> bool) -> f64 {
        if let Some(shells) = &mut self.shells {
            let all = shells.moments::<S>(&mut self.walk, offset);
            for (ball, moments) in all.iter().enumerate().filter(|(ball, _)| wanted(*ball)) {
                place(&mut self.moments[ball], lane, *moments);
            }
            return 1.0;
        }
        let (most, radius_of_fewer) = match self.neighborhood {
            Neighborhood::Ball(_) if !self.options.robust => {
                place(&mut self.moments[0], lane, self.walk.moments::<S>(offset));
                return 1.0;
            }
            Neighborhood::Ball(_) => (usize::MAX, Some(1.0)),
            Neighborhood::Nearest(k) => (k, None),
            Neighborhood::Hybrid { most, .. } => (most, Some(1.0)),
        };
        let members = &mut self.members[lane];
        members.take(&mut self.walk, offset);
        let radius = members.keep_nearest(most, radius_of_fewer);
        place(&mut self.moments[0], lane, members.moments::<S>(self.set, |_| true));
        radius
    }

    /// Fits and writes the pending queries; says whether the walk has moved for it.
    pub fn fit_pending(&mut self, parts: &mut [ColumnsPart<'_>]) -> bool {
        if self.pending.is_empty() {
            return false;
        }
        let mut fits: Vec<Paraboloids> = Vec::with_capacity(parts.len());
        let mut starts = Vec::with_capacity(parts.len());
        for ball in 0..parts.len() {
            // A smaller ball's normal is near to that of the next larger one.
            starts.push(fits.last().map(Paraboloids::start));
            fits.push(self.fit(fit_paraboloids, ball, starts[ball]));
        }
        let moved = !self.exact() && self.sum_again(&mut fits, &starts);
        if self.options.robust {
            let all = fits.into_iter().map(|fits| self.fit_without_outliers(fits)).collect();
            fits = all;
        }
        for (ball, (fits, part)) in fits.iter().zip(parts).enumerate() {
            let quadrics = self.exact().then(|| self.fit(fit_quadrics, ball, None));
            for (lane, (query, moments)) in self.pending.iter().zip(&self.moments[ball]).enumerate() {
                let quadric = quadrics.as_ref().filter(|quadrics| match self.options.fit {
                    FitKind::Auto => quadrics.preferred.get(lane),
                    _ => quadrics.trusted.get(lane),
                });
                let fit = Fit { paraboloid: fits, quadric, lane };
                part.write(query.entry, moments.sums[0], query.radius, &fit);
            }
        }
        self.pending.clear();
        self.moments.iter_mut().for_each(Vec::clear);
        moved
    }

    /// Takes the sums again in `f64` where those in `f32` do not carry the fits, and fits again; says whether the
    /// walk has moved for it.
    fn sum_again(&mut self, fits: &mut [Paraboloids], starts: &[Option<(Axes, Mask)>]) -> bool {
        let mut moved = false;
        for lane in 0..self.pending.len() {
            let weak = |ball: usize| fits[ball].needs_f64.get(lane);
            if !(0..fits.len()).any(weak) {
                continue;
            }
            let Pending { key, offset, patch, .. } = self.pending[lane];
            match patch {
                Some(patch) => self.moments[0][lane] = self.hierarchical.moments::<f64>(patch, offset),
                None => {
                    self.walk.enter_row(key);
                    self.walk.enter_run(offset, offset);
                    self.around::<f64>(offset, lane, weak);
                }
            }
            moved = true;
        }
        for (ball, fits) in fits.iter_mut().enumerate() {
            if (0..self.pending.len()).any(|lane| fits.needs_f64.get(lane)) {
                // From where it began before, so that the batch's other lanes find what they had.
                *fits = self.fit(fit_paraboloids, ball, starts[ball]);
            }
        }
        moved
    }

    /// Fits again, without the points that are far from the fits, until the choice of points stands.
    fn fit_without_outliers(&mut self, mut fits: Paraboloids) -> Paraboloids {
        for _ in 0..robust::MAX_PASSES {
            let mut changed = false;
            for lane in 0..self.pending.len() {
                let (members, distances) = (&mut self.members[lane], &mut self.distances);
                let moments = without_outliers(members, &fits, lane, self.set, distances);
                if let Some(moments) = moments.filter(|moments| *moments != self.moments[0][lane]) {
                    self.moments[0][lane] = moments;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
            fits = self.fit(fit_paraboloids, 0, None);
        }
        fits
    }

    /// Fits one kind of surface to one of the balls around all pending queries.
    fn fit<T>(&self, fit: fn(InstructionSet, &Task<'_>) -> T, ball: usize, start: Option<(Axes, Mask)>) -> T {
        let moments = &MomentBatch::new(&self.moments[ball]);
        fit(self.set, &Task { moments, axes: self.options.axes, to_sensor: self.to_sensor(), start })
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

/// Puts a lane's moments where they belong, the next place or one that is taken.
fn place(moments: &mut Vec<Moments<f64>>, lane: usize, of_lane: Moments<f64>) {
    if lane == moments.len() {
        moments.push(of_lane);
    } else {
        moments[lane] = of_lane;
    }
}
