//! Nearest neighbours among points that are one to a voxel of edge 1, and to which others are added.

use rustc_hash::FxHashMap;

/// Voxels along the edge of a block; with 4, a block's voxels are the bits of one word.
const EDGE: i32 = 4;
/// Distances within which neighbours are looked for, one after the other, until there are enough. Beyond the last one
/// nothing is near.
const REACHES: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// 64 voxels, of which those with a point are marked.
#[derive(Debug, Clone)]
struct Block {
    occupied: u64,
    points: [u32; 64],
}

/// Which voxels have a point.
#[derive(Debug, Clone, Default)]
pub(super) struct VoxelIndex {
    blocks: FxHashMap<[i32; 3], u32>,
    stored: Vec<Block>,
}

/// The nearest point, and how far the next one is.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Nearest {
    /// Number of the point; `u32::MAX` where none is within the reach.
    pub index: u32,
    /// Squared distance to it; infinite where there is none.
    pub squared: f64,
    /// All other points are at least so far.
    pub next: f64,
}

impl Nearest {
    /// Whether there is one.
    pub fn is_some(&self) -> bool {
        self.index != u32::MAX
    }
}

impl VoxelIndex {
    /// Enters a point under a number; `false` where its voxel has one.
    pub fn insert(&mut self, point: [f64; 3], number: u32) -> bool {
        let voxel = point.map(|c| c.floor() as i32);
        let next = self.stored.len() as u32;
        let block = *self.blocks.entry(voxel.map(|c| c.div_euclid(EDGE))).or_insert(next);
        if block == next {
            self.stored.push(Block { occupied: 0, points: [0; 64] });
        }
        let [x, y, z] = voxel.map(|c| c.rem_euclid(EDGE) as usize);
        let bit = x + 4 * y + 16 * z;
        let block = &mut self.stored[block as usize];
        let is_new = block.occupied >> bit & 1 == 0;
        if is_new {
            block.occupied |= 1 << bit;
            block.points[bit] = number;
        }
        is_new
    }

    /// The nearest point within a reach; of equally near ones the first.
    pub fn nearest(&self, points: &[[f64; 3]], at: [f64; 3], reach: f64) -> Nearest {
        let mut found = Nearest { index: u32::MAX, squared: f64::INFINITY, next: f64::INFINITY };
        for step in REACHES {
            let step = step.min(reach);
            let (mut best, mut next) = ((f64::INFINITY, u32::MAX), f64::INFINITY);
            self.visit(at, step, |number| {
                let squared = squared_distance(&points[number as usize], &at);
                if (squared, number) < best {
                    (best, next) = ((squared, number), best.0);
                } else {
                    next = next.min(squared);
                }
            });
            // What was not looked at is farther than this step.
            if best.0 <= step * step {
                return Nearest { index: best.1, squared: best.0, next: next.sqrt().min(step) };
            }
            found.next = step;
            if step == reach {
                break;
            }
        }
        found
    }

    /// Squared distances and numbers of the `count` nearest points, or of all within the largest reach where there are
    /// fewer, in ascending order. `found` is overwritten.
    pub fn nearest_k(&self, points: &[[f64; 3]], at: [f64; 3], count: usize, found: &mut Vec<(f64, u32)>) {
        for step in &REACHES[1..] {
            found.clear();
            self.visit(at, *step, |number| {
                let squared = squared_distance(&points[number as usize], &at);
                if squared <= step * step {
                    found.push((squared, number));
                }
            });
            if found.len() >= count {
                break;
            }
        }
        let order = |a: &(f64, u32), b: &(f64, u32)| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1));
        if found.len() > count {
            found.select_nth_unstable_by(count, order);
            found.truncate(count);
        }
        found.sort_unstable_by(order);
    }

    /// Shows the numbers of all points in voxels that a cube about a point meets.
    pub fn visit(&self, at: [f64; 3], reach: f64, mut show: impl FnMut(u32)) {
        let low = at.map(|c| (c - reach).floor() as i32);
        let high = at.map(|c| (c + reach).floor() as i32);
        let [first, last] = [low, high].map(|corner| corner.map(|c| c.div_euclid(EDGE)));
        for z in first[2]..=last[2] {
            let along_z = voxels_along(z, low[2], high[2]).map_or(0, |(a, b)| bits(16 * a, 16 * (b + 1)));
            for y in first[1]..=last[1] {
                let along_y = voxels_along(y, low[1], high[1])
                    .map_or(0, |(a, b)| bits(4 * a, 4 * (b + 1)) * 0x0001_0001_0001_0001);
                for x in first[0]..=last[0] {
                    let Some(&block) = self.blocks.get(&[x, y, z]) else { continue };
                    let along_x = voxels_along(x, low[0], high[0])
                        .map_or(0, |(a, b)| bits(a, b + 1) * 0x1111_1111_1111_1111);
                    let block = &self.stored[block as usize];
                    let mut left = block.occupied & along_x & along_y & along_z;
                    while left != 0 {
                        show(block.points[left.trailing_zeros() as usize]);
                        left &= left - 1;
                    }
                }
            }
        }
    }
}

