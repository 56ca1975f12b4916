//! The sensor's surroundings, as earlier scans have seen them; lengths are in voxels.

use super::correspondences::LookedUp;
use super::settings::MapSettings;
use super::voxel_index::{Nearest, VoxelIndex, squared_distance};
use crate::RigidTransform;
use crate::alignment::{GicpTarget, plane_of};
use crate::visibility::{SphericalRangeImage, Visibility};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::collections::BTreeMap;
use std::sync::OnceLock;

/// Distance up to which a point's neighbourhood counts as dense: those that change one are then found in the blocks
/// next to them.
const DENSE: f64 = 4.0;
/// Edge of the cells that sparse points are sorted into: as far as any neighbourhood reaches.
const CELL: f64 = 16.0;
/// Points that one thread takes at a time.
const PART: usize = 1024;
/// Thickness of half of a neighbourhood above which its points may lie on one line, which has no normal.
const MAX_HALF_THICKNESS: f64 = 0.7;

/// One point for each voxel, the first that was seen, with the normal of the surface there.
///
/// A mean over scans would move with the errors of their poses; the first point stays where it is. Normals are made when
/// they are asked for, as scans only meet a part of the map. When points come in, they are made anew only where the
/// nearest neighbours are other ones than before.
#[derive(Debug, Clone)]
pub(super) struct LocalMap {
    neighbors: usize,
    max_thickness: f64,
    points: Vec<[f64; 3]>,
    planes: Vec<OnceLock<Plane>>,
    /// Number of the scan that each point came from.
    scans: Vec<u32>,
    /// Scans in a row that have looked through each point.
    seen_through: Vec<u8>,
    scans_through: u8,
    index: VoxelIndex,
}

/// What a point's neighbours are on.
#[derive(Debug, Clone, Copy)]
struct Plane {
    /// Unit normal; 0 where neighbours are on no plane, as at edges and in thickets.
    normal: [f64; 3],
    /// Squared distance to the farthest neighbour; infinite where these were too few.
    reach: f64,
}

impl LocalMap {
    pub fn new(settings: &MapSettings) -> Self {
        Self {
            neighbors: settings.normal_neighbors,
            max_thickness: settings.max_thickness,
            points: Vec::new(),
            planes: Vec::new(),
            scans: Vec::new(),
            seen_through: Vec::new(),
            scans_through: settings.scans_through,
            index: VoxelIndex::default(),
        }
    }

    pub fn len(&self) -> usize {
        self.points.len()
    }

    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    /// The unit normal of a point, of which the side is open; `None` where its neighbours are on no plane.
    pub fn normal(&self, number: u32) -> Option<[f64; 3]> {
        Some(self.plane(number).normal).filter(|normal| *normal != [0.0; 3])
    }

    /// Normals of two halves of the points that a point's normal is taken from; `None` where either half is on no plane.
    pub fn half_normals(&self, number: u32) -> Option<[[f64; 3]; 2]> {
        let mut found = Vec::new();
        self.index.nearest_k(&self.points, self.points[number as usize], self.neighbors, &mut found);
        // By turns, as they are sorted by their distance: both halves reach equally far.
        let half = |first: usize| {
            let some = found.iter().skip(first).step_by(2);
            let plane = plane_of(some.map(|(_, index)| self.points[*index as usize]));
            (plane.thickness <= MAX_HALF_THICKNESS).then_some(plane.normal)
        };
        Some([half(0)?, half(1)?])
    }

    /// Adds another map's points where they are after a motion.
    pub fn add_moved(&mut self, other: &Self, motion: &RigidTransform) {
        let mut of_scans: BTreeMap<u32, Vec<[f64; 3]>> = BTreeMap::new();
        for (point, scan) in other.points.iter().zip(&other.scans) {
            of_scans.entry(*scan).or_default().push(motion.transform_point(*point));
        }
        for (scan, points) in of_scans {
            self.add(points, scan);
        }
    }

    pub fn scans(&self) -> &[u32] {
        &self.scans
    }

    /// The nearest point within a reach.
    pub fn nearest(&self, at: [f64; 3], reach: f64) -> Nearest {
        self.index.nearest(&self.points, at, reach)
    }

    /// Adds those points of a scan that are in voxels of their own.
    pub fn add(&mut self, points: impl IntoIterator<Item = [f64; 3]>, scan: u32) {
        let before = self.points.len();
        for point in points {
            if self.index.insert(point, self.points.len() as u32) {
                self.points.push(point);
                self.scans.push(scan);
            }
        }
        self.planes.resize(self.points.len(), OnceLock::new());
        self.seen_through.resize(self.points.len(), 0);
        self.forget_planes(before);
    }

