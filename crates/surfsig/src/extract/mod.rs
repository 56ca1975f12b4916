//! From points to curvature: the only loop over points.

mod extraction;
mod monitor;
mod neighborhood;
mod queries;
mod region;
mod robust;
mod shares;
mod status;

pub use extraction::Extraction;
pub use monitor::Monitor;
pub use neighborhood::Neighborhood;
pub use queries::{Queries, voxel_representatives};
pub use status::Status;

use crate::ball::{DirectWalk, MomentSource};
use crate::cell_index::{CellIndex, Row, RowKey};
use crate::fit::FitAxes;
use crate::fit::paraboloid::{Paraboloids, Task, fit_paraboloids};
use crate::fit::tensor::MomentBatch;
use crate::hierarchy::HierarchicalWalk;
use crate::members::Members;
use crate::moments::{Moments, Scalar};
use crate::simd::InstructionSet;
use crate::simd::lanes::{LANES, Lanes};
use crate::threads::with_threads;
use crate::{Error, PointCloud, Radius};
use extraction::{Columns, ColumnsPart};
use neighborhood::first_radius;
use rayon::prelude::*;
use robust::without_outliers;
use shares::{Share, shares};
use std::ops::Range;

/// Most queries that share their windows.
const RUN: usize = 32;

/// How an extraction is done.
///
/// ```
/// use surfsig::{ExtractOptions, FitAxes};
/// let options = ExtractOptions { viewpoint: Some([0.0, 0.0, 2.0]), threads: Some(2), ..Default::default() };
/// assert_eq!(options.axes, FitAxes::Surface);
/// ```
#[derive(Debug, Clone, Default)]
pub struct ExtractOptions<'a> {
    /// Axes in which the paraboloids are fitted.
    pub axes: FitAxes,
    /// Where the sensor stood, in the cloud's coordinates.
    pub viewpoint: Option<[f64; 3]>,
    /// In place of a viewpoint: for each query a vector to the side from which it was seen, such as a
    /// normal that somebody knows. It chooses the side of the fitted normal and nothing else; where it is
    /// zero or not finite, nobody knows.
    pub directions: Option<&'a [[f32; 3]]>,
    /// Leave out points that are far from the fitted surface, by three standard deviations of the others, and
    /// fit again, until none is left out or comes back. The count is then that of the points that stay.
    pub robust: bool,
    /// Number of threads; all cores where it is `None`. The result is the same, bit for bit.
    pub threads: Option<usize>,
    /// Instructions to use; the best there are where it is `None`. The result is the same, bit for bit.
    pub instruction_set: Option<InstructionSet>,
}

/// Curvature at every point of a cloud, from the points within a radius or another [`Neighborhood`].
///
/// # Errors
/// [`Error::RadiusBelowResolution`] where the radius is too small for the cloud's coordinates;
/// [`Error::TooManyPoints`], [`Error::Threads`].
///
/// ```
/// use surfsig::{extract, ExtractOptions, PointCloud, Radius, Status};
/// let line: Vec<[f32; 3]> = (0..9).map(|i| [i as f32, 0.0, 0.0]).collect();
/// let found = extract(&PointCloud::new(&line), Radius::new(20.0)?, &ExtractOptions::default())?;
/// assert_eq!(found.status[4], Status::Degenerate);
/// assert!(found.k1[4].is_nan() && found.linearity[4] == 1.0);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn extract(
    cloud: &PointCloud<'_>,
    neighborhood: impl Into<Neighborhood>,
    options: &ExtractOptions<'_>,
) -> Result<Extraction, Error> {
    extract_monitored(cloud, neighborhood, &Queries::All, options, &Monitor::default())
}

