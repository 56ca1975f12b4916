//! Points thinned to one for each voxel.

use rustc_hash::FxHashMap;

/// The voxel of a point; far away the last one there is.
pub(crate) fn voxel_of(point: &[f64; 3], voxel: f64) -> [i64; 3] {
    point.map(|x| (x / voxel).floor() as i64)
}

/// Which points share a voxel: of each point the number of its voxel, in the order in which voxels first occur.
pub(crate) struct Voxels {
    pub numbers: Vec<u32>,
    /// Points in each.
    pub counts: Vec<u32>,
}

impl Voxels {
    /// # Panics
    /// If there are 2^32 points or more.
    pub fn new(points: &[[f64; 3]], voxel: f64) -> Self {
        assert!(u32::try_from(points.len()).is_ok(), "fewer than 2^32 points");
        let mut of_key: FxHashMap<[i64; 3], u32> = FxHashMap::default();
        let mut counts = Vec::new();
        let number = |point: &[f64; 3]| {
            let number = *of_key.entry(voxel_of(point, voxel)).or_insert(counts.len() as u32);
            if number as usize == counts.len() {
                counts.push(0);
            }
            counts[number as usize] += 1;
            number
        };
        let numbers = points.iter().map(number).collect();
        Self { numbers, counts }
    }

    /// The sums of some vectors over the points of each voxel.
    pub fn sums(&self, vectors: impl Iterator<Item = [f64; 3]>) -> Vec<[f64; 3]> {
        let mut sums = vec![[0.0; 3]; self.counts.len()];
        for (&number, vector) in self.numbers.iter().zip(vectors) {
            for (sum, part) in sums[number as usize].iter_mut().zip(vector) {
                *sum += part;
            }
        }
        sums
    }

    /// The means of the points of each voxel.
    pub fn means(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let sums = self.sums(points.iter().copied());
        sums.into_iter().zip(&self.counts).map(|(sum, &count)| sum.map(|x| x / f64::from(count))).collect()
    }
}

/// The mean of the points of each voxel, in the order in which voxels first occur.
///
/// # Panics
/// If there are 2^32 points or more.
///
/// ```
/// let points = [[0.1, 0.0, 0.0], [1.5, 0.0, 0.0], [0.3, 0.0, 0.0]];
/// assert_eq!(surfsig::voxel_means(&points, 1.0), [[0.2, 0.0, 0.0], [1.5, 0.0, 0.0]]);
/// ```
pub fn voxel_means(points: &[[f64; 3]], voxel: f64) -> Vec<[f64; 3]> {
    Voxels::new(points, voxel).means(points)
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
