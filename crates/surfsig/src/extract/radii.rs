//! Balls of several radii around every query, in one pass over the points.

use super::{Balls, ExtractOptions, Extraction, Found, Neighborhood, Queries, check, run, with_some};
use crate::threads::with_threads;
use crate::{Error, Monitor, PointCloud, Radius, Resolution, Status};

/// Balls that are walked together have radii down to this share of the largest: offsets in float32 are then
/// exact enough for all.
const SMALLEST: f64 = 1.0 / 8.0;

/// Curvature from balls of several radii, one extraction for each radius, in their order.
///
/// The points of the largest ball are looked at once, and each is summed once, in the shell between two radii.
/// Only where a ball holds many hundreds of points each radius has a pass of its own, by the hierarchy. A value
/// differs from that of [`extract`](super::extract()) with this radius alone by no more than rounding does:
/// |dk| <= 1e-5 max(|k|, 1/r), and a point whose distance is the radius within rounding may count in one of them
/// only.
///
/// The monitor counts each query once for each radius.
///
/// # Errors
/// As [`extract_monitored`](super::extract_monitored()).
///
/// ```
/// use surfsig::{extract_radii, ExtractOptions, Monitor, PointCloud, Queries, Radius};
/// let points: Vec<[f32; 3]> = (0..400).map(|i| [(i % 20) as f32, (i / 20) as f32, 0.0]).collect();
/// let radii = [Radius::new(2.0)?, Radius::new(3.0)?];
/// let found = extract_radii(
///     &PointCloud::new(&points), &radii, &Queries::All, &ExtractOptions::default(), &Monitor::default(),
/// )?;
/// assert_eq!((found[0].count[210], found[1].count[210]), (13, 29));
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn extract_radii(
    cloud: &PointCloud<'_>,
    radii: &[Radius],
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Vec<Extraction>, Error> {
    check(cloud, queries, options)?;
    let mut order: Vec<usize> = (0..radii.len()).collect();
    order.sort_by(|&a, &b| radii[b].get().total_cmp(&radii[a].get()));
    let mut found: Vec<Option<Extraction>> = radii.iter().map(|_| None).collect();
    with_threads(options.threads, || {
        let together = |a: &usize, b: &usize| radii[*b].get() >= SMALLEST * radii[*a].get();
        let mut rest = &order[..];
        while let Some(largest) = rest.first() {
            let len = rest.partition_point(|other| together(largest, other));
            let (group, later) = rest.split_at(len);
            let group_radii: Vec<Radius> = group.iter().map(|&i| radii[i]).collect();
            for (&i, of_radius) in
                group.iter().zip(run_group(cloud, &group_radii, queries, options, monitor)?)
            {
                found[i] = Some(of_radius);
            }
            rest = later;
        }
        Ok(())
    })??;
    let mut found: Vec<Extraction> = found.into_iter().flatten().collect();
    let resolution = Resolution::of(cloud);
    found.iter_mut().for_each(|of_radius| of_radius.mark_too_coarse(&resolution, cloud, queries));
    Ok(found)
}

/// Balls of radii that can be walked together, the largest first.
pub(super) fn run_group(
    cloud: &PointCloud<'_>,
    radii: &[Radius],
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Vec<Extraction>, Error> {
    let alone = |radius: Radius, queries: &Queries<'_>, options: &ExtractOptions<'_>| {
        let found = run(cloud, &Balls::one(radius), Neighborhood::Ball(radius), queries, options, monitor);
        Ok(found?.of_balls.swap_remove(0))
    };
    if options.robust {
        // What is an outlier is another matter for each ball.
        return radii.iter().map(|&radius| alone(radius, queries, options)).collect();
    }
    let Some(&largest) = radii.first() else { return Ok(Vec::new()) };
    let relative: Vec<f64> = radii.iter().map(|radius| radius.get() / largest.get()).collect();
    let balls = Balls { largest, radii: &relative };
    let Found { mut of_balls, left, .. } =
        run(cloud, &balls, Neighborhood::Ball(largest), queries, options, monitor)?;
    if !left.is_empty() {
        // Where most queries are left, all are asked for: that costs less than an index of some.
        let most = 2 * left.len() > of_balls[0].len();
        // The largest ball alone; the smaller ones may yet be walked together.
        let dense = |queries: &Queries<'_>, options: &ExtractOptions<'_>| {
            let first = alone(largest, queries, options)?;
            let smaller = run_group(cloud, &radii[1..], queries, options, monitor)?;
            Ok::<Vec<Extraction>, Error>(std::iter::once(first).chain(smaller).collect())
        };
        let dense = if most {
            let done = of_balls[0].status.iter().filter(|&&status| status != Status::NotFinite).count();
            monitor.take_back(radii.len() * done);
            dense(queries, options)?
        } else {
            with_some(queries, options, &left, dense)?
        };
        let entries =
            left.iter().enumerate().map(|(place, &query)| (query, if most { query } else { place }));
        for (all, dense) in of_balls.iter_mut().zip(&dense) {
            all.take_over(entries.clone(), dense);
        }
    }
    Ok(of_balls)
}
