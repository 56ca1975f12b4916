//! What speaks for a transform of a model: the part that the sensor saw, less what it saw through or missed.

use super::FindSettings;
use super::likelihood::{LEAST_WITHOUT_FREE_SPACE, Measures};
use super::misfit::shared_part;
use super::model::{Model, rung_above};
use super::rim::{Rim, step_beyond_rim};
use super::scene::{Free, SceneSurface};
use super::side::{Side, most_seen};
use crate::alignment::{FACING_AWAY, cosine_towards, transformed};
use crate::depth_image::{ALIKE, DepthImage, FACING, Front, Judgement, SurfacePlace, dot};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::random::some_of;
use nalgebra::{Matrix3, Matrix3x6, Matrix6, Vector3, Vector6};
use rayon::prelude::*;
use rustc_hash::FxHashMap;
use std::sync::Arc;

/// Extents of a model around its middle that are looked at.
const REACH: f64 = 1.2;
/// Of these, the edge of the cells whose transforms are judged by one depth image.
const CELL: f64 = 0.5;
/// The same of images that are kept for all models: fewer and larger ones.
const SHARED_CELL: f64 = 1.0;
/// Half the diagonal of a cell, in its edge: the farthest that a model's middle is from that of its cell.
const HALF_DIAGONAL: f64 = 0.87;

/// What a scene says about a transform of a model.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Evidence {
    /// Confirmed less wrong samples, over the most of the model that can be seen at once.
    pub support: f64,
    /// What the probability that the transform is right was computed from; zeros where nothing supports it.
    pub measures: Measures,
    /// Logarithm of the odds that it is right.
    pub log_odds: f64,
    /// Share of what faces the sensor that is seen, 0 to 1; of all where it is not known from where all was seen.
    pub visible: f64,
    /// Share of the model's surface that lies on the scene's, 0 to 1.
    pub overlap: f64,
}

/// A model before the surface of a scene, seen from a viewpoint, or from nobody knows where.
pub(super) struct ModelView<'a> {
    pub scene: Arc<SceneSurface>,
    /// Some of the model's samples.
    pub samples: Vec<SurfacePlace>,
    /// All of them, where its front is judged.
    front: Vec<SurfacePlace>,
    /// From small motions, shifts and turns in units of the reach, to those that move the samples by as much in the mean
    /// square; `None` where a motion moves none of them.
    to_motions: Option<Matrix6<f64>>,
    /// Whether the model goes all around.
    is_closed: bool,
    pub viewpoint: Option<[f64; 3]>,
    /// From the model's middle, what is looked at.
    pub reach: f64,
    rim: Rim,
    /// Share of the samples that can be seen at once, at most.
    most_seen: f64,
    settings: &'a FindSettings,
}

impl Evidence {
    /// Of a transform that nothing speaks for.
    fn none(support: f64, visible: f64, overlap: f64) -> Self {
        Self { support, measures: Measures::default(), log_odds: f64::NEG_INFINITY, visible, overlap }
    }

    /// The same with the logarithm of the odds by all measures, where it is that by its own evidence and the best rival has
    /// some.
    pub fn among_rivals(self, rival_log_odds: f64, is_free_space_known: bool) -> Self {
        if self.log_odds == f64::NEG_INFINITY {
            return self;
        }
        let (measures, log_odds) =
            self.measures.among_rivals(self.log_odds, rival_log_odds, is_free_space_known);
        Self { measures, log_odds, ..self }
    }

    /// Whether there is as much evidence, among rivals, as the probability was learnt from.
    pub fn is_enough(&self, is_free_space_known: bool) -> bool {
        is_free_space_known || self.measures.own_log_odds >= LEAST_WITHOUT_FREE_SPACE
    }

    /// Probability that the transform is right.
    pub fn score(&self) -> f64 {
        1.0 / (1.0 + (-self.log_odds).exp())
    }
}

/// What depth images say of a model's samples.
struct Seen {
    /// Shares of all.
    judgement: Judgement,
    /// Share of those that face the sensor.
    visible: f64,
    /// Of each to the line of sight.
    cosines: Vec<f32>,
    /// Of all the model's samples those that the model itself does not hide, and its outline, where that is looked at.
    front: Option<Front>,
}

