//! The tests of a pose of one piece on another: the same that a registration must survive.

use super::agreement::PiecePair;
use super::pose_search::{self, measured};
use super::result::PoseEvidence;
use crate::alignment::{
    Alternative, Closeness, Doubt, Explained, FittedSurface, FittedTarget, FreeDirection, GicpCloud, HIDDEN,
    PointToSurfaceSettings, Rivals, ScaleLimits, TargetSurface, free_directions, without_free_motion,
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
        let own = measured(self, T_target_source);
        let some = self.source.places(settings.examined_points);
        let rivals = Rivals {
            surface: BothViews { pair: self, best: *T_target_source },
            source: &some,
            T_target_source: *T_target_source,
            radius: self.radius(),
            settings: settings.rivals,
        };
        let best = rivals.explained();
        let surface = self.target_surface();
        let free_directions = self.free_directions(&surface, T_target_source);
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
        let (scale, doubt) = self.scale(&surface, &T_target_source.transform_points(&some));
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

    fn target_surface(&self) -> TargetSurface {
        let places = self.target.places(self.settings.surface_points);
        // Some of the points are farther from each other than all of them are.
        let thinner = self.target.points.len() as f64 / places.len().max(1) as f64;
        TargetSurface::new(places, self.target.voxel * thinner.sqrt())
    }

    /// Motions that the points do not determine which a pose brings to the target's surface, where that is smooth: at
    /// edges normals are those of no face, which would seem to hold motions.
    #[allow(non_snake_case)]
    fn free_directions(
        &self,
        surface: &TargetSurface,
        T_target_source: &RigidTransform,
    ) -> Vec<FreeDirection> {
        let settings = self.settings;
        let at_pose = PointToSurfaceSettings { max_iterations: 0, ..settings.point_to_surface };
        let places = self.source.places(settings.surface_points);
        if let Some(found) = surface.align(&places, *T_target_source, &at_pose) {
            let clouds = || [places, surface.points().to_vec()].map(GicpCloud::new);
            return found.free_directions(clouds, surface.voxel(), &settings.rivals);
        }
        // Pieces too small for that.
        let rows = self.residuals(T_target_source, settings.surface_points).into_iter();
        let (points, normals): (Vec<[f64; 3]>, Vec<[f64; 3]>) =
            rows.map(|(point, normal, _)| (<[f64; 3]>::from(point), <[f64; 3]>::from(normal))).unzip();
        free_directions(&points, &normals)
    }

    /// The scale of the source, of which some points are given in the target, and its standard error, and the doubt
    /// whether it is 1.
    fn scale(&self, surface: &TargetSurface, moved: &[[f64; 3]]) -> ([f64; 2], Option<Doubt>) {
        let settings = self.settings;
        let fit = PointToSurfaceSettings {
            max_distance: settings.rival_distance * self.radius() / self.target.voxel,
            ..settings.point_to_surface
        };
        let farthest = f64::from(self.target.tolerance);
        let target = FittedTarget { surface, farthest, fit, is_hidden: &|_| false };
        let best = Explained::new(target.closeness_of(moved), moved);
        let limits = ScaleLimits { doubted: settings.doubted_scale, deviations: settings.scale_deviations };
        let (scale, doubt) = target.scale(moved, &best, limits);
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

#[cfg(test)]
mod tests {
    use super::super::tests::{FLAT, sheet};
    use super::super::{PieceView, RecurrenceSettings, examine_poses};
    use super::*;
    use crate::Monitor;
    use crate::recurrences::ExaminedPose;

    /// So bent that it slides nowhere: a parabola is nearly a circle, which turns about its axis.
    const SHEET: [f64; 3] = [0.03, 0.03, -2e-3];

    /// The pose of a source on a target, both of which were scanned from the same place.
    fn examined(source: [f64; 3], target: [f64; 3]) -> ExaminedPose {
        let itself = RigidTransform::identity();
        let [source, target] = [source, target].map(|shape| sheet(shape, &itself));
        let center = |view: &PieceView| RigidTransform::from_rotation_vector([0.0; 3], view.center());
        let pose = center(&target).inverse() * center(&source);
        let settings = RecurrenceSettings::default();
        examine_poses(&[&source, &target], &[([0, 1], pose)], &settings, &Monitor::default())
            .unwrap()
            .remove(0)
    }

    fn names(found: &ExaminedPose) -> Vec<&'static str> {
        found.doubts.iter().map(Doubt::name).collect()
    }

    #[test]
    fn a_sheet_that_no_motion_brings_onto_itself_is_trusted() {
        let found = examined(SHEET, SHEET);
        assert_eq!(found.doubts, []);
        assert!(found.free_directions.is_empty() && found.alternatives.is_empty());
        let evidence = found.evidence;
        assert!((evidence.scale - 1.0).abs() < 4.0 * evidence.scale_standard_error + 1e-3, "{evidence:?}");
        assert!(evidence.overlap > 0.99 && evidence.free_space < 0.01, "{evidence:?}");
    }

    #[test]
    fn a_flat_sheet_slides_and_rotates_and_has_no_scale() {
        let found = examined(FLAT, FLAT);
        assert_eq!(names(&found), ["free_directions"]);
        assert_eq!(found.free_directions.len(), 3);
        assert!(found.evidence.scale.is_nan() && found.evidence.scale_standard_error.is_nan());
    }

    #[test]
    fn a_mirrored_sheet_is_told() {
        let [a, b, c] = SHEET;
        let found = examined([a, -b, c], SHEET);
        assert!(names(&found).contains(&"mirrored"), "{found:?}");
    }

    #[test]
    fn a_larger_sheet_is_told_with_its_scale() {
        let ([a, b, c], scale) = (SHEET, 1.05);
        let found = examined([a / scale, b / scale, c / scale.powi(2)], SHEET);
        assert!(names(&found).contains(&"scale"), "{found:?}");
        let evidence = found.evidence;
        assert!((evidence.scale - scale).abs() < 4.0 * evidence.scale_standard_error, "{evidence:?}");
    }

    #[test]
    fn what_a_pose_leaves_open_its_followers_do_too() {
        let itself = RigidTransform::identity();
        let [flat, bent] = [FLAT, SHEET].map(|shape| sheet(shape, &itself));
        let settings = RecurrenceSettings::default();
        let poses = [([0, 1], itself), ([1, 2], itself), ([3, 4], itself)];
        let found = |threads| {
            let settings = RecurrenceSettings { threads: Some(threads), ..settings.clone() };
            let views = [&flat, &flat, &flat, &bent, &bent];
            examine_poses(&views, &poses, &settings, &Monitor::default()).unwrap()
        };
        let one = found(1);
        assert_eq!(one.iter().map(|pose| pose.free_directions.len()).collect::<Vec<_>>(), [3, 3, 0]);
        assert_eq!(format!("{:?}", found(3)), format!("{one:?}"), "NaN is equal to nothing but in words");
        let missing = [([0, 5], itself)];
        assert!(examine_poses(&[&flat], &missing, &settings, &Monitor::default()).is_err());
    }
}
