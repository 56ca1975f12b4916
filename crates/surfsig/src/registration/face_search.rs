//! Where matches find no transform that both sensors allow: transforms that take faces onto faces, of which nearly all
//! put surface where a sensor looked through (Huber and Hebert, Fully automatic registration of multiple 3D data sets,
//! 2003, judge so what matches propose).

use super::free_space::BothSensors;
use super::settings::FaceSettings;
use crate::alignment::{FaceOffsets, FacedPoints, GicpCloud, GicpTarget, face_transforms};
use crate::geometry::RigidTransform;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Two scans about their middles, both with a viewpoint.
pub(super) struct FaceSearch<'a> {
    pub source: &'a Faced<'a>,
    pub target: &'a Faced<'a>,
    pub sensors: &'a BothSensors<'a>,
    /// Distance between the clouds' points.
    pub voxel: f64,
    /// Root mean square of the distances by which another transform moves points elsewhere, at least.
    pub distance: f64,
    pub settings: FaceSettings,
}

/// A scan's points with the sides from which they were seen, and some of them.
pub(super) struct Faced<'a> {
    cloud: &'a GicpCloud,
    all: FacedPoints,
    some: FacedPoints,
}

impl<'a> Faced<'a> {
    pub fn new(cloud: &'a GicpCloud, viewpoint: [f64; 3], settings: &FaceSettings) -> Self {
        let all = FacedPoints::seen_from(viewpoint, cloud.points(), cloud.normals());
        let some = all.some(settings.points);
        Self { cloud, all, some }
    }

    /// The unit normal of the point nearest to a position, on the side from which it was seen.
    pub fn normal_near(&self, position: [f64; 3], near: f64) -> Option<Vector3<f64>> {
        self.cloud.nearest(position, near).map(|number| self.all.normals[number as usize].into())
    }

    /// The share of another scan's points that lie on this one, seen from the same side.
    fn explained(&self, other: &FacedPoints, transform: &RigidTransform, near: f64) -> f64 {
        let lies_on = |(point, normal): &(&[f64; 3], &[f64; 3])| {
            let normal = Vector3::from(transform.transform_vector(**normal));
            self.normal_near(transform.transform_point(**point), near)
                .is_some_and(|nearest| normal.dot(&nearest) > SAME_SIDE)
        };
        let count = other.points.iter().zip(&other.normals).filter(lies_on).count();
        count as f64 / other.points.len().max(1) as f64
    }
}

/// Cosine of the angle between the normals of one surface in both scans, at least (45 degrees): noise and edges turn
/// them.
pub(super) const SAME_SIDE: f64 = 0.7;

/// Of so many points one tells at first whether a transform is worth more; so many times the share must then lie in free
/// space.
const FEW: usize = 4;

/// A transform with what speaks for it.
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy)]
pub(super) struct FaceCandidate {
    pub T_target_source: RigidTransform,
    /// The larger share of one scan that lies on the other, less what lies in free space.
    pub score: f64,
}

impl FaceSearch<'_> {
    /// Transforms that differ, the best first; of the source's mirror image, if that is wanted.
    pub fn candidates(&self, mirrored: bool) -> Vec<FaceCandidate> {
        let settings = &self.settings;
        let offsets =
            FaceOffsets { step: self.voxel, most: settings.translations, least_share: settings.least_share };
        let proposed = face_transforms(&self.source.all, &self.target.all, offsets, mirrored);
        // Few points refute most of them.
        let few = [self.source, self.target].map(|side| side.some.some(settings.points / FEW));
        let least = settings.least_in_sight * settings.points as f64;
        let at_first = self.sensors.with_points(&few[0].points, &few[1].points, least as usize / FEW);
        let sensors =
            self.sensors.with_points(&self.source.some.points, &self.target.some.points, least as usize);
        let scored = |transform: &RigidTransform| -> Option<FaceCandidate> {
            if at_first.free_space(transform) > FEW as f64 * settings.refuting_share {
                return None;
            }
            let free_space = sensors.free_space(transform);
            // NaN where neither sensor would have seen anything of the other's scan.
            let part = 1.0 - free_space / settings.refuting_share;
            if part.is_nan() || part <= 0.0 {
                return None;
            }
            let near = settings.near * self.voxel;
            let on_target = self.target.explained(&self.source.some, transform, near);
            let on_source = self.source.explained(&self.target.some, &transform.inverse(), near);
            let score = on_target.max(on_source) * part;
            (score > 0.0).then_some(FaceCandidate { T_target_source: *transform, score })
        };
        let mut scored: Vec<FaceCandidate> =
            proposed.par_iter().with_min_len(16).filter_map(scored).collect();
        // A stable sort: of equal scores the one that was proposed first.
        scored.sort_by(|a, b| b.score.total_cmp(&a.score));
        let mut chosen: Vec<FaceCandidate> = Vec::new();
        for candidate in scored {
            if chosen.len() == settings.candidates {
                break;
            }
            let differs = |other: &FaceCandidate| {
                let points = self.source.some.points.iter().copied();
                candidate.T_target_source.displacement_from(&other.T_target_source, points) > self.distance
            };
            if chosen.iter().all(differs) {
                chosen.push(candidate);
            }
        }
        chosen
    }

    /// Whether the first of the candidates explains much, and none of the others nearly as much.
    pub fn is_exclusive(&self, candidates: &[FaceCandidate]) -> bool {
        let [best, others @ ..] = candidates else { return false };
        let settings = &self.settings;
        let largest = settings.rival_share * best.score;
        best.score >= settings.certain_score && others.first().is_none_or(|other| other.score <= largest)
    }
}
