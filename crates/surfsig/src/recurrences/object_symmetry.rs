//! Motions after which an object, as far as all pieces of a group show it, looks the same.

use super::agreement::PiecePair;
use super::{PieceView, RecurrenceSettings};
use crate::alignment::{
    FittedTarget, FreeDirection, PointToSurfaceSettings, Rivals, TargetSurface, free_directions, symmetries,
};
use crate::depth_image::{Counts, SurfacePlace};
use crate::geometry::RigidTransform;
use crate::random::some_of;

/// A piece, and its pose T_piece_first on the first one of its group.
pub(super) type Member<'a> = (&'a PieceView, RigidTransform);

/// A motion of the first piece, about its centre, after which the object looks the same.
pub(super) struct ObjectSymmetry {
    pub motion: RigidTransform,
    /// The share of the object's points that lies on its surface then, near points counting more.
    pub explained: f64,
}

/// The symmetries of the object that the members show, the first of which lies on itself; without those that differ by
/// its free motions only.
pub(super) fn object_symmetries(
    members: &[Member<'_>],
    settings: &RecurrenceSettings,
) -> Vec<ObjectSymmetry> {
    let Some(&(first, _)) = members.first() else { return Vec::new() };
    let object: Vec<SurfacePlace> = members.iter().flat_map(|member| in_first(member)).collect();
    let object: Vec<SurfacePlace> =
        some_of(object.len(), settings.object_points).into_iter().map(|number| object[number]).collect();
    let points: Vec<[f64; 3]> = object.iter().map(|point| point.place.map(f64::from)).collect();
    let normals: Vec<[f64; 3]> = object.iter().map(|point| point.normal.map(f64::from)).collect();
    let free = free_directions(&points, &normals);
    if free.iter().any(|direction| matches!(direction, FreeDirection::RotationAboutPoint { .. })) {
        return Vec::new();
    }
    let some: Vec<[f64; 3]> = some_of(points.len(), settings.examined_points)
        .into_iter()
        .map(|number| points[number])
        .collect();
    let voxel = first.voxel;
    let surface = TargetSurface::new(points, voxel);
    let itself = RigidTransform::identity();
    let Some(found) = surface.align(&some, itself, &settings.point_to_surface) else { return Vec::new() };
    let pair = PiecePair { source: first, target: first, settings };
    let radius = pair.radius();
    let fit = PointToSurfaceSettings {
        max_distance: settings.rival_distance * radius / voxel,
        ..settings.point_to_surface
    };
    let target = FittedTarget { surface: &surface, farthest: found.farthest, fit, is_hidden: &|_| false };
    let rivals = Rivals {
        surface: target,
        source: &some,
        T_target_source: itself,
        radius,
        settings: settings.rivals,
    };
    let best = rivals.explained();
    let proposed: Vec<RigidTransform> = symmetries(surface.points(), &normals, &some, radius)
        .into_iter()
        .filter(|motion| pair.is_elsewhere(motion, &itself, &free))
        .collect();
    let sample: Vec<SurfacePlace> =
        some_of(object.len(), settings.rivals.points).into_iter().map(|number| object[number]).collect();
    let own = contradicted(members, &sample, &itself);
    let mut kept: Vec<ObjectSymmetry> = Vec::new();
    for (motion, explained) in rivals.as_good_as_the_best(&best, &proposed, |_| settings.rivals.deficit) {
        let known = kept.iter().map(|one| &one.motion).chain([&itself]);
        let is_new = known.into_iter().all(|known| pair.is_elsewhere(&motion, known, &free));
        if is_new
            && contradicted(members, &sample, &motion) <= own + settings.symmetry_excess
        {
            kept.push(ObjectSymmetry { motion, explained });
        }
    }
    kept
}

/// The points of a member, with their normals, where they are on the first piece.
fn in_first<'a>((piece, pose): &Member<'a>) -> impl Iterator<Item = SurfacePlace> + use<'a> {
    let to_first = pose.inverse();
    let moved = move |point: &SurfacePlace| SurfacePlace {
        place: to_first.transform_point(point.place.map(f64::from)).map(|x| x as f32),
        normal: to_first.transform_vector(point.normal.map(f64::from)).map(|x| x as f32),
    };
    piece.points.iter().map(moved)
}

/// Of an object's points, moved, the share in the free space of the members' sensors, of those in sight of each.
fn contradicted(members: &[Member<'_>], object: &[SurfacePlace], motion: &RigidTransform) -> f64 {
    let mut all = Counts::default();
    for (piece, pose) in members {
        all.add(&piece.image.count(&piece.image.to_image(&(*pose * *motion)), object, piece.tolerance));
    }
    let wrong = f64::from(all.contradicted + all.missing);
    wrong / (f64::from(all.confirmed + all.mismatched) + wrong).max(1.0)
}
