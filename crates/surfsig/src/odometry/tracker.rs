//! Scan after scan: predicted, aligned with the map, and searched among keyframes where that fails.

use super::expectation::Expectation;
use super::keyframes::Keyframes;
use super::local_map::LocalMap;
use super::result::ScanStatus;
use super::scale::{Scale, distances};
use super::scan_alignment::{ScanAlignment, align};
use super::settings::OdometrySettings;
use super::thinned_scan::ThinnedScan;
use crate::RigidTransform;
use crate::alignment::{FreeDirection, orthonormal, unscaled};
use crate::statistics::quantile;
use nalgebra::{Matrix6, Vector3};

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
}

/// What a pose may be off by.
#[derive(Debug, Clone, Copy)]
pub(super) struct Covariance {
    /// By chance, in each scan anew.
    pub random: Matrix6<f64>,
    /// Alike in all scans.
    pub systematic: Matrix6<f64>,
    /// Along motions that nothing determines, in the unknown variance of such a motion: they stay apart from the
    /// others, so that the small angles between those of several scans do not count.
    pub open: Matrix6<f64>,
}

impl Covariance {
    fn zeros() -> Self {
        Self { random: Matrix6::zeros(), systematic: Matrix6::zeros(), open: Matrix6::zeros() }
    }

    /// In other axes.
    fn carried(&self, transform: &RigidTransform) -> Self {
        let adjoint = transform.adjoint();
        let adjoint = Matrix6::from_fn(|row, column| adjoint[row][column]);
        let carried = |covariance: &Matrix6<f64>| adjoint * covariance * adjoint.transpose();
        Self {
            random: carried(&self.random),
            systematic: carried(&self.systematic),
            open: carried(&self.open),
        }
    }
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
    /// Poses and covariances of the scans that are in the map, by their numbers.
    mapped: Vec<Option<(RigidTransform, Covariance)>>,
    last: RigidTransform,
    /// From a scan to the next one.
    motion: RigidTransform,
    /// Scans since the last one that has a pose.
    since: usize,
    /// Sum of the squared errors of predictions, and their number.
    squared_errors: f64,
    predictions: f64,
    expectation: Expectation,
    is_lost: bool,
    /// Scans whose poses the next ones have to confirm.
    trial: Vec<Step>,
    last_mapped: Option<RigidTransform>,
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
            mapped: Vec::new(),
            last: RigidTransform::identity(),
            motion: RigidTransform::identity(),
            since: 1,
            squared_errors: (settings.prediction.first_error * median_range).powi(2),
            predictions: 1.0,
            expectation: Expectation::new(&settings.expectation),
            is_lost: false,
            trial: Vec::new(),
            last_mapped: None,
            number: 0,
        }
    }

    /// Passes over a scan without a pose.
    pub fn skip(&mut self) {
        self.number += 1;
        self.since += 1;
    }

    /// Finds the pose of the next scan: none if it is lost, and several where it confirms those before.
    pub fn follow(&mut self, scan: &ThinnedScan) -> Vec<Step> {
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
            };
            return self.take(scan, first);
        }
        let prediction = self.last * power(self.motion, self.since);
        let tracked = self.aligned(scan, prediction);
        let chosen = match tracked {
            Some(found) if self.expectation.is_met(&found) => Some((found, ScanStatus::Tracked)),
            doubted => self.relocalised_or_doubted(scan, doubted, &prediction),
        };
        let min_overlap = self.settings.expectation.min_overlap;
        let believed = chosen.filter(|(found, _)| found.overlap >= min_overlap);
        let Some((found, status)) = believed else {
            self.lose();
            return Vec::new();
        };
        let step = Step {
            number: self.number,
            T_map_scan: found.T_map_scan,
            covariance: self.covariance(&found),
            free_directions: found.free_directions.clone(),
            status,
            overlap: found.overlap,
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
        self.expectation.add(&found);
        self.take(scan, step)
    }

    /// The pose found among keyframes, or else the doubted one where it may be kept.
    fn relocalised_or_doubted(
        &mut self,
        scan: &ThinnedScan,
        doubted: Option<ScanAlignment>,
        prediction: &RigidTransform,
    ) -> Option<(ScanAlignment, ScanStatus)> {
        let is_met =
            |found: &ScanAlignment| found.free_directions.is_empty() && self.expectation.is_met(found);
        let searched = self.keyframes.find(scan, self.map_range, is_met);
        if let Some((found, map)) = searched.filter(|(found, _)| self.is_better(found, doubted.as_ref())) {
            self.map = map;
            self.trial.clear();
            return Some((found, ScanStatus::Relocalised));
        }
        let kept = doubted.filter(|found| self.is_expected(found, prediction));
        kept.map(|found| (found, ScanStatus::Tracked))
    }

    fn lose(&mut self) {
        self.skip();
        self.trial.clear();
        self.is_lost = true;
        if self.since > self.settings.prediction.max_lost {
            // Where the sensor went meanwhile, nobody knows.
            self.motion = RigidTransform::identity();
        }
    }

    fn aligned(&self, scan: &ThinnedScan, start: RigidTransform) -> Option<ScanAlignment> {
        let known = |pose: &RigidTransform| self.keyframes.would_have_seen(pose);
        align(scan, &self.map, start, self.correspondence_distance(), &self.settings.alignment, known)
    }

    /// As far as predictions were wrong (KISS-ICP's threshold, Vizzo and others, 2023).
    fn correspondence_distance(&self) -> f64 {
        let settings = &self.settings.prediction;
        let variance = self.squared_errors / self.predictions * self.since as f64;
        let by_motion = settings.min_correspondence_distance.max(settings.max_deviation * variance.sqrt());
        self.fixed_correspondence_distance.unwrap_or(by_motion)
    }

    fn prediction_error(&self, prediction: &RigidTransform, found: &ScanAlignment) -> f64 {
        self.distance_at_range(&(prediction.inverse() * found.T_map_scan))
    }

    /// How far a motion carries a point at the median range, at most.
    fn distance_at_range(&self, motion: &RigidTransform) -> f64 {
        2.0 * self.median_range * (0.5 * rotation_angle(motion)).sin() + motion.translation.norm()
    }

    /// Whether a pose that was searched takes the place of the doubted one.
    fn is_better(&self, searched: &ScanAlignment, doubted: Option<&ScanAlignment>) -> bool {
        let Some(doubted) = doubted.filter(|doubted| doubted.free_directions.is_empty()) else { return true };
        let apart = self.distance_at_range(&(doubted.T_map_scan.inverse() * searched.T_map_scan));
        let gain = self.settings.relocalisation.overlap_gain;
        apart > self.settings.prediction.min_correspondence_distance
            && (searched.overlap > doubted.overlap + gain || self.expectation.is_contradicted(doubted))
    }

    /// Whether a doubted pose may be kept: it is near where the sensor was expected, which long after it was lost is
    /// nowhere.
    fn is_expected(&self, found: &ScanAlignment, prediction: &RigidTransform) -> bool {
        let near = self.prediction_error(prediction, found) <= self.correspondence_distance();
        let goes_on = !self.is_lost || self.since <= self.settings.prediction.max_lost;
        near && goes_on && self.expectation.may_be_new(found)
    }

    /// Keeps back poses in a known part of the map until one is certain or enough have followed each other: parts that
    /// look alike from one viewpoint differ a little farther on.
    fn stays_on_trial(&mut self, step: &Step, found: &ScanAlignment) -> bool {
        self.trial.push(step.clone());
        let settings = &self.settings.relocalisation;
        let needed = match self.trial[0].status {
            ScanStatus::Relocalised => settings.scans_on_trial,
            _ => settings.scans_on_trial_there,
        };
        self.is_lost = self.trial.len() < needed && !self.expectation.is_certain(found);
        if self.is_lost {
            self.go_on(step);
        }
        self.is_lost
    }

    /// Adds the error of the map, which is that of the scans that it was made of.
    fn covariance(&self, found: &ScanAlignment) -> Covariance {
        let to_scan = found.T_map_scan.inverse();
        let mut of_map = Covariance::zeros();
        for &(number, share) in &found.scans {
            if let Some((pose, of_scan)) = &self.mapped[number as usize] {
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
    fn take(&mut self, scan: &ThinnedScan, step: Step) -> Vec<Step> {
        self.go_on(&step);
        let pose = step.T_map_scan;
        let steps = if self.trial.is_empty() { vec![step] } else { std::mem::take(&mut self.trial) };
        if steps[0].status == ScanStatus::Relocalised {
            self.last_mapped = None;
        }
        let Some(step) = steps.last().filter(|_| self.has_moved(&pose)) else { return steps };
        let number = step.number as u32;
        // First of all what leaves: new points need no normals that are made with it.
        self.map.keep_within(pose.translation.into(), self.map_range);
        let is_near = |point: &&[f64; 3]| Vector3::from(**point).norm() <= self.map_range;
        let near = scan.points.iter().filter(is_near).map(|point| pose.transform_point(*point));
        self.map.add(near, number);
        self.mapped.resize(step.number + 1, None);
        self.mapped[step.number] = Some((pose, step.covariance));
        self.keyframes.offer(scan, &pose, number);
        self.last_mapped = Some(pose);
        steps
    }

    /// Expects the next scan from here, with the motion since the last one.
    fn go_on(&mut self, step: &Step) {
        if step.status == ScanStatus::Relocalised {
            self.motion = RigidTransform::identity();
        } else if self.since == 1 {
            self.motion = self.last.inverse() * step.T_map_scan;
        }
        self.last = step.T_map_scan;
        self.since = 1;
        self.number += 1;
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

/// The covariance of a sum whose parts may err alike: the least one that none of their correlations exceeds in trace, with
/// rotations in units of `unit`.
fn sum_of_alike(one: &Matrix6<f64>, other: &Matrix6<f64>, unit: f64) -> Matrix6<f64> {
    let size = |covariance: &Matrix6<f64>| {
        (0..6).map(|k| covariance[(k, k)] * if k < 3 { unit * unit } else { 1.0 }).sum::<f64>().sqrt()
    };
    let (of_one, of_other) = (size(one), size(other));
    if of_one == 0.0 || of_other == 0.0 {
        return one + other;
    }
    one * (1.0 + of_other / of_one) + other * (1.0 + of_one / of_other)
}

/// The motion of several steps.
fn power(motion: RigidTransform, steps: usize) -> RigidTransform {
    RigidTransform::exp(motion.log().map(|component| component * steps as f64))
}

/// The angle of a motion's rotation, 0 to pi.
pub(super) fn rotation_angle(motion: &RigidTransform) -> f64 {
    let [x, y, z, ..] = motion.log();
    (x * x + y * y + z * z).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn parts_that_err_alike_add_up_before_they_are_squared() {
        let one = Matrix6::identity() * 0.04;
        let sum = sum_of_alike(&one, &(one * 9.0), 5.0);
        assert!((sum - Matrix6::identity() * 0.64).amax() < 1e-12, "0.2 + 0.6, squared");
        assert_eq!(sum_of_alike(&one, &Matrix6::zeros(), 5.0), one);
    }

    #[test]
    fn a_motion_that_goes_on_is_repeated() {
        let motion = RigidTransform::from_rotation_vector([0.1, -0.2, 0.4], [1.0, 2.0, -0.5]);
        let difference = (motion * motion * motion).inverse() * power(motion, 3);
        assert!(difference.log().iter().all(|component| component.abs() < 1e-13));
        assert_eq!(power(motion, 0), RigidTransform::identity());
        assert!((rotation_angle(&motion) - 0.21_f64.sqrt()).abs() < 1e-15);
    }
}