    /// The plane that a point's neighbours are on.
    fn plane(&self, number: u32) -> &Plane {
        self.planes[number as usize].get_or_init(|| {
            let mut found = Vec::with_capacity(8 * self.neighbors);
            self.index.nearest_k(&self.points, self.points[number as usize], self.neighbors, &mut found);
            let reach = if found.len() < self.neighbors { f64::INFINITY } else { found[found.len() - 1].0 };
            let plane = plane_of(found.iter().map(|(_, index)| self.points[*index as usize]));
            let is_thin = plane.thickness <= self.max_thickness;
            Plane { normal: if is_thin { plane.normal } else { [0.0; 3] }, reach }
        })
    }

    /// Forgets the planes of points whose neighbours those from a number on have become.
    fn forget_planes(&mut self, first_new: usize) {
        // Points whose neighbours are not within `DENSE`, by cells.
        let mut sparse: FxHashMap<[i32; 3], Vec<u32>> = FxHashMap::default();
        let mut is_any_made = false;
        for (number, (point, plane)) in (0..).zip(self.points.iter().zip(&self.planes)) {
            let Some(plane) = plane.get() else { continue };
            is_any_made = true;
            if plane.reach > DENSE * DENSE {
                sparse.entry(cell_of(point)).or_default().push(number);
            }
        }
        if !is_any_made {
            return;
        }
        let (points, planes) = (&self.points, &mut self.planes);
        for new in &points[first_new..] {
            let mut forget = |number: u32| {
                let other = number as usize;
                let is_changed = |plane: &Plane| squared_distance(&points[other], new) <= plane.reach;
                if planes[other].get().is_some_and(is_changed) {
                    planes[other] = OnceLock::new();
                }
            };
            self.index.visit(*new, DENSE, &mut forget);
            let [x, y, z] = cell_of(new);
            for neighbor in 0..27 {
                let cell = [x + neighbor % 3 - 1, y + neighbor / 3 % 3 - 1, z + neighbor / 9 - 1];
                sparse.get(&cell).into_iter().flatten().copied().for_each(&mut forget);
            }
        }
    }

    /// Counts for each point the scans in a row that looked through it: something that has moved on is no part of the
    /// map, and goes with the next [`Self::keep_within`]. `to_scan` takes the map to the range image.
    pub fn look_through(&mut self, image: &SphericalRangeImage, to_scan: &RigidTransform) {
        self.points.par_iter().zip(&mut self.seen_through).with_min_len(PART).for_each(|(point, count)| {
            *count = match image.visibility(to_scan.transform_point(*point)) {
                Visibility::FreeSpace => count.saturating_add(1),
                Visibility::Confirmed => 0,
                Visibility::Hidden | Visibility::Unmeasured => *count,
            };
        });
    }

    /// Takes out what is farther from a point, and what scans have looked through. Far points are sparse, so their
    /// normals are poor.
    pub fn keep_within(&mut self, center: [f64; 3], distance: f64) {
        let is_near = |(point, through): (&[f64; 3], &u8)| {
            squared_distance(point, &center) <= distance * distance && *through < self.scans_through
        };
        let near: Vec<bool> = self.points.iter().zip(&self.seen_through).map(is_near).collect();
        if near.iter().all(|near| *near) {
            return;
        }
        keep(&mut self.points, &near);
        keep(&mut self.planes, &near);
        keep(&mut self.scans, &near);
        keep(&mut self.seen_through, &near);
        self.index = VoxelIndex::default();
        for (number, point) in (0..).zip(&self.points) {
            self.index.insert(*point, number);
        }
    }
}

impl GicpTarget for LocalMap {
    type Memory = LookedUp;

    fn nearest(&self, at: [f64; 3], reach: f64) -> Option<u32> {
        let found = self.nearest(at, reach);
        found.is_some().then_some(found.index)
    }

    fn nearest_again(&self, at: [f64; 3], reach: f64, memory: &mut LookedUp) -> Option<u32> {
        let found = memory.nearest(self, at, reach);
        found.filter(|(_, squared)| *squared <= reach * reach).map(|(number, _)| number)
    }

    fn surface(&self, number: u32) -> ([f64; 3], [f64; 3]) {
        (self.points[number as usize], self.plane(number).normal)
    }
}

fn cell_of(point: &[f64; 3]) -> [i32; 3] {
    // One less than the whole range of numbers, as the cells next to it are looked at.
    point.map(|c| ((c / CELL).floor() as i32).clamp(i32::MIN + 1, i32::MAX - 1))
}

fn keep<T>(values: &mut Vec<T>, kept: &[bool]) {
    let mut flags = kept.iter();
    values.retain(|_| flags.next() == Some(&true));
}

#[cfg(test)]
mod tests {
    use super::super::settings::ScanAlignmentSettings;
    use super::*;
    use crate::KdTree;
    use crate::alignment::{HeldLimits, IndependentNormals, PlaceNormals};
    use crate::random::uniform;
    use nalgebra::Vector3;
    use proptest::prelude::*;