impl<'a> ModelView<'a> {
    /// Takes so many of a side's samples at most. Without its rim it tells only what [`ModelView::supports`] gives.
    pub fn new(
        side: &Side<'_>,
        scene: Arc<SceneSurface>,
        viewpoint: Option<[f64; 3]>,
        most: usize,
        settings: &'a FindSettings,
    ) -> Self {
        if let Some(viewpoint) = viewpoint {
            scene.see_from(viewpoint);
        }
        let model = &side.model;
        let chosen = some_of(model.samples.len(), most);
        let points: Vec<[f64; 3]> = chosen.iter().map(|&i| model.samples[i]).collect();
        // In the order of a tree's leaves, searches one after the other find their part of another tree in the cache.
        let near_each_other = KdTree::new(&points);
        let order: Vec<usize> = near_each_other.indices().iter().map(|&i| chosen[i as usize]).collect();
        let samples = model.surface(&order);
        let reach = REACH * model.extent();
        Self {
            rim: Rim::default(),
            scene,
            viewpoint,
            reach,
            most_seen: most_seen(&samples),
            to_motions: to_motions(&samples, reach),
            samples,
            front: Vec::new(),
            is_closed: side.is_closed,
            settings,
        }
    }

    /// The same, which judges where the model ends, too.
    pub fn with_rim(self, side: &Side<'_>) -> Self {
        Self { rim: Rim::new(side, &self.samples, self.scene.voxel, self.scene.spacing), ..self }
    }

    /// The same, which judges the model's front and its outline, too; of few samples neither has a picture.
    pub fn with_front(self, model: &Model) -> Self {
        let all: Vec<usize> = (0..model.samples.len()).collect();
        Self { front: model.surface(&all), ..self }
    }

    /// Logarithm of the odds of a transform that nothing speaks for.
    pub fn log_odds_of_nothing(&self) -> f64 {
        if self.viewpoint.is_some() {
            return f64::NEG_INFINITY;
        }
        Measures::default().log_odds_without_free_space(self.settings)
    }

    /// Transforms, fitted to the scene's surface near them by point to plane; distances are in voxels.
    ///
    /// `most` of the samples do it. Unobservable motions are not made.
    pub fn aligned(
        &self,
        transforms: &[RigidTransform],
        distances: (f64, f64, usize),
        most: usize,
    ) -> Vec<RigidTransform> {
        let (first, last, count) = distances;
        let ratio = |step: usize| step as f64 / (count.max(2) - 1) as f64;
        let distance = |step: usize| self.scene.voxel * first * (last / first).powf(ratio(step));
        let steps: Vec<f64> = (0..count).map(distance).collect();
        let some: Vec<SurfacePlace> =
            some_of(self.samples.len(), most).into_iter().map(|i| self.samples[i]).collect();
        self.scene.surface.align_all(transforms, &some, &steps, self.viewpoint)
    }

    /// Weighs transforms (T_scene_model) by the free samples of the scene.
    pub fn judged(&self, transforms: &[RigidTransform], free: Free<'_>) -> Vec<Evidence> {
        if self.viewpoint.is_none() {
            return transforms.par_iter().map(|transform| self.weighed(transform, None, free)).collect();
        }
        self.in_images(transforms, free, |image, local, viewpoint, transform| {
            let judgement = image.judge(local, &self.samples, self.scene.voxel as f32);
            // In the model's axes only one point has to be moved.
            let from = transform.inverse().transform_point(viewpoint).map(|x| x as f32);
            let cosines: Vec<f32> = self.samples.iter().map(|sample| cosine_towards(sample, from)).collect();
            let facing = cosines.iter().filter(|&&cosine| cosine > FACING).count();
            let facing = facing as f64 / self.samples.len().max(1) as f64;
            let confirmed = f64::from(judgement.confirmed);
            let visible = confirmed / facing.max(confirmed).max(1e-9);
            let is_looked_at = !self.front.is_empty() && self.is_possible(&judgement);
            let front = is_looked_at.then(|| self.front(image, local));
            self.weighed(transform, Some(&Seen { judgement, visible, cosines, front }), free)
        })
    }

    fn front(&self, image: &DepthImage, local: &RigidTransform) -> Front {
        let beyond = step_beyond_rim(self.scene.voxel, self.scene.spacing) / self.scene.voxel;
        image.front(&image.to_image(local), &self.front, self.scene.voxel as f32, beyond.ceil() as i32)
    }

    /// The support of each transform by depth images alone, which costs little; there is a viewpoint.
    pub fn supports(&self, transforms: &[RigidTransform]) -> Vec<f64> {
        self.in_images(transforms, Free::All, |image, local, _, _| {
            self.support(&image.judge(local, &self.samples, self.scene.voxel as f32))
        })
    }

    /// Whether a transform is worth a look. Few samples must support it. Where the front is judged, too, that tells better
    /// what was seen through: sensors lose steep rims, so that up to a sixth of a true instance's samples seem to be.
    fn is_possible(&self, judgement: &Judgement) -> bool {
        if self.front.is_empty() {
            return self.support(judgement) > 0.0;
        }
        judgement.confirmed > judgement.contradicted + judgement.missing
    }

