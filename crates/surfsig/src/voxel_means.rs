//! One point for each voxel: the mean of those in it.

use rustc_hash::FxHashMap;

/// Voxels from 0 to a point along an axis, at most: beyond, float64 cannot tell them apart.
const MOST_VOXELS: f64 = (1_u64 << 43) as f64;

/// The mean of the points of each voxel, in the order of the voxels' first points.
///
/// The lattice is anchored at 0. Points that are not finite, or too far away to be in one voxel, are left out.
pub(crate) fn voxel_means(points: &[[f64; 3]], edge: f64) -> Vec<[f64; 3]> {
    let mut numbers: FxHashMap<[i64; 3], u32> = FxHashMap::default();
    numbers.reserve(points.len() / 2);
    // Sums are taken from the voxel's first point, where they lose nothing at large coordinates.
    let mut sums: Vec<([f64; 3], [f64; 3], f64)> = Vec::new();
    let per_edge = 1.0 / edge;
    for point in points {
        let steps = point.map(|c| (c * per_edge).floor());
        if !steps.iter().all(|step| step.abs() < MOST_VOXELS) {
            continue;
        }
        let number = *numbers.entry(steps.map(|step| step as i64)).or_insert(sums.len() as u32);
        if number as usize == sums.len() {
            sums.push((*point, [0.0; 3], 1.0));
        } else {
            let (first, sum, count) = &mut sums[number as usize];
            for k in 0..3 {
                sum[k] += point[k] - first[k];
            }
            *count += 1.0;
        }
    }
    let mean = |(first, sum, count): ([f64; 3], [f64; 3], f64)| [0, 1, 2].map(|k| first[k] + sum[k] / count);
    sums.into_iter().map(mean).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;
    use std::collections::BTreeMap;

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(3), ..Default::default() })]

        #[test]
        fn each_voxel_has_the_mean_of_its_points(
            points in prop::collection::vec(prop::array::uniform3(-3.0_f64..3.0), 0..200),
        ) {
            let mut voxels: BTreeMap<[i64; 3], Vec<[f64; 3]>> = BTreeMap::new();
            for point in &points {
                voxels.entry(point.map(|c| (c / 0.5).floor() as i64)).or_default().push(*point);
            }
            let found = voxel_means(&points, 0.5);
            prop_assert_eq!(found.len(), voxels.len());
            let mut first = Vec::new();
            for mean in found {
                let members = &voxels[&mean.map(|c| (c / 0.5).floor() as i64)];
                for k in 0..3 {
                    let expected = members.iter().map(|point| point[k]).sum::<f64>() / members.len() as f64;
                    prop_assert!((mean[k] - expected).abs() < 1e-14);
                }
                first.push(points.iter().position(|point| *point == members[0]));
            }
            prop_assert!(first.is_sorted());
        }
    }

    #[test]
    fn points_that_are_in_no_voxel_are_left_out() {
        let points = [[f64::NAN, 0.0, 0.0], [1e300, 0.0, 0.0], [0.25, 0.0, 0.0], [f64::INFINITY; 3]];
        assert_eq!(voxel_means(&points, 1.0), [[0.25, 0.0, 0.0]]);
    }
}
