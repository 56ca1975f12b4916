//! The tests of a pose of one piece on another: the same that a registration must survive.

use super::agreement::PiecePair;
use super::pose_search::{self, measured};
use super::result::PoseEvidence;
use crate::alignment::{
    Alternative, Closeness, Doubt, Explained, FittedSurface, FittedTarget, FreeDirection, HIDDEN, PointToSurface,
    PointToSurfaceSettings, Rivals, ScaleLimits, TargetSurface, without_free_motion,
};
use crate::depth_image::{DepthImage, Judgement, SurfacePlace};
use crate::geometry::RigidTransform;
use crate::random::{Generator, some_of};

/// Points of the target by which two poses are compared.
const COMPARED: usize = 60;

/// What the tests said of a pose.
pub(super) struct Examination {
    pub evidence: PoseEvidence,
    /// In the target's coordinates.
    pub free_directions: Vec<FreeDirection>,
    pub alternatives: Vec<Alternative>,
    /// That one of both is the other's mirror image, or has another size.
    pub doubts: Vec<Doubt>,
}

/// Poses of two pieces as both sensors saw them.
struct BothViews<'a> {
    pair: &'a PiecePair<'a>,
    /// By which it is known where points of the source are.
    best: RigidTransform,
}

impl FittedSurface for BothViews<'_> {
    fn fitted(&self, _: &[[f64; 3]], start: RigidTransform) -> Option<RigidTransform> {
        Some(self.pair.fitted(&start, self.pair.settings.fine_points))
    }

    /// Of the source's points in the target's depth image, then of the target's in the source's.
    #[allow(non_snake_case)]
    fn closeness(&self, _: &[[f64; 3]], T_target_source: &RigidTransform) -> Closeness {
        let PiecePair { source, target, .. } = self.pair;
        let mut there =
            seen_closeness(&target.image, T_target_source, self.some(&source.points), target.tolerance);
        let back = T_target_source.inverse();
        there.extend(seen_closeness(&source.image, &back, self.some(&target.points), source.tolerance));
        there
    }

    fn places(&self, source: &[[f64; 3]]) -> Vec<[f64; 3]> {
        let mut places = self.best.transform_points(source);
        places.extend(self.some(&self.pair.target.points).iter().map(|point| point.place.map(f64::from)));
        places
    }
}

impl BothViews<'_> {
    /// Those of a piece's points that tell poses apart.
    fn some<'b>(&self, points: &'b [SurfacePlace]) -> &'b [SurfacePlace] {
        &points[..self.pair.settings.examined_points.min(points.len())]
    }
}

/// 1 for points that are on the surface that was seen, 0 for those that should have been seen there and were not.
fn seen_closeness(
    image: &DepthImage,
    pose: &RigidTransform,
    points: &[SurfacePlace],
    tolerance: f32,
) -> Closeness {
    let to_image = image.to_image(pose);
    let of_point = |point: &SurfacePlace| {
        let found = image.count(&to_image, &[*point], tolerance);
        Some(if found.contradicted + found.missing + found.mismatched > 0 {
            0.0
        } else if found.confirmed > 0 {
            1.0
        } else {
            HIDDEN
        })
    };
    points.iter().map(of_point).collect()
}

/// The share of points in free space, of those in sight: where the sensor looked through, or would have seen something.
fn free_space(judgements: &[Judgement; 2]) -> f64 {
    let of_side = |side: &Judgement| {
        let wrong = side.contradicted + side.missing;
        f64::from(wrong / (side.confirmed + side.mismatched + wrong).max(f32::MIN_POSITIVE))
    };
    of_side(&judgements[0]).max(of_side(&judgements[1]))
}

/// The share of points in sight that are not where the other sensor saw the surface.
fn disagreement(judgements: &[Judgement; 2]) -> f64 {
    let of_side = |side: &Judgement| {
        let wrong = side.contradicted + side.missing + side.mismatched;
        f64::from(wrong / (side.confirmed + wrong).max(f32::MIN_POSITIVE))
    };
    of_side(&judgements[0]).max(of_side(&judgements[1]))
}

