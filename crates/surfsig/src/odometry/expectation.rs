//! How scans lie on the map of late, by which a pose is doubted, believed at once, or on trial.

use super::scan_alignment::ScanAlignment;
use super::settings::ExpectationSettings;
use crate::statistics::median;
use std::collections::VecDeque;

/// Points that contradict nothing, however few there are.
const FEW: f64 = 3.0;

/// What the last scans with a pose did; all shares depend on the sensor and its surroundings.
#[derive(Debug, Clone)]
pub(super) struct Expectation {
    settings: ExpectationSettings,
    overlaps: VecDeque<f64>,
    known: VecDeque<f64>,
    free_space: VecDeque<f64>,
    unexplained: VecDeque<f64>,
}

impl Expectation {
    pub fn new(settings: &ExpectationSettings) -> Self {
        let none = VecDeque::new;
        Self {
            settings: settings.clone(),
            overlaps: none(),
            known: none(),
            free_space: none(),
            unexplained: none(),
        }
    }

    /// Takes a scan that has a pose.
    pub fn add(&mut self, found: &ScanAlignment) {
        let values = [found.overlap, found.known, found.free_space, found.unexplained];
        let lasts = [&mut self.overlaps, &mut self.known, &mut self.free_space, &mut self.unexplained];
        for (last, value) in lasts.into_iter().zip(values) {
            last.push_back(value);
            if last.len() > self.settings.scans {
                last.pop_front();
            }
        }
    }

    /// Whether the scan lies on the map as scans do and contradicts nothing.
    pub fn is_met(&self, found: &ScanAlignment) -> bool {
        // Of a scan that sees what none has seen, less lies on the map.
        let expected = self.overlap() * (found.known / self.known()).min(1.0);
        found.overlap >= self.settings.doubted_overlap * expected && !self.is_contradicted(found)
    }

    /// Overlap of a scan that sees what scans have seen of late, below which it is doubted.
    pub fn least_overlap(&self) -> f64 {
        self.settings.doubted_overlap * self.overlap()
    }

    /// Whether scan and map cannot both be, by what either sensor would have measured.
    pub fn is_contradicted(&self, found: &ScanAlignment) -> bool {
        // A few points may be anything, and of few points they are a large share.
        let few = FEW / (found.known * found.count as f64).max(1.0);
        found.unexplained > self.largest_unexplained() + self.settings.unexplained_excess + few
            || found.free_space > self.free_space() + self.settings.free_space_excess
    }

    /// Whether a scan alone says that its pose is right: the map explains all of it, and determines it.
    pub fn is_certain(&self, found: &ScanAlignment) -> bool {
        let full = found.overlap >= self.settings.certain_overlap * self.overlap();
        let explained = found.unexplained <= self.settings.certain_unexplained;
        found.free_directions.is_empty() && full && explained && !self.is_contradicted(found)
    }

    /// Whether a new room, or something that moves, may be all that is unexpected; `distance` is that from the expected
    /// pose, in voxels at the median range.
    pub fn may_be_new(&self, found: &ScanAlignment, distance: f64) -> bool {
        let settings = &self.settings;
        let (departed, arrived) = match distance <= settings.near {
            true => (settings.departed_excess_near, settings.arrived_excess_near),
            false => (settings.departed_excess, settings.arrived_excess),
        };
        found.free_space <= self.free_space() + departed
            && found.unexplained <= self.largest_unexplained() + arrived
    }

    /// Whether enough of the scan lies on the map, and determines its pose, where a point at a range counts.
    pub fn is_believable(&self, found: &ScanAlignment, range: f64) -> bool {
        let least = self.settings.least_overlap.max(self.settings.min_overlap * found.known);
        found.overlap >= least && found.deviation(range) <= self.settings.max_deviation
    }

    fn overlap(&self) -> f64 {
        median(self.overlaps.iter().copied().collect()).unwrap_or(self.settings.first_overlap)
    }

    /// Before any scan is known, all of one may be.
    fn known(&self) -> f64 {
        median(self.known.iter().copied().collect()).unwrap_or(1.0).max(f64::MIN_POSITIVE)
    }

    fn free_space(&self) -> f64 {
        median(self.free_space.iter().copied().collect()).unwrap_or(0.0)
    }

    /// Before any scan is known, all of one may be new.
    fn largest_unexplained(&self) -> f64 {
        self.unexplained.iter().copied().reduce(f64::max).unwrap_or(1.0)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::{FreeDirection, RigidTransform};
    use nalgebra::Matrix6;

    fn lying(overlap: f64, free_space: f64, unexplained: f64) -> ScanAlignment {
        ScanAlignment {
            T_map_scan: RigidTransform::identity(),
            covariance: Matrix6::identity(),
            count: 4000,
            overlap,
            free_space,
            known: 1.0,
            unexplained,
            systematic: Matrix6::zeros(),
            free_directions: Vec::new(),
            scans: Vec::new(),
            within: None,
        }
    }

    #[test]
    fn the_last_scans_say_what_is_expected() {
        let mut expectation = Expectation::new(&ExpectationSettings::default());
        // Before any scan only overlap and free space say something.
        assert!(expectation.is_met(&lying(0.4, 0.0, 0.9)));
        assert!(!expectation.is_met(&lying(0.3, 0.0, 0.0)));
        for unexplained in [0.0, 0.03, 0.01] {
            expectation.add(&lying(0.8, 0.02, unexplained));
        }
        assert!(expectation.is_met(&lying(0.69, 0.029, 0.044)));
        assert!(!expectation.is_met(&lying(0.67, 0.0, 0.0)));
        assert!(!expectation.is_met(&lying(0.8, 0.031, 0.0)));
        assert!(!expectation.is_met(&lying(0.8, 0.0, 0.046)));
        let free_directions = vec![FreeDirection::Translation { axis: [1.0, 0.0, 0.0] }];
        let slides = ScanAlignment { free_directions, ..lying(0.8, 0.0, 0.0) };
        assert!(expectation.is_met(&slides) && !expectation.is_certain(&slides));
        assert!(expectation.is_certain(&lying(0.75, 0.0, 0.019)));
        assert!(!expectation.is_certain(&lying(0.74, 0.0, 0.0)));
        assert!(!expectation.is_certain(&lying(0.8, 0.0, 0.021)));
        assert!(expectation.may_be_new(&lying(0.5, 0.06, 0.22), 1.0));
        assert!(!expectation.may_be_new(&lying(0.5, 0.0, 0.24), 1.0));
        assert!(!expectation.may_be_new(&lying(0.5, 0.08, 0.0), 1.0));
        assert!(expectation.may_be_new(&lying(0.5, 0.3, 0.4), 0.5));
        assert!(!expectation.may_be_new(&lying(0.5, 0.4, 0.0), 0.5));
    }

    #[test]
    fn scans_of_long_ago_are_forgotten() {
        let mut expectation = Expectation::new(&ExpectationSettings::default());
        expectation.add(&lying(0.9, 0.0, 0.5));
        for _ in 0..10 {
            expectation.add(&lying(0.5, 0.0, 0.0));
        }
        assert!(expectation.is_met(&lying(0.43, 0.0, 0.0)));
        assert!(!expectation.is_met(&lying(0.5, 0.0, 0.1)));
    }
}
