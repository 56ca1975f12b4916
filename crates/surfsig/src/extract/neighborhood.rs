//! Which points around a query count.

use crate::{Error, Monitor, PointCloud, Radius};
use rayon::prelude::*;

/// Queries at which the distance to the k-th neighbour is looked up, to choose a first radius.
const SAMPLES: usize = 24;

/// How often as many points again are looked at for places where too many points were in one.
const ROUNDS: usize = 8;

/// The points around a query that a surface is fitted to.
///
/// ```
/// use surfsig::{extract, ExtractOptions, Neighborhood, PointCloud, Radius};
/// let points: Vec<[f32; 3]> = (0..400).map(|i| [(i % 20) as f32, (i / 20) as f32, 0.0]).collect();
/// let cloud = PointCloud::new(&points);
/// let found = extract(&cloud, Neighborhood::Nearest(9), &ExtractOptions::default())?;
/// assert_eq!(found.count[210], 9);
/// assert!((found.radius_of(210) - 2_f64.sqrt()).abs() < 1e-6);
///
/// // A radius is a neighbourhood: the ball.
/// assert_eq!(Neighborhood::from(Radius::new(2.0)?), Neighborhood::Ball(Radius::new(2.0)?));
/// # Ok::<(), surfsig::Error>(())
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Neighborhood {
    /// All points within a radius.
    Ball(Radius),
    /// The k nearest points, the query itself included where it is one of the cloud's. Of points that are
    /// equally far, the first in the order of the lattice.
    Nearest(usize),
    /// The k nearest of the points within a radius.
    Hybrid {
        /// Of the ball.
        radius: Radius,
        /// At most this many points.
        most: usize,
    },
}

impl From<Radius> for Neighborhood {
    fn from(radius: Radius) -> Self {
        Self::Ball(radius)
    }
}

impl Neighborhood {
    pub(super) fn check(&self) -> Result<(), Error> {
        match self {
            Self::Nearest(0) | Self::Hybrid { most: 0, .. } => Err(Error::NoNeighbors),
            _ => Ok(()),
        }
    }

    /// Most points that count, where it is not all of a ball.
    pub(super) fn most(&self) -> Option<usize> {
        match *self {
            Self::Ball(_) => None,
            Self::Nearest(most) | Self::Hybrid { most, .. } => Some(most),
        }
    }
}

/// A radius that holds k points around three quarters of the points, estimated at a few of them; later
/// passes double it for those that need more.
pub(super) fn first_radius(cloud: &PointCloud<'_>, k: usize, monitor: &Monitor) -> Result<Radius, Error> {
    let (distances, largest) = distances_to_nearest(cloud, k, monitor)?;
    let most = distances.get(3 * distances.len() / 4).copied().unwrap_or(1.0);
    let found = distances.into_iter().find(|&d| d >= most && d > 0.0).unwrap_or(1.0);
    // Not below what float64 can number at these coordinates.
    Radius::new((1.05 * found).max(1e-12 * largest.max(1e-6)).min(1e17))
}

/// Distances to the k-th nearest point, the smallest first, at a few places; and the largest coordinate. Where k
/// points are in one place, the distance to the nearest other place.
pub(super) fn distances_to_nearest(
    cloud: &PointCloud<'_>,
    k: usize,
    monitor: &Monitor,
) -> Result<(Vec<f64>, f64), Error> {
    let positions: Vec<[f64; 3]> = (0..cloud.len()).filter_map(|i| cloud.position(i)).collect();
    let largest = positions.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
    let mut distances = different_places(&positions)
        .par_iter()
        .map(|centre| {
            monitor.check()?;
            let square = |p: &[f64; 3]| (0..3).map(|a| (p[a] - centre[a]).powi(2)).sum::<f64>();
            let mut squares: Vec<f64> = positions.iter().map(square).collect();
            let nth = k.min(squares.len()) - 1;
            let (_, &mut square, farther) = squares.select_nth_unstable_by(nth, f64::total_cmp);
            let positive = |&square: &f64| square > 0.0;
            let nearest = || farther.iter().copied().filter(positive).min_by(f64::total_cmp);
            Ok(Some(square).filter(positive).or_else(nearest).unwrap_or(0.0).sqrt())
        })
        .collect::<Result<Vec<f64>, Error>>()?;
    distances.sort_unstable_by(f64::total_cmp);
    Ok((distances, largest))
}

/// A few places, spread over the order of the points. Many points may be in one, as missing returns are at
/// (0, 0, 0): it counts once.
fn different_places(positions: &[[f64; 3]]) -> Vec<[f64; 3]> {
    let mut places: Vec<[f64; 3]> = Vec::with_capacity(SAMPLES);
    let mut step = positions.len().div_ceil(SAMPLES).max(1);
    let mut offset = 0;
    for _ in 0..ROUNDS {
        for place in positions.iter().skip(offset).step_by(step) {
            if places.len() < SAMPLES && !places.contains(place) {
                places.push(*place);
            }
        }
        if places.len() == SAMPLES || step == 1 {
            break;
        }
        // Half way between those that were looked at.
        (step, offset) = (step.div_ceil(2), step.div_ceil(2) / 2);
    }
    places
}
