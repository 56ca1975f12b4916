//! Where the sensor is, if not where it is expected: moved otherwise, rotated, or carried to another keyframe.

use super::super::local_map::LocalMap;
use super::super::result::ScanStatus;
use super::super::rotation_search::{points_near, rotations_on_map, some_points};
use super::super::scan_alignment::ScanAlignment;
use super::super::thinned_scan::ThinnedScan;
use super::Tracker;
use crate::RigidTransform;

impl Tracker {
    /// The pose found by rotations of the sensor or among keyframes, or else the doubted one where it
    /// may be kept.
    pub(super) fn found_elsewhere_or_doubted(
        &mut self,
        scan: &ThinnedScan,
        doubted: Option<ScanAlignment>,
        prediction: &RigidTransform,
    ) -> Option<(ScanAlignment, ScanStatus)> {
        let kept = doubted.as_ref().filter(|found| self.is_expected(found, prediction));
        // A search costs several scans, and changes next to nothing where a pose is only doubted.
        if kept.is_none() || self.since_search >= self.settings.relocalisation.scans_between {
            self.since_search = 0;
            if let Some(found) = self.by_rotation(scan, doubted.as_ref()) {
                self.begin_trial_at(&found);
                return Some((found, ScanStatus::Relocalised));
            }
            if let Some((found, map)) = self.among_keyframes(scan, doubted.as_ref()) {
                self.begin_trial_at(&found);
                self.map = map;
                return Some((found, ScanStatus::Relocalised));
            }
        }
        doubted.filter(|found| self.is_expected(found, prediction)).map(|found| (found, ScanStatus::Tracked))
    }

    /// The pose of a sensor that has stopped, or goes back as one that is shaken does, and where it was aligned from,
    /// if the scan clearly lies better there than where its motion leads.
    pub(super) fn by_other_motion(
        &self,
        scan: &ThinnedScan,
        doubted: Option<&ScanAlignment>,
    ) -> Option<(RigidTransform, ScanAlignment)> {
        // Along a free direction lines of the scan lie best on those of the scan before, and would stop the sensor.
        if doubted.is_some_and(|doubted| !doubted.free_directions.is_empty()) {
            return None;
        }
        let settings = &self.settings.relocalisation;
        let prediction = self.prediction();
        let points = some_points(scan.coarse.points(), settings.rotation_points);
        let near =
            |pose: &RigidTransform| points_near(&points, &self.map, pose, settings.rotation_distance) as f64;
        let least = near(&prediction) + settings.clear_gain * points.len() as f64;
        let distance = self.settings.prediction.min_correspondence_distance;
        let (start, _) = [self.last, self.last * self.motion.inverse()]
            .into_iter()
            .filter(|start| self.distance_at_range(&(prediction.inverse() * *start)) > distance)
            .map(|start| (start, near(&start)))
            .filter(|(_, count)| *count > least)
            .max_by(|a, b| a.1.total_cmp(&b.1))?;
        let found = self.aligned(scan, start)?;
        let is_chosen =
            found.free_directions.is_empty() && self.is_met(&found) && self.is_better(&found, doubted);
        is_chosen.then_some((start, found))
    }

    /// From where the sensor is expected, rotated about itself.
    fn by_rotation(&self, scan: &ThinnedScan, doubted: Option<&ScanAlignment>) -> Option<ScanAlignment> {
        let settings = &self.settings.relocalisation;
        if self.since > self.settings.prediction.max_lost {
            return None;
        }
        let mut around = self.prediction();
        around.rotation = self.last.rotation;
        let starts = rotations_on_map(scan.coarse.points(), &self.map, &around, settings);
        let distance = settings.max_correspondence_distance.max(self.correspondence_distance());
        let found: Vec<ScanAlignment> = starts
            .into_iter()
            .filter_map(|start| self.aligned_within(scan, start, distance))
            .filter(|found| {
                found.free_directions.is_empty() && self.is_met(found) && self.is_better(found, doubted)
            })
            .collect();
        let best = found.iter().max_by(|a, b| a.overlap.total_cmp(&b.overlap))?;
        // Where several rotations are as good, as in a square room, none is known.
        let is_rival = |other: &ScanAlignment| {
            let apart = self.distance_at_range(&(best.T_map_scan.inverse() * other.T_map_scan));
            apart > distance && other.overlap > best.overlap - settings.overlap_gain
        };
        (!found.iter().any(is_rival)).then(|| best.clone())
    }