    fn map_of(scans: &[Vec<[f64; 3]>]) -> LocalMap {
        let mut map = LocalMap::new(&MapSettings::default());
        for (number, points) in (0..).zip(scans) {
            map.add(points.iter().copied(), number);
        }
        map
    }

    /// The largest difference between normals of a map and those that are made of all its points at once.
    fn largest_error_of_normals(map: &LocalMap) -> f64 {
        let tree = KdTree::new(map.points());
        let mut found = Vec::new();
        let error = |(number, point): (u32, &[f64; 3])| {
            let normal = map.normal(number).unwrap_or_default();
            tree.nearest_k(*point, 20, &mut found);
            let plane = plane_of(found.iter().map(|(_, index)| map.points()[*index as usize]));
            let expected = if plane.thickness <= 0.35 { plane.normal } else { [0.0; 3] };
            let along: f64 = (0..3).map(|k| expected[k] * normal[k]).sum();
            (0..3).map(|k| (normal[k] - expected[k].copysign(expected[k] * along)).abs()).fold(0.0, f64::max)
        };
        (0..).zip(map.points()).map(error).fold(0.0, f64::max)
    }

    /// Whether a noisy floor, with a step of a height in its middle, holds what moves along x.
    fn is_held(noise: f64, height: f64) -> bool {
        let mut map = LocalMap::new(&MapSettings::default());
        let at = |i: usize, k: u64| uniform(i, k) - 0.5;
        let floor = (0..20_000).map(|i| {
            let x = 80.0 * at(i, 0);
            [x, 60.0 * at(i, 1), noise * at(i, 2) + if x > 0.0 { height } else { 0.0 }]
        });
        let riser = (0..(60.0 * height * 4.0) as usize)
            .map(|i| [noise * at(i, 3), 60.0 * at(i, 4), height * (0.5 + at(i, 5))]);
        map.add(floor.chain(riser), 0);
        let halves = (0..).zip(map.points()).filter_map(|(i, &point)| {
            Some(PlaceNormals { point, used: map.normal(i)?, independent: map.half_normals(i)? })
        });
        let ScanAlignmentSettings { held_share, held_deviations, .. } = ScanAlignmentSettings::default();
        let limits = HeldLimits { share: held_share, deviations: held_deviations };
        IndependentNormals::new(halves).hold(|_| Vector3::x(), limits)
    }

    #[test]
    fn errors_of_normals_hold_nothing_and_a_step_does() {
        for noise in [0.05, 0.3, 0.6] {
            assert!(!is_held(noise, 0.0), "a floor with noise {noise}");
            assert!(is_held(noise, 5.0), "a step with noise {noise}");
        }
    }

    proptest! {
        #![proptest_config(ProptestConfig { rng_seed: prop::test_runner::RngSeed::Fixed(9), cases: 64, ..Default::default() })]

        #[test]
        fn the_first_point_of_each_voxel_stays(
            scans in prop::collection::vec(prop::collection::vec(prop::array::uniform3(-4.0_f64..5.0), 0..120), 0..5),
            distance in 1.0_f64..9.0,
        ) {
            let mut expected: BTreeMap<[i64; 3], ([f64; 3], u32)> = BTreeMap::new();
            for (number, points) in (0..).zip(&scans) {
                for point in points {
                    expected.entry(point.map(|c| c.floor() as i64)).or_insert((*point, number));
                }
            }
            let mut map = map_of(&scans);
            let of = |map: &LocalMap| -> BTreeMap<[i64; 3], ([f64; 3], u32)> {
                let entry = |(point, scan): (&[f64; 3], &u32)| (point.map(|c| c.floor() as i64), (*point, *scan));
                map.points().iter().zip(map.scans()).map(entry).collect()
            };
            prop_assert_eq!(map.len(), expected.len());
            prop_assert_eq!(of(&map), expected.clone());
            map.keep_within([0.5; 3], distance);
            expected.retain(|_, (point, _)| squared_distance(point, &[0.5; 3]) <= distance * distance);
            prop_assert_eq!(of(&map), expected);
            // What was taken out may come again, and its voxel is free.
            let points: Vec<[f64; 3]> = map.points().to_vec();
            for point in &points {
                prop_assert_eq!(map.nearest(*point, 1.0).squared, 0.0);
            }
        }

        #[test]
        fn normals_are_those_of_all_points_at_once(
            scans in prop::collection::vec(
                prop::collection::vec(
                    prop::array::uniform2(-5.0_f64..5.0).prop_map(|[x, y]| [x, y, (0.4 * x).sin() + 0.1 * y * y]), 1..150,
                ),
                1..6,
            ),
        ) {
            let mut map = LocalMap::new(&MapSettings::default());
            for (number, points) in (0..).zip(&scans) {
                map.add(points.iter().copied(), number);
                prop_assert!(largest_error_of_normals(&map) < 1e-6);
            }
        }
    }
}
