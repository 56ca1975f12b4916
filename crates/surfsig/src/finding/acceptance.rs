//! Which candidates are instances: the best one takes its part of the scene away from the others, and so on.

use super::evidence::{Evidence, ModelView};
use super::examination::{Examined, Refined};
use super::model::Model;
use super::scene::{Free, Scene, SceneSurface};
use super::{FindSettings, Instance, log_odds};
use crate::alignment::{FreeDirection, PointToSurfaceSettings, TargetSurface, even_sample, infinite_along};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::{Error, Monitor};
use nalgebra::{Matrix6, Vector3};
use rayon::prelude::*;
use std::sync::{Arc, OnceLock};

/// By how much the logarithm of the odds may grow when a transform is fitted to the scene's own points: those that are
/// lower by as much are not given up before. A fit by which they fall more has left the place that was judged.
const GAIN_OF_FIT: f64 = 2.0;

/// A model that is looked for, with one of its sides out.
pub(super) struct Sought<'a> {
    /// The model's number.
    number: usize,
    pub model: Model,
    pub view: ModelView<'a>,
    tree: KdTree,
    /// Largest distance of the model's samples from its centre.
    pub extent: f64,
    /// See [`Sought::surface`].
    surface: OnceLock<TargetSurface>,
}

impl<'a> Sought<'a> {
    pub fn new(number: usize, model: Model, view: ModelView<'a>) -> Self {
        let (tree, extent) = (KdTree::new(&model.samples), model.extent());
        Self { number, tree, extent, model, view, surface: OnceLock::new() }
    }

    /// All of the model's points as the surface that the scene's points are fitted to, made when it is first asked for.
    pub fn surface(&self) -> &TargetSurface {
        self.surface.get_or_init(|| TargetSurface::new(self.model.points.clone(), self.view.scene.voxel))
    }

    /// Whether a point, in the model's axes, is at its surface.
    pub fn is_on(&self, point: [f64; 3], reach: f64) -> bool {
        self.tree.nearest(point, reach).is_some()
    }
}

/// A transform of a model that is good enough.
#[allow(non_snake_case)]
#[derive(Clone)]
pub(super) struct Candidate<'a> {
    pub sought: Arc<Sought<'a>>,
    pub T_scene_model: RigidTransform,
    pub evidence: Evidence,
    /// Logarithm of the odds of its best rival.
    pub rival_log_odds: f64,
    /// Whether it was fitted to the scene's own points.
    pub is_fitted: bool,
}

impl Candidate<'_> {
    /// Whether a point of the scene is at the model's surface.
    fn is_near(&self, inverse: &RigidTransform, point: [f64; 3], reach: f64) -> bool {
        let limit = self.sought.extent + reach;
        let gap = Vector3::from(point) - self.T_scene_model.translation;
        gap.norm_squared() < limit * limit && self.sought.is_on(inverse.transform_point(point), reach)
    }

    /// Which points of the scene are at the model's surface, by their numbers.
    fn near(&self, points: impl IndexedParallelIterator<Item = [f64; 3]>, distance: f64) -> Vec<usize> {
        let inverse = self.T_scene_model.inverse();
        let reach = distance * self.sought.view.scene.voxel;
        points
            .enumerate()
            .with_min_len(1024)
            .filter(|(_, point)| self.is_near(&inverse, *point, reach))
            .map(|(number, _)| number)
            .collect()
    }

    /// Its evidence by the samples of the scene that are free, among its rivals.
    pub fn judged(&self, free: Free<'_>) -> Evidence {
        self.among_its_rivals(self.sought.view.judged(&[self.T_scene_model], free)[0])
    }

    fn among_its_rivals(&self, evidence: Evidence) -> Evidence {
        evidence.among_rivals(self.rival_log_odds, self.sought.view.viewpoint.is_some())
    }
}

/// The samples of each of the scene's surfaces that no instance explains yet.
struct Unexplained {
    surfaces: Vec<(Arc<SceneSurface>, Vec<bool>)>,
}

