//! The tests that a transform must survive before it is trusted.

use super::free_space::BothSensors;
use super::settings::RegistrationSettings;
use crate::alignment::{
    Alternative, Doubt, FittedTarget, FreeDirection, GicpCloud, PointToSurface, Rivals, ScaleLimits,
    TargetSurface, symmetries,
};
use crate::geometry::RigidTransform;
use crate::random::some_of;

/// Two scans about their middles, of which transforms are judged.
pub(super) struct Judge<'a> {
    pub surface: &'a TargetSurface,
    /// The source and the target, one point for each voxel.
    pub clouds: &'a [GicpCloud; 2],
    pub voxel: f64,
    /// The source's points that are fitted.
    pub sample: &'a [[f64; 3]],
    pub sensors: BothSensors<'a>,
    /// Of the patches.
    pub radius: f64,
    pub settings: &'a RegistrationSettings,
}

/// What speaks for a transform.
#[derive(Debug, Clone, Copy)]
pub(super) struct Support<'a> {
    /// The matches that agree; `None` where a start was given.
    pub inliers: Option<usize>,
    /// What the search by faces says; `None` where there was none.
    pub faces: Option<Faces<'a>>,
}

/// What the search by faces says of a transform: those that take faces onto faces, as far as both sensors allow them,
/// are among the others that were proposed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Faces<'a> {
    /// Transforms that take the faces of the source's mirror image onto faces, as far as both sensors allow them.
    pub mirrored: &'a [RigidTransform],
    /// Whether none of these explains nearly as much, before it is refined.
    pub is_exclusive: bool,
}

/// What the tests said of a transform.
pub(super) struct Judgement {
    pub doubts: Vec<Doubt>,
    pub free_directions: Vec<FreeDirection>,
    pub alternatives: Vec<Alternative>,
    pub explained: f64,
    pub free_space: f64,
    pub scale: f64,
    pub scale_standard_error: f64,
    /// A rival that explains more, or leaves less in free space.
    pub better: Option<RigidTransform>,
}