/// The first and the last voxel of a block along an axis that are from `low` to `high`.
fn voxels_along(block: i32, low: i32, high: i32) -> Option<(u32, u32)> {
    let start = block.checked_mul(EDGE)?;
    let first = low.saturating_sub(start).max(0);
    let last = high.saturating_sub(start).min(EDGE - 1);
    (first <= last).then_some((first as u32, last as u32))
}

/// The bits from one up to, and without, another.
fn bits(first: u32, end: u32) -> u64 {
    let below = |bit: u32| if bit == 64 { u64::MAX } else { (1 << bit) - 1 };
    below(end) & !below(first)
}

pub(super) fn squared_distance(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let [x, y, z] = [0, 1, 2].map(|k| a[k] - b[k]);
    x * x + y * y + z * z
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn index_of(points: Vec<[f64; 3]>) -> (VoxelIndex, Vec<[f64; 3]>) {
        let (mut index, mut kept) = (VoxelIndex::default(), Vec::new());
        for point in points {
            if index.insert(point, kept.len() as u32) {
                kept.push(point);
            }
        }
        (index, kept)
    }

    fn by_brute_force(points: &[[f64; 3]], at: [f64; 3]) -> Vec<(f64, u32)> {
        let mut all: Vec<(f64, u32)> =
            points.iter().map(|point| squared_distance(point, &at)).zip(0..).collect();
        all.sort_by(|a, b| a.0.total_cmp(&b.0).then(a.1.cmp(&b.1)));
        all
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(7), ..Default::default() })]

        #[test]
        fn neighbours_are_those_of_a_search_through_all(
            points in prop::collection::vec(prop::array::uniform3(-7.0_f64..9.0), 0..300),
            at in prop::array::uniform3(-12.0_f64..12.0),
            reach in 0.3_f64..6.0,
        ) {
            let (index, points) = index_of(points);
            let expected = by_brute_force(&points, at);
            let found = index.nearest(&points, at, reach);
            let near = expected.first().filter(|(squared, _)| *squared <= reach * reach);
            prop_assert_eq!(near.copied(), found.is_some().then_some((found.squared, found.index)));
            // The bound on all the others holds.
            let others = expected.iter().find(|(_, number)| *number != found.index);
            prop_assert!(others.is_none_or(|(squared, _)| squared.sqrt() >= found.next));
            let mut nearest = Vec::new();
            for count in [1, 20, 400] {
                index.nearest_k(&points, at, count, &mut nearest);
                let within = expected.iter().filter(|(squared, _)| *squared <= 256.0).count();
                prop_assert_eq!(&nearest, &expected[..count.min(within)]);
            }
        }
    }

    #[test]
    fn points_beyond_all_voxels_are_no_error() {
        let far = [[1e300, -1e300, 0.0], [3e9, 0.0, 0.0], [-3e9, 0.0, f64::INFINITY]];
        let (index, points) = index_of(far.to_vec());
        assert_eq!(points.len(), 3);
        assert!(
            index.nearest(&points, [0.0; 3], 16.0)
                == Nearest { index: u32::MAX, squared: f64::INFINITY, next: 16.0 }
        );
        let mut found = Vec::new();
        for at in far {
            index.nearest_k(&points, at, 5, &mut found);
        }
    }
}
