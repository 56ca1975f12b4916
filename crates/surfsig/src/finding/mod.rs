//! Where instances of models are in a scene: [`find_instances`].
//!
//! Each place of the scene proposes transforms by the places of a model that it is most similar to ([`proposals`]).
//! Those that many agree on are fitted to the scene's surface and judged by what the sensor saw ([`evidence`],
//! [`rim`]); the best ones become instances, each of which takes its points away from the others ([`acceptance`]) and is
//! tried to be refuted ([`examination`]).

mod acceptance;
mod evidence;
mod examination;
mod likelihood;
mod lines_of_sight;
mod misfit;
mod model;
mod proposals;
mod result;
mod rim;
mod rival_candidates;
mod samples;
mod scene;
mod settings;

pub use likelihood::Measures;
pub use model::{MODEL_STEPS, Model};
pub use result::Instance;
pub use settings::FindSettings;

use crate::geometry::RigidTransform;
use crate::scan::CenteredScan;
use crate::{Error, FieldPlaces, Monitor, Scan, with_threads};
use acceptance::{Candidate, Sought, accepted, least_before_fit};
use evidence::{Evidence, ModelView};
use model::{MIN_POINTS, SPACINGS_PER_RADIUS, on_ladder};
use proposals::{Proposals, different, weighted_transforms};
use rival_candidates::rival_log_odds;
use scene::{Free, Scene};
use std::sync::Arc;

/// Steps of each model that [`Monitor::done`] counts; [`find_instances`] takes one more before and after all.
pub const FIND_STEPS_PER_MODEL: usize = 3;

/// Finds every instance of models in a scene; the best first. There may be none.
///
/// Where all points of the scene can have been seen from its viewpoint (from the origin of its coordinates, if none is
/// given: most sensors are there), what a model has where the sensor saw through, or saw nothing, speaks against it. A
/// scene may have directions besides a viewpoint; then they alone say on which side of its surface the sensor was. The
/// result is the same whatever the number of threads.
///
/// # Errors
/// [`Error::InvalidModel`] for a model whose arrays do not belong together, [`Error::InvalidRadius`] for coordinates of
/// no use, [`Error::Threads`], [`Error::Cancelled`].
///
/// ```
/// use surfsig::{find_instances, FindSettings, Model, Monitor, PointCloud, RigidTransform, Scan};
///
/// // A bent egg, and the same one elsewhere, of which half is seen.
/// let golden = std::f64::consts::PI * (5.0_f64.sqrt() - 1.0);
/// let egg: Vec<[f64; 3]> = (0..6000)
///     .map(|i| {
///         let z = 1.0 - (f64::from(i) + 0.5) / 3000.0;
///         let (sine, cosine) = (golden * f64::from(i)).sin_cos();
///         let r = (1.0 - z * z).sqrt();
///         [r * cosine + 0.4 * z * z, 0.7 * r * sine + 0.3 * cosine * r * z, 1.6 * z]
///     })
///     .collect();
/// let model = Model::new(&Scan::new(PointCloud::new_f64(&egg)), None, &Monitor::default())?;
/// let truth = RigidTransform::from_rotation_vector([0.4, -1.0, 0.7], [5.0, 3.0, 9.0]);
/// let seen: Vec<[f64; 3]> =
///     egg.iter().filter(|p| p[0] > 0.1).map(|p| truth.transform_point(*p)).collect();
/// let scene = Scan::new(PointCloud::new_f64(&seen));
/// let found = find_instances(&[&model], &scene, &FindSettings::default(), &Monitor::default())?;
/// assert_eq!(found.len(), 1);
/// let off = (truth.inverse() * found[0].T_scene_model).log();
/// assert!(off.iter().all(|component| component.abs() < 0.02));
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn find_instances(
    models: &[&Model],
    scene: &Scan<'_>,
    settings: &FindSettings,
    monitor: &Monitor,
) -> Result<Vec<Instance>, Error> {
    models.iter().try_for_each(|model| model.check())?;
    with_threads(settings.threads, || {
        let scan = CenteredScan::new(scene);
        let radii = models.iter().map(|model| model.places.radius);
        let radius = radii.fold(f64::INFINITY, f64::min);
        if scan.points.len() < MIN_POINTS || models.is_empty() {
            return Ok(Vec::new());
        }
        let mut scene = Scene::new(scan, radius, settings, monitor)?;
        monitor.add(1);
        let mut candidates = Vec::new();
        for (number, model) in models.iter().enumerate() {
            candidates.extend(candidates_of(number, model, &mut scene, settings, monitor)?);
        }
        let found = accepted(candidates, &scene, models, settings, monitor)?;
        monitor.add(1);
        Ok(found)
    })?
}