    fn support(&self, judgement: &Judgement) -> f64 {
        let Judgement { confirmed, contradicted, missing, .. } = judgement;
        let [confirmed, contradicted, missing] = [confirmed, contradicted, missing].map(|x| f64::from(*x));
        let wrong = self.settings.contradicted_weight * contradicted + self.settings.missing_weight * missing;
        (confirmed - wrong) / self.most_seen
    }

    /// What is told of each transform by the depth image of the cell that its model's middle is in: the image, the
    /// transform about the image's middle, the viewpoint, and the transform.
    fn in_images<T: Send>(
        &self,
        transforms: &[RigidTransform],
        free: Free<'_>,
        told: impl Fn(&DepthImage, &RigidTransform, [f64; 3], &RigidTransform) -> T + Sync,
    ) -> Vec<T> {
        let Some(viewpoint) = self.viewpoint else { return Vec::new() };
        let is_shared = self.scene.keeps_images() && matches!(free, Free::All);
        let (step, reach) = if is_shared { rung_above(self.reach) } else { (0, self.reach) };
        let edge = if is_shared { SHARED_CELL } else { CELL } * reach;
        let mut cells: FxHashMap<[i64; 3], Vec<usize>> = FxHashMap::default();
        for (number, transform) in transforms.iter().enumerate() {
            let cell = <[f64; 3]>::from(transform.translation).map(|x| (x / edge).round() as i64);
            cells.entry(cell).or_default().push(number);
        }
        let of_cell = |(cell, numbers): (&[i64; 3], &Vec<usize>)| {
            let middle = cell.map(|x| x as f64 * edge);
            let made = || self.scene.image(middle, reach + HALF_DIAGONAL * edge, free);
            let shared = is_shared.then(|| self.scene.shared_image(step, *cell)).flatten();
            let image = shared.unwrap_or_default();
            let image = image.get_or_init(made);
            let told = |&number: &usize| {
                let transform = &transforms[number];
                let mut local = *transform;
                local.translation -= Vector3::from(middle);
                (number, told(image, &local, viewpoint, transform))
            };
            numbers.iter().map(told).collect::<Vec<_>>()
        };
        let mut told: Vec<(usize, T)> = cells.par_iter().map(of_cell).flatten_iter().collect();
        told.sort_unstable_by_key(|(number, _)| *number);
        told.into_iter().map(|(_, value)| value).collect()
    }

    /// The evidence, by what depth images say where it is known from where all was seen.
    fn weighed(&self, transform: &RigidTransform, seen: Option<&Seen>, free: Free<'_>) -> Evidence {
        if let Some(seen) = seen
            && !self.is_possible(&seen.judgement)
        {
            return Evidence::none(self.support(&seen.judgement), seen.visible, 0.0);
        }
        let moved: Vec<SurfacePlace> =
            self.samples.iter().map(|sample| transformed(transform, sample)).collect();
        let touching = self.settings.touching_distance * self.scene.voxel;
        let faces_away = |sample: usize| seen.is_some_and(|seen| seen.cosines[sample] < FACING_AWAY);
        let nearest = |sample: usize| self.scene.surface.nearest(&moved[sample], touching);
        let nearest: Vec<Option<usize>> =
            (0..moved.len()).map(|sample| if faces_away(sample) { None } else { nearest(sample) }).collect();
        let is_touching: Vec<bool> =
            nearest.iter().map(|near| near.is_some_and(|sample| free.has(sample))).collect();
        let share = |count: usize| count as f64 / self.samples.len().max(1) as f64;
        let overlap = share(nearest.iter().flatten().count());
        let touching = share(is_touching.iter().filter(|&&touches| touches).count());
        let (support, visible, judgement) = match seen {
            Some(seen) => (self.support(&seen.judgement), seen.visible, seen.judgement),
            None => {
                let unknown = Judgement { confirmed: touching as f32, ..Default::default() };
                (self.settings.unknown_free_space_weight * touching / self.most_seen, touching, unknown)
            }
        };
        if touching <= 0.0 {
            return Evidence::none(support, visible, overlap);
        }
        let on = || (0..moved.len()).filter(|&sample| is_touching[sample]);
        let front = seen.and_then(|seen| seen.front).unwrap_or_default();
        let of = |count: u32, all: u32| f64::from(count) / f64::from(all.max(1));
        let (agreement, misfit) =
            self.agreement_and_misfit(on().filter_map(|sample| Some((&moved[sample], nearest[sample]?))));
        let told = front.confirmed + front.mismatched + front.contradicted + front.missing;
        let measures = Measures {
            front_confirmed: of(front.confirmed, front.facing),
            front_hidden: of(front.hidden, front.facing),
            front_mismatched: of(front.mismatched, told),
            front_contradicted: of(front.contradicted, told),
            front_missing: of(front.missing, told),
            pixels: f64::from(front.pixels),
            outline_ends: of(front.ends, front.outline),
            // A view ends wherever something was before it.
            outline_goes_on: if self.is_closed { of(front.goes_on, front.outline) } else { 0.0 },
            uncovered: of(front.not_covered, front.pixels),
            constraint: self.constraint(on().map(|sample| &self.samples[sample])),
            support,
            confirmed: f64::from(judgement.confirmed) / self.most_seen,
            visible,
            contradicted: f64::from(judgement.contradicted) / self.most_seen,
            mismatched: f64::from(judgement.mismatched) / self.most_seen,
            missing: f64::from(judgement.missing) / self.most_seen,
            agreement,
            misfit,
            going_on: self.rim.going_on(transform, &is_touching, &self.scene, free),
            roundness: normal_spread(on().map(|sample| &self.samples[sample].normal)),
            resolution: self.reach / self.scene.voxel,
            ..Measures::default()
        };
        let log_odds = if seen.is_some() {
            if self.front.is_empty() { measures.log_odds_of_samples() } else { measures.log_odds() }
        } else {
            measures.log_odds_without_free_space(self.settings)
        };
        Evidence { support, measures, log_odds, visible, overlap }
    }

