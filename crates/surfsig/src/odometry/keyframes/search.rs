//! Where a sensor is that was lost: the keyframes that see as far as its scan, or whose keypoints match those of it.

use super::super::local_map::LocalMap;
use super::super::motions::{different_poses, distance_at_range};
use super::super::rotation_search::{points_near, some_points};
use super::super::scan_alignment::{ScanAlignment, Start, align, align_roughly};
use super::super::settings::RelocalisationSettings;
use super::super::thinned_scan::ThinnedScan;
use super::panorama::Panorama;
use super::ranges::Ranges;
use super::{Keyframe, Keyframes, Which, in_float32};
use crate::alignment::{ConsensusSettings, Correspondences};
use crate::field::{KeypointOptions, keypoints_within, match_fields};
use crate::{FieldOptions, FieldPlaces, Monitor, PointCloud, Radius, RigidTransform};
use rayon::prelude::*;

/// How a scan is searched among keyframes.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(in super::super) enum By {
    /// How far it sees all around: little work, but the sensor is turned about its z axis alone, and sees as much.
    Panorama,
    /// Signatures of keypoints.
    Signatures,
}

impl Keyframes {
    /// Of the poses that a search proposes, the one that lies best on the map of the keyframes around it, and that map.
    /// `last` is where the sensor was.
    pub fn find(
        &mut self,
        scan: &ThinnedScan,
        last: &RigidTransform,
        map_range: f64,
        by: By,
        is_believed: impl Fn(&ScanAlignment) -> bool,
    ) -> Option<(ScanAlignment, LocalMap)> {
        let settings = &self.settings.relocalisation;
        let reach = settings.max_correspondence_distance;
        let (proposals, distance) = match by {
            // As far off as keyframes are from each other.
            By::Panorama => (self.panoramas(scan), reach.max(settings.keyframe_distance * self.median_range)),
            By::Signatures => (self.proposals(scan, last), reach),
        };
        let settings = &self.settings.relocalisation;
        let some = some_points(scan.coarse.points(), settings.rotation_points);
        let on_map = |pose: RigidTransform| {
            let map = self.map_next_to(&pose);
            let pose = align_roughly(scan, &map, pose, distance, &self.settings.alignment)?;
            Some((points_near(&some, &map, &pose, settings.rotation_distance), pose))
        };
        // To align costs as much as a tracked scan does; of equally good ones the first was proposed first.
        let best = proposals.into_iter().filter_map(on_map).rev().max_by_key(|(near, _)| *near);
        let found = best.and_then(|(_, pose)| {
            let map = self.map_of(pose.translation.into(), map_range, |_| true);
            let known = |pose: &RigidTransform| self.would_have_seen(pose, Which::All);
            let found = align(scan, &map, Start::near(pose, reach), &self.settings.alignment, known)?;
            is_believed(&found).then_some((found, map))
        });
        let found =
            found.filter(|(found, _)| by == By::Signatures || self.do_matches_say(scan, &found.T_map_scan));
        if found.is_some() {
            self.searched.clear();
        }
        found
    }

    /// Whether matches with the keyframe next to a pose propose the same: along a corridor there are other places that a
    /// scan fits to.
    fn do_matches_say(&mut self, scan: &ThinnedScan, pose: &RigidTransform) -> bool {
        let range = self.median_range;
        let apart = |other: &RigidTransform| distance_at_range(range, &(other.inverse() * *pose));
        let to_keyframe = |number: &usize| apart(&self.kept[*number].T_map_scan);
        let nearest = (0..self.kept.len()).min_by(|a, b| to_keyframe(a).total_cmp(&to_keyframe(b)));
        let Some(number) = nearest else { return false };
        let settings = &self.settings.relocalisation;
        let ours = described(&in_float32(&scan.means(settings.detail_voxel)), self.patch_radius, settings);
        let matched = self.matched(number, &ours);
        self.forget_descriptions();
        let settings = &self.settings.relocalisation;
        matched.is_some_and(|(agree, matched)| {
            agree >= settings.confirming_matches && apart(&matched) <= settings.confirming_distance
        })
    }

