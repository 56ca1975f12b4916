//! Scans that are kept, to find a sensor again that was lost.

mod panorama;
mod ranges;
mod search;

pub(super) use search::By;

use super::local_map::LocalMap;
use super::motions::rotation_angle;
use super::settings::OdometrySettings;
use super::thinned_scan::ThinnedScan;
use super::voxel_index::squared_distance;
use crate::visibility::SphericalRangeImage;
use crate::{FieldPlaces, RigidTransform};
use panorama::Panorama;
use ranges::Ranges;
use std::collections::{BTreeSet, VecDeque};

/// A scan that is kept; lengths are in voxels.
#[allow(non_snake_case)]
struct Keyframe {
    number: u32,
    T_map_scan: RigidTransform,
    /// The mean of each voxel's points.
    points: Vec<[f32; 3]>,
    /// Those of smaller voxels, for the signatures.
    detail: Vec<[f32; 3]>,
    range_image: SphericalRangeImage,
    ranges: Ranges,
    panorama: Panorama,
    /// Its keypoints, once they have been asked for.
    described: Option<FieldPlaces>,
    /// Whether the present map has what it saw.
    is_loaded: bool,
}

/// Which keyframes say what was in sight.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Which {
    /// Those whose points are in the present map.
    Loaded,
    /// The others.
    Unloaded,
    All,
}

/// The keyframes of a sequence, one for each viewpoint and direction.
pub(super) struct Keyframes {
    settings: OdometrySettings,
    median_range: f64,
    patch_radius: f64,
    kept: Vec<Keyframe>,
    /// Numbers of those that have been searched since the sensor was found last.
    searched: BTreeSet<u32>,
    /// Numbers of those whose keypoints are described, the oldest description first.
    described: VecDeque<u32>,
}

impl Keyframes {
    pub fn new(settings: &OdometrySettings, median_range: f64, patch_radius: f64) -> Self {
        Self {
            settings: settings.clone(),
            median_range,
            patch_radius,
            kept: Vec::new(),
            searched: BTreeSet::new(),
            described: VecDeque::new(),
        }
    }

    /// Keeps a scan, unless there is one of nearly the same pose; of too many keyframes the one leaves that has another
    /// the nearest to it. Tells whether it is kept.
    pub fn offer(&mut self, scan: &ThinnedScan, pose: &RigidTransform, number: u32) -> bool {
        if !self.is_new(pose) {
            return false;
        }
        let settings = &self.settings.relocalisation;
        self.kept.push(Keyframe {
            number,
            T_map_scan: *pose,
            points: in_float32(&scan.points),
            detail: in_float32(&scan.means(settings.detail_voxel)),
            range_image: scan.range_image.clone(),
            ranges: Ranges::new(scan.coarse.points()),
            panorama: Panorama::new(scan.coarse.points()),
            described: None,
            is_loaded: true,
        });
        if self.kept.len() > settings.max_kept {
            self.drop_one();
        }
        true
    }

    /// Whether no keyframe in the present map has nearly this pose.
    pub fn is_new(&self, pose: &RigidTransform) -> bool {
        let settings = &self.settings.relocalisation;
        let to_scan = pose.inverse();
        let is_alike = |other: &Keyframe| {
            let between = to_scan * other.T_map_scan;
            other.is_loaded
                && between.translation.norm() < settings.keyframe_distance * self.median_range
                && rotation_angle(&between) < settings.keyframe_rotation
        };
        !self.kept.iter().rev().any(is_alike)
    }

    /// Lets the map's scans tell which keyframes are in it: the others neither say what is known nor what is new.
    pub fn mark_loaded(&mut self, in_map: &BTreeSet<u32>, number: u32) {
        let recent = self.settings.relocalisation.scans_apart;
        for keyframe in &mut self.kept {
            keyframe.is_loaded = in_map.contains(&keyframe.number) || number - keyframe.number < recent;
        }
    }