    /// How well some samples determine the transform; see [`Measures::constraint`].
    fn constraint<'b>(&self, samples: impl Iterator<Item = &'b SurfacePlace>) -> f64 {
        let (mut squares, mut count) = (Matrix6::zeros(), 0.0);
        for sample in samples {
            let [place, normal] = [sample.place, sample.normal].map(|x| Vector3::from(x.map(f64::from)));
            let turn = place.cross(&normal) / self.reach;
            let change = Vector6::new(normal.x, normal.y, normal.z, turn.x, turn.y, turn.z);
            squares += change * change.transpose();
            count += 1.0;
        }
        let Some(to_motions) = self.to_motions.filter(|_| count > 0.0) else { return 0.0 };
        let relative = to_motions * (squares / count) * to_motions.transpose();
        relative.symmetric_eigenvalues().min().max(0.0)
    }

    /// Mean agreement in residual and normal of pairs of a sample and the scene's near it, 1 on the same surface, and
    /// [`Measures::misfit`].
    fn agreement_and_misfit<'b>(&self, pairs: impl Iterator<Item = (&'b SurfacePlace, usize)>) -> (f64, f64) {
        let touching = (self.settings.touching_distance * self.scene.voxel) as f32;
        let (mut sum, mut distances) = (0.0, Vec::new());
        for (sample, near) in pairs {
            let near = &self.scene.samples()[near];
            let gap = [0, 1, 2].map(|k| near.place[k] - sample.place[k]);
            let distance = dot(&gap, &near.normal);
            let residual = distance / touching;
            let cosine = dot(&sample.normal, &near.normal);
            let agreement =
                (1.0 - residual * residual).max(0.0) * ((cosine - ALIKE) / (1.0 - ALIKE)).max(0.0);
            sum += f64::from(agreement);
            distances.push(f64::from(distance));
        }
        let agreement = sum / distances.len().max(1) as f64;
        (agreement, shared_part(&distances) * REACH / self.reach)
    }
}

/// See [`ModelView::to_motions`].
fn to_motions(samples: &[SurfacePlace], reach: f64) -> Option<Matrix6<f64>> {
    let mut squares = Matrix6::zeros();
    for sample in samples {
        let across = Vector3::from(sample.place.map(f64::from)).cross_matrix() / reach;
        let mut moved = Matrix3x6::zeros();
        moved.fixed_view_mut::<3, 3>(0, 0).copy_from(&Matrix3::identity());
        moved.fixed_view_mut::<3, 3>(0, 3).copy_from(&-across);
        squares += moved.transpose() * moved;
    }
    (squares / samples.len().max(1) as f64).cholesky()?.l().try_inverse()
}

/// How far normals are from being parallel: 1 less the largest eigenvalue of their second moments, 0 of none.
fn normal_spread<'a>(normals: impl Iterator<Item = &'a [f32; 3]>) -> f64 {
    let (mut moments, mut count) = (Matrix3::zeros(), 0.0);
    for normal in normals {
        let normal = Vector3::from(normal.map(f64::from));
        moments += normal * normal.transpose();
        count += 1.0;
    }
    if count > 0.0 { 1.0 - (moments / count).symmetric_eigenvalues().max() } else { 0.0 }
}
