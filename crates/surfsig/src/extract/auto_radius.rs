//! For each query the largest ball that one surface still explains.

use super::explained::Shown;
use super::neighborhood::NearestDistances;
use super::radii::run_group;
use super::{ExtractOptions, Extraction, Queries, check, with_some};
use crate::threads::with_threads;
use crate::{Error, Monitor, PointCloud, Radius, Resolution, Status};

/// Fewest points of a ball whose radius is chosen automatically: ten more than a paraboloid has unknowns.
pub const FEWEST_AUTO_POINTS: u32 = 16;

/// Most points of a ball: errors are then small, and a ball that is more would only be slower.
const MOST: u32 = 10_000;

/// Passes from a radius of one unit beyond which no radius is valid.
const LIMIT: f64 = 200.0;

/// Radii that are tried in one pass, of which the next pass repeats the last.
const STEPS: i32 = 5;

/// Passes after which a query is left as it is: radii have then grown ten-thousandfold.
const PASSES: i32 = 7;

/// Passes by which queries in dense places begin below the others, at most.
const PASSES_BELOW: i32 = 8;

/// Curvature from balls whose radius each query chooses: of the radii 2^(i/2), in the cloud's unit, the largest
/// that the fit still explains. [`Extraction::radii`] has it.
///
/// A query begins with the smallest ball that holds 16 points and a surface, and its ball grows as long as the
/// points that come are no farther from the surface than those before. Of these balls it takes the one whose mean
/// curvature errs least: the variance of the fit, and a squared bias that shows where curvature differs from the
/// next smaller ball's by more than three standard errors. Where a larger ball was rejected, it goes back by one
/// step, for a bias shows late. Only points in the balls count; they are at most 10,000. Where no ball holds a
/// surface, a query has what the largest one says.
///
/// The monitor counts each query when its radius is chosen.
///
/// # Errors
/// As [`extract`](super::extract()); [`Error::AutoRadiusInSensorAxes`], for without standard errors nothing can
/// be compared.
///
/// ```
/// use surfsig::{extract_auto_radius, ExtractOptions, Monitor, PointCloud, Queries};
/// // A roof: two planes that meet at x = 0.
/// let points: Vec<[f32; 3]> = (0..6400)
///     .map(|i| ((i % 80) as f32 - 39.5, (i / 80) as f32))
///     .map(|(x, y)| [x, y, -0.5 * x.abs() + 0.01 * ((7.0 * x + 3.0 * y * y).sin())])
///     .collect();
/// let cloud = PointCloud::new(&points);
/// let found = extract_auto_radius(&cloud, &Queries::All, &ExtractOptions::default(), &Monitor::default())?;
/// let radius_at = |x: usize| found.radius_of(40 * 80 + x);
/// assert!(radius_at(20) > 12.0 && radius_at(35) < 8.0);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn extract_auto_radius(
    cloud: &PointCloud<'_>,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<Extraction, Error> {
    check_auto(cloud, queries, options)?;
    with_threads(options.threads, || {
        let nearest = NearestDistances::of(cloud, FEWEST_AUTO_POINTS as usize, monitor)?;
        let (mut best, _) = run_auto(cloud, &nearest, queries, options, monitor)?;
        best.mark_too_coarse(&Resolution::of(cloud), cloud, queries);
        Ok(best)
    })?
}

/// What the options and the queries ask for together.
pub(super) fn check_auto(
    cloud: &PointCloud<'_>,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
) -> Result<(), Error> {
    check(cloud, queries, options)?;
    if options.axes == crate::FitAxes::Sensor {
        return Err(Error::AutoRadiusInSensorAxes);
    }
    Ok(())
}

/// The same, on the threads that are there, where it is known how far neighbours are; and for each query the largest
/// radius that it looked at.
pub(super) fn run_auto(
    cloud: &PointCloud<'_>,
    nearest: &NearestDistances,
    queries: &Queries<'_>,
    options: &ExtractOptions<'_>,
    monitor: &Monitor,
) -> Result<(Extraction, Vec<f64>), Error> {
    let distance = nearest.distances.iter().copied().find(|&d| d > 0.0).unwrap_or(1.0);
    let step = 2.0 * distance.max(1e-9 * nearest.largest.max(1e-6)).log2();
    // Passes are counted from a radius of one unit, so that where the first begins costs time, and changes nothing
    // but how far the last one reaches.
    // Beyond its limits no radius is valid, which the first pass then says.
    let first = (step / f64::from(STEPS - 1)).floor().clamp(-LIMIT, LIMIT) as i32;
    let count = queries.len(cloud);
    let lowest = first - PASSES_BELOW;
    let mut climb = Climb { cloud, queries, options, monitor, lowest, found: None, reach: vec![0.0; count] };
    climb.from(first, (0..count).collect())?;
    let (best, _) = climb.found.expect("the first pass has found something for all");
    Ok((best, climb.reach))
}

/// The radius of a step.
fn radius_of(step: i32) -> Result<Radius, Error> {
    Radius::new(2.0_f64.powf(f64::from(step) / 2.0))
}

/// Queries on their way to larger balls.
struct Climb<'a> {
    cloud: &'a PointCloud<'a>,
    queries: &'a Queries<'a>,
    options: &'a ExtractOptions<'a>,
    monitor: &'a Monitor,
    /// A pass below which nobody begins.
    lowest: i32,
    /// The best balls so far, and for each the next smaller one.
    found: Option<(Extraction, Extraction)>,
    /// The largest radius that each query looked at.
    reach: Vec<f64>,
}

