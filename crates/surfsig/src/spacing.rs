//! How far apart the points of a surface are.

use crate::kd_tree::KdTree;
use crate::random::some_of;
use crate::statistics::median;
use rayon::prelude::*;

/// Points that tell the spacing of all.
const MEASURED: usize = 5000;
/// Points that a thread measures at a time.
const PART: usize = 256;

/// Median distance of a finite point to its nearest other one; of many points, by a fixed choice of them. 0 of none.
///
/// ```
/// let points: Vec<[f64; 3]> = (0..100).map(|i| [f64::from(i % 10), f64::from(i / 10), 0.0]).collect();
/// assert_eq!(surfsig::point_spacing(&points), 1.0);
/// ```
pub fn point_spacing(points: &[[f64; 3]]) -> f64 {
    let tree = KdTree::new(points);
    let to_nearest = |number: usize| {
        let is_other = |other: u32| other as usize != number;
        let nearest = tree.nearest_where(points[number], f64::INFINITY, is_other);
        nearest.map_or(0.0, |(_, square)| square.sqrt())
    };
    let asked = some_of(points.len(), MEASURED);
    median(asked.into_par_iter().with_min_len(PART).map(to_nearest).collect()).unwrap_or(0.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_spacing_is_the_median_of_all_distances() {
        let number = |i: usize| (i as f64 * 12.9898).sin() * 43_758.545_3 % 1.0;
        let points: Vec<[f64; 3]> = (0..301).map(|i| [0, 1, 2].map(|k| number(3 * i + k))).collect();
        let to_nearest = |i: usize| {
            let others = (0..points.len())
                .filter(|&k| k != i)
                .map(|k| (0..3).map(|axis| (points[i][axis] - points[k][axis]).powi(2)).sum::<f64>().sqrt());
            others.fold(f64::INFINITY, f64::min)
        };
        let slow = median((0..points.len()).map(to_nearest).collect()).unwrap();
        assert!((point_spacing(&points) - slow).abs() < 1e-12);
        assert_eq!((point_spacing(&[]), point_spacing(&[[1.0; 3]; 9])), (0.0, 0.0));
    }
}
