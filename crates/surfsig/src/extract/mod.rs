//! From points to curvature: the only loop over points.

mod alike;
mod auto_radius;
mod columns;
mod declaration;
mod explained;
mod extraction;
mod neighborhood;
mod queries;
mod radii;
mod region;
mod robust;
mod shares;
mod whole_cloud;
mod worker;

pub use auto_radius::{FEWEST_AUTO_POINTS, extract_auto_radius};
pub use extraction::{Column, Extraction};
pub use neighborhood::{
    NearestDistances, Neighborhood, different_places, distance_to_nearest, sampled_numbers,
};
pub use queries::{Queries, voxel_representatives};
pub use radii::extract_radii;
pub use whole_cloud::{PartSize, WholeCloud, extract_part};

use crate::cell_index::CellIndex;
use crate::fit::{FitAxes, FitKind};
use crate::hierarchy::DENSE;
use crate::simd::InstructionSet;
use crate::threads::with_threads;
use crate::{Error, Monitor, PointCloud, Radius, Resolution};
use extraction::{Columns, ColumnsPart, Conditions, Entries};
use rayon::prelude::*;
use shares::{Share, shares};
use std::sync::Mutex;
use worker::Worker;

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
    /// Which surface is fitted.
    pub fit: FitKind,
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
    check(cloud, queries, options)?;
    let mut found =
        with_threads(options.threads, || extract_within(cloud, neighborhood, queries, options, monitor))??;
    found.mark_too_coarse(&Resolution::of(cloud), cloud, queries);
    Ok(found)
}

/// The same, on the threads that are there, with options that go together.
pub(crate) fn extract_within(
    cloud: &PointCloud<'_>,
    neighborhood: Neighborhood,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    match neighborhood {
        Neighborhood::Ball(radius) | Neighborhood::Hybrid { radius, .. } => {
            Ok(run(cloud, &Balls::one(radius), neighborhood, queries, options, monitor)?
                .of_balls
                .swap_remove(0))
        }
        Neighborhood::Nearest(k) => {
            let first = NearestDistances::of(cloud, k, monitor)?.first_radius()?;
            Ok(run_nearest(cloud, k, first, queries, options, monitor)?.0)
        }
    }
}

/// What the options and the queries ask for together.
fn check(cloud: &PointCloud<'_>, queries: &Queries<'_>, options: &ExtractOptions<'_>) -> Result<(), Error> {
    if options.fit != FitKind::Paraboloid && options.axes == FitAxes::Sensor {
        return Err(Error::QuadricInSensorAxes);
    }
    queries.check(cloud)?;
    if let Some(directions) = options.directions.map(<[_]>::len).filter(|&n| n != queries.len(cloud)) {
        return Err(Error::DirectionsMismatch { directions, queries: queries.len(cloud) });
    }
    Ok(())
}

/// Balls that grow from a first radius until each holds its k nearest points; and the radius of each query's last.
fn run_nearest(
    cloud: &PointCloud<'_>,
    k: usize,
    first: Radius,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<(Extraction, Vec<f64>), Error> {
    let mut radius = first;
    let mut reach = vec![radius.get(); queries.len(cloud)];
    let nearest = Neighborhood::Nearest(k);
    let Found { mut of_balls, mut left } =
        run(cloud, &Balls::one(radius), nearest, queries, options, monitor)?;
    let mut found = of_balls.swap_remove(0);
    while !left.is_empty() {
        // The count of what is done starts again for those that need more.
        monitor.take_back(left.len());
        radius = Radius::new(2.0 * radius.get())?;
        let more = with_some(queries, options, &left, |queries, options| {
            run(cloud, &Balls::one(radius), nearest, queries, options, monitor)
        })?;
        found.radius = radius.get();
        left.iter().for_each(|&query| reach[query] = radius.get());
        found.take_over(left.iter().copied().zip(0..), &more.of_balls[0]);
        left = more.left.into_iter().map(|i| left[i]).collect();
    }
    Ok((found, reach))
}

/// Does something with some of the queries, and with the options that belong to them.
fn with_some<T>(
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    chosen: &[usize],
    job: impl FnOnce(&Queries<'_>, &ExtractOptions<'_>) -> T,
) -> T {
    let some = queries.some(chosen);
    let directions: Option<Vec<[f32; 3]>> =
        options.directions.map(|all| chosen.iter().map(|&i| all[i]).collect());
    job(&some.queries(), &ExtractOptions { directions: directions.as_deref(), ..options.clone() })
}

/// Some balls around each query.
struct Balls<'a> {
    /// Radius of the largest, and of the lattice.
    largest: Radius,
    /// Radii in units of the largest, it being the first.
    radii: &'a [f64],
}

