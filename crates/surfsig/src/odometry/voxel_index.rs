//! Nearest neighbours among points that are one to a voxel of edge 1, and to which others are added.

use rustc_hash::FxHashMap;

/// Members along the edge of a cube; with 4, they are the bits of one word. Voxels are the members of blocks, and these
/// those of regions: where nothing is near, a search looks at a few regions.
const EDGE: i32 = 4;
/// Distances within which neighbours are looked for, one after the other, until there are enough. Beyond the last one
/// nothing is near.
const REACHES: [f64; 5] = [1.0, 2.0, 4.0, 8.0, 16.0];

/// 4 x 4 x 4 members, of which those that are occupied are marked.
#[derive(Debug, Clone)]
struct Cube {
    occupied: u64,
    /// Numbers of points in a block, and of blocks in a region.
    numbers: [u32; 64],
}

impl Cube {
    const EMPTY: Self = Self { occupied: 0, numbers: [0; 64] };

    /// Enters a member, unless there is one: its number then, and whether it is new.
    fn enter(&mut self, member: [i32; 3], number: u32) -> (u32, bool) {
        let [x, y, z] = member.map(|c| c.rem_euclid(EDGE) as usize);
        let bit = x + 4 * y + 16 * z;
        let is_new = self.occupied >> bit & 1 == 0;
        if is_new {
            self.occupied |= 1 << bit;
            self.numbers[bit] = number;
        }
        (self.numbers[bit], is_new)
    }
}

/// Which voxels have a point.
#[derive(Debug, Clone, Default)]
pub(super) struct VoxelIndex {
    numbers_of_regions: FxHashMap<[i32; 3], u32>,
    regions: Vec<Cube>,
    blocks: Vec<Cube>,
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
        let block = voxel.map(|c| c.div_euclid(EDGE));
        let next = self.regions.len() as u32;
        let region = *self.numbers_of_regions.entry(block.map(|c| c.div_euclid(EDGE))).or_insert(next);
        if region == next {
            self.regions.push(Cube::EMPTY);
        }
        let (block, is_new) = self.regions[region as usize].enter(block, self.blocks.len() as u32);
        if is_new {
            self.blocks.push(Cube::EMPTY);
        }
        self.blocks[block as usize].enter(voxel, number).1
    }

    /// The nearest point within a reach; of equally near ones the first.
    pub fn nearest(&self, points: &[[f64; 3]], at: [f64; 3], reach: f64) -> Nearest {
        /// The two least squared distances, and the number of the nearest point.
        struct Least {
            squared: f64,
            index: u32,
            next: f64,
        }
        let mut found = Nearest { index: u32::MAX, squared: f64::INFINITY, next: f64::INFINITY };
        for step in REACHES {
            let step = step.min(reach);
            let mut least = Least { squared: f64::INFINITY, index: u32::MAX, next: f64::INFINITY };
            // Points beyond the step do not count, and the second least distance is a bound on all others.
            let is_wanted = |least: &Least, squared: f64| squared <= least.next.min(step * step);
            self.walk(at, step, &mut least, is_wanted, |least, number| {
                let squared = squared_distance(&points[number as usize], &at);
                if (squared, number) < (least.squared, least.index) {
                    *least = Least { squared, index: number, next: least.squared };
                } else {
                    least.next = least.next.min(squared);
                }
            });
            // What was not looked at is farther than this step.
            if least.squared <= step * step {
                let next = least.next.sqrt().min(step);
                return Nearest { index: least.index, squared: least.squared, next };
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
            let is_wanted = |_: &Vec<(f64, u32)>, squared: f64| squared <= step * step;
            self.walk(at, *step, found, is_wanted, |found, number| {
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
        self.walk(at, reach, &mut (), |(), _| true, |(), number| show(number));
    }

    /// The same, without the regions and blocks of which the squared distance is not wanted.
    fn walk<T>(
        &self,
        at: [f64; 3],
        reach: f64,
        state: &mut T,
        is_wanted: impl Fn(&T, f64) -> bool,
        mut show: impl FnMut(&mut T, u32),
    ) {
        let low = at.map(|c| (c - reach).floor() as i32);
        let high = at.map(|c| (c + reach).floor() as i32);
        let [first, last] = [low, high].map(|corner| corner.map(|c| c.div_euclid(EDGE)));
        let [start, end] = [first, last].map(|corner| corner.map(|c| c.div_euclid(EDGE)));
        for z in start[2]..=end[2] {
            for y in start[1]..=end[1] {
                for x in start[0]..=end[0] {
                    let Some(&number) = self.numbers_of_regions.get(&[x, y, z]) else { continue };
                    if !is_wanted(state, squared_distance_to_cube(&at, [x, y, z], EDGE * EDGE)) {
                        continue;
                    }
                    let region = &self.regions[number as usize];
                    for bit in bits_of(region.occupied & members_within([x, y, z], first, last)) {
                        let block = member_of([x, y, z], bit);
                        if !is_wanted(state, squared_distance_to_cube(&at, block, EDGE)) {
                            continue;
                        }
                        let Cube { occupied, numbers } = &self.blocks[region.numbers[bit] as usize];
                        for bit in bits_of(occupied & members_within(block, low, high)) {
                            show(state, numbers[bit]);
                        }
                    }
                }
            }
        }
    }
}

/// The numbers of the bits of a word that are set.
fn bits_of(word: u64) -> impl Iterator<Item = usize> {
    let mut left = word;
    std::iter::from_fn(move || {
        let bit = left.trailing_zeros() as usize;
        (left != 0).then(|| {
            left &= left - 1;
            bit
        })
    })
}

/// A member of a cube, by the number of its bit; both are numbered along each axis.
fn member_of(cube: [i32; 3], bit: usize) -> [i32; 3] {
    let within = [bit & 3, bit >> 2 & 3, bit >> 4];
    [0, 1, 2].map(|k| EDGE * cube[k] + within[k] as i32)
}

/// The bits of a cube's members from `low` to `high` along each axis.
fn members_within(cube: [i32; 3], low: [i32; 3], high: [i32; 3]) -> u64 {
    // Of each axis the bits of the members along it, one to each place of the others.
    let along = |axis: usize, width: u32, repeated: u64| {
        let start = EDGE * cube[axis];
        let first = low[axis].saturating_sub(start).clamp(0, EDGE);
        let end = high[axis].saturating_sub(start).clamp(-1, EDGE - 1) + 1;
        if first < end { bits(width * first as u32, width * end as u32) * repeated } else { 0 }
    };
    along(0, 1, 0x1111_1111_1111_1111) & along(1, 4, 0x0001_0001_0001_0001) & along(2, 16, 1)
}

/// The bits from one up to, and without, another.
fn bits(first: u32, end: u32) -> u64 {
    let below = |bit: u32| if bit == 64 { u64::MAX } else { (1 << bit) - 1 };
    below(end) & !below(first)
}

/// Squared distance to a cube of an edge in voxels, numbered along each axis.
fn squared_distance_to_cube(at: &[f64; 3], cube: [i32; 3], edge: i32) -> f64 {
    let edge = f64::from(edge);
    let outside = |k: usize| {
        let start = f64::from(cube[k]) * edge;
        (start - at[k]).max(at[k] - start - edge).max(0.0)
    };
    let [x, y, z] = [0, 1, 2].map(outside);
    x * x + y * y + z * z
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
