//! The search for one model in a scene: transforms that its matches propose, aligned, and judged by what the sensor saw.

use super::acceptance::{Candidate, Sought, least_before_fit};
use super::evidence::{Evidence, ModelView};
use super::model::{Model, SPACINGS_PER_RADIUS, on_ladder};
use super::proposals::{Proposals, different, weighted_transforms};
use super::rival_candidates::rival_log_odds;
use super::scene::{Free, Scene, SceneSurface};
use super::settings::FindSettings;
use super::side::Side;
use crate::geometry::RigidTransform;
use crate::{Error, FieldPlaces, Monitor};
use std::borrow::Cow;
use std::sync::Arc;

/// How much of what matches propose is tried.
#[derive(Debug, Clone, Copy)]
struct Effort {
    /// Transforms that are aligned.
    aligned: usize,
    /// Of these, those that are aligned again and judged.
    tried: usize,
    /// By so many points.
    points: usize,
}

/// A model before the surfaces of a scene.
pub(super) struct ModelSearch<'a> {
    number: usize,
    /// The model; and with its other side out, where it or the scene does not say which one is.
    sides: Vec<Side<'a>>,
    /// The scene's, with patches of the model's radii.
    places: Vec<Arc<FieldPlaces>>,
    fine: Arc<SceneSurface>,
    coarse: Arc<SceneSurface>,
    rough: Arc<SceneSurface>,
    viewpoint: Option<[f64; 3]>,
    settings: &'a FindSettings,
}

/// Transforms of one side, aligned to the scene's surface and judged.
struct Judged<'a> {
    view: ModelView<'a>,
    transforms: Vec<RigidTransform>,
    evidence: Vec<Evidence>,
}

impl<'a> ModelSearch<'a> {
    pub fn new(
        number: usize,
        model: Cow<'a, Model>,
        scene: &mut Scene<'_>,
        settings: &'a FindSettings,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let least = least_radius(scene);
        let is_too_fine = model.places.radius < least;
        let model = if is_too_fine { Cow::Owned(model.with_radius(least, monitor)?) } else { model };
        Self::of(number, model, scene, settings, monitor)
    }

    fn of(
        number: usize,
        model: Cow<'a, Model>,
        scene: &mut Scene<'_>,
        settings: &'a FindSettings,
        monitor: &Monitor,
    ) -> Result<Self, Error> {
        let voxel = scene.voxel(&model)?;
        let sought = model.places_sought(scene.viewpoint.is_some());
        let seen = |own: &FieldPlaces| match own.is_empty() {
            true => Ok(Arc::new(FieldPlaces::new(own.radius))),
            false => scene.places(own.radius),
        };
        let places = sought.iter().map(seen).collect::<Result<_, _>>()?;
        let fine = scene.fine_surface(voxel)?;
        let coarse = scene.coarse_surface(voxel, settings.coarse_voxels * voxel)?;
        let rough = on_ladder(settings.rough_voxel * model.extent()).max(coarse.voxel);
        let rough = scene.rough_surface(voxel, rough)?;
        let is_known = model.is_sided && scene.is_oriented;
        let inside_out = if is_known { None } else { Some(model.inside_out(monitor)?) };
        let sides = std::iter::once(model).chain(inside_out.map(Cow::Owned)).map(Side::new).collect();
        Ok(Self { number, sides, places, fine, coarse, rough, viewpoint: scene.viewpoint, settings })
    }

    /// The largest logarithm of the odds that a brief search for a model finds, of which [`Model::brief`] is given; infinite
    /// where that cannot tell, as the scene has too few points, or it is not known which side of the model is the outer one.
    pub fn briefly(
        number: usize,
        brief: Cow<'a, Model>,
        scene: &mut Scene<'_>,
        settings: &'a FindSettings,
        monitor: &Monitor,
    ) -> Result<f64, Error> {
        let least = least_radius(scene);
        if !brief.is_sided || brief.all_places().all(|places| places.is_empty() || places.radius < least) {
            return Ok(f64::INFINITY);
        }
        let effort = Effort {
            aligned: settings.brief_aligned,
            tried: settings.brief_tried,
            points: settings.brief_points,
        };
        let search = Self::of(number, brief, scene, settings, monitor)?;
        let judged = search.sides.iter().filter_map(|side| search.judged(side, effort));
        let log_odds = judged.flat_map(|judged| judged.evidence).map(|evidence| evidence.log_odds);
        Ok(log_odds.fold(f64::NEG_INFINITY, f64::max))
    }

