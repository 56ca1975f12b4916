//! Where the sensor is, if not where it is expected: moved otherwise, rotated, or carried to another keyframe.

use super::super::keyframes::By;
use super::super::local_map::LocalMap;
use super::super::result::ScanStatus;
use super::super::rotation_search::{points_near, rotations_on_map, some_points};
use super::super::rough_alignment::Trials;
use super::super::scan_alignment::{ScanAlignment, Start};
use super::super::thinned_scan::ThinnedScan;
use super::Tracker;
use crate::RigidTransform;

impl Tracker {
    /// Whether a scan is aligned from where it is expected: long after the sensor was lost only where it lies on the map
    /// there, as it does where something that hid the surroundings has left.
    pub(super) fn may_be_at(&self, scan: &ThinnedScan, expected: &RigidTransform) -> bool {
        if self.since <= self.settings.prediction.max_lost {
            return true;
        }
        let settings = &self.settings.relocalisation;
        let some = some_points(scan.coarse.points(), settings.rotation_points);
        let near = points_near(&some, &self.map, expected, settings.rotation_distance);
        near as f64 >= self.expectation.least_overlap() * some.len() as f64
    }

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
            let by = self.searches_keyframes.then(|| self.next_search());
            if let Some(found) = self.by_rotation(scan, doubted.as_ref(), by.is_some() || self.since > 1) {
                self.begin_trial_at(&found);
                return Some((found, ScanStatus::Relocalised));
            }
            if let Some(by) = by
                && let Some((found, map)) = self.among_keyframes(scan, doubted.as_ref(), by)
            {
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
        let least = self.least_near(scan, doubted);
        let pose = *self
            .trials(self.correspondence_distance())
            .likeliest(scan, &self.map, [start], least)
            .first()?;
        let found = self.aligned(scan, pose)?;
        let is_chosen =
            found.free_directions.is_empty() && self.is_met(&found) && self.is_better(&found, doubted);
        is_chosen.then_some((start, found))
    }

    /// How a scan is searched among keyframes: both kinds take turns, so that each scan costs a few tracked ones.
    fn next_search(&mut self) -> By {
        self.searches += 1;
        if self.searches.is_multiple_of(2) { By::Signatures } else { By::Panorama }
    }

    /// From where the sensor is expected, rotated about itself; with `only_likely` only if a rotation alone brings most of
    /// the points near the map.
    fn by_rotation(
        &self,
        scan: &ThinnedScan,
        doubted: Option<&ScanAlignment>,
        only_likely: bool,
    ) -> Option<ScanAlignment> {
        let settings = &self.settings.relocalisation;
        if self.since > self.settings.prediction.max_lost {
            return None;
        }
        let mut around = self.prediction();
        around.rotation = self.last.rotation;
        let points = scan.coarse.points();
        let rotations = rotations_on_map(points, &self.map, &around, settings);
        let likely = settings.likely_share * points.len().min(settings.rotation_points) as f64;
        if only_likely && rotations.first().is_none_or(|(near, _)| (*near as f64) < likely) {
            return None;
        }
        let starts = rotations.into_iter().map(|(_, pose)| pose);
        let distance = settings.max_correspondence_distance.max(self.correspondence_distance());
        let found: Vec<ScanAlignment> = self
            .trials(distance)
            .likeliest(scan, &self.map, starts, self.least_near(scan, doubted))
            .into_iter()
            .filter_map(|pose| self.aligned_from(scan, Start::near(pose, distance)))
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
        by: By,
    ) -> Option<(ScanAlignment, LocalMap)> {
        let (expectation, median_range) = (&self.expectation, self.median_range);
        let is_met = |found: &ScanAlignment| {
            found.free_directions.is_empty()
                && expectation.is_met(found)
                && expectation.is_believable(found, median_range)
        };
        let searched = self.keyframes.find(scan, &self.last, self.map_range, by, is_met);
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
            .flat_map(|around| rotations_on_map(scan.coarse.points(), &self.map, around, settings))
            .map(|(_, pose)| pose);
        let starts = starts.iter().copied().chain(rotated);
        let found = self.trials(distance).likeliest(scan, &self.map, starts, 0).into_iter();
        found
            .filter_map(|pose| self.aligned_from(scan, Start::near(pose, distance)))
            .filter(|found| found.free_directions.is_empty() && self.is_met(found))
            .max_by(|a, b| a.overlap.total_cmp(&b.overlap))
    }