    /// The map of the keyframes around a pose that are not in the present map, and the number of the nearest of them.
    pub fn unloaded_near(&self, pose: &RigidTransform, map_range: f64) -> Option<(LocalMap, u32)> {
        self.near(pose, map_range, |other| !other.is_loaded)
    }

    /// The same of the keyframes of scans before one, whatever the map has.
    pub fn earlier_near(
        &self,
        pose: &RigidTransform,
        map_range: f64,
        before: usize,
    ) -> Option<(LocalMap, u32)> {
        self.near(pose, map_range, |other| (other.number as usize) < before)
    }

    /// Whether there is a keyframe of a scan before one near a pose.
    pub fn has_earlier_near(&self, pose: &RigidTransform, before: usize) -> bool {
        self.nearest(pose, |other| (other.number as usize) < before).is_some()
    }

    fn near(
        &self,
        pose: &RigidTransform,
        map_range: f64,
        is_in: impl Fn(&Keyframe) -> bool,
    ) -> Option<(LocalMap, u32)> {
        let nearest = self.nearest(pose, &is_in)?;
        Some((self.map_of(pose.translation.into(), map_range, &is_in), nearest.number))
    }

    /// Of some keyframes the one next to a pose, if a loop may close there.
    fn nearest(&self, pose: &RigidTransform, is_in: impl Fn(&Keyframe) -> bool) -> Option<&Keyframe> {
        let distance = |other: &&Keyframe| (other.T_map_scan.translation - pose.translation).norm();
        let reach = self.settings.relocalisation.loop_distance * self.median_range;
        let asked = self.kept.iter().filter(|keyframe| is_in(keyframe));
        asked.min_by(|a, b| distance(a).total_cmp(&distance(b))).filter(|nearest| distance(nearest) <= reach)
    }

