//! Places that are worth matching: distinctive ones, spread over the scan.

use super::{FieldOptions, FieldPlaces, distinctiveness::distinctiveness, signatures_within};
use crate::kd_tree::KdTree;
use crate::random::some_of;
use crate::statistics::median;
use crate::{Error, Monitor, PointCloud, Queries, Radius, voxel_representatives, with_threads};

/// Of the candidates, the share from which spread keypoints are chosen: the most distinctive.
const DISTINCTIVE_SHARE: usize = 3;

/// Which keypoints are chosen.
///
/// ```
/// let options = surfsig::KeypointOptions { count: 200, ..Default::default() };
/// assert_eq!(options.candidates_per_radius, 8.0);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct KeypointOptions {
    /// How many, at most.
    pub count: usize,
    /// In place of `count`: the smallest distance between two, in the cloud's unit.
    pub spacing: Option<f64>,
    /// Voxels along a patch's radius, of which each gives one candidate.
    pub candidates_per_radius: f64,
    /// Candidates that each is compared with to tell how distinctive it is, at most: all by default. The time grows with
    /// this number times that of all candidates.
    pub compared: usize,
}

impl Default for KeypointOptions {
    fn default() -> Self {
        Self { count: 1000, spacing: None, candidates_per_radius: 8.0, compared: usize::MAX }
    }
}

/// Chooses places that are distinctive, and spread over the scan; the best first.
///
/// A place is the more distinctive, the less its signature is like those of the places most like it, of which all
/// within a radius do not count; patches that the scan's rim cuts off count for less. Of the most distinctive third of
/// the candidates those stay whose distance to the next one that is more distinctive is largest (adaptive non-maximal
/// suppression: Brown, Szeliski, Winder, Multi-image matching using multi-scale oriented patches, 2005). Where a
/// spacing is given, all candidates are taken, the most distinctive first, that are as far from those before.
///
/// # Errors
/// As [`crate::field_signatures`].
///
/// ```
/// use surfsig::{find_keypoints, FieldOptions, KeypointOptions, Monitor, PointCloud, Radius};
/// // Two bumps on a floor are what is distinctive there.
/// let bump = |x: f64, y: f64| 0.15 * (-30.0 * (x * x + 2.0 * y * y)).exp();
/// let points: Vec<[f64; 3]> = (0..160 * 80)
///     .map(|i| (f64::from(i % 160) * 0.025, f64::from(i / 160) * 0.025))
///     .map(|(x, y)| [x, y, bump(x - 1.0, y - 1.0) + bump(y - 1.0, x - 3.0)])
///     .collect();
/// let options = FieldOptions { viewpoint: Some([2.0, 1.0, 5.0]), ..Default::default() };
/// let found = find_keypoints(
///     &PointCloud::new_f64(&points), Radius::new(0.4)?, &KeypointOptions { count: 6, ..Default::default() },
///     &options, &Monitor::default(),
/// )?;
/// assert_eq!(found.len(), 6);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn find_keypoints(
    cloud: &PointCloud<'_>,
    radius: Radius,
    keypoints: &KeypointOptions,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
) -> Result<FieldPlaces, Error> {
    with_threads(options.threads, || keypoints_within(cloud, radius, keypoints, options, monitor))?
}

/// The same, on the threads that are there.
pub(crate) fn keypoints_within(
    cloud: &PointCloud<'_>,
    radius: Radius,
    keypoints: &KeypointOptions,
    options: &FieldOptions<'_>,
    monitor: &Monitor,
) -> Result<FieldPlaces, Error> {
    let size = radius.get();
    let voxel = size / keypoints.candidates_per_radius;
    let voxel = Radius::new(keypoints.spacing.map_or(voxel, |spacing| spacing.min(voxel)))?;
    let candidates = voxel_representatives(cloud, voxel)?;
    let points: Vec<[f64; 3]> = candidates.iter().filter_map(|&i| cloud.position(i as usize)).collect();
    let found = signatures_within(cloud, radius, &Queries::Indices(&candidates), options, monitor)?;
    let found = FieldPlaces::known(size, &candidates, &points, &found);
    let order = most_distinctive_first(&found, keypoints.compared, radius, monitor)?;
    let chosen = match keypoints.spacing {
        Some(spacing) => spaced(&found.points, &order, spacing),
        None => {
            let most = order.len().min(keypoints.count.max(order.len() / DISTINCTIVE_SHARE));
            let mut chosen = spread(&found.points, &order[..most]);
            chosen.truncate(keypoints.count);
            chosen
        }
    };
    Ok(found.take(&chosen))
}