impl PiecePair<'_> {
    /// Tries to refute a pose T_target_source; `key` is that of the random choices.
    #[allow(non_snake_case)]
    pub fn examined(&self, T_target_source: &RigidTransform, key: &[u64]) -> Examination {
        let settings = self.settings;
        let radius = self.radius();
        let own = measured(self, T_target_source);
        let surface = TargetSurface::new(self.target.places(), self.target.voxel);
        let all = self.source.places();
        let some = &all[..settings.examined_points.min(all.len())];
        let rivals = Rivals {
            surface: BothViews { pair: self, best: *T_target_source },
            source: some,
            T_target_source: *T_target_source,
            radius,
            settings: settings.rivals,
        };
        let best = rivals.explained();
        let fit = surface.align(some, *T_target_source, &settings.point_to_surface);
        let no_fit = Vec::new();
        let (points, normals) = fit.as_ref().map_or((&no_fit, &no_fit), |fit| (&fit.points, &fit.normals));
        let free_directions = rivals.free_directions(&best, points, normals);
        let leads_elsewhere =
            |one: &RigidTransform, other: &RigidTransform| self.is_elsewhere(one, other, &free_directions);
        let proposed = self.rivals(T_target_source, leads_elsewhere, &mut Generator::new(key));
        let share = free_space(&own.judgements);
        let mut alternatives: Vec<Alternative> = Vec::new();
        for (transform, explained) in
            rivals.as_good_as_the_best(&best, &proposed, |_| settings.rivals.deficit)
        {
            let free_space = self.free_space(&transform);
            let is_other = alternatives
                .iter()
                .map(|one| &one.T_target_source)
                .chain([T_target_source])
                .all(|other| leads_elsewhere(&transform, other));
            if is_other
                && explained >= settings.least_explained * best.share()
                && free_space <= share + settings.free_space_excess
            {
                alternatives.push(Alternative { T_target_source: transform, explained, free_space });
            }
        }
        let (scale, doubt) =
            fit.map_or(([f64::NAN; 2], None), |fit| self.scale(&surface, &fit, some, radius));
        let mut doubts: Vec<Doubt> = doubt.into_iter().collect();
        doubts.extend(self.mirrored(&own.judgements, key));
        let evidence = PoseEvidence {
            overlap: 0.5 * own.judgements.iter().map(|side| f64::from(side.confirmed)).sum::<f64>(),
            explained: best.share(),
            free_space: share,
            scale: scale[0],
            scale_standard_error: scale[1],
        };
        Examination { evidence, free_directions, alternatives, doubts }
    }
}

impl PiecePair<'_> {
    /// The share of points that a pose T_target_source brings into the free space of the other sensor.
    pub fn free_space(&self, pose: &RigidTransform) -> f64 {
        free_space(&self.judgements(pose))
    }

    /// The unit of the lengths in [`crate::RivalSettings`].
    pub fn radius(&self) -> f64 {
        self.settings.radius_share * self.source.extent.min(self.target.extent)
    }

    /// Whether two poses T_target_source differ by more than a motion that is free.
    pub fn is_elsewhere(&self, one: &RigidTransform, other: &RigidTransform, free: &[FreeDirection]) -> bool {
        let motion = *one * other.inverse();
        let rest = without_free_motion(&motion, free, [0.0; 3], self.target.extent);
        let some = some_of(self.target.points.len(), COMPARED);
        let places = some.into_iter().map(|number| self.target.points[number].place.map(f64::from));
        let distance = rest.displacement_from(&RigidTransform::identity(), places);
        distance > self.settings.rivals.distance * self.radius()
    }

    /// The scale of the source and its standard error, and the doubt whether it is 1.
    fn scale(
        &self,
        surface: &TargetSurface,
        fit: &PointToSurface,
        some: &[[f64; 3]],
        radius: f64,
    ) -> ([f64; 2], Option<Doubt>) {
        let settings = self.settings;
        let wide = PointToSurfaceSettings {
            max_distance: settings.rival_distance * radius / self.target.voxel,
            ..settings.point_to_surface
        };
        let target = FittedTarget { surface, farthest: fit.farthest, fit: wide, is_hidden: &|_| false };
        let moved = fit.T_target_source.transform_points(some);
        let best = Explained::new(target.closeness_of(&moved), some);
        let limits = ScaleLimits { doubted: settings.doubted_scale, deviations: settings.scale_deviations };
        let (scale, doubt) = target.scale(&moved, &best, limits);
        (scale.map_or([f64::NAN; 2], |found| [found.scale, found.standard_error]), doubt)
    }

    /// The doubt whether the source's mirror image lies better on the target, where a part of what is in sight disagrees.
    fn mirrored(&self, own: &[Judgement; 2], key: &[u64]) -> Option<Doubt> {
        let settings = self.settings;
        let own_share = disagreement(own);
        if own_share <= settings.doubted_disagreement {
            return None;
        }
        let source = self.source.mirrored();
        let mirrored = PiecePair { source: &source, ..*self };
        let found = pose_search::align(&mirrored, key)?;
        let confirmed = |sides: &[Judgement; 2]| sides[0].confirmed + sides[1].confirmed;
        let is_better = disagreement(&found.judgements) < settings.mirrored_disagreement * own_share
            && confirmed(&found.judgements) >= confirmed(own);
        let inliers = f64::from(found.judgements[0].confirmed) * source.points.len() as f64;
        is_better.then_some(Doubt::Mirrored { inliers: inliers.round() as usize })
    }
}