/// Curvature at chosen places, for a caller who watches.
///
/// # Errors
/// As [`extract`]; [`Error::IndexOutOfRange`] for an index that the cloud does not have;
/// [`Error::Cancelled`] where the monitor asked to stop.
///
/// ```
/// use surfsig::{extract_monitored, ExtractOptions, Monitor, PointCloud, Queries, Radius};
/// let points: Vec<[f32; 3]> = (0..100).map(|i| [(i % 10) as f32, (i / 10) as f32, 0.0]).collect();
/// let places = [[4.5, 4.5, 0.1]];
/// let queries = Queries::Positions(PointCloud::new_f64(&places));
/// let monitor = Monitor::default();
/// let found = extract_monitored(
///     &PointCloud::new(&points), Radius::new(3.0)?, &queries, &ExtractOptions::default(), &monitor,
/// )?;
/// assert!(found.k1[0].abs() < 1e-6 && (found.normals[0][2] - 1.0).abs() < 1e-6);
/// assert_eq!(monitor.done(), 1);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn extract_monitored(
    cloud: &PointCloud<'_>,
    neighborhood: impl Into<Neighborhood>,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    let neighborhood = neighborhood.into();
    neighborhood.check()?;
    queries.check(cloud)?;
    if let Some(directions) = options.directions.map(<[_]>::len).filter(|&n| n != queries.len(cloud)) {
        return Err(Error::DirectionsMismatch { directions, queries: queries.len(cloud) });
    }
    with_threads(options.threads, || match neighborhood {
        Neighborhood::Ball(radius) | Neighborhood::Hybrid { radius, .. } => {
            Ok(run(cloud, radius, neighborhood, queries, options, monitor)?.0)
        }
        Neighborhood::Nearest(k) => run_nearest(cloud, k, queries, options, monitor),
    })?
}

/// Balls that grow until each holds its k nearest points.
fn run_nearest(
    cloud: &PointCloud<'_>,
    k: usize,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    let mut radius = first_radius(cloud, k, monitor)?;
    let (mut found, index) = run(cloud, radius, Neighborhood::Nearest(k), queries, options, monitor)?;
    let mut left = unresolved(&found, k, &index);
    while !left.is_empty() {
        // The count of what is done starts again for those that need more.
        monitor.take_back(left.len());
        radius = Radius::new(2.0 * radius.get())?;
        let some = queries.some(&left);
        let directions: Option<Vec<[f32; 3]>> =
            options.directions.map(|all| left.iter().map(|&i| all[i]).collect());
        let options = ExtractOptions { directions: directions.as_deref(), ..options.clone() };
        let (more, index) = run(cloud, radius, Neighborhood::Nearest(k), &some.queries(), &options, monitor)?;
        found.replace(&left, &more);
        let still = unresolved(&more, k, &index);
        left = still.into_iter().map(|i| left[i]).collect();
    }
    Ok(found)
}

/// The queries that have fewer than k points where there are more.
fn unresolved(found: &Extraction, k: usize, index: &CellIndex) -> Vec<usize> {
    let enough = k.min(index.len());
    let short = |&i: &usize| (found.count[i] as usize) < enough && found.status[i] != Status::NotFinite;
    (0..found.len()).filter(short).collect()
}

fn run(
    cloud: &PointCloud<'_>,
    radius: Radius,
    neighborhood: Neighborhood,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<(Extraction, CellIndex), Error> {
    let index = CellIndex::of_positions(cloud.len(), |i| cloud.position(i), radius, monitor)?;
    let elsewhere = queries.index(cloud, radius, monitor)?;
    let asked = elsewhere.as_ref().unwrap_or(&index);
    let own_radii = !matches!(neighborhood, Neighborhood::Ball(_));
    let mut columns = Columns::new(asked.len(), radius.get(), own_radii, options.axes);
    let set = options.instruction_set.unwrap_or_else(InstructionSet::detect);
    let hierarchy = matches!(neighborhood, Neighborhood::Ball(_)) && !options.robust;
    let shares = shares(&index, asked, hierarchy);
    let parts = columns.parts(shares.iter().map(Share::len));
    // One by one, since some are large.
    shares.iter().zip(parts).par_bridge().try_for_each_init(
        || Worker::new(&index, asked, neighborhood, options, set),
        |worker, (share, mut part)| match share {
            Share::Direct(runs) => worker.extract(runs, &mut part, monitor),
            Share::Region { corner, cells } => worker.extract_region(*corner, cells, &mut part, monitor),
        },
    )?;
    let oriented = options.viewpoint.is_some() || options.directions.is_some();
    let query_of_entry = shares.iter().flat_map(Share::ranks).map(|rank| asked.point_of_rank[rank]);
    let found = columns.finish(queries.len(cloud), query_of_entry, options.axes, oriented);
    Ok((found, index))
}

/// One thread's share of the loop: gathers moments until a batch is full, fits it, writes it.
struct Worker<'a> {
    walk: DirectWalk<'a>,
    hierarchical: HierarchicalWalk<'a>,
    asked: &'a CellIndex,
    neighborhood: Neighborhood,
    options: &'a ExtractOptions<'a>,
    set: InstructionSet,
    pending: Vec<Pending>,
    moments: Vec<Moments<f64>>,
    /// Of each pending query, where its points are looked at more than once.
    members: Vec<Members>,
    distances: Vec<f64>,
}

