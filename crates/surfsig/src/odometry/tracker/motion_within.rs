//! The sensor's motion within a scan.

use super::super::deskewing::MotionWithin;
use super::super::local_map::LocalMap;
use super::super::scan_alignment::ScanAlignment;
use super::super::thinned_scan::ThinnedScan;
use super::Tracker;
use crate::RigidTransform;
use nalgebra::Vector6;

impl Tracker {
    /// The motion within the next scan, as it is expected.
    pub fn expected_within(&self) -> MotionWithin {
        let last = Vector6::from(self.motion.log());
        // At the next scan's reference, by the twists at the middles between the last three.
        let twist = self.motion_before.map_or(last, |before| last + 1.5 * (last - before));
        MotionWithin {
            times: Vec::new(),
            twist,
            since: (self.since == 1 && !self.mapped.is_empty() && !self.is_lost)
                .then_some((self.last, self.has_motion.then_some(last))),
            farthest: self.correspondence_distance(),
            deviation: self.settings.alignment.deskew_deviation,
            range: self.median_range.max(1.0),
        }
    }

    /// Deskews the first scan by the motion that the second one has shown, and aligns that anew.
    pub(super) fn deskew_first(&mut self, scan: &ThinnedScan, found: ScanAlignment) -> Option<ScanAlignment> {
        let Some(first) = self.first.take() else { return Some(found) };
        let mut found = found;
        for _ in 0..self.settings.alignment.deskew_steps {
            // Both scans are bent nearly alike, so that the poses tell the motion.
            let twist = Vector6::from(found.T_map_scan.log());
            let first = first.deskewed_anew(twist, &self.settings)?;
            let scan = scan.deskewed_anew(twist, &self.settings)?;
            self.map = LocalMap::new(&self.settings.map);
            self.map.add(first.points.iter().copied(), 0);
            self.keyframes.remove(&[0]);
            self.keyframes.offer(&first, &RigidTransform::identity(), 0);
            found = self.aligned(&scan, found.T_map_scan)?;
        }
        Some(found)
    }
}