    /// The pose of a scan that most matches with a keyframe agree with, and how many, if they are enough.
    fn matched(&mut self, number: usize, ours: &FieldPlaces) -> Option<(usize, RigidTransform)> {
        let (radius, settings) = (self.patch_radius, &self.settings.relocalisation);
        let keyframe = &mut self.kept[number];
        if keyframe.described.is_none() {
            self.described.push_back(keyframe.number);
        }
        let theirs = keyframe.described.get_or_insert_with(|| described(&keyframe.detail, radius, settings));
        let found = match_fields(ours, theirs, true);
        let matches = Correspondences::new(&found, ours, theirs, ConsensusSettings::default());
        let transform = matches.agreed_transform();
        let agree = matches.inlier_count(&transform);
        (agree >= settings.min_matches).then(|| (agree, keyframe.T_map_scan * transform))
    }

    /// Poses at the keyframes that see as far all around as a scan does, if it is turned.
    fn panoramas(&self, scan: &ThinnedScan) -> Vec<RigidTransform> {
        let panorama = Panorama::new(scan.coarse.points());
        let compared = |keyframe: &Keyframe| {
            let (difference, angle) = keyframe.panorama.compared(&panorama);
            let turn = RigidTransform::from_rotation_vector([0.0, 0.0, angle], [0.0; 3]);
            (difference, keyframe.T_map_scan * turn)
        };
        let mut poses: Vec<(f32, RigidTransform)> = self.kept.par_iter().map(compared).collect();
        poses.sort_by(|a, b| a.0.total_cmp(&b.0));
        let settings = &self.settings.relocalisation;
        let apart = settings.keyframe_distance * self.median_range;
        self.distinct(poses.into_iter().map(|(_, pose)| pose), apart)
    }

    /// The first poses that are apart from those before, as many as are tried.
    fn distinct(&self, poses: impl Iterator<Item = RigidTransform>, apart: f64) -> Vec<RigidTransform> {
        different_poses(poses, self.median_range, apart, self.settings.relocalisation.max_trials)
    }

    /// The keyframes that are searched now: half of them the nearest to where the sensor was, the others those that see
    /// about as far as the scan, of these first what has not been searched.
    fn chosen(&mut self, scan: &ThinnedScan, last: &RigidTransform) -> Vec<usize> {
        let most = self.settings.relocalisation.max_keyframes.min(self.kept.len());
        let distance = |number: &usize| (self.kept[*number].T_map_scan.translation - last.translation).norm();
        let ranges = Ranges::new(scan.coarse.points());
        let difference = |number: &usize| self.kept[*number].ranges.difference(&ranges);
        let mut nearest: Vec<usize> = (0..self.kept.len()).collect();
        nearest.sort_by(|a, b| distance(a).total_cmp(&distance(b)));
        let mut alike: Vec<usize> = nearest.split_off(most.div_ceil(2));
        if alike.iter().all(|number| self.searched.contains(&self.kept[*number].number)) {
            self.searched.clear();
        }
        alike.sort_by(|a, b| {
            let is_searched = |number: &usize| self.searched.contains(&self.kept[*number].number);
            is_searched(a).cmp(&is_searched(b)).then(difference(a).total_cmp(&difference(b)))
        });
        alike.truncate(most - nearest.len());
        // By turns, so that the likeliest of either kind come first.
        let mut chosen = Vec::new();
        let mut alike = alike.into_iter();
        for number in nearest {
            chosen.extend([alike.next(), Some(number)].into_iter().flatten());
        }
        chosen
    }

    /// Poses of a scan that enough matches with a keyframe agree with, those of most matches first.
    fn proposals(&mut self, scan: &ThinnedScan, last: &RigidTransform) -> Vec<RigidTransform> {
        let chosen = self.chosen(scan, last);
        if chosen.is_empty() {
            return Vec::new();
        }
        let radius = self.patch_radius;
        let settings = &self.settings.relocalisation;
        let ours = described(&in_float32(&scan.means(settings.detail_voxel)), radius, settings);
        let mut proposals: Vec<(usize, RigidTransform)> = Vec::new();
        let mut newly_described = 0;
        for number in chosen {
            let keyframe = &self.kept[number];
            newly_described += usize::from(keyframe.described.is_none());
            if keyframe.described.is_none() && newly_described > self.settings.relocalisation.max_described {
                continue;
            }
            self.searched.insert(keyframe.number);
            proposals.extend(self.matched(number, &ours));
        }
        self.forget_descriptions();
        proposals.sort_by_key(|(agree, _)| std::cmp::Reverse(*agree));
        let apart = self.settings.prediction.min_correspondence_distance;
        self.distinct(proposals.into_iter().map(|(_, pose)| pose), apart)
    }

