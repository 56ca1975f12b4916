//! The map as a surface to which a scan is fitted anew from where it was pushed.

use super::local_map::LocalMap;
use super::settings::ScanAlignmentSettings;
use crate::alignment::{Closeness, FittedSurface, LinearisedDistances};
use crate::geometry::RigidTransform;
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};
use nalgebra::Vector3;
use rayon::prelude::*;

/// Of the largest eigenvalue, below which a step has no part in a direction.
const UNDETERMINED: f64 = 1e-8;
/// Share of a pushed scan's points that must meet the map.
const LEAST_SHARE: f64 = 0.3;
/// Length of a step, in voxels, below which the fit has converged.
const CONVERGED: f64 = 0.01;
/// Points that one thread takes at a time.
const PART: usize = 64;

/// The map's points with their normals; lengths are in voxels.
pub(super) struct MapSurface<'a> {
    map: &'a LocalMap,
    /// Residual from which on a point is not explained.
    farthest: f64,
    settings: &'a ScanAlignmentSettings,
}

impl<'a> MapSurface<'a> {
    pub fn new(map: &'a LocalMap, farthest: f64, settings: &'a ScanAlignmentSettings) -> Self {
        Self { map, farthest, settings }
    }

    /// A point's distance along the normal of the map's nearest point, and that normal.
    fn residual(&self, point: &[f64; 3]) -> Option<(f64, Vector3<f64>)> {
        let reach = self.settings.rivals.push * self.settings.rival_radius + self.settings.max_point_distance;
        let nearest = self.map.nearest(*point, reach);
        let index = nearest.is_some().then_some(nearest.index)?;
        let normal = Vector3::from(self.map.normal(index)?);
        self.map.goes_on(index).then_some(())?;
        Some((
            normal.dot(&(Vector3::from(*point) - Vector3::from(self.map.points()[index as usize]))),
            normal,
        ))
    }

    fn residuals(&self, points: &[[f64; 3]]) -> Vec<Option<(f64, Vector3<f64>)>> {
        points.par_iter().with_min_len(PART).map(|point| self.residual(point)).collect()
    }
}

impl FittedSurface for MapSurface<'_> {
    fn fitted(&self, source: &[[f64; 3]], start: RigidTransform) -> Option<RigidTransform> {
        let mut pose = start;
        for _ in 0..self.settings.rival_steps {
            let moved = pose.transform_points(source);
            let residuals = self.residuals(&moved);
            let deviation =
                DEVIATIONS_PER_MEDIAN * median(residuals.iter().flatten().map(|(r, _)| r.abs()).collect())?;
            let limit = self.settings.max_deviation * deviation.max(self.settings.min_deviation);
            let rows: Vec<_> = moved
                .iter()
                .zip(&residuals)
                .filter_map(|(point, residual)| Some((Vector3::from(*point), (*residual)?)))
                .filter(|(_, (distance, _))| distance.abs() < limit)
                .map(|(point, (distance, normal))| (point, normal, distance))
                .collect();
            if (rows.len() as f64) < LEAST_SHARE * source.len() as f64 {
                return None;
            }
            let (change, length) = LinearisedDistances::new(&rows).step(UNDETERMINED);
            pose = change * pose;
            if length < CONVERGED {
                break;
            }
        }
        Some(pose)
    }

    fn closeness(&self, moved: &[[f64; 3]]) -> Closeness {
        let closeness = |distance: f64| (1.0 - (distance / self.farthest).powi(2)).max(0.0);
        self.residuals(moved).into_iter().map(|residual| residual.map(|(r, _)| closeness(r))).collect()
    }
}