impl Unexplained {
    fn new(candidates: &[Candidate<'_>]) -> Self {
        let mut surfaces: Vec<(Arc<SceneSurface>, Vec<bool>)> = Vec::new();
        for candidate in candidates {
            let scene = &candidate.sought.view.scene;
            if !surfaces.iter().any(|(known, _)| Arc::ptr_eq(known, scene)) {
                surfaces.push((Arc::clone(scene), vec![true; scene.samples().len()]));
            }
        }
        Self { surfaces }
    }

    fn of(&self, candidate: &Candidate<'_>) -> Free<'_> {
        let scene = &candidate.sought.view.scene;
        let known = self.surfaces.iter().find(|(known, _)| Arc::ptr_eq(known, scene));
        known.map_or(Free::All, |(_, is_free)| Free::Only(is_free))
    }

    /// Takes away what an instance explains.
    fn take(&mut self, instance: &Candidate<'_>, distance: f64) {
        for (surface, is_free) in &mut self.surfaces {
            let points = surface.samples().par_iter().map(|sample| sample.place.map(f64::from));
            for number in instance.near(points, distance) {
                is_free[number] = false;
            }
        }
    }
}

/// Logarithm of the odds below which a transform is given up before it is fitted to the scene's own points.
pub(super) fn least_before_fit(settings: &FindSettings) -> f64 {
    log_odds(settings.min_score) - GAIN_OF_FIT
}

/// Takes the best candidate and its part of the scene away, until none is good enough; the best instance first.
pub(super) fn accepted(
    mut candidates: Vec<Candidate<'_>>,
    scene: &Scene<'_>,
    settings: &FindSettings,
    monitor: &Monitor,
) -> Result<Vec<Instance>, Error> {
    let mut unexplained = Unexplained::new(&candidates);
    let mut is_taken = vec![false; scene.scan.points.len()];
    let mut instances = Vec::new();
    let least = log_odds(settings.min_score);
    while instances.len() < settings.at_most {
        monitor.check()?;
        // Of equal ones the first.
        let best = (0..candidates.len()).reduce(|best, other| {
            let is_better = candidates[other].evidence.log_odds > candidates[best].evidence.log_odds;
            if is_better { other } else { best }
        });
        let Some(best) = best else { break };
        let candidate = candidates.remove(best);
        let free = unexplained.of(&candidate);
        let Some((refined, evidence)) = refined(&candidate, scene, &is_taken, free, settings) else {
            continue;
        };
        let fitted = &refined.candidate;
        if evidence.log_odds < least_before_fit(settings) {
            continue;
        }
        if !candidate.is_fitted && candidates.iter().any(|other| other.evidence.log_odds > evidence.log_odds)
        {
            // Fitted it is worse than it seemed: another one may be better.
            candidates.push(Candidate { evidence, ..refined.candidate });
            continue;
        }
        if evidence.log_odds < least || !evidence.is_enough(fitted.sought.view.viewpoint.is_some()) {
            continue;
        }
        let examined = refined.examined(evidence.support, free, settings);
        let own = fitted.near(scene.scan.points.par_iter().copied(), settings.own_distance);
        let own: Vec<usize> = own.into_iter().filter(|&number| !is_taken[number]).collect();
        own.iter().for_each(|&number| is_taken[number] = true);
        unexplained.take(fitted, settings.own_distance);
        instances.push(instance(&refined, examined, evidence, own, scene));
        // Only those near it have lost something.
        let is_near = |other: &Candidate<'_>| {
            let reach = fitted.sought.view.reach + other.sought.view.reach;
            (other.T_scene_model.translation - fitted.T_scene_model.translation).norm() < reach
        };
        let near = (0..candidates.len()).filter(|&number| is_near(&candidates[number])).collect();
        judge_again(&mut candidates, near, &unexplained);
        candidates.retain(|candidate| candidate.evidence.log_odds >= least_before_fit(settings));
    }
    instances.sort_by(|a, b| b.score.total_cmp(&a.score));
    Ok(instances)
}

/// Judges candidates with given numbers by what is unexplained, those of a model at once.
fn judge_again(candidates: &mut [Candidate<'_>], mut numbers: Vec<usize>, unexplained: &Unexplained) {
    while let Some(&first) = numbers.first() {
        let sought = Arc::clone(&candidates[first].sought);
        let (same, others): (Vec<usize>, Vec<usize>) =
            numbers.into_iter().partition(|&number| Arc::ptr_eq(&candidates[number].sought, &sought));
        let transforms: Vec<RigidTransform> =
            same.iter().map(|&number| candidates[number].T_scene_model).collect();
        let judged = sought.view.judged(&transforms, unexplained.of(&candidates[first]));
        for (number, evidence) in same.into_iter().zip(judged) {
            candidates[number].evidence = candidates[number].among_its_rivals(evidence);
        }
        numbers = others;
    }
}

/// The candidate fitted to the scene's own points, which no other instance has taken, and its evidence by the samples that
/// are free; `None` where hardly any point is near.
pub(super) fn refined<'a>(
    candidate: &Candidate<'a>,
    scene: &Scene<'_>,
    is_taken: &[bool],
    free: Free<'_>,
    settings: &FindSettings,
) -> Option<(Refined<'a>, Evidence)> {
    let voxel = candidate.sought.view.scene.voxel;
    let points = &scene.scan.points;
    let near = candidate.near(points.par_iter().copied(), settings.own_distance);
    let near: Vec<[f64; 3]> =
        near.into_iter().filter(|&number| !is_taken[number]).map(|number| points[number]).collect();
    let sample = even_sample(&near, settings.max_fitted, voxel);
    // The model's surface is the target: it is whole, and denser than what is seen.
    let surface = candidate.sought.surface();
    let start = candidate.T_scene_model.inverse();
    if let Some(fit) = surface.align(&sample, start, &settings.point_to_surface) {
        let fitted =
            Candidate { T_scene_model: fit.T_target_source.inverse(), is_fitted: true, ..candidate.clone() };
        let evidence = fitted.judged(free);
        if evidence.log_odds >= candidate.evidence.log_odds - GAIN_OF_FIT {
            return Some((Refined { candidate: fitted, fit, sample }, evidence));
        }
    }
    // Where the points hardly determine a motion, the fit has followed their noise and left the place that was judged, or
    // even the surface.
    let there = PointToSurfaceSettings { max_iterations: 0, ..settings.point_to_surface };
    let fit = surface.align(&sample, start, &there)?;
    let stays = Candidate { is_fitted: true, ..candidate.clone() };
    Some((Refined { candidate: stays, fit, sample }, candidate.evidence))
}

fn instance(
    refined: &Refined<'_>,
    examined: Examined,
    evidence: Evidence,
    own: Vec<usize>,
    scene: &Scene<'_>,
) -> Instance {
    let Refined { candidate: fitted, fit, .. } = refined;
    let translated = |by: [f64; 3]| RigidTransform::from_rotation_vector([0.0; 3], by);
    let from_middle = translated(scene.scan.center);
    let from_model = translated(fitted.sought.model.center).inverse();
    let to_scene = from_middle * fitted.T_scene_model;
    // A small motion of the scene in the model's axes is the opposite one of the model in the scene's.
    let rotation = fitted.T_scene_model.rotation;
    let mut both = Matrix6::zeros();
    both.fixed_view_mut::<3, 3>(0, 0).copy_from(&rotation);
    both.fixed_view_mut::<3, 3>(3, 3).copy_from(&rotation);
    let covariance = both * fit.covariance * both.transpose();
    let free_directions: Vec<FreeDirection> =
        examined.free_directions.iter().map(|direction| direction.transformed(&to_scene)).collect();
    let center = to_scene.transform_point(fit.center);
    let open: Vec<_> = free_directions.iter().flat_map(|direction| direction.twists(center)).collect();
    Instance {
        model: fitted.sought.number,
        T_scene_model: to_scene * from_model,
        covariance: infinite_along(&covariance, &open, fitted.sought.model.places.radius).into(),
        alternatives: examined
            .alternatives
            .iter()
            .map(|transform| from_middle * *transform * from_model)
            .collect(),
        scale: examined.scale,
        scale_standard_error: examined.scale_standard_error,
        doubts: examined.doubts,
        center,
        score: evidence.score(),
        measures: evidence.measures,
        visible: evidence.visible,
        overlap: evidence.overlap,
        rms: fit.rms,
        free_directions,
        indices: own.into_iter().map(|number| scene.scan.numbers[number]).collect(),
    }
}
