//! The hierarchy against the walk over the points themselves.

use super::{CELLS_PER_REGION, HierarchicalWalk};
use crate::ball::DirectWalk;
use crate::cell_index::CellIndex;
use crate::lattice::{CELLS_PER_ROW, RowKey};
use crate::moments::Moments;
use crate::simd::InstructionSet;
use crate::{PointCloud, Radius};
use proptest::prelude::*;

/// A reproducible value in [0, 1).
fn random(i: usize, column: u64) -> f64 {
    let mut x = (i as u64).wrapping_mul(0x9e37_79b9_7f4a_7c15) ^ column.wrapping_mul(0xd1b5_4a32_d192_ed03);
    for shift in [30, 27, 31] {
        x = (x ^ (x >> shift)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
    }
    (x >> 11) as f64 / (1_u64 << 53) as f64
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    Surface,
    Volume,
    Clusters,
    Copies,
    Grid,
}

/// Points in and around the unit cube.
fn points(shape: Shape, count: usize, seed: u64) -> Vec<[f64; 3]> {
    let side = (count as f64).sqrt().ceil();
    let value = |i, column| random(i, 7 * seed + column);
    let point = |i: usize| {
        let [x, y, z] = [value(i, 1), value(i, 2), value(i, 3)];
        match shape {
            Shape::Surface => [x, y, 0.3 * (4.0 * x).sin() * (3.0 * y).cos() + 0.01 * z],
            Shape::Volume => [x, y, z],
            Shape::Clusters => {
                let cluster = i % 9;
                [0, 1, 2].map(|axis| value(cluster, 4 + axis) + 0.02 * [x, y, z][axis as usize])
            }
            Shape::Copies => [0, 1, 2].map(|axis| value(i % 40, 4 + axis)),
            // Multiples of a 20th of the radius used with it: many lie exactly on the sphere.
            Shape::Grid => [(i as f64 % side) * 0.01, (i as f64 / side).floor() * 0.01, 0.0],
        }
    };
    (0..count).map(point).collect()
}

/// Shows every query with its patch: its number, its row and its offset from the row's middle.
fn each_query(
    index: &CellIndex,
    queries: &PointCloud<'_>,
    mut show: impl FnMut(&mut HierarchicalWalk<'_>, usize, usize, RowKey, [f32; 3]),
) {
    let asked = CellIndex::new(queries, Radius::new(index.lattice.radius).unwrap()).unwrap();
    let mut walk = HierarchicalWalk::new(index, InstructionSet::detect());
    let offset = |rank: usize| [asked.x[rank], asked.y[rank], asked.z[rank]];
    let mut seen = 0;
    for row in &asked.rows {
        let mut start = row.start;
        while start < row.end {
            let cell = index.lattice.cell(asked.x[start]);
            let end = start + asked.x[start..row.end].partition_point(|&x| index.lattice.cell(x) == cell);
            let RowKey { z, y, x } = row.key;
            let place = [x * CELLS_PER_ROW + i64::from(cell), y, z];
            walk.enter_region(place.map(|c| c.div_euclid(CELLS_PER_REGION) * CELLS_PER_REGION));
            walk.enter_cell(row.key, cell, (start..end).map(offset));
            while let Some((patch, range)) = walk.next_patch() {
                for query in range {
                    seen += 1;
                    let rank = start + walk.number(query);
                    show(&mut walk, patch, asked.point_of_rank[rank] as usize, row.key, offset(rank));
                }
            }
            start = end;
        }
    }
    assert_eq!(seen, asked.len());
}

/// Compares the sums around every `stride`-th query with those of the direct walk.
fn compare(cloud: &PointCloud<'_>, queries: &PointCloud<'_>, radius: f64, stride: usize) {
    let index = CellIndex::new(cloud, Radius::new(radius).unwrap()).unwrap();
    let mut direct = DirectWalk::new(&index, InstructionSet::detect());
    each_query(&index, queries, |walk, patch, query, key, offset| {
        if query % stride == 0 {
            direct.enter_row(key);
            direct.enter_run(offset, offset);
            let expected = direct.moments::<f64>(offset);
            assert_close(&walk.moments::<f64>(patch, offset), &expected);
            assert_close(&walk.moments::<f32>(patch, offset), &expected);
        }
    });
}

/// The same number of points, and sums that differ, on average over the points, by no more than what rounding
/// the way from one row's middle to another to float32 does: 5e-7, to the fourth power.
fn assert_close(found: &Moments<f64>, expected: &Moments<f64>) {
    assert_eq!(found.count(), expected.count());
    for (a, b) in found.sums.iter().zip(expected.sums) {
        assert!((a - b).abs() <= 2e-6 * expected.count(), "{a} {b} of {}", expected.count());
    }
}

proptest! {
    #![proptest_config(ProptestConfig { cases: 40, rng_seed: prop::test_runner::RngSeed::Fixed(11), ..Default::default() })]

    #[test]
    fn balls_have_the_same_points_and_sums_as_by_the_direct_walk(
        shape in prop::sample::select(vec![Shape::Surface, Shape::Volume, Shape::Clusters, Shape::Copies, Shape::Grid]),
        count in 600_usize..9000,
        radius in 0.15_f64..0.7,
        seed in 0_u64..1000,
        far in prop::bool::ANY,
    ) {
        let origin = if far { [500_000.0, 4_500_000.0, 100.0] } else { [0.0; 3] };
        let points = points(shape, count, seed);
        let radius = if shape == Shape::Grid { 0.2 } else { radius };
        let cloud = PointCloud::new_f64(&points).with_origin(origin);
        compare(&cloud, &cloud, radius, 1 + count / 60);
    }

    #[test]
    fn so_have_balls_around_places_where_there_are_no_points(
        count in 600_usize..6000, radius in 0.15_f64..0.7, seed in 0_u64..1000,
    ) {
        let surface = points(Shape::Surface, count, seed);
        let places = points(Shape::Volume, 200, seed + 1);
        compare(&PointCloud::new_f64(&surface), &PointCloud::new_f64(&places), radius, 3);
    }
}

#[test]
fn thirty_thousand_neighbours_are_the_same_and_none_is_missed() {
    for (shape, radius) in [(Shape::Surface, 0.6), (Shape::Volume, 0.6)] {
        let points = points(shape, 40_000, 3);
        let cloud = PointCloud::new_f64(&points);
        compare(&cloud, &cloud, radius, 400);
    }
}

#[test]
fn sums_have_the_same_bits_in_a_tile_with_a_margin_of_one_radius_and_among_fewer_queries() {
    let (points, radius) = (points(Shape::Surface, 60_000, 5), 0.2);
    for origin in [[0.0; 3], [500_000.0, 4_500_000.0, 100.0]] {
        let within = |p: &[f64; 3], margin: f64| {
            (0..2).all(|axis| p[axis] >= 0.43 - margin && p[axis] <= 0.57 + margin)
        };
        let inner: Vec<[f64; 3]> = points.iter().filter(|p| within(p, 0.0)).step_by(3).copied().collect();
        let tile: Vec<[f64; 3]> = points.iter().filter(|p| within(p, 1.0005 * radius)).copied().collect();
        let sums = |cloud: &[[f64; 3]], queries: &[[f64; 3]]| {
            let cloud = PointCloud::new_f64(cloud).with_origin(origin);
            let index = CellIndex::new(&cloud, Radius::new(radius).unwrap()).unwrap();
            let mut sums = vec![[0; 35]; queries.len()];
            let queries = PointCloud::new_f64(queries).with_origin(origin);
            each_query(&index, &queries, |walk, patch, query, _, offset| {
                sums[query] = walk.moments::<f64>(patch, offset).sums.map(f64::to_bits);
            });
            sums
        };
        let whole = sums(&points, &inner);
        assert!(whole == sums(&tile, &inner));
        let some: Vec<[f64; 3]> = inner.iter().step_by(7).copied().collect();
        assert!(sums(&points, &some).iter().eq(whole.iter().step_by(7)));
    }
}