    /// Their scans' numbers.
    pub fn numbers(&self) -> impl Iterator<Item = usize> + '_ {
        self.kept.iter().map(|keyframe| keyframe.number as usize)
    }

    /// The pose of a keyframe.
    pub fn pose(&self, number: u32) -> Option<RigidTransform> {
        self.kept.iter().find(|keyframe| keyframe.number == number).map(|keyframe| keyframe.T_map_scan)
    }

    /// Moves those that are in the present map.
    pub fn move_loaded(&mut self, correction: &RigidTransform) {
        for keyframe in self.kept.iter_mut().filter(|keyframe| keyframe.is_loaded) {
            keyframe.T_map_scan = *correction * keyframe.T_map_scan;
        }
    }

    fn drop_one(&mut self) {
        let distance =
            |a: &Keyframe, b: &Keyframe| (a.T_map_scan.translation - b.T_map_scan.translation).norm();
        let gap = |index: usize| {
            let others = self.kept.iter().enumerate().filter(|(other, _)| *other != index);
            others.map(|(_, other)| distance(&self.kept[index], other)).fold(f64::INFINITY, f64::min)
        };
        let gaps: Vec<f64> = (0..self.kept.len()).map(gap).collect();
        let closest = (0..gaps.len()).min_by(|a, b| gaps[*a].total_cmp(&gaps[*b]));
        if let Some(index) = closest {
            self.kept.remove(index);
        }
    }

    /// Tells which points of a scan at a pose the keyframes next to it would have measured: of those in the present map,
    /// of those that are not, or of all.
    pub fn would_have_seen(
        &self,
        pose: &RigidTransform,
        which: Which,
    ) -> impl Fn([f64; 3]) -> bool + use<'_> {
        let observers: Vec<(RigidTransform, &SphericalRangeImage)> = self
            .next_to(pose, which)
            .into_iter()
            .map(|other| (other.T_map_scan.inverse() * *pose, &other.range_image))
            .collect();
        move |point| {
            observers
                .iter()
                .any(|(transform, image)| image.visibility(transform.transform_point(point)).is_in_sight())
        }
    }

    /// Those next to a pose, the nearest first: as many as tell what is in sight there.
    fn next_to(&self, pose: &RigidTransform, which: Which) -> Vec<&Keyframe> {
        let distance = |other: &Keyframe| (other.T_map_scan.translation - pose.translation).norm();
        let is_asked = |keyframe: &&Keyframe| match which {
            Which::Loaded => keyframe.is_loaded,
            Which::Unloaded => !keyframe.is_loaded,
            Which::All => true,
        };
        let mut near: Vec<&Keyframe> = self.kept.iter().filter(is_asked).collect();
        near.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        near.truncate(self.settings.relocalisation.observers);
        near
    }

    /// The number of the one next to a pose, and its pose.
    pub fn nearest_to(&self, pose: &RigidTransform) -> Option<(usize, RigidTransform)> {
        let nearest = self.next_to(pose, Which::All).into_iter().next()?;
        Some((nearest.number as usize, nearest.T_map_scan))
    }

    /// The map of those next to a pose: enough to tell the likeliest of several.
    fn map_next_to(&self, pose: &RigidTransform) -> LocalMap {
        self.map_with(self.next_to(pose, Which::All))
    }

    /// Takes out those of scans whose poses were wrong.
    pub fn remove(&mut self, numbers: &[usize]) {
        self.kept.retain(|keyframe| !numbers.contains(&(keyframe.number as usize)));
    }

    /// The map of some of the keyframes taken within a distance of a point.
    fn map_of(&self, center: [f64; 3], distance: f64, is_in: impl Fn(&Keyframe) -> bool) -> LocalMap {
        let is_near = |keyframe: &&Keyframe| {
            let from: [f64; 3] = keyframe.T_map_scan.translation.into();
            squared_distance(&from, &center) <= distance * distance
        };
        let asked = self.kept.iter().filter(|keyframe| is_in(keyframe));
        let mut map = self.map_with(asked.filter(is_near));
        map.keep_within(center, distance);
        map
    }

    fn map_with<'a>(&self, keyframes: impl IntoIterator<Item = &'a Keyframe>) -> LocalMap {
        let mut map = LocalMap::new(&self.settings.map);
        for keyframe in keyframes {
            let moved = |point: &[f32; 3]| keyframe.T_map_scan.transform_point(point.map(f64::from));
            map.add(keyframe.points.iter().map(moved), keyframe.number);
        }
        map
    }
}

fn in_float32(points: &[[f64; 3]]) -> Vec<[f32; 3]> {
    points.iter().map(|point| point.map(|c| c as f32)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn of_too_many_keyframes_the_older_of_the_nearest_two_leaves() {
        let mut settings = OdometrySettings::default();
        settings.relocalisation.max_kept = 3;
        let floor = (0..400).map(|i| [f64::from(i % 20) - 10.0, f64::from(i / 20) - 10.0, -4.0]);
        let scan = ThinnedScan::of_one_moment(floor.collect(), &settings);
        let mut keyframes = Keyframes::new(&settings, 15.0, 5.0);
        let at = |x: f64| RigidTransform::from_rotation_vector([0.0; 3], [x, 0.0, 0.0]);
        let mut after = |number: u32, x: f64| {
            let is_kept = keyframes.offer(&scan, &at(x), number);
            (is_kept, keyframes.numbers().collect::<Vec<_>>())
        };
        assert_eq!(after(0, 0.0), (true, vec![0]));
        assert_eq!(after(1, 30.0), (true, vec![0, 1]));
        assert_eq!(after(2, 50.0), (true, vec![0, 1, 2]));
        // Nearer to another one than three tenths of the median range.
        assert_eq!(after(3, 54.0), (false, vec![0, 1, 2]));
        assert_eq!(after(4, 65.0), (true, vec![0, 1, 4]));
        assert_eq!(after(5, 100.0), (true, vec![1, 4, 5]));
        assert_eq!([1, 4, 5].map(|number| keyframes.pose(number)), [30.0, 65.0, 100.0].map(|x| Some(at(x))));
        assert_eq!(keyframes.pose(2), None);
    }
}