    fn among_keyframes(
        &mut self,
        scan: &ThinnedScan,
        doubted: Option<&ScanAlignment>,
    ) -> Option<(ScanAlignment, LocalMap)> {
        if !self.searches_keyframes {
            return None;
        }
        let (expectation, median_range) = (&self.expectation, self.median_range);
        let is_met = |found: &ScanAlignment| {
            found.free_directions.is_empty()
                && expectation.is_met(found)
                && expectation.is_believable(found, median_range)
        };
        let searched = self.keyframes.find(scan, &self.last, self.map_range, is_met);
        searched.filter(|(found, _)| self.is_better(found, doubted))
    }

    /// Ends a trial that a pose found by a search contradicts: the sensor cannot have moved so far.
    fn begin_trial_at(&mut self, found: &ScanAlignment) {
        let reach =
            self.correspondence_distance().max(self.median_range * self.settings.prediction.first_error);
        let moved = (found.T_map_scan.translation - self.last.translation).norm();
        if moved > reach + self.motion.translation.norm() * self.since as f64 {
            self.trial.clear();
        }
    }

    /// The pose of another scan near one of several starts, or where it lies best if it is rotated about the first, if
    /// the map alone leaves no doubt of it.
    pub fn located(&self, scan: &ThinnedScan, starts: &[RigidTransform]) -> Option<ScanAlignment> {
        let settings = &self.settings.relocalisation;
        let distance = self.correspondence_distance().max(settings.max_correspondence_distance);
        let rotated = starts
            .first()
            .into_iter()
            .flat_map(|around| rotations_on_map(scan.coarse.points(), &self.map, around, settings));
        let found = starts.iter().copied().chain(rotated);
        found
            .filter_map(|start| self.aligned_within(scan, start, distance))
            .filter(|found| found.free_directions.is_empty() && self.is_met(found))
            .max_by(|a, b| a.overlap.total_cmp(&b.overlap))
    }

    /// Whether a pose that was searched takes the place of the doubted one.
    pub(super) fn is_better(&self, searched: &ScanAlignment, doubted: Option<&ScanAlignment>) -> bool {
        let Some(doubted) = doubted.filter(|doubted| doubted.free_directions.is_empty()) else { return true };
        let apart = self.distance_at_range(&(doubted.T_map_scan.inverse() * searched.T_map_scan));
        let gain = self.settings.relocalisation.overlap_gain;
        apart > self.settings.prediction.min_correspondence_distance
            && (searched.overlap > doubted.overlap + gain || self.expectation.is_contradicted(doubted))
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::scale::Scale;
    use super::super::super::settings::OdometrySettings;
    use super::*;

    #[test]
    fn a_map_left_long_ago_looked_for_correspondences_ever_farther() {
        let settings = OdometrySettings::default();
        let points: Vec<[f64; 3]> =
            (0..3000).map(|i| [0, 1, 2].map(|k| 5.0 * (f64::from(3 * i + k) * 12.9898).sin())).collect();
        let mut tracker = Tracker::new(&settings, &Scale::new(&points, None, &settings.scale));
        let mut after = |scans: usize| {
            (0..scans).for_each(|_| tracker.skip());
            tracker.correspondence_distance()
        };
        assert!(after(1) < after(1));
        let far = after(10);
        assert_eq!(after(1000), far);
    }
}