impl Judge<'_> {
    /// Judges a transform beside others that were proposed.
    pub fn judged(
        &self,
        found: &PointToSurface,
        proposed: &[RigidTransform],
        support: Support<'_>,
    ) -> Judgement {
        let settings = self.settings;
        let some = self.some(self.sample);
        let is_hidden = |point: [f64; 3]| self.sensors.is_hidden_from_target(point);
        let rivals = self.rivals(found, found.T_target_source, &some, &is_hidden);
        let best = rivals.explained();
        let free_space = self.sensors.free_space(&found.T_target_source);
        let moved = found.T_target_source.transform_points(&some);
        let symmetric = symmetries(self.surface.points(), &found.normals, &moved, self.radius);
        let proposed: Vec<RigidTransform> = proposed
            .iter()
            .copied()
            .chain(symmetric.into_iter().map(|symmetry| symmetry * found.T_target_source))
            .collect();
        // Where less is in free space, something that only one scan shows may explain less.
        let deficit = |transform: &RigidTransform| {
            let is_freer = self.sensors.free_space(transform) < free_space - settings.free_space.excess;
            if is_freer { settings.free_space.deficit } else { settings.rivals.deficit }
        };
        let alternatives: Vec<Alternative> = rivals
            .as_good_as_the_best(&best, &proposed, deficit)
            .into_iter()
            .map(|(transform, explained)| Alternative {
                T_target_source: transform,
                explained,
                free_space: self.sensors.free_space(&transform),
            })
            // What a sensor looked through refutes a rival, too. NaN refutes nothing.
            .filter(|rival| {
                let excess = rival.free_space - free_space;
                excess.is_nan() || excess <= settings.free_space.excess
            })
            .collect();
        let is_better = |rival: &&Alternative| {
            rival.free_space < free_space - settings.free_space.excess
                || rival.explained > (1.0 + settings.rivals.deficit) * best.share()
        };
        let mut judged = Judgement {
            better: alternatives.iter().find(is_better).map(|rival| rival.T_target_source),
            doubts: Vec::new(),
            free_directions: found.free_directions(|| self.clouds, self.voxel, &settings.rivals),
            alternatives,
            explained: best.share(),
            free_space,
            scale: f64::NAN,
            scale_standard_error: f64::NAN,
        };
        let limits = ScaleLimits { doubted: settings.doubted_scale, deviations: settings.scale_deviations };
        let (scale, doubt) = rivals.surface.scale(&moved, &best, limits);
        if let Some(scale) = scale {
            (judged.scale, judged.scale_standard_error) = (scale.scale, scale.standard_error);
        }
        judged.doubts.extend(doubt);
        self.doubt(found, support, &mut judged);
        judged
    }

    /// Whether a transform of the source's mirror image explains more than the one that was found, by more than chance,
    /// and leaves no more than that does in free space; or leaves less there, and explains nearly as much.
    pub fn is_refuted_by_mirror(
        &self,
        found: &PointToSurface,
        free_space: f64,
        mirrored: RigidTransform,
    ) -> bool {
        let settings = self.settings;
        let some = self.some(self.sample);
        let is_hidden = |point: [f64; 3]| self.sensors.is_hidden_from_target(point);
        let Some(fitted) = self.surface.align(&some, mirrored, &settings.rival_fit) else { return false };
        let rivals_of = |transform| self.rivals(found, transform, &some, &is_hidden);
        let (own, image) = (found.T_target_source, fitted.T_target_source);
        let excess = self.sensors.free_space(&image) - free_space;
        // NaN refutes nothing.
        if excess < -settings.free_space.excess {
            !rivals_of(own).refutes(&image, settings.free_space.deficit)
        } else {
            (excess.is_nan() || excess <= settings.free_space.excess)
                && rivals_of(image).refutes(&own, settings.rivals.deficit)
        }
    }

    /// Those of points that tell transforms apart.
    fn some(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        some_of(points.len(), self.settings.rivals.points).into_iter().map(|i| points[i]).collect()
    }

    #[allow(non_snake_case)]
    fn rivals<'b>(
        &'b self,
        found: &PointToSurface,
        T_target_source: RigidTransform,
        source: &'b [[f64; 3]],
        is_hidden: &'b (dyn Fn([f64; 3]) -> bool + Sync),
    ) -> Rivals<'b, FittedTarget<'b>> {
        let settings = self.settings;
        let surface = FittedTarget {
            surface: self.surface,
            farthest: found.farthest,
            fit: settings.rival_fit,
            is_hidden,
        };
        Rivals { surface, source, T_target_source, radius: self.radius, settings: settings.rivals }
    }

    fn doubt(&self, found: &PointToSurface, support: Support<'_>, judged: &mut Judgement) {
        let settings = self.settings;
        let doubts = &mut judged.doubts;
        // NaN is no free space that is known.
        let is_freer_than = |share: f64| judged.free_space <= share;
        let explains_much = judged.explained >= settings.certain_explained;
        // Where the source's mirror image explains more, faces prove nothing. Where it explains as much, as in corridors
        // whose ceilings are like their floors, the mirror image is a scan of the same place.
        let is_of_one_hand = |faces: &Faces<'_>| {
            let mut mirrored = faces.mirrored.iter();
            !mirrored.any(|&mirrored| self.is_refuted_by_mirror(found, judged.free_space, mirrored))
        };
        let is_proved_by_faces = support.faces.is_some_and(|faces| {
            let explains = faces.is_exclusive && is_freer_than(settings.free_space.certain_share)
                || explains_much && is_freer_than(settings.faces.certain_free_space);
            explains && is_of_one_hand(&faces)
        });
        let needed = if is_proved_by_faces {
            0
        } else if explains_much && is_freer_than(settings.free_space.certain_share) {
            settings.certain_inliers
        } else {
            settings.trusted_inliers
        };
        if let Some(inliers) = support.inliers.filter(|&inliers| inliers < needed) {
            doubts.push(Doubt::FewMatches { inliers, needed });
        }
        let overlap = found.overlap;
        let least = match support.inliers {
            None => settings.trusted_overlap_of_start,
            Some(_) => settings.trusted_overlap,
        };
        if overlap < least {
            doubts.push(Doubt::LittleOverlap { overlap });
        }
        if !judged.free_directions.is_empty() {
            doubts.push(Doubt::FreeDirections { count: judged.free_directions.len() });
        }
        if judged.free_space > settings.free_space.doubted_share {
            doubts.push(Doubt::FreeSpace { share: judged.free_space });
        }
        if !judged.alternatives.is_empty() {
            doubts.push(Doubt::Ambiguous { alternatives: judged.alternatives.len() });
        }
    }
}