    /// Transforms that are good enough where no other instance is near; the best first.
    pub fn candidates(self, monitor: &Monitor) -> Result<Vec<Candidate<'a>>, Error> {
        let FindSettings { aligned, tried, fine_points: points, .. } = *self.settings;
        let effort = Effort { aligned, tried, points };
        let mut candidates = Vec::new();
        for side in &self.sides {
            monitor.check()?;
            let Some(judged) = self.judged(side, effort) else { continue };
            candidates.extend(self.good(side, judged));
        }
        candidates.sort_by(|a, b| b.evidence.log_odds.total_cmp(&a.evidence.log_odds));
        Ok(candidates)
    }

    /// Of those that were judged, those that may be good enough, among their rivals.
    fn good(&self, side: &Side<'_>, judged: Judged<'a>) -> Vec<Candidate<'a>> {
        let Judged { view, transforms, evidence } = judged;
        let sought = Arc::new(Sought::new(self.number, side.model.without_places(), view));
        let is_free_space_known = self.viewpoint.is_some();
        let least = least_before_fit(self.settings);
        let may_be_good = |&number: &usize| {
            evidence[number].among_rivals(f64::NEG_INFINITY, is_free_space_known).log_odds >= least
        };
        let good: Vec<usize> = (0..evidence.len()).filter(may_be_good).collect();
        let rivals = rival_log_odds(&sought, &transforms, &evidence, &good);
        let candidate = |(number, rival_log_odds): (usize, f64)| Candidate {
            sought: Arc::clone(&sought),
            T_scene_model: transforms[number],
            evidence: evidence[number].among_rivals(rival_log_odds, is_free_space_known),
            rival_log_odds,
            is_fitted: false,
        };
        good.into_iter().zip(rivals).map(candidate).collect()
    }

    /// The best transforms of a side, by most of its points; `None` where nothing speaks for any.
    ///
    /// Where the viewpoint is known, those that the coarse surface says may be right are looked at first. If one of them is,
    /// the others are its rivals.
    fn judged(&self, side: &Side<'_>, effort: Effort) -> Option<Judged<'a>> {
        let settings = self.settings;
        let view = self.view(side, &self.coarse, settings.coarse_points).with_rim(side);
        let (aligned, least) = if self.viewpoint.is_some() {
            let agreed = self.most_supported(&view, side, effort);
            let distances = [settings.first_distances, settings.coarse_distances];
            (best_first(&view, &agreed, &distances), least_before_fit(settings))
        } else {
            // The first alignment was made by fewer points.
            (best_first(&view, &self.most_agreed(side), &[settings.coarse_distances]), f64::NEG_INFINITY)
        };
        let promising = aligned.partition_point(|(_, log_odds)| *log_odds >= least);
        let different = |most: usize| self.different(side, transforms_of(&aligned[..most]), effort.tried);
        let (promising, tried) = (different(promising), different(aligned.len()));
        if promising.is_empty() {
            return None;
        }
        let view = self.view(side, &self.fine, effort.points).with_rim(side).with_front(&side.model);
        let judged = |tried: &[RigidTransform]| {
            let transforms = view.aligned(tried, settings.fine_distances, settings.aligned_points);
            let evidence = view.judged(&transforms, Free::All);
            (transforms, evidence)
        };
        let (mut transforms, mut evidence) = judged(&promising);
        if evidence.iter().any(|one| one.log_odds >= least) {
            let (others, of_others) = judged(&tried[promising.len()..]);
            transforms.extend(others);
            evidence.extend(of_others);
        }
        Some(Judged { view, transforms, evidence })
    }

    /// Where the viewpoint is known: of all transforms that matches propose, those that what the sensor saw speaks for, and
    /// most others agree with.
    fn most_supported(&self, view: &ModelView<'_>, side: &Side<'_>, effort: Effort) -> Vec<RigidTransform> {
        let own = |seen: &FieldPlaces| side.model.all_places().find(|own| own.radius == seen.radius);
        let matched = self.places.iter().filter_map(|seen| Some((own(seen)?, seen)));
        let weighted: Vec<(RigidTransform, f64)> =
            matched.flat_map(|(own, seen)| weighted_transforms(own, seen, self.settings.similar)).collect();
        let rough = self.view(side, &self.rough, self.settings.few_points);
        let transforms: Vec<RigidTransform> = weighted.iter().map(|(one, _)| *one).collect();
        let supports = rough.supports(&transforms);
        let supported = weighted.into_iter().zip(supports).filter(|(_, support)| *support > 0.0);
        let supported: Vec<(RigidTransform, f64)> = supported.map(|(one, _)| one).collect();
        let agreed = Proposals::of_weighted(&supported, side.model.extent(), self.settings).most_agreed();
        let supports = view.supports(&agreed.iter().map(|(one, _)| *one).collect::<Vec<_>>());
        let rate = |votes: f64, support: f64| votes.ln() + support / self.settings.support_per_vote;
        let rates = agreed.iter().zip(supports).map(|((one, votes), support)| (*one, rate(*votes, support)));
        let mut rated: Vec<(RigidTransform, f64)> = rates.collect();
        rated.sort_by(|(_, a), (_, b)| b.total_cmp(a));
        rated.into_iter().take(effort.aligned).map(|(one, _)| one).collect()
    }

    /// Where it is not: those that most others agree with, after a first alignment.
    fn most_agreed(&self, side: &Side<'_>) -> Vec<RigidTransform> {
        let proposed =
            Proposals::of_best_matches(&side.model.places, &self.places[0], self.settings).most_agreed();
        let proposed: Vec<RigidTransform> = proposed.into_iter().map(|(one, _)| one).collect();
        let view = self.view(side, &self.coarse, self.settings.first_points).with_rim(side);
        let aligned = best_first(&view, &proposed, &[self.settings.first_distances]);
        self.different(side, transforms_of(&aligned), self.settings.kept)
    }

    fn view(&self, side: &Side<'_>, surface: &Arc<SceneSurface>, most: usize) -> ModelView<'a> {
        ModelView::new(side, Arc::clone(surface), self.viewpoint, most, self.settings)
    }

    fn different(
        &self,
        side: &Side<'_>,
        transforms: impl Iterator<Item = RigidTransform>,
        most: usize,
    ) -> Vec<RigidTransform> {
        let [distance, angle] = self.settings.same;
        different(transforms, most, distance * side.model.places.radius, angle)
    }
}

/// Radius of patches, below which a scene has too few points in them.
fn least_radius(scene: &Scene<'_>) -> f64 {
    SPACINGS_PER_RADIUS * scene.spacing
}

fn transforms_of(aligned: &[(RigidTransform, f64)]) -> impl Iterator<Item = RigidTransform> {
    aligned.iter().map(|(transform, _)| *transform)
}

/// Transforms that anything speaks for, aligned by the samples of a view, by one range of distances after the other, where
/// that is better, with the logarithm of their odds; the best first.
fn best_first(
    view: &ModelView<'_>,
    transforms: &[RigidTransform],
    distances: &[(f64, f64, usize)],
) -> Vec<(RigidTransform, f64)> {
    let judged = |transforms: &[RigidTransform]| view.judged(transforms, Free::All);
    let aligned = distances
        .iter()
        .fold(transforms.to_vec(), |transforms, range| view.aligned(&transforms, *range, usize::MAX));
    let mut all: Vec<(RigidTransform, Evidence)> =
        transforms.iter().copied().zip(judged(transforms)).collect();
    for (best, after) in all.iter_mut().zip(aligned.iter().copied().zip(judged(&aligned))) {
        // Of a coarse surface, some of it smoothed by the sensor, an alignment may slide away.
        if after.1.log_odds >= best.1.log_odds {
            *best = after;
        }
    }
    all.retain(|(_, evidence)| evidence.support > 0.0);
    all.sort_by(|(_, a), (_, b)| b.log_odds.total_cmp(&a.log_odds));
    all.into_iter().map(|(transform, evidence)| (transform, evidence.log_odds)).collect()
}
