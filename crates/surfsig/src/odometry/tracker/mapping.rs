//! What a scan with a pose adds to the map, and what its pose is off by.

use super::super::motions::rotation_angle;
use super::super::pose_covariance::{Covariance, sum_of_alike};
use super::super::result::ScanStatus;
use super::super::scan_alignment::ScanAlignment;
use super::super::thinned_scan::ThinnedScan;
use super::{Step, Tracker};
use crate::RigidTransform;
use crate::alignment::{orthonormal, unscaled};
use nalgebra::Vector3;
use std::collections::BTreeSet;

impl Tracker {
    /// Adds the error of the map, which is that of the scans that it was made of.
    pub(super) fn covariance(&self, found: &ScanAlignment) -> Covariance {
        let to_scan = found.T_map_scan.inverse();
        let mut of_map = Covariance::zeros();
        for &(number, share) in &found.scans {
            if let Some((pose, of_scan)) = self.mapped.get(&(number as usize)) {
                let carried = of_scan.carried(&(to_scan * *pose));
                of_map.random += carried.random * share;
                of_map.systematic += carried.systematic * share;
                of_map.open += carried.open * share;
            }
        }
        let unit = self.median_range;
        let mut open = of_map.open;
        for direction in &found.free_directions {
            for motion in orthonormal(&direction.twists([0.0; 3]), unit) {
                let twist = unscaled(&motion, unit);
                open += twist * twist.transpose();
            }
        }
        let random = found.covariance + of_map.random;
        Covariance { random, systematic: sum_of_alike(&found.systematic, &of_map.systematic, unit), open }
    }

    /// Puts a scan into the map, and gives its step after those that it confirms.
    pub(super) fn take(&mut self, scan: &ThinnedScan, points: &[[f64; 3]], step: Step) -> Vec<Step> {
        self.go_on(&step);
        let pose = step.T_map_scan;
        let steps = if self.trial.is_empty() { vec![step] } else { std::mem::take(&mut self.trial) };
        self.trial_is_there = false;
        if steps[0].status == ScanStatus::Relocalised {
            self.last_mapped = None;
        }
        let Some(step) = steps.last().filter(|_| self.has_moved(&pose)) else { return steps };
        let number = step.number as u32;
        if self.doubted.is_empty() {
            self.map.look_through(&scan.range_image, &pose.inverse());
        }
        // First of all what leaves: new points need no normals that are made with it.
        self.map.keep_within(pose.translation.into(), self.map_range);
        let is_near = |point: &&[f64; 3]| Vector3::from(**point).norm() <= self.map_range;
        let near = points.iter().filter(is_near).map(|point| pose.transform_point(*point));
        self.map.add(near, number);
        self.mapped.insert(step.number, (pose, step.covariance));
        self.is_at_keyframe = self.keyframes.offer(scan, &pose, number);
        self.forget_scans();
        self.last_mapped = Some(pose);
        steps
    }

    /// Forgets poses of scans that are neither in the map nor in that of a keyframe: memory is that of the surroundings,
    /// however long the way is.
    fn forget_scans(&mut self) {
        let mut in_map = self.map.scans().to_vec();
        // Points of a scan follow each other, so that few numbers are left to be sorted.
        in_map.dedup();
        let mut needed: BTreeSet<usize> = in_map.into_iter().map(|number| number as usize).collect();
        needed.extend(self.keyframes.numbers());
        self.mapped.retain(|number, _| needed.contains(number));
    }

    /// Whether the sensor went on since the last scan of the map.
    fn has_moved(&self, pose: &RigidTransform) -> bool {
        let settings = &self.settings.map;
        self.last_mapped.is_none_or(|last| {
            let since = last.inverse() * *pose;
            since.translation.norm() > settings.min_translation
                || rotation_angle(&since) > settings.min_rotation
        })
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::scale::Scale;
    use super::super::super::settings::OdometrySettings;
    use super::*;
    use crate::random::uniform;

    #[test]
    fn only_scans_of_the_surroundings_and_keyframes_have_poses_however_long_the_way_is() {
        let mut settings = OdometrySettings { map_range: Some(12.0), ..Default::default() };
        settings.relocalisation.max_kept = 4;
        let floor = (0..2000).map(|i| [30.0 * (uniform(i, 0) - 0.5), 30.0 * (uniform(i, 1) - 0.5), -4.0]);
        let scan = ThinnedScan::of_one_moment(floor.collect(), &settings);
        let scale = Scale { voxel: 1.0, median_range: 10.0, patch_radius: 5.0 };
        let mut tracker = Tracker::new(&settings, &scale);
        tracker.map_range = 12.0;
        let mut go_to = |x: f64| {
            let step = Step {
                number: tracker.number,
                T_map_scan: RigidTransform::from_rotation_vector([0.0; 3], [x, 0.0, 0.0]),
                covariance: Covariance::zeros(),
                free_directions: Vec::new(),
                status: ScanStatus::Tracked,
                overlap: 1.0,
                twist: None,
            };
            assert_eq!(tracker.take(&scan, &scan.points, step).len(), 1);
            let from_sensor = |point: &[f64; 3]| Vector3::new(point[0] - x, point[1], point[2]).norm();
            assert!(tracker.map.points().iter().all(|point| from_sensor(point) <= 12.0));
            let keyframes: Vec<usize> = tracker.keyframes.numbers().collect();
            let mut needed: BTreeSet<usize> =
                tracker.map.scans().iter().map(|number| *number as usize).collect();
            needed.extend(&keyframes);
            let with_poses: BTreeSet<usize> = tracker.mapped.keys().copied().collect();
            assert_eq!(with_poses, needed);
            (keyframes, with_poses)
        };
        for i in 0..40 {
            go_to(2.0 * f64::from(i));
        }
        let (keyframes, with_poses) = go_to(80.0);
        assert_eq!(keyframes, [34, 36, 38, 40]);
        // Scan 29, at 58, was the first to reach what is 11.3 voxels, as far as the floor is seen, behind 80.
        assert!(with_poses.first().is_some_and(|first| (29..=31).contains(first)), "{with_poses:?}");
        // To and fro, where no new keyframe comes.
        for i in 0..40 {
            let (keyframes, with_poses) = go_to(80.0 - 2.0 * f64::from((i + 1) % 2));
            assert_eq!(keyframes, [34, 36, 38, 40]);
            assert!(with_poses.len() < 20, "{with_poses:?}");
        }
    }
}
