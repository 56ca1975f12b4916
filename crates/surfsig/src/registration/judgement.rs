//! The tests that a transform must survive before it is trusted.

use super::doubt::Doubt;
use super::free_space::BothSensors;
use super::settings::RegistrationSettings;
use crate::alignment::{Alternative, FreeDirection, PointToSurface, Rivals, TargetSurface};
use crate::geometry::RigidTransform;
use crate::random::some_of;
use crate::scan::CenteredScan;

/// Two scans and the transform that was found, all about the scans' middles.
pub(super) struct Candidate<'a> {
    pub source: &'a CenteredScan,
    pub target: &'a CenteredScan,
    /// The source's points that were fitted.
    pub sample: &'a [[f64; 3]],
    pub surface: &'a TargetSurface,
    pub found: &'a PointToSurface,
    /// Other transforms that matches proposed.
    pub proposed: &'a [RigidTransform],
    /// Matches that agree; `None` where a start was given.
    pub inliers: Option<usize>,
    pub voxel: f64,
    pub radius: f64,
}

/// What the tests said.
pub(super) struct Judgement {
    pub doubts: Vec<Doubt>,
    pub free_directions: Vec<FreeDirection>,
    pub alternatives: Vec<Alternative>,
    pub explained: f64,
    pub free_space: f64,
    pub scale: f64,
    pub scale_standard_error: f64,
}

impl Candidate<'_> {
    pub fn judged(&self, settings: &RegistrationSettings) -> Judgement {
        let numbers = some_of(self.sample.len(), settings.rivals.points);
        let some: Vec<[f64; 3]> = numbers.into_iter().map(|i| self.sample[i]).collect();
        let rivals = Rivals {
            surface: self.surface,
            source: &some,
            best: self.found,
            radius: self.radius,
            settings: settings.rivals,
            fit: settings.rival_fit,
        };
        let explained = rivals.explained();
        let sensors =
            BothSensors::new(self.source, self.sample, self.target, self.voxel, settings.free_space);
        let free_space = |transform: &RigidTransform| sensors.free_space(transform);
        let of_best = free_space(&self.found.T_target_source);
        let alternatives: Vec<Alternative> = rivals
            .as_good_as_the_best(&explained, self.proposed)
            .into_iter()
            .map(|(transform, explained)| Alternative {
                T_target_source: transform,
                explained,
                free_space: free_space(&transform),
            })
            // What a sensor looked through refutes a rival, too.
            .filter(|rival| !(rival.free_space > settings.free_space.doubted_share))
            .collect();
        let mut judged = Judgement {
            doubts: Vec::new(),
            free_directions: rivals.free_directions(&explained),
            alternatives,
            explained: explained.share(),
            free_space: of_best,
            scale: f64::NAN,
            scale_standard_error: f64::NAN,
        };
        self.enough(settings, &mut judged.doubts);
        if !judged.free_directions.is_empty() {
            judged.doubts.push(Doubt::FreeDirections { count: judged.free_directions.len() });
        }
        if of_best > settings.free_space.doubted_share {
            judged.doubts.push(Doubt::FreeSpace { share: of_best });
        }
        if !judged.alternatives.is_empty() {
            judged.doubts.push(Doubt::Ambiguous { alternatives: judged.alternatives.len() });
        }
        self.scale(&rivals, settings, &mut judged);
        judged
    }

    /// Whether enough speaks for the transform.
    fn enough(&self, settings: &RegistrationSettings, doubts: &mut Vec<Doubt>) {
        let overlap = self.found.overlap;
        let needed = match self.inliers {
            None => settings.trusted_overlap_of_start,
            Some(_) => settings.trusted_overlap,
        };
        if let Some(inliers) = self.inliers.filter(|&inliers| inliers < settings.trusted_inliers) {
            doubts.push(Doubt::FewMatches { inliers, needed: settings.trusted_inliers });
        }
        if overlap < needed {
            doubts.push(Doubt::LittleOverlap { overlap });
        }
    }

    /// Whether a source of another size fits better.
    fn scale(&self, rivals: &Rivals<'_>, settings: &RegistrationSettings, judged: &mut Judgement) {
        let moved = self.found.T_target_source.transform_points(rivals.source);
        let Some(scale) = self.surface.scale_of(&moved, &settings.rival_fit) else { return };
        judged.scale = scale.scale;
        judged.scale_standard_error = scale.standard_error;
        let off = scale.scale.ln().abs();
        let is_significant = off > settings.scale_deviations * scale.standard_error / scale.scale;
        let (deficit, _) = rivals.explained().deficit_of(&rivals.closeness_of(&scale.points));
        if is_significant && off > settings.doubted_scale && deficit < 0.0 {
            let Judgement { scale, scale_standard_error: standard_error, .. } = *judged;
            judged.doubts.push(Doubt::Scale { scale, standard_error });
        }
    }
}