impl Climb<'_> {
    /// Queries that have no ball yet, from the balls of this pass on.
    fn from(&mut self, first: i32, queries: Vec<usize>) -> Result<(), Error> {
        let mut active: Vec<(usize, Growth)> =
            queries.into_iter().map(|query| (query, Growth::default())).collect();
        for pass in first..first + PASSES {
            let numbers: Vec<usize> = active.iter().map(|(query, _)| *query).collect();
            let steps = (0..STEPS).map(|step| pass * (STEPS - 1) + step);
            let radii = steps.map(radius_of).collect::<Result<Vec<Radius>, Error>>()?;
            let balls = self.balls(&radii, &numbers)?;
            // The axes of smaller balls begin with those of the largest.
            let largest = radii[radii.len() - 1].get();
            numbers.iter().for_each(|&query| self.reach[query] = self.reach[query].max(largest));
            let (mut lower, mut ended, mut best) = (Vec::new(), Vec::new(), vec![None; numbers.len()]);
            let mut place = 0..numbers.len();
            active.retain_mut(|(query, growth)| {
                let place = place.next().expect("as many places as queries");
                if pass == first && first > self.lowest && begins(&balls[0], place) {
                    lower.push(*query);
                    return false;
                }
                let goes_on = growth.climb(&balls, place, &mut best[place]);
                if !goes_on || pass + 1 == first + PASSES {
                    ended.push((*query, growth.goes_back()));
                }
                goes_on
            });
            self.take_over(&balls, &numbers, &best);
            self.finish(&ended);
            self.monitor.add(ended.len());
            if !lower.is_empty() {
                self.from(first - 1, lower)?;
            }
            if active.is_empty() {
                break;
            }
        }
        Ok(())
    }

    /// Balls around some of the queries, of these radii, the smallest first.
    fn balls(&self, radii: &[Radius], chosen: &[usize]) -> Result<Vec<Extraction>, Error> {
        let monitor = self.monitor.apart();
        let largest_first: Vec<Radius> = radii.iter().rev().copied().collect();
        let mut balls = if chosen.len() == self.queries.len(self.cloud) {
            run_group(self.cloud, &largest_first, self.queries, self.options, &monitor)?
        } else {
            with_some(self.queries, self.options, chosen, |queries, options| {
                run_group(self.cloud, &largest_first, queries, options, &monitor)
            })?
        };
        balls.reverse();
        Ok(balls)
    }

    /// Takes over those balls that are the best so far of the queries with these numbers.
    fn take_over(&mut self, balls: &[Extraction], numbers: &[usize], best: &[Option<usize>]) {
        let (found, smaller) = self.found.get_or_insert_with(|| {
            let ball = &balls[0];
            let all = Extraction { radii: vec![ball.radius as f32; ball.len()], ..ball.clone() };
            (all.clone(), all)
        });
        for (number, ball) in balls.iter().enumerate() {
            for (column, chosen) in [(&mut *found, Some(number)), (&mut *smaller, Some(number + 1))] {
                let of_ball = |&(place, _): &(usize, &usize)| best[place] == chosen;
                let entries =
                    numbers.iter().enumerate().filter(of_ball).map(|(place, &query)| (query, place));
                column.take_over(entries.clone(), ball);
                entries.for_each(|(query, _)| column.radii[query] = ball.radius as f32);
            }
            found.radius = found.radius.max(ball.radius);
        }
    }

    /// Gives those queries that have ended and go back by a step the smaller ball.
    fn finish(&mut self, ended: &[(usize, bool)]) {
        let Some((found, smaller)) = &mut self.found else { return };
        let back = ended.iter().filter(|(_, back)| *back).map(|&(query, _)| (query, query));
        found.take_over(back, smaller);
    }
}

/// Whether a ball holds enough points, and a surface.
fn begins(ball: &Extraction, place: usize) -> bool {
    ball.count[place] >= FEWEST_AUTO_POINTS && matches!(ball.status[place], Status::Ok | Status::OneSided)
}

/// How a query's ball has grown.
struct Growth {
    begun: bool,
    /// The squared error that is expected of the best ball.
    risk: f64,
    /// The mean square that new points may have.
    noise_square: f64,
    /// The best ball is the very first.
    at_first: bool,
    /// A larger ball than the best was smooth enough, and worse.
    rejected: bool,
}

impl Default for Growth {
    fn default() -> Self {
        let (risk, noise_square) = (f64::INFINITY, f64::INFINITY);
        Self { begun: false, risk, noise_square, at_first: true, rejected: false }
    }
}

impl Growth {
    /// Notes the number of the best ball, if it is one of these, the smallest first; says whether the query may yet
    /// take a larger one.
    fn climb(&mut self, balls: &[Extraction], place: usize, best: &mut Option<usize>) -> bool {
        let mut smaller = self.begun.then(|| Shown::of(&balls[0], place));
        for (number, ball) in balls.iter().enumerate().skip(usize::from(self.begun)) {
            if self.begun && ball.count[place] > MOST {
                return false;
            }
            if !begins(ball, place) {
                if !self.begun {
                    // Until there is a surface, what the largest ball says stands.
                    *best = Some(number);
                }
                continue;
            }
            let shown = Shown::of(ball, place);
            let mut risk = shown.variance_of_mean;
            if let Some(smaller) = &smaller {
                if !shown.is_as_smooth(smaller, self.noise_square) {
                    return false;
                }
                risk += shown.bias_square(smaller);
            }
            let better = risk < self.risk;
            if better {
                *best = Some(number);
                (self.risk, self.at_first) = (risk, !self.begun);
            }
            self.rejected = !better;
            self.begun = true;
            self.noise_square = self.noise_square.min(shown.noise_square_at_most());
            smaller = Some(shown);
        }
        balls[0].status[place] != Status::NotFinite
    }

    /// Whether the best ball's bias may not have shown yet.
    fn goes_back(&self) -> bool {
        self.rejected && !self.at_first
    }
}