/// Transforms of a model that are good enough where no other instance is near; the best first.
fn candidates_of<'a>(
    number: usize,
    model: &Model,
    scene: &mut Scene<'_>,
    settings: &'a FindSettings,
    monitor: &Monitor,
) -> Result<Vec<Candidate<'a>>, Error> {
    let least = SPACINGS_PER_RADIUS * scene.spacing;
    let model = if model.places.radius < least { model.with_radius(least, monitor)? } else { model.clone() };
    let voxel = scene.voxel(&model)?;
    let places: Vec<Arc<FieldPlaces>> =
        model.all_places().map(|own| scene.places(own.radius)).collect::<Result<_, _>>()?;
    let fine = scene.fine_surface(voxel)?;
    let coarse = scene.coarse_surface(voxel, settings.coarse_voxels * voxel)?;
    let rough = on_ladder(settings.rough_voxel * model.extent()).max(coarse.voxel);
    let rough = scene.rough_surface(voxel, rough)?;
    monitor.add(1);
    let mut sides = vec![model];
    if !(sides[0].is_sided && scene.is_oriented) {
        let other = sides[0].inside_out(monitor)?;
        sides.push(other);
    }
    let mut candidates = Vec::new();
    for side in sides {
        monitor.check()?;
        let view = |surface: &Arc<_>, most| {
            ModelView::new(&side, Arc::clone(surface), scene.viewpoint, most, settings)
        };
        let [distance, angle] = [settings.same[0] * side.places.radius, settings.same[1]];
        let second = view(&coarse, settings.coarse_points);
        let kept = if scene.viewpoint.is_some() {
            let matched = side.all_places().zip(&places);
            let weighted: Vec<(RigidTransform, f64)> =
                matched.flat_map(|(own, seen)| weighted_transforms(own, seen, settings.similar)).collect();
            let supported = supported(&view(&rough, settings.few_points), &weighted);
            let agreed = Proposals::of_weighted(&supported, side.extent(), settings).most_agreed();
            most_supported(&second, &agreed, settings)
        } else {
            let proposed = Proposals::of_best_matches(&side.places, &places[0], settings).most_agreed();
            let proposed: Vec<RigidTransform> = proposed.into_iter().map(|(one, _)| one).collect();
            let kept =
                best_first(&view(&coarse, settings.first_points), &proposed, &[settings.first_distances]);
            different(kept, settings.kept, distance, angle)
        };
        let all_distances = [settings.first_distances, settings.coarse_distances];
        // Without a viewpoint the first alignment was made by fewer points.
        let left = if scene.viewpoint.is_some() { &all_distances[..] } else { &all_distances[1..] };
        let tried = best_first(&second, &kept, left);
        let tried = different(tried, settings.tried, distance, angle);
        monitor.check()?;
        if tried.is_empty() {
            continue;
        }
        let last = view(&fine, settings.fine_points).with_front(&side);
        let aligned = last.aligned(&tried, settings.fine_distances, settings.aligned_points);
        let judged = last.judged(&aligned, Free::All);
        let sought = Arc::new(Sought::new(number, side, last));
        let least = least_before_fit(settings);
        let is_free_space_known = scene.viewpoint.is_some();
        let may_be_good = |&number: &usize| {
            judged[number].among_rivals(f64::NEG_INFINITY, is_free_space_known).log_odds >= least
        };
        let good: Vec<usize> = (0..judged.len()).filter(may_be_good).collect();
        let rivals = rival_log_odds(&sought, &aligned, &judged, &good);
        candidates.extend(good.into_iter().zip(rivals).map(|(number, rival_log_odds)| Candidate {
            sought: Arc::clone(&sought),
            T_scene_model: aligned[number],
            evidence: judged[number].among_rivals(rival_log_odds, is_free_space_known),
            rival_log_odds,
            is_fitted: false,
        }));
    }
    monitor.add(FIND_STEPS_PER_MODEL - 1);
    candidates.sort_by(|a, b| b.evidence.log_odds.total_cmp(&a.evidence.log_odds));
    Ok(candidates)
}

/// Logarithm of the odds of a probability.
fn log_odds(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}

/// The transforms that what the sensor saw speaks for.
fn supported(view: &ModelView<'_>, weighted: &[(RigidTransform, f64)]) -> Vec<(RigidTransform, f64)> {
    let transforms: Vec<RigidTransform> = weighted.iter().map(|(one, _)| *one).collect();
    let supports = view.supports(&transforms);
    weighted.iter().zip(supports).filter(|(_, support)| *support > 0.0).map(|(one, _)| *one).collect()
}

/// Of the transforms that most others agree with, each of which comes with its votes, those that have most votes and are
/// supported most by what the sensor saw.
fn most_supported(
    view: &ModelView<'_>,
    agreed: &[(RigidTransform, f64)],
    settings: &FindSettings,
) -> Vec<RigidTransform> {
    let transforms: Vec<RigidTransform> = agreed.iter().map(|(one, _)| *one).collect();
    let supports = view.supports(&transforms);
    let rate = |votes: f64, support: f64| votes.ln() + support / settings.support_per_vote;
    let rates = agreed.iter().zip(supports).map(|((one, votes), support)| (*one, rate(*votes, support)));
    let mut rated: Vec<(RigidTransform, f64)> = rates.collect();
    rated.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    rated.into_iter().take(settings.aligned).map(|(one, _)| one).collect()
}

/// Transforms that anything speaks for, aligned by the samples of a view, by one range of distances after the other, where
/// that is better; the best first.
fn best_first(
    view: &ModelView<'_>,
    transforms: &[RigidTransform],
    distances: &[(f64, f64, usize)],
) -> impl Iterator<Item = RigidTransform> + use<> {
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
    all.into_iter().map(|(transform, _)| transform)
}

#[cfg(test)]
mod tests;
