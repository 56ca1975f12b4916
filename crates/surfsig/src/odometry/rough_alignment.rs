//! Many starts, of which some of a scan's points tell the likeliest.

use super::local_map::LocalMap;
use super::motions::different_poses;
use super::rotation_search::{points_near, some_points};
use super::scan_alignment::align_roughly;
use super::settings::OdometrySettings;
use super::thinned_scan::ThinnedScan;
use crate::RigidTransform;

/// How starts are tried; lengths are in voxels.
pub(super) struct Trials<'a> {
    pub settings: &'a OdometrySettings,
    /// Of corresponding points, at most.
    pub distance: f64,
    /// Range at which poses are compared.
    pub range: f64,
}

impl Trials<'_> {
    /// Where starts lead to with some of a scan's points, of which `least` and more come near the map: the pose with most
    /// of them, and those with nearly as many that are others. To align costs as much as a tracked scan does.
    pub fn likeliest(
        &self,
        scan: &ThinnedScan,
        map: &LocalMap,
        starts: impl IntoIterator<Item = RigidTransform>,
        least: usize,
    ) -> Vec<RigidTransform> {
        let settings = &self.settings.relocalisation;
        let some = some_points(scan.coarse.points(), settings.rotation_points);
        let tried = |start: RigidTransform| {
            let pose = align_roughly(scan, map, start, self.distance, &self.settings.alignment)?;
            Some((points_near(&some, map, &pose, settings.rotation_distance), pose))
        };
        let mut tried: Vec<(usize, RigidTransform)> = starts.into_iter().filter_map(tried).collect();
        tried.sort_by_key(|(near, _)| std::cmp::Reverse(*near));
        let fewer = (settings.overlap_gain * some.len() as f64) as usize;
        let least = tried.first().map_or(0, |(most, _)| most.saturating_sub(fewer)).max(least);
        let likely = tried.into_iter().filter(|(near, _)| *near >= least).map(|(_, pose)| pose);
        let apart = self.settings.prediction.min_correspondence_distance;
        different_poses(likely, self.range, apart, usize::MAX)
    }
}
