//! Scan after scan: predicted, aligned with the map, and searched where that fails: by other motions, by rotations, and
//! among keyframes.

mod loops;
mod mapping;
mod motion_within;
mod relocalisation;

pub(super) use loops::Loop;

use super::expectation::Expectation;
use super::keyframes::{Keyframes, Which};
use super::local_map::LocalMap;
use super::motions::{distance_at_range, power};
use super::pose_covariance::Covariance;
use super::result::ScanStatus;
use super::scale::{Scale, distances};
use super::scan_alignment::{ScanAlignment, Start, align};
use super::settings::OdometrySettings;
use super::thinned_scan::ThinnedScan;
use crate::RigidTransform;
use crate::alignment::FreeDirection;
use crate::statistics::quantile;
use nalgebra::Vector6;
use std::collections::BTreeMap;

/// Share of a scan's points that the map's range is taken from.
const MOST: f64 = 0.99;
/// Part of a motion that nothing determines from which on a motion counts as such a one.
pub(super) const LEAST_OPEN: f64 = 0.1;

/// A scan with a pose; lengths are in voxels, and the scan is about its sensor.
#[allow(non_snake_case)]
#[derive(Debug, Clone)]
pub(super) struct Step {
    /// The scan's number, from 0.
    pub number: usize,
    pub T_map_scan: RigidTransform,
    /// Of the twist in the scan's axes by which the pose is off.
    pub covariance: Covariance,
    /// Motions, in the scan's coordinates, that the map does not determine.
    pub free_directions: Vec<FreeDirection>,
    pub status: ScanStatus,
    pub overlap: f64,
    /// From scan to scan, in the sensor's axes at the reference, where the times of points are known.
    pub twist: Option<Vector6<f64>>,
}

/// Keeps the map, the motion and the keyframes; lengths are in voxels.
pub(super) struct Tracker {
    settings: OdometrySettings,
    /// Median range of the first scan.
    pub median_range: f64,
    /// Given largest distances, if any.
    fixed_map_range: Option<f64>,
    fixed_correspondence_distance: Option<f64>,
    map_range: f64,
    map: LocalMap,
    keyframes: Keyframes,
    /// Poses and covariances of the scans that are in the map, and of keyframes, by their numbers.
    mapped: BTreeMap<usize, (RigidTransform, Covariance)>,
    last: RigidTransform,
    /// From a scan to the next one.
    motion: RigidTransform,
    /// Whether the last two scans have told it.
    has_motion: bool,
    /// The motion before, where the last three scans have told both.
    motion_before: Option<Vector6<f64>>,
    /// Scans since the last one that has a pose.
    since: usize,
    /// Sum of the squared errors of predictions, and their number.
    squared_errors: f64,
    predictions: f64,
    expectation: Expectation,
    is_lost: bool,
    /// Scans whose poses the next ones have to confirm.
    trial: Vec<Step>,
    /// Whether the first of them is where the sensor was expected, and has only rotated.
    trial_is_there: bool,
    last_mapped: Option<RigidTransform>,
    /// The first scan, until the second one shows how the sensor moved within it.
    first: Option<ThinnedScan>,
    /// Scans since the last search.
    since_search: usize,
    /// Searches among keyframes so far, since the sensor was found last.
    searches: usize,
    /// Whether it is this map's turn to search its keyframes.
    searches_keyframes: bool,
    /// Numbers of the scans up to the last one whose poses were kept though doubted.
    doubted: Vec<usize>,
    /// Numbers of the scans whose poses a later one has disproved, until they are asked for.
    disproved: Vec<usize>,
    /// Loops that were closed, until they are asked for.
    loops: Vec<Loop>,
    /// Whether the last scan has become a keyframe.
    is_at_keyframe: bool,
    number: usize,
}

impl Tracker {
    pub fn new(settings: &OdometrySettings, scale: &Scale) -> Self {
        let in_voxels = |length: f64| length / scale.voxel;
        let median_range = in_voxels(scale.median_range);
        Self {
            settings: settings.clone(),
            median_range,
            fixed_map_range: settings.map_range.map(in_voxels),
            fixed_correspondence_distance: settings.max_correspondence_distance.map(in_voxels),
            map_range: 0.0,
            map: LocalMap::new(&settings.map),
            keyframes: Keyframes::new(settings, median_range, in_voxels(scale.patch_radius)),
            mapped: BTreeMap::new(),
            last: RigidTransform::identity(),
            motion: RigidTransform::identity(),
            has_motion: false,
            motion_before: None,
            since: 1,
            squared_errors: (settings.prediction.first_error * median_range).powi(2),
            predictions: 1.0,
            expectation: Expectation::new(&settings.expectation),
            is_lost: false,
            trial: Vec::new(),
            trial_is_there: false,
            last_mapped: None,
            first: None,
            since_search: usize::MAX,
            searches: 0,
            searches_keyframes: true,
            doubted: Vec::new(),
            disproved: Vec::new(),
            loops: Vec::new(),
            is_at_keyframe: false,
            number: 0,
        }
    }

