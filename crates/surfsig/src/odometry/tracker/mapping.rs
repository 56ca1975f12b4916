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
        if self.is_at_keyframe {
            self.forget_scans();
        }
        self.last_mapped = Some(pose);
        steps
    }

    /// Forgets poses of scans that are neither in the map nor in that of a keyframe: memory is that of the surroundings,
    /// however long the way is.
    fn forget_scans(&mut self) {
        let mut needed: BTreeSet<usize> = self.map.scans().iter().map(|number| *number as usize).collect();
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
