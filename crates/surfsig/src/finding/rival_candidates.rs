//! What other transforms of the same model reach in a scene: a right one stands out among them.
//!
//! Where much of a scene is like the model, as smooth clutter is like a smooth object, many transforms reach nearly as much
//! as the best, and that says less. Where the best is right, the others are far behind.

use super::acceptance::Sought;
use super::evidence::Evidence;
use crate::alignment::transformed;
use crate::depth_image::SurfacePlace;
use crate::geometry::RigidTransform;
use crate::random::some_of;
use nalgebra::Vector3;
use rayon::prelude::*;

/// Samples of the model by which transforms are compared.
const COMPARED: usize = 300;
/// Mean distance between the samples under two transforms, in extents of the model, up to which they are one: what is
/// taken as right is a tenth of the diameter off at most.
const SAME: f64 = 0.2;
/// Share of the samples on the scene under one transform that must lie on the model under another one for both to explain
/// the same part of the scene.
const SAME_PART: f64 = 0.5;
/// Share of the samples that lie on the model itself under another transform if that is a symmetry of the model.
const SYMMETRIC: f64 = 0.9;
/// Distance from the model up to which they do, in its extents.
const ON_ITSELF: f64 = 0.1;
/// Logarithm of the odds below which a rival says nothing: it is also that of none.
const NO_RIVAL: f64 = -12.0;

/// For some of a model's transforms (T_scene_model), which have numbers: the logarithm of the odds that the best other one
/// has by its own evidence which explains the same part of the scene, symmetries of the model left out.
pub(super) fn rival_log_odds(
    sought: &Sought<'_>,
    transforms: &[RigidTransform],
    evidence: &[Evidence],
    numbers: &[usize],
) -> Vec<f64> {
    let compared = Compared::new(sought, transforms);
    let mut rivals: Vec<usize> =
        (0..transforms.len()).filter(|&number| evidence[number].log_odds > NO_RIVAL).collect();
    rivals.sort_by(|&a, &b| evidence[b].log_odds.total_cmp(&evidence[a].log_odds));
    // Where free space is not known, next to nothing on the scene still has odds: they are those of none then.
    let least = NO_RIVAL.max(sought.view.log_odds_of_nothing());
    let of = |&one: &usize| {
        let on_scene = compared.on_scene(one);
        let is_rival = |&&other: &&usize| {
            !compared.are_one(one, other)
                && compared.explain_the_same(&on_scene, one, other)
                && !compared.is_symmetry(one, other)
        };
        rivals.iter().find(is_rival).map_or(least, |&best| evidence[best].log_odds)
    };
    numbers.par_iter().map(of).collect()
}

/// Transforms of a model, which are compared by some of its samples.
struct Compared<'a> {
    sought: &'a Sought<'a>,
    transforms: &'a [RigidTransform],
    samples: Vec<SurfacePlace>,
}

impl<'a> Compared<'a> {
    fn new(sought: &'a Sought<'a>, transforms: &'a [RigidTransform]) -> Self {
        let all = &sought.view.samples;
        let samples = some_of(all.len(), COMPARED).into_iter().map(|number| all[number]).collect();
        Self { sought, transforms, samples }
    }

    /// The samples that lie on the scene under a transform.
    fn on_scene(&self, one: usize) -> Vec<&SurfacePlace> {
        let scene = &self.sought.view.scene;
        let is_near = |sample: &&SurfacePlace| {
            scene.surface.nearest(&transformed(&self.transforms[one], sample), scene.voxel).is_some()
        };
        self.samples.iter().filter(is_near).collect()
    }

    /// Whether two transforms move the model to about the same place.
    fn are_one(&self, one: usize, other: usize) -> bool {
        let [one, other] = [one, other].map(|number| &self.transforms[number]);
        let turn = one.rotation - other.rotation;
        let shift = one.translation - other.translation;
        let distance =
            |sample: &SurfacePlace| (turn * Vector3::from(sample.place.map(f64::from)) + shift).norm();
        let sum: f64 = self.samples.iter().map(distance).sum();
        sum <= SAME * self.sought.extent * self.samples.len() as f64
    }

    /// Share of some samples that lie on the model, within a distance, when one transform has moved them and the other one
    /// the model.
    fn share_on<'b>(
        &self,
        samples: impl ExactSizeIterator<Item = &'b SurfacePlace>,
        one: usize,
        other: usize,
        distance: f64,
    ) -> f64 {
        let between = self.transforms[other].inverse() * self.transforms[one];
        let all = samples.len().max(1);
        let is_on = |sample: &&SurfacePlace| {
            self.sought.is_on(between.transform_point(sample.place.map(f64::from)), distance)
        };
        samples.filter(is_on).count() as f64 / all as f64
    }

    fn explain_the_same(&self, on_scene: &[&SurfacePlace], one: usize, other: usize) -> bool {
        let voxel = self.sought.view.scene.voxel;
        self.share_on(on_scene.iter().copied(), one, other, voxel) >= SAME_PART
    }

    fn is_symmetry(&self, one: usize, other: usize) -> bool {
        let distance = ON_ITSELF * self.sought.extent;
        self.share_on(self.samples.iter(), one, other, distance) >= SYMMETRIC
    }
}