    pub(super) fn trials(&self, distance: f64) -> Trials<'_> {
        Trials { settings: &self.settings, distance, range: self.median_range }
    }

    /// How many of some of a scan's points a pose that was searched has to bring near the map: most of them, and as many
    /// as the doubted pose does.
    fn least_near(&self, scan: &ThinnedScan, doubted: Option<&ScanAlignment>) -> usize {
        let settings = &self.settings.relocalisation;
        let some = some_points(scan.coarse.points(), settings.rotation_points);
        let doubted = doubted.filter(|doubted| doubted.free_directions.is_empty());
        let by_doubted = doubted
            .map_or(0, |found| points_near(&some, &self.map, &found.T_map_scan, settings.rotation_distance));
        by_doubted.max((settings.likely_share * some.len() as f64).ceil() as usize)
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
    use crate::random::uniform;

    /// A scan of a furnished room, in voxels, of which `kind` is the furniture.
    fn scan(kind: u64, settings: &OdometrySettings) -> ThinnedScan {
        let at = |i: usize, k: u64| uniform(i, k) - 0.5;
        let walls = (0..12_000).map(|i| match i % 3 {
            0 => [50.0 * at(i, 0), 36.0 * at(i, 1), -8.0],
            1 => [50.0 * at(i, 0), if i % 2 == 0 { -18.0 } else { 18.0 }, 16.0 * at(i, 1)],
            _ => [if i % 2 == 0 { -25.0 } else { 25.0 }, 36.0 * at(i, 0), 16.0 * at(i, 1)],
        });
        let boxes = (0..9_000).map(|i| {
            let middle: [f64; 3] =
                [0, 1, 2].map(|k| [44.0, 30.0, 10.0][k] * at(i / 900, 10 * kind + k as u64));
            let mut point = [0, 1, 2].map(|k| 5.0 * at(i, k));
            point[i % 3] = if i % 2 == 0 { 2.5 } else { -2.5 };
            [0, 1, 2].map(|k| middle[k] + point[k])
        });
        ThinnedScan::of_one_moment(walls.chain(boxes).collect(), settings)
    }

    #[test]
    fn long_after_the_sensor_was_lost_each_scan_was_aligned_at_its_last_pose() {
        let settings = OdometrySettings::default();
        let first = scan(1, &settings);
        let mut tracker = Tracker::new(&settings, &Scale::new(&first.points, Some(1.0), &settings.scale));
        for _ in 0..3 {
            assert_eq!(tracker.follow(&first).len(), 1);
        }
        let here = RigidTransform::identity();
        let elsewhere = RigidTransform::from_rotation_vector([0.0, 0.0, 0.7], [9.0, 4.0, 0.0]);
        assert!(tracker.may_be_at(&first, &elsewhere));
        (0..10).for_each(|_| tracker.skip());
        assert!(tracker.may_be_at(&first, &here));
        assert!(!tracker.may_be_at(&first, &elsewhere));
    }

    #[test]
    fn a_sensor_that_was_carried_and_turned_is_found_by_how_far_it_sees() {
        let settings = OdometrySettings::default();
        let first = scan(1, &settings);
        let mut tracker = Tracker::new(&settings, &Scale::new(&first.points, Some(1.0), &settings.scale));
        tracker.follow(&first);
        (0..10).for_each(|_| tracker.skip());
        let truth = RigidTransform::from_rotation_vector([0.02, -0.03, 2.0], [3.0, 2.0, 0.5]);
        let points = truth.inverse().transform_points(&first.points);
        let moved = ThinnedScan::of_one_moment(points, &settings);
        let (found, _) = tracker.among_keyframes(&moved, None, By::Panorama).unwrap();
        let off = (truth.inverse() * found.T_map_scan).log();
        assert!(off.iter().all(|component| component.abs() < 0.05), "{off:?}");
        assert!(tracker.among_keyframes(&scan(2, &settings), None, By::Panorama).is_none());
    }

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