/// A query whose moments wait for their batch.
#[derive(Clone, Copy)]
struct Pending {
    key: RowKey,
    offset: [f32; 3],
    /// Where the hierarchical walk keeps what the query shares with others.
    patch: Option<usize>,
    /// Where its values belong in the thread's part of the columns.
    entry: usize,
    /// Its number among the queries.
    query: u32,
    /// Radius of its neighbourhood, in units of the lattice's.
    radius: f64,
}

impl<'a> Worker<'a> {
    fn new(
        index: &'a CellIndex,
        asked: &'a CellIndex,
        neighborhood: Neighborhood,
        options: &'a ExtractOptions<'a>,
        set: InstructionSet,
    ) -> Self {
        let (walk, hierarchical) = (DirectWalk::new(index, set), HierarchicalWalk::new(index, set));
        let (pending, moments) = (Vec::with_capacity(LANES), Vec::with_capacity(LANES));
        let members = (0..LANES).map(|_| Members::new()).collect();
        let distances = Vec::new();
        Self { walk, hierarchical, asked, neighborhood, options, set, pending, moments, members, distances }
    }

    /// Fills a part of the columns with the queries of these runs of ranks, one after the other.
    fn extract(
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
            let (moments, radius) = self.around::<f32>(offset, self.pending.len());
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
    fn fit_pending(&mut self, part: &mut ColumnsPart<'_>) -> bool {
        if self.pending.is_empty() {
            return false;
        }
        let mut fits = self.fit();
        let again: Vec<usize> = (0..self.pending.len()).filter(|&lane| fits.needs_f64.get(lane)).collect();
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
            fits = self.fit();
        }
        if self.options.robust {
            fits = self.fit_without_outliers(fits);
        }
        for (lane, (query, moments)) in self.pending.iter().zip(&self.moments).enumerate() {
            part.write(query.entry, moments.sums[0], query.radius, &fits, lane);
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
                let fitted = self.moments[lane].count();
                let (members, distances) = (&mut self.members[lane], &mut self.distances);
                if let Some(moments) = without_outliers(members, &fits, lane, fitted, self.set, distances) {
                    self.moments[lane] = moments;
                    changed = true;
                }
            }
            if !changed {
                break;
            }
            fits = self.fit();
        }
        fits
    }

    fn fit(&self) -> Paraboloids {
        let batch = MomentBatch::new(&self.moments);
        let pending = |lane: usize| self.pending[lane.min(self.pending.len() - 1)];
        let each = |towards: &dyn Fn(Pending, usize) -> f64| {
            [0, 1, 2].map(|axis| Lanes(std::array::from_fn(|lane| towards(pending(lane), axis))))
        };
        let to_sensor = match (self.options.viewpoint, self.options.directions) {
            (Some(viewpoint), _) => Some(each(&|Pending { key, offset, .. }, axis| {
                viewpoint[axis] - self.asked.lattice.middle(key)[axis] - f64::from(offset[axis])
            })),
            (None, Some(directions)) => {
                Some(each(&|Pending { query, .. }, axis| f64::from(directions[query as usize][axis])))
            }
            (None, None) => None,
        };
        fit_paraboloids(self.set, &Task { moments: &batch, axes: self.options.axes, to_sensor })
    }
}
