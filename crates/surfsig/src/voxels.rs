//! Points thinned to one for each voxel.

use rustc_hash::FxHashMap;

/// The voxel of a point; far away the last one there is.
pub(crate) fn voxel_of(point: &[f64; 3], voxel: f64) -> [i64; 3] {
    point.map(|x| (x / voxel).floor() as i64)
}

/// The mean of the points of each voxel, in the order in which voxels first occur.
///
/// ```
/// let points = [[0.1, 0.0, 0.0], [1.5, 0.0, 0.0], [0.3, 0.0, 0.0]];
/// assert_eq!(surfsig::voxel_means(&points, 1.0), [[0.2, 0.0, 0.0], [1.5, 0.0, 0.0]]);
/// ```
pub fn voxel_means(points: &[[f64; 3]], voxel: f64) -> Vec<[f64; 3]> {
    let mut numbers: FxHashMap<[i64; 3], usize> = FxHashMap::default();
    let mut sums: Vec<([f64; 3], f64)> = Vec::new();
    for point in points {
        let number = *numbers.entry(voxel_of(point, voxel)).or_insert(sums.len());
        if number == sums.len() {
            sums.push(([0.0; 3], 0.0));
        }
        let (sum, count) = &mut sums[number];
        for k in 0..3 {
            sum[k] += point[k];
        }
        *count += 1.0;
    }
    sums.into_iter().map(|(sum, count)| sum.map(|x| x / count)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn means_lie_in_their_voxels_and_weigh_all_points() {
        let number = |i: usize| (i as f64 * 12.9898).sin() * 5.0;
        let points: Vec<[f64; 3]> = (0..500).map(|i| [0, 1, 2].map(|k| number(3 * i + k))).collect();
        let means = voxel_means(&points, 2.0);
        let mut seen = std::collections::HashMap::<[i64; 3], Vec<[f64; 3]>>::new();
        for point in &points {
            seen.entry(point.map(|x| (x / 2.0).floor() as i64)).or_default().push(*point);
        }
        assert_eq!(means.len(), seen.len());
        for mean in &means {
            let inside = &seen[&voxel_of(mean, 2.0)];
            for k in 0..3 {
                let expected = inside.iter().map(|point| point[k]).sum::<f64>() / inside.len() as f64;
                assert!((mean[k] - expected).abs() < 1e-12);
            }
        }
    }
}
