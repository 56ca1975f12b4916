//! The nearest points of the map, looked up again only where another one can have become nearer.

use super::local_map::LocalMap;
use super::voxel_index::{Nearest, squared_distance};
use crate::RigidTransform;
use rayon::prelude::*;

/// Voxels beyond the largest distance within which a neighbour is looked for, so that a point without one need not be
/// looked up again after every small step.
const SLACK: f64 = 0.5;
/// Points that one thread takes at a time.
const PART: usize = 1024;

/// Where a point was when it was looked up in the map, and what was found there.
///
/// While a point has moved by d since, all others are at least as far as the second nearest was, less d (Greenspan and
/// Godin, A nearest neighbor method for efficient ICP, 2001). So the result is that of looking up each anew.
#[derive(Debug, Clone, Copy)]
pub(super) struct LookedUp {
    at: [f64; 3],
    nearest: Nearest,
}

impl Default for LookedUp {
    /// That of a point that was never looked up.
    fn default() -> Self {
        Self { at: [0.0; 3], nearest: Nearest { index: u32::MAX, squared: f64::INFINITY, next: 0.0 } }
    }
}

impl LookedUp {
    /// Number and squared distance of the map's point nearest to where the point is now; it is `None`, or farther than
    /// the reach, where none is within that.
    pub fn nearest(&mut self, map: &LocalMap, at: [f64; 3], reach: f64) -> Option<(u32, f64)> {
        let Self { at: before, nearest } = self;
        let farthest = nearest.next - squared_distance(&at, before).sqrt();
        let squared = match nearest.is_some() {
            true => squared_distance(&at, &map.points()[nearest.index as usize]),
            false => reach * reach,
        };
        let found = if farthest > 0.0 && squared < farthest * farthest {
            // Others are as far as they were where it was looked up.
            Nearest { squared, ..*nearest }
        } else {
            (*before, *nearest) = (at, map.nearest(at, reach + SLACK));
            *nearest
        };
        found.is_some().then_some((found.index, found.squared))
    }
}

/// For each point of a scan its nearest point of the map.
pub(super) struct Correspondences {
    looked_up: Vec<LookedUp>,
    found: Vec<Option<(u32, f64)>>,
}

impl Correspondences {
    pub fn new(count: usize) -> Self {
        Self { looked_up: vec![LookedUp::default(); count], found: vec![None; count] }
    }

    /// Number and squared distance of the nearest point of the map within `reach` of each point of a scan.
    pub fn update(
        &mut self,
        map: &LocalMap,
        points: &[[f64; 3]],
        pose: &RigidTransform,
        reach: f64,
    ) -> &[Option<(u32, f64)>] {
        let of_point = |(point, looked_up): (&[f64; 3], &mut LookedUp)| {
            let nearest = looked_up.nearest(map, pose.transform_point(*point), reach);
            nearest.filter(|(_, squared)| *squared < reach * reach)
        };
        let found = points.par_iter().zip(&mut self.looked_up).with_min_len(PART);
        found.map(of_point).collect_into_vec(&mut self.found);
        &self.found
    }
}

#[cfg(test)]
mod tests {
    use super::super::settings::MapSettings;
    use super::*;

    #[test]
    fn after_any_steps_neighbours_are_those_of_a_new_search() {
        let number = |i: u64, k: u64| {
            ((i * 3 + k).wrapping_mul(0x9e37_79b9_7f4a_7c15) >> 11) as f64 / (1_u64 << 53) as f64
        };
        let cloud = |from: u64, count: u64| -> Vec<[f64; 3]> {
            (from..from + count).map(|i| [0, 1, 2].map(|k| 12.0 * number(i, k) - 6.0)).collect()
        };
        let mut map = LocalMap::new(&MapSettings::default());
        map.add(cloud(0, 700), 0);
        let points = cloud(5000, 300);
        let mut correspondences = Correspondences::new(points.len());
        let mut pose = RigidTransform::identity();
        for step in 0..40 {
            let size = 0.5_f64.powi(step % 10);
            let twist =
                [0.1, -0.2, 0.1, 0.5, 0.3, -0.4].map(|c| c * size * if step % 3 == 0 { 1.0 } else { -0.7 });
            pose = pose * RigidTransform::exp(twist);
            for (point, found) in points.iter().zip(correspondences.update(&map, &points, &pose, 2.0)) {
                let nearest = map.nearest(pose.transform_point(*point), 2.0);
                assert_eq!(*found, nearest.is_some().then_some((nearest.index, nearest.squared)));
            }
        }
    }
}
