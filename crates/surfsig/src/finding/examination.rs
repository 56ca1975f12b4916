//! What may be wrong with an instance: the same tests that a registration must survive.

use super::FindSettings;
use super::acceptance::Candidate;
use super::scene::Free;
use crate::alignment::{
    Doubt, FittedTarget, FreeDirection, GicpCloud, PointToSurface, PointToSurfaceSettings, Rivals,
    ScaleLimits, symmetries,
};
use crate::geometry::RigidTransform;
use crate::random::some_of;

/// A candidate, fitted to the points of the scene that are its own.
pub(super) struct Refined<'a> {
    pub candidate: Candidate<'a>,
    /// The scene's points on the model: the target is the model.
    pub fit: PointToSurface,
    /// The scene's points that were fitted.
    pub sample: Vec<[f64; 3]>,
}

/// What the tests said; directions and transforms are about the middles of model and scene.
pub(super) struct Examined {
    /// In the model's coordinates.
    pub free_directions: Vec<FreeDirection>,
    /// T_scene_model of other transforms that explain as much.
    pub alternatives: Vec<RigidTransform>,
    /// How many times as large as the model the instance is; NaN where that is not determined.
    pub scale: f64,
    pub scale_standard_error: f64,
    pub doubts: Vec<Doubt>,
}

impl Refined<'_> {
    /// Tries to refute the transform, whose support by the free samples of the scene is given.
    pub fn examined(&self, support: f64, free: Free<'_>, settings: &FindSettings) -> Examined {
        let numbers = some_of(self.sample.len(), settings.rivals.points);
        let some: Vec<[f64; 3]> = numbers.into_iter().map(|i| self.sample[i]).collect();
        let sought = &self.candidate.sought;
        let surface = sought.surface();
        let radius = sought.model.places.radius;
        // In a few steps, as in registration: how much a rival explains hardly depends on the last of them.
        let fit = PointToSurfaceSettings {
            max_distance: settings.rival_distance * radius / sought.view.scene.voxel,
            ..Default::default()
        };
        let rivals = Rivals {
            surface: FittedTarget { surface, farthest: self.fit.farthest, fit, is_hidden: &|_| false },
            source: &some,
            T_target_source: self.fit.T_target_source,
            radius,
            settings: settings.rivals,
        };
        let best = rivals.explained();
        let moved = self.fit.T_target_source.transform_points(&some);
        let proposed: Vec<RigidTransform> = symmetries(surface.points(), &self.fit.normals, &moved, radius)
            .into_iter()
            .map(|symmetry| symmetry * self.fit.T_target_source)
            .collect();
        // What the sensor saw through or did not see refutes a rival, too.
        let is_as_good = |transform: &RigidTransform| {
            let rival = Candidate { T_scene_model: *transform, ..self.candidate.clone() };
            rival.judged(free).support >= support - settings.rival_deficit * support.abs()
        };
        let alternatives: Vec<RigidTransform> = rivals
            .as_good_as_the_best(&best, &proposed, |_| settings.rivals.deficit)
            .into_iter()
            .map(|(transform, _)| transform.inverse())
            .filter(is_as_good)
            .collect();
        let clouds = || [self.sample.clone(), surface.points().to_vec()].map(GicpCloud::new);
        let free_directions = self.fit.free_directions(clouds, sought.view.scene.voxel, &settings.rivals);
        let limits = ScaleLimits { doubted: settings.doubted_scale, deviations: settings.scale_deviations };
        let (scale, doubt) = rivals.surface.scale(&moved, &best, limits);
        let mut doubts: Vec<Doubt> = doubt.into_iter().collect();
        if !free_directions.is_empty() {
            doubts.push(Doubt::FreeDirections { count: free_directions.len() });
        }
        if !alternatives.is_empty() {
            doubts.push(Doubt::Ambiguous { alternatives: alternatives.len() });
        }
        let [scale, scale_standard_error] =
            scale.map_or([f64::NAN; 2], |found| [found.scale, found.standard_error]);
        Examined { free_directions, alternatives, scale, scale_standard_error, doubts }
    }
}
