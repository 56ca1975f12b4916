//! Motions after which an object, as far as all pieces of a group show it, looks the same.

use super::agreement::PiecePair;
use super::{PieceView, RecurrenceSettings};
use crate::alignment::{
    Closeness, Explained, FittedSurface, FreeDirection, HIDDEN, LinearisedDistances, Rivals, free_directions,
    partial_symmetries,
};
use crate::depth_image::{Counts, SurfacePlace};
use crate::geometry::RigidTransform;
use crate::random::some_of;
use nalgebra::Vector3;

/// A piece, and its pose T_piece_first on the first one of its group.
pub(super) type Member<'a> = (&'a PieceView, RigidTransform);

/// A motion of the first piece, about its centre, after which the object looks the same.
pub(super) struct ObjectSymmetry {
    pub motion: RigidTransform,
    /// The share of the object's points that lies on its surface then.
    pub explained: f64,
}

/// The surface that all pieces of a group show, in the coordinates of the first one.
struct Object<'a> {
    members: &'a [Member<'a>],
    points: Vec<SurfacePlace>,
    settings: &'a RecurrenceSettings,
}

/// The symmetries of the object that the members show, the first of which lies on itself; without those that differ by
/// its free motions only.
///
/// What no sensor saw speaks neither for a motion nor against it.
pub(super) fn object_symmetries(
    members: &[Member<'_>],
    settings: &RecurrenceSettings,
) -> Vec<ObjectSymmetry> {
    let Some(&(first, _)) = members.first() else { return Vec::new() };
    let object = Object::new(members, settings);
    let places: Vec<[f64; 3]> = object.points.iter().map(|point| point.place.map(f64::from)).collect();
    let normals: Vec<[f64; 3]> = object.points.iter().map(|point| point.normal.map(f64::from)).collect();
    let free = free_directions(&places, &normals);
    if free.iter().any(|direction| matches!(direction, FreeDirection::RotationAboutPoint { .. })) {
        return Vec::new();
    }
    let itself = RigidTransform::identity();
    let pair = PiecePair { source: first, target: first, settings };
    let radius = pair.radius();
    let mut proposed = partial_symmetries(&places, &normals, &places, radius, settings.least_explained);
    proposed.retain(|motion| pair.is_elsewhere(motion, &itself, &free));
    let rivals = Rivals {
        surface: &object,
        source: &places,
        T_target_source: itself,
        radius,
        settings: settings.rivals,
    };
    let best: Explained = rivals.explained();
    let own = object.free_space(&itself);
    let mut kept: Vec<ObjectSymmetry> = Vec::new();
    for (motion, explained) in rivals.as_good_as_the_best(&best, &proposed, |_| settings.symmetry_excess) {
        let known = kept.iter().map(|one| &one.motion).chain([&itself]);
        let is_new = known.into_iter().all(|known| pair.is_elsewhere(&motion, known, &free));
        if is_new
            && explained >= settings.least_explained * best.share()
            && object.free_space(&motion) <= own + settings.symmetry_excess
        {
            kept.push(ObjectSymmetry { motion, explained });
        }
    }
    kept
}

impl<'a> Object<'a> {
    fn new(members: &'a [Member<'a>], settings: &'a RecurrenceSettings) -> Self {
        let all: Vec<SurfacePlace> = members.iter().flat_map(in_first).collect();
        let some = some_of(all.len(), settings.object_points);
        Self { members, points: some.into_iter().map(|number| all[number]).collect(), settings }
    }

    /// Of the points, moved, what each member's image says.
    fn counts<'b>(
        &'b self,
        motion: &'b RigidTransform,
        point: &'b SurfacePlace,
    ) -> impl Iterator<Item = Counts> + 'b {
        self.members.iter().map(move |(piece, pose)| {
            let to_image = piece.image.to_image(&(*pose * *motion));
            piece.image.count(&to_image, &[*point], piece.tolerance)
        })
    }

    /// The share of the points, moved, in the free space of the members' sensors, of those in sight of each.
    fn free_space(&self, motion: &RigidTransform) -> f64 {
        let mut all = Counts::default();
        for (piece, pose) in self.members {
            let to_image = piece.image.to_image(&(*pose * *motion));
            all.add(&piece.image.count(&to_image, &self.points, piece.tolerance));
        }
        let wrong = f64::from(all.contradicted + all.missing);
        wrong / (f64::from(all.confirmed + all.mismatched) + wrong).max(1.0)
    }
}

impl FittedSurface for &Object<'_> {
    /// Point to plane, by the points of all members; motions that these do not determine are not made.
    fn fitted(&self, _: &[[f64; 3]], start: RigidTransform) -> Option<RigidTransform> {
        let mut motion = start;
        for _ in 0..self.settings.fit_steps {
            let mut rows = Vec::new();
            for (piece, pose) in self.members {
                let (to_piece, to_first) = (*pose * motion, pose.inverse());
                let found = piece.image.correspondences(&to_piece, &self.points, piece.tolerance);
                for (point, surface) in self.points.iter().zip(found) {
                    let Some(surface) = surface else { continue };
                    let vector = |v: [f64; 3]| Vector3::from(v);
                    let point = vector(motion.transform_point(point.place.map(f64::from)));
                    let normal = vector(to_first.transform_vector(surface.normal.map(f64::from)));
                    let place = vector(to_first.transform_point(surface.place.map(f64::from)));
                    rows.push((point, normal, normal.dot(&(point - place))));
                }
            }
            if rows.is_empty() {
                return None;
            }
            let (step, _) = LinearisedDistances::new(&rows).step(self.settings.unobservable_share);
            motion = step * motion;
        }
        Some(motion)
    }

    #[allow(non_snake_case)]
    fn closeness(&self, _: &[[f64; 3]], T_target_source: &RigidTransform) -> Closeness {
        let of_point = |point: &SurfacePlace| {
            let mut is_wrong = false;
            for counts in self.counts(T_target_source, point) {
                if counts.confirmed > 0 && counts.contradicted == 0 {
                    return Some(1.0);
                }
                is_wrong |= counts.contradicted + counts.missing + counts.mismatched > 0;
            }
            Some(if is_wrong { 0.0 } else { HIDDEN })
        };
        self.points.iter().map(of_point).collect()
    }
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
