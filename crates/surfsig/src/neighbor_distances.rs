//! How far points are from their nearest others: what tells outliers.

use crate::kd_tree::KdTree;
use crate::{Error, Monitor, with_threads};
use rayon::prelude::*;

/// Points that a thread takes at a time.
const PART: usize = 1024;

/// Of each point the mean distance to its `count` nearest others, or to all where there are fewer; 0 where there is
/// none. Coordinates must be finite, and within 1e150.
///
/// # Errors
/// [`Error::Threads`], [`Error::Cancelled`]; [`Error::TooManyPoints`] beyond 2^32 - 1 points.
///
/// ```
/// use surfsig::{mean_neighbor_distances, Monitor};
/// let line: Vec<[f64; 3]> = (0..4).map(|i| [f64::from(i), 0.0, 0.0]).collect();
/// let found = mean_neighbor_distances(&line, 2, None, &Monitor::default())?;
/// assert_eq!(found, [1.5, 1.0, 1.0, 1.5]);
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn mean_neighbor_distances(
    points: &[[f64; 3]],
    count: usize,
    threads: Option<usize>,
    monitor: &Monitor,
) -> Result<Vec<f64>, Error> {
    if u32::try_from(points.len()).is_err() {
        return Err(Error::TooManyPoints(points.len()));
    }
    with_threads(threads, || {
        let tree = KdTree::new(points);
        // In the order of the leaves, searches one after the other find their part of the tree in the cache.
        let of_part = |found: &mut Vec<(f64, u32)>, part: &[u32]| {
            monitor.check()?;
            let mut previous = None;
            let mean = |&index: &u32| {
                // The nearest of all is the point itself, or one in the same place.
                tree.nearest_k_after(&mut previous, points[index as usize], count + 1, found);
                let others = found.len().saturating_sub(1).max(1) as f64;
                (index, found.iter().skip(1).map(|(square, _)| square.sqrt()).sum::<f64>() / others)
            };
            let means: Vec<(u32, f64)> = part.iter().map(mean).collect();
            monitor.add(part.len());
            Ok(means)
        };
        let parts: Vec<Vec<(u32, f64)>> =
            tree.indices().par_chunks(PART).map_init(Vec::new, of_part).collect::<Result<_, Error>>()?;
        let mut means = vec![0.0; points.len()];
        for (index, mean) in parts.into_iter().flatten() {
            means[index as usize] = mean;
        }
        Ok(means)
    })?
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_are_those_of_a_search_through_all() {
        let number = |i: usize| (i as f64 * 12.9898).sin() * 5.0;
        let points: Vec<[f64; 3]> = (0..300).map(|i| [0, 1, 2].map(|k| number(3 * (i % 250) + k))).collect();
        let found = mean_neighbor_distances(&points, 7, Some(2), &Monitor::default()).unwrap();
        for (i, mean) in found.iter().enumerate() {
            let distance =
                |j: usize| (0..3).map(|k| (points[i][k] - points[j][k]).powi(2)).sum::<f64>().sqrt();
            let mut distances: Vec<f64> = (0..300).filter(|&j| j != i).map(distance).collect();
            distances.sort_by(f64::total_cmp);
            assert!((mean - distances[..7].iter().sum::<f64>() / 7.0).abs() < 1e-12);
        }
        assert_eq!(mean_neighbor_distances(&points, 7, Some(1), &Monitor::default()).unwrap(), found);
        assert_eq!(mean_neighbor_distances(&[[1.0; 3]], 7, None, &Monitor::default()).unwrap(), [0.0]);
        let stopped = Monitor::default();
        stopped.cancel();
        assert_eq!(mean_neighbor_distances(&points, 7, None, &stopped), Err(Error::Cancelled));
    }
}