    /// Whether poses of the last scans wait for the next ones.
    pub fn is_on_trial(&self) -> bool {
        !self.trial.is_empty()
    }

    /// Lets the next scans be searched among this map's keyframes, or not.
    pub fn search_keyframes(&mut self, searches: bool) {
        self.searches_keyframes = searches;
    }

    /// Whether the last scan has become a keyframe, and its pose is beyond doubt.
    pub fn is_at_sure_keyframe(&self) -> bool {
        self.is_at_keyframe && self.doubted.is_empty()
    }

    /// Ends tracking: only a search finds the sensor again.
    pub fn leave(&mut self) {
        self.trial.clear();
        self.is_lost = true;
        self.since = self.settings.prediction.max_lost + 1;
        self.motion = RigidTransform::identity();
    }

    /// Where the next scan is expected, in the map.
    pub fn prediction(&self) -> RigidTransform {
        self.last * power(self.motion, self.since)
    }

    /// Gives the numbers of scans whose poses the last one has disproved.
    pub fn take_disproved(&mut self) -> Vec<usize> {
        std::mem::take(&mut self.disproved)
    }

    /// From a scan to the next one, in voxels.
    pub fn motion(&self) -> RigidTransform {
        self.motion
    }

    /// Passes over a scan without a pose.
    pub fn skip(&mut self) {
        self.number += 1;
        self.since += 1;
        (self.has_motion, self.motion_before) = (false, None);
        if self.since > self.settings.prediction.max_lost {
            // Where the sensor went meanwhile, nobody knows.
            self.motion = RigidTransform::identity();
        }
    }

    /// Finds the pose of the next scan: none if it is lost, and several where it confirms those before.
    pub fn follow(&mut self, scan: &ThinnedScan) -> Vec<Step> {
        self.is_at_keyframe = false;
        let farthest = quantile(&mut distances(&scan.points, [0.0; 3]), MOST);
        let needed = self.settings.map.range_factor * farthest;
        self.map_range = self.fixed_map_range.unwrap_or(self.map_range.max(needed));
        if self.mapped.is_empty() {
            let first = Step {
                number: self.number,
                T_map_scan: RigidTransform::identity(),
                covariance: Covariance::zeros(),
                free_directions: Vec::new(),
                status: ScanStatus::Tracked,
                overlap: 1.0,
                twist: None,
            };
            self.first = scan.motion.is_some().then(|| scan.clone());
            return self.take(scan, &scan.points, first);
        }
        self.since_search = self.since_search.saturating_add(1);
        let mut prediction = self.prediction();
        let first = if self.may_be_at(scan, &prediction) { self.aligned(scan, prediction) } else { None };
        let mut first = first.and_then(|found| self.deskew_first(scan, found));
        if !first.as_ref().is_some_and(|found| self.is_met(found))
            && let Some((start, found)) = self.by_other_motion(scan, first.as_ref())
        {
            prediction = start;
            first = Some(found);
        }
        let chosen = match first {
            Some(found) if self.is_met(&found) => {
                self.searches = 0;
                Some((found, ScanStatus::Tracked))
            }
            doubted => self.found_elsewhere_or_doubted(scan, doubted, &prediction),
        };
        let Some((mut found, status)) = chosen.filter(|(found, _)| self.is_believable(found)) else {
            self.lose();
            return Vec::new();
        };
        let mut step = Step {
            number: self.number,
            T_map_scan: found.T_map_scan,
            covariance: self.covariance(&found),
            free_directions: found.free_directions.clone(),
            status,
            overlap: found.overlap,
            twist: found.within.as_ref().map(|(twist, _)| *twist),
        };
        let was_expected = status == ScanStatus::Tracked && !self.is_lost;
        if !was_expected && self.stays_on_trial(&step, &found) {
            return Vec::new();
        }
        if was_expected {
            let error = self.prediction_error(&prediction, &found);
            if error > self.settings.prediction.min_error {
                self.squared_errors += error * error;
                self.predictions += 1.0;
            }
        }
        self.remember_doubt(&step, &found);
        self.expectation.add(&found);
        if was_expected
            && self.doubted.is_empty()
            && self.keyframes.is_new(&found.T_map_scan)
            && let Some(there) = self.closed_loop(scan, &found)
        {
            step.T_map_scan = there.T_map_scan;
            step.covariance = self.covariance(&there);
            found = there;
        }
        let points = found.within.as_ref().map_or(&scan.points, |(_, points)| points);
        self.take(scan, points, step)
    }

    /// Gives the loops that the last scan has closed.
    pub fn take_loops(&mut self) -> Vec<Loop> {
        std::mem::take(&mut self.loops)
    }