fn most_distinctive_first(
    found: &FieldPlaces,
    compared: usize,
    radius: Radius,
    monitor: &Monitor,
) -> Result<Vec<usize>, Error> {
    let unlike =
        distinctiveness(&found.vectors, &found.points, &some_of(found.len(), compared), radius, monitor)?;
    let full = median(found.count.iter().map(|&count| f64::from(count)).collect()).unwrap_or(1.0);
    let score = |place: usize| f64::from(unlike[place]) * (f64::from(found.count[place]) / full).min(1.0);
    let scores: Vec<f64> = (0..found.len()).map(score).collect();
    let mut order: Vec<usize> = (0..found.len()).collect();
    order.sort_by(|&a, &b| scores[b].total_cmp(&scores[a]));
    Ok(order)
}

/// Places, given the most distinctive first, in the order of their distance to the nearest one before; the first one
/// has none before it, and is the first.
fn spread(points: &[[f64; 3]], order: &[usize]) -> Vec<usize> {
    let chosen: Vec<[f64; 3]> = order.iter().map(|&place| points[place]).collect();
    let tree = KdTree::new(&chosen);
    let to_earlier = |(rank, point): (u32, &[f64; 3])| {
        tree.nearest_where(*point, f64::INFINITY, |other| other < rank).map_or(f64::INFINITY, |found| found.1)
    };
    let distances: Vec<f64> = (0..).zip(&chosen).map(to_earlier).collect();
    let mut ranks: Vec<usize> = (0..order.len()).collect();
    ranks.sort_by(|&a, &b| distances[b].total_cmp(&distances[a]));
    ranks.into_iter().map(|rank| order[rank]).collect()
}

/// Those of places, given the most distinctive first, that are `spacing` from all taken before.
fn spaced(points: &[[f64; 3]], order: &[usize], spacing: f64) -> Vec<usize> {
    let tree = KdTree::new(points);
    let (mut is_free, mut near) = (vec![true; points.len()], Vec::new());
    let mut chosen = Vec::new();
    for &place in order {
        if is_free[place] {
            chosen.push(place);
            tree.within(points[place], spacing, &mut near);
            near.iter().for_each(|&other| is_free[other as usize] = false);
        }
    }
    chosen
}

#[cfg(test)]
mod tests {
    use super::*;

    fn scattered(count: usize) -> Vec<[f64; 3]> {
        (0..count).map(|i| [0, 1, 2].map(|k| ((i * 3 + k) as f64 * 12.9898).sin() * 43.758 % 1.0)).collect()
    }

    fn distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
        (0..3).map(|k| (a[k] - b[k]).powi(2)).sum::<f64>().sqrt()
    }

    #[test]
    fn spread_places_come_in_the_order_of_their_distance_to_those_before() {
        let points = scattered(300);
        let order: Vec<usize> = (0..300).map(|rank| rank * 7 % 300).collect();
        let found = spread(&points, &order);
        let to_earlier = |place: usize| {
            let rank = order.iter().position(|&other| other == place).unwrap();
            order[..rank]
                .iter()
                .map(|&other| distance(&points[place], &points[other]))
                .fold(f64::INFINITY, f64::min)
        };
        assert_eq!(found[0], order[0]);
        assert!(found.windows(2).all(|pair| to_earlier(pair[0]) >= to_earlier(pair[1])));
        let mut sorted = found;
        sorted.sort_unstable();
        assert_eq!(sorted, (0..300).collect::<Vec<_>>());
    }

    #[test]
    fn spaced_places_are_apart_and_leave_no_gap() {
        let points = scattered(300);
        let order: Vec<usize> = (0..300).rev().collect();
        let found = spaced(&points, &order, 0.3);
        for (rank, &place) in found.iter().enumerate() {
            assert!(found[..rank].iter().all(|&other| distance(&points[place], &points[other]) > 0.3));
        }
        let near = |place: usize| found.iter().any(|&other| distance(&points[place], &points[other]) <= 0.3);
        assert!((0..300).all(near));
    }
}
