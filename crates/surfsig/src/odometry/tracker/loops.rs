//! A sensor that comes back to where it was: the map that was dropped there is loaded again, and what the way around has
//! drifted by is known.

use super::super::keyframes::Which;
use super::super::local_map::LocalMap;
use super::super::scan_alignment::{ScanAlignment, Start, align};
use super::super::thinned_scan::ThinnedScan;
use super::super::translation_search::translations_on_map;
use super::Tracker;
use crate::RigidTransform;
use std::collections::BTreeSet;

/// A scan that lies on what an earlier one saw; lengths are in voxels, and scans are numbered from 0.
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Loop {
    pub scan: usize,
    /// The scan of the keyframe next to it.
    pub earlier: usize,
    pub T_earlier_scan: RigidTransform,
    /// The scan's pose by the way around.
    pub T_map_scan_before: RigidTransform,
}

impl Tracker {
    /// Whether a scan of a later map may lie on this one's keyframes of scans before one.
    pub fn has_keyframe_near(&self, expected: &RigidTransform, before: usize) -> bool {
        self.keyframes.has_earlier_near(expected, before)
    }

    /// The number of the keyframe next to a pose, and its pose.
    pub fn keyframe_next_to(&self, pose: &RigidTransform) -> Option<(usize, RigidTransform)> {
        self.keyframes.nearest_to(pose)
    }

    /// Where a scan of a later map lies on the keyframes of this one, which the sensor has left: the pose of that scan, and
    /// that of the keyframe next to it with its number. Scans from `before` on do not count.
    pub fn seen_again(
        &self,
        scan: &ThinnedScan,
        expected: &RigidTransform,
        before: usize,
    ) -> Option<(ScanAlignment, RigidTransform, usize)> {
        let (map, earlier) = self.keyframes.earlier_near(expected, self.map_range, before)?;
        let there = self.surely_on(&map, scan, expected, Which::All)?;
        Some((there, self.keyframes.pose(earlier)?, earlier as usize))
    }

    /// Where a scan lies on a map of keyframes without doubt, though a way around has drifted.
    fn surely_on(
        &self,
        map: &LocalMap,
        scan: &ThinnedScan,
        expected: &RigidTransform,
        which: Which,
    ) -> Option<ScanAlignment> {
        let settings = &self.settings.relocalisation;
        let known = |pose: &RigidTransform| self.keyframes.would_have_seen(pose, which);
        let distance = settings.max_correspondence_distance;
        let starts = translations_on_map(scan.coarse.points(), map, expected, settings);
        self.trials(distance)
            .likeliest(scan, map, starts, 0)
            .into_iter()
            .filter_map(|pose| align(scan, map, Start::near(pose, distance), &self.settings.alignment, known))
            .filter(|there| there.free_directions.is_empty() && self.is_met(there))
            .max_by(|a, b| a.overlap.total_cmp(&b.overlap))
    }

    /// Where a scan at a new keyframe's pose lies on keyframes that the map lacks: loads these, moves what the map has
    /// onto them, and gives the scan's pose there.
    pub(super) fn closed_loop(&mut self, scan: &ThinnedScan, found: &ScanAlignment) -> Option<ScanAlignment> {
        let numbers: BTreeSet<u32> = self.map.scans().iter().copied().collect();
        self.keyframes.mark_loaded(&numbers, self.number as u32);
        let (map, earlier) = self.keyframes.unloaded_near(&found.T_map_scan, self.map_range)?;
        let there = self.surely_on(&map, scan, &found.T_map_scan, Which::Unloaded)?;
        let correction = there.T_map_scan * found.T_map_scan.inverse();
        let present = std::mem::replace(&mut self.map, map);
        self.map.add_moved(&present, &correction);
        self.keyframes.move_loaded(&correction);
        for number in numbers {
            if let Some((pose, _)) = self.mapped.get_mut(&(number as usize)) {
                *pose = correction * *pose;
            }
        }
        self.last = correction * self.last;
        self.last_mapped = self.last_mapped.map(|pose| correction * pose);
        let of_earlier = self.keyframes.pose(earlier)?;
        self.loops.push(Loop {
            scan: self.number,
            earlier: earlier as usize,
            T_earlier_scan: of_earlier.inverse() * there.T_map_scan,
            T_map_scan_before: found.T_map_scan,
        });
        Some(there)
    }
}