    /// Forgets the oldest descriptions, where there are too many: each takes more than all else of its keyframe.
    fn forget_descriptions(&mut self) {
        while self.described.len() > self.settings.relocalisation.max_descriptions {
            let oldest = self.described.pop_front();
            if let Some(keyframe) = self.kept.iter_mut().find(|keyframe| Some(keyframe.number) == oldest) {
                keyframe.described = None;
            }
        }
    }
}

/// The keypoints of a scan about its sensor; none where it has no patch.
fn described(points: &[[f32; 3]], radius: f64, settings: &RelocalisationSettings) -> FieldPlaces {
    let options = FieldOptions { viewpoint: Some([0.0; 3]), ..Default::default() };
    let keypoints = KeypointOptions {
        count: settings.keypoints,
        candidates_per_radius: settings.candidates_per_radius,
        compared: settings.compared,
        ..Default::default()
    };
    let found = Radius::new(radius).and_then(|radius| {
        let (cloud, monitor) = (PointCloud::new(points), Monitor::default());
        keypoints_within(&cloud, radius, &keypoints, &options, &monitor)
    });
    found.unwrap_or_else(|_| FieldPlaces::new(radius))
}

#[cfg(test)]
mod tests {
    use super::super::super::settings::OdometrySettings;
    use super::*;
    use crate::random::uniform;

    #[test]
    fn the_oldest_descriptions_are_forgotten() {
        let mut settings = OdometrySettings::default();
        settings.relocalisation.max_descriptions = 3;
        let at = |i: usize, k: u64| uniform(i, k) - 0.5;
        let floor = (0..4000).map(|i| [40.0 * at(i, 0), 40.0 * at(i, 1), -4.0]);
        let scan = ThinnedScan::of_one_moment(floor.collect(), &settings);
        let mut keyframes = Keyframes::new(&settings, 15.0, 5.0);
        for number in 0..8 {
            let pose = RigidTransform::from_rotation_vector([0.0; 3], [10.0 * f64::from(number), 0.0, 0.0]);
            assert!(keyframes.offer(&scan, &pose, number));
        }
        for _ in 0..6 {
            keyframes.proposals(&scan, &RigidTransform::identity());
            let kept: Vec<u32> = keyframes
                .kept
                .iter()
                .filter(|keyframe| keyframe.described.is_some())
                .map(|one| one.number)
                .collect();
            assert!(!kept.is_empty() && kept.len() <= 3, "{kept:?}");
            assert_eq!(kept.len(), keyframes.described.len());
        }
    }

    #[test]
    fn a_scan_was_found_where_only_the_walls_were_alike() {
        let settings = OdometrySettings::default();
        let at = |i: usize, k: u64| uniform(i, k) - 0.5;
        let scan = |kind: u64| {
            let boxes = (0..12_000).map(|i| {
                let middle = [0, 1, 2].map(|k| [50.0, 40.0, 16.0][k] * at(i / 600, 10 * kind + k as u64));
                let mut point = [0, 1, 2].map(|k| 5.0 * at(i, k));
                point[i % 3] = if i % 2 == 0 { 2.5 } else { -2.5 };
                [0, 1, 2].map(|k| middle[k] + point[k])
            });
            let floor = (0..6000).map(|i| [60.0 * at(i, 3), 60.0 * at(i, 4), -9.0]);
            ThinnedScan::of_one_moment(floor.chain(boxes).collect(), &settings)
        };
        let here = RigidTransform::identity();
        let mut keyframes = Keyframes::new(&settings, 20.0, 5.0);
        assert!(keyframes.offer(&scan(1), &here, 0));
        assert!(keyframes.do_matches_say(&scan(1), &here));
        let beside = RigidTransform::from_rotation_vector([0.0; 3], [2.0, 0.0, 0.0]);
        assert!(!keyframes.do_matches_say(&scan(1), &beside));
        assert!(!keyframes.do_matches_say(&scan(2), &here));
    }
}
