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

/// Distances to the k-th nearest point at a few places of a cloud, by which a search for neighbours begins.
#[derive(Debug, Clone, PartialEq)]
pub struct NearestDistances {
    /// In the cloud's own unit, the smallest first.
    pub distances: Vec<f64>,
    /// The largest coordinate, without its sign.
    pub largest: f64,
}

impl NearestDistances {
    /// At a few places of this cloud.
    pub(super) fn of(cloud: &PointCloud<'_>, k: usize, monitor: &Monitor) -> Result<Self, Error> {
        let positions: Vec<[f64; 3]> = (0..cloud.len()).filter_map(|i| cloud.position(i)).collect();
        let largest = positions.iter().flatten().fold(0.0_f64, |m, c| m.max(c.abs()));
        let candidates = sampled_numbers(positions.len()).into_iter().map(|i| positions[i]);
        let mut distances = different_places(candidates)
            .par_iter()
            .map(|&place| monitor.check().map(|()| distance_to_nearest(&positions, place, k)))
            .collect::<Result<Vec<f64>, Error>>()?;
        distances.sort_unstable_by(f64::total_cmp);
        Ok(Self { distances, largest })
    }

    /// A radius that holds k points around three quarters of the points; later passes double it for those that
    /// need more.
    pub(super) fn first_radius(&self) -> Result<Radius, Error> {
        let distances = &self.distances;
        let most = distances.get(3 * distances.len() / 4).copied().unwrap_or(1.0);
        let found = distances.iter().copied().find(|&d| d >= most && d > 0.0).unwrap_or(1.0);
        // Not below what float64 can number at these coordinates.
        Radius::new((1.05 * found).max(1e-12 * self.largest.max(1e-6)).min(1e17))
    }
}

/// Distance from a place to the k-th nearest of some positions, the place's own included. Where k of them are in one
/// place, the distance to the nearest other place; 0 where there is none.
///
/// ```
/// let positions = [[0.0; 3], [1.0, 0.0, 0.0], [0.0, 3.0, 0.0]];
/// assert_eq!(surfsig::distance_to_nearest(&positions, [0.0; 3], 3), 3.0);
/// ```
pub fn distance_to_nearest(positions: &[[f64; 3]], place: [f64; 3], k: usize) -> f64 {
    let square = |p: &[f64; 3]| (0..3).map(|a| (p[a] - place[a]).powi(2)).sum::<f64>();
    let mut squares: Vec<f64> = positions.iter().map(square).collect();
    let Some(nth) = k.min(squares.len()).checked_sub(1) else { return 0.0 };
    let (_, &mut square, farther) = squares.select_nth_unstable_by(nth, f64::total_cmp);
    let positive = |&square: &f64| square > 0.0;
    let nearest = || farther.iter().copied().filter(positive).min_by(f64::total_cmp);
    Some(square).filter(positive).or_else(nearest).unwrap_or(0.0).sqrt()
}

/// Numbers of the points, among those that are finite, at which it is looked how far neighbours are; in the order in
/// which [`different_places`] looks at them.
///
/// ```
/// assert_eq!(surfsig::sampled_numbers(3), [0, 1, 2]);
/// ```
pub fn sampled_numbers(count: usize) -> Vec<usize> {
    let mut numbers = Vec::new();
    let mut step = count.div_ceil(SAMPLES).max(1);
    let mut offset = 0;
    for _ in 0..ROUNDS {
        numbers.extend((offset..count).step_by(step));
        if step == 1 {
            break;
        }
        // Half way between those that were looked at.
        (step, offset) = (step.div_ceil(2), step.div_ceil(2) / 2);
    }
    numbers
}

/// A few different places of those that are looked at. Many points may be in one, as missing returns are at
/// (0, 0, 0): it counts once.
///
/// ```
/// assert_eq!(surfsig::different_places([[1.0; 3], [1.0; 3], [2.0; 3]]), [[1.0; 3], [2.0; 3]]);
/// ```
pub fn different_places(candidates: impl IntoIterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
    let mut places: Vec<[f64; 3]> = Vec::with_capacity(SAMPLES);
    for place in candidates {
        if places.len() == SAMPLES {
            break;
        }
        if !places.contains(&place) {
            places.push(place);
        }
    }
    places
}