    fn is_met(&self, found: &ScanAlignment) -> bool {
        self.expectation.is_met(found) && self.is_believable(found)
    }

    fn is_believable(&self, found: &ScanAlignment) -> bool {
        self.expectation.is_believable(found, self.median_range)
    }

    /// Keeps the numbers of doubted poses until one is beyond doubt: if that is found elsewhere, they were wrong.
    fn remember_doubt(&mut self, step: &Step, found: &ScanAlignment) {
        let is_elsewhere = self.trial.first().is_some_and(|first| first.status == ScanStatus::Relocalised);
        if is_elsewhere && !self.trial_is_there {
            self.disproved = std::mem::take(&mut self.doubted);
            for number in &self.disproved {
                self.mapped.remove(number);
            }
            self.keyframes.remove(&self.disproved);
        } else if self.expectation.is_met(found) {
            self.doubted.clear();
        } else {
            self.doubted.push(step.number);
        }
    }

    fn lose(&mut self) {
        self.skip();
        self.trial.clear();
        self.trial_is_there = false;
        self.is_lost = true;
    }

    fn aligned(&self, scan: &ThinnedScan, start: RigidTransform) -> Option<ScanAlignment> {
        let max_distance = self.correspondence_distance();
        let is_guess = !self.has_motion && !self.is_lost;
        self.aligned_from(scan, Start { pose: start, max_distance, is_guess })
    }

    fn aligned_from(&self, scan: &ThinnedScan, start: Start) -> Option<ScanAlignment> {
        let known = |pose: &RigidTransform| self.keyframes.would_have_seen(pose, Which::Loaded);
        align(scan, &self.map, start, &self.settings.alignment, known)
    }

    /// As far as predictions were wrong (KISS-ICP's threshold, Vizzo and others, 2023).
    fn correspondence_distance(&self) -> f64 {
        let settings = &self.settings.prediction;
        // Once the motion is not believed to go on, looking farther takes seconds and finds nothing.
        let steps = self.since.min(settings.max_lost);
        let variance = self.squared_errors / self.predictions * steps as f64;
        let by_motion = settings.min_correspondence_distance.max(settings.max_deviation * variance.sqrt());
        self.fixed_correspondence_distance.unwrap_or(by_motion)
    }

    fn prediction_error(&self, prediction: &RigidTransform, found: &ScanAlignment) -> f64 {
        self.distance_at_range(&(prediction.inverse() * found.T_map_scan))
    }

    /// How far a motion carries a point at the median range, at most.
    fn distance_at_range(&self, motion: &RigidTransform) -> f64 {
        distance_at_range(self.median_range, motion)
    }

    /// Whether a doubted pose may be kept: it is near where the sensor was expected, which long after it was lost is
    /// nowhere.
    fn is_expected(&self, found: &ScanAlignment, prediction: &RigidTransform) -> bool {
        let error = self.prediction_error(prediction, found);
        let goes_on = !self.is_lost || self.since <= self.settings.prediction.max_lost;
        // While it is lost, the motion says less.
        let distance = error * self.since as f64;
        error <= self.correspondence_distance() && goes_on && self.expectation.may_be_new(found, distance)
    }

    /// Keeps back poses in a known part of the map until one is certain or enough have followed each other: parts that
    /// look alike from one viewpoint differ a little farther on.
    fn stays_on_trial(&mut self, step: &Step, found: &ScanAlignment) -> bool {
        let is_near = self.trial.is_empty() && !self.is_lost && {
            let moved = step.T_map_scan.translation - self.prediction().translation;
            moved.norm() <= self.correspondence_distance()
        };
        self.trial_is_there |= is_near;
        self.trial.push(step.clone());
        let settings = &self.settings.relocalisation;
        let needed = match self.trial[0].status {
            ScanStatus::Relocalised if !self.trial_is_there => settings.scans_on_trial,
            _ => settings.scans_on_trial_there,
        };
        self.is_lost = self.trial.len() < needed && !self.expectation.is_certain(found);
        if self.is_lost {
            self.go_on(step);
        }
        self.is_lost
    }

    /// Expects the next scan from here, with the motion since the last one.
    fn go_on(&mut self, step: &Step) {
        let moved = self.last.inverse() * step.T_map_scan;
        // A sensor that was found again far off has been carried there, which it does not go on to be.
        let is_carried = step.status == ScanStatus::Relocalised
            && moved.translation.norm() > self.correspondence_distance() + self.motion.translation.norm();
        self.motion_before = None;
        if is_carried {
            self.motion = RigidTransform::identity();
        } else if self.since == 1 {
            self.motion_before = self.has_motion.then(|| Vector6::from(self.motion.log()));
            self.has_motion = self.number > 0;
            self.motion = moved;
        }
        self.last = step.T_map_scan;
        self.since = 1;
        self.number += 1;
    }
}