impl Balls<'_> {
    fn one(radius: Radius) -> Self {
        Self { largest: radius, radii: &[1.0] }
    }
}

/// What one walk over the queries gives.
struct Found {
    /// Of each ball.
    of_balls: Vec<Extraction>,
    /// The queries for which more is to be done, in their order: those in dense places, where several balls are
    /// not walked at once, and those that have fewer than the nearest points that are wanted.
    left: Vec<usize>,
}

fn run(
    cloud: &PointCloud<'_>,
    balls: &Balls<'_>,
    neighborhood: Neighborhood,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Found, Error> {
    let whole = CellIndex::of_positions(cloud.len(), |i| cloud.position(i), balls.largest, monitor)?;
    let elsewhere = queries.index(cloud, balls.largest, monitor)?;
    let asked = elsewhere.as_ref().unwrap_or(&whole);
    // Of equal points no more than are wanted can be among the nearest, and one more says that there are more.
    let thinned = neighborhood.most().and_then(|most| whole.with_copies(most.saturating_add(1)));
    let index = thinned.as_ref().unwrap_or(&whole);
    let own_radii = !matches!(neighborhood, Neighborhood::Ball(_));
    let set = options.instruction_set.unwrap_or_else(InstructionSet::detect);
    let dense = (matches!(neighborhood, Neighborhood::Ball(_)) && !options.robust).then_some(DENSE);
    let mut shares = shares(index, asked, dense);
    let mut left = Vec::new();
    if balls.radii.len() > 1 {
        let dense = shares.extract_if(.., |share| matches!(share, Share::Region { .. }));
        left = dense.flat_map(|share| share.ranks().collect::<Vec<_>>()).collect();
        left.iter_mut().for_each(|rank| *rank = asked.point_of_rank[*rank] as usize);
    }
    let lengths: Vec<usize> = shares.iter().map(Share::len).collect();
    let entries = lengths.iter().sum();
    let conditions = Conditions::new(own_radii, options);
    let mut columns: Vec<Columns> = balls
        .radii
        .iter()
        .map(|radius| Columns::new(entries, radius * balls.largest.get(), conditions))
        .collect();
    let mut parts: Vec<Vec<ColumnsPart<'_>>> = lengths.iter().map(|_| Vec::new()).collect();
    for columns in &mut columns {
        for (parts, part) in parts.iter_mut().zip(columns.parts(lengths.iter().copied())) {
            parts.push(part);
        }
    }
    // One by one, since some are large.
    let short = Mutex::new(Vec::new());
    shares.iter().zip(parts).par_bridge().try_for_each_init(
        || Worker::new(index, asked, neighborhood, balls.radii, options, set),
        |worker, (share, mut parts)| match share {
            Share::Direct(runs) => {
                let found = worker.extract(runs, &mut parts, monitor)?;
                short.lock().expect("no thread panics with the lock").extend(found);
                Ok(())
            }
            Share::Region { corner, cells } => worker.extract_region(*corner, cells, &mut parts, monitor),
        },
    )?;
    // Who watches may have stopped the last part.
    monitor.check()?;
    let oriented = options.viewpoint.is_some() || options.directions.is_some();
    let query_of_entry = shares.iter().flat_map(Share::ranks).map(|rank| asked.point_of_rank[rank]);
    let entries = Entries::new(queries.len(cloud), query_of_entry);
    let finish = |columns: Columns| columns.ordered(&entries, options.axes, oriented);
    let of_balls = columns.into_iter().map(finish).collect();
    left.extend(
        short.into_inner().expect("no thread panics with the lock").into_iter().map(|query| query as usize),
    );
    // Threads end in any order.
    left.sort_unstable();
    Ok(Found { of_balls, left })
}
