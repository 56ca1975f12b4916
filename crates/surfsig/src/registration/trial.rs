//! Which of the transforms that were proposed is the best one, and what its tests say.

use super::face_search::{FaceCandidate, FaceSearch, Faced, SAME_SIDE};
use super::judgement::{Faces, Judge, Judgement, Support};
use crate::alignment::{Correspondences, Doubt, GicpSettings, PointToSurface, gicp};
use crate::geometry::RigidTransform;
use crate::{Error, Monitor};
use nalgebra::Vector3;

/// Two scans about their middles, with all by which transforms are refined and judged.
pub(super) struct Trial<'a> {
    pub judge: Judge<'a>,
    /// The source and the target with the sides from which they were seen, where both viewpoints are known.
    pub sides: Option<[Faced<'a>; 2]>,
    /// `None` where a start was given.
    pub matches: Option<&'a Correspondences>,
    pub monitor: &'a Monitor,
}

/// A transform that was refined and judged.
pub(super) struct Tried {
    pub found: PointToSurface,
    pub judged: Judgement,
    /// The matches that agree; `None` where a start was given.
    pub inliers: Option<usize>,
    /// Whether transforms by faces were among those that were proposed.
    pub is_by_faces: bool,
}

impl Tried {
    fn is_doubted(&self, of_kind: impl Fn(&Doubt) -> bool) -> bool {
        self.judged.doubts.iter().any(of_kind)
    }
}

impl Trial<'_> {
    /// The best of proposed transforms; where matches do not prove it, or a sensor refutes it, also of those by faces.
    /// `None` where none brings the scans together.
    pub fn best(&self, proposals: &[RigidTransform]) -> Result<Option<Tried>, Error> {
        let by_matches = self.tried(proposals, None)?;
        let is_refuted = by_matches
            .as_ref()
            .is_none_or(|tried| tried.is_doubted(|doubt| matches!(doubt, Doubt::FreeSpace { .. })));
        let is_unproved = by_matches
            .as_ref()
            .is_some_and(|tried| tried.is_doubted(|doubt| matches!(doubt, Doubt::FewMatches { .. })));
        if self.matches.is_none() || !(is_refuted || is_unproved) {
            return Ok(by_matches);
        }
        let Some([source, target]) = &self.sides else { return Ok(by_matches) };
        let settings = self.judge.settings;
        let search = FaceSearch {
            source,
            target,
            sensors: &self.judge.sensors,
            voxel: self.judge.voxel,
            distance: settings.rivals.distance * self.judge.radius,
            settings: settings.faces,
        };
        let candidates = search.candidates(false);
        if candidates.is_empty() {
            return Ok(by_matches);
        }
        let transforms_of = |candidates: &[FaceCandidate]| -> Vec<RigidTransform> {
            candidates.iter().map(|candidate| candidate.T_target_source).collect()
        };
        let mirrored = transforms_of(&search.candidates(true));
        let faces = Faces { mirrored: &mirrored, is_exclusive: search.is_exclusive(&candidates) };
        let transforms = [&transforms_of(&candidates), proposals].concat();
        let by_faces = self.tried(&transforms, Some(faces))?;
        let is_better = |by_faces: &Tried| {
            by_faces.judged.doubts.is_empty()
                || is_refuted && by_faces.judged.free_space <= settings.free_space.doubted_share
        };
        Ok(by_faces.filter(is_better).or(by_matches))
    }

    /// The first transform, refined and judged beside the others, or another one that is better.
    fn tried(&self, proposals: &[RigidTransform], faces: Option<Faces<'_>>) -> Result<Option<Tried>, Error> {
        let Some((first, others)) = proposals.split_first() else { return Ok(None) };
        self.monitor.check()?;
        let Judge { sample, settings, radius, .. } = self.judge;
        let align = |start: RigidTransform| self.aligned(start);
        let Some(found) = align(self.refined(*first)) else { return Ok(None) };
        self.monitor.check()?;
        let moved = found.T_target_source.displacement_from(first, sample.iter().copied());
        let is_by_faces = faces.is_some();
        let support = |found: &PointToSurface, is_first: bool| Support {
            inliers: self.matches.map(|matches| matches.inlier_count(&found.T_target_source)),
            faces: faces.map(|faces| Faces { is_exclusive: is_first && faces.is_exclusive, ..faces }),
        };
        let own = support(&found, moved <= settings.rivals.distance * radius);
        let judged = self.judge.judged(&found, others, own);
        let Some(better) = judged.better.and_then(align) else {
            return Ok(Some(Tried { found, judged, inliers: own.inliers, is_by_faces }));
        };
        let others: Vec<RigidTransform> = others.iter().copied().chain([found.T_target_source]).collect();
        let own = support(&better, false);
        let judged = self.judge.judged(&better, &others, own);
        Ok(Some(Tried { found: better, judged, inliers: own.inliers, is_by_faces }))
    }

    /// Whether the nearest of the target's points shows the other side of the surface: scans from two rooms see both
    /// sides of a wall, which would pull each other together.
    fn sees_other_side(&self, point: [f64; 3], transform: &RigidTransform, near: f64) -> bool {
        let cosine = || {
            let [source, target] = self.sides.as_ref()?;
            let own = source.normal_near(point, near)?;
            let other = target.normal_near(transform.transform_point(point), near)?;
            Some(Vector3::from(transform.transform_vector(own.into())).dot(&other))
        };
        cosine().is_some_and(|cosine| cosine < -SAME_SIDE)
    }

    /// Fits the points of the sample to the surface, but for those that see the other side of it.
    fn aligned(&self, start: RigidTransform) -> Option<PointToSurface> {
        let Judge { surface, sample, settings, .. } = self.judge;
        let near = settings.point_to_surface.max_distance * self.judge.voxel;
        let kept: Vec<[f64; 3]> =
            sample.iter().filter(|point| !self.sees_other_side(**point, &start, near)).copied().collect();
        let mut found = surface.align(&kept, start, &settings.point_to_surface)?;
        found.overlap *= kept.len() as f64 / sample.len() as f64;
        Some(found)
    }

    /// By generalised ICP, in voxels, without points that see the other side of the surface; a transform without
    /// correspondences stays as it was proposed.
    fn refined(&self, proposed: RigidTransform) -> RigidTransform {
        let settings = self.judge.settings;
        let [source, target] = self.judge.clouds;
        let near = settings.gicp_distances[0] * self.judge.voxel;
        // Where sides are not known, all points stay.
        let kept =
            self.sides.as_ref().map(|_| source.some(|point| !self.sees_other_side(point, &proposed, near)));
        let source = kept.as_ref().unwrap_or(source);
        let mut transform = proposed;
        for distance in settings.gicp_distances {
            let [rotation_epsilon, translation] = settings.gicp_epsilon;
            let round = GicpSettings {
                max_correspondence_distance: distance * self.judge.voxel,
                max_iterations: settings.gicp_iterations,
                rotation_epsilon,
                translation_epsilon: translation * self.judge.voxel,
            };
            let found = gicp(target, source, transform, &round);
            if found.inliers == 0 {
                return proposed;
            }
            transform = found.T_target_source;
        }
        transform
    }
}
