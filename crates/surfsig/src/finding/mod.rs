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
mod model_search;
mod model_source;
mod proposals;
mod result;
mod rim;
mod rival_candidates;
mod samples;
mod scene;
mod settings;
mod side;

pub use likelihood::Measures;
pub use model::{MODEL_STEPS, Model};
pub use model_source::ModelSource;
pub use result::Instance;
pub use settings::FindSettings;

use crate::scan::CenteredScan;
use crate::{Error, Monitor, Scan, with_threads};
use acceptance::{accepted, least_before_fit};
use model::MIN_POINTS;
use model_search::ModelSearch;
use model_source::InMemory;
use scene::Scene;

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
    find_instances_of(&InMemory(models), scene, settings, monitor)
}

/// The same, of models that are loaded when they are needed.
///
/// Of several models each is first looked for briefly, where it is known what the sensor saw through; only those that may
/// be there are loaded as a whole and searched.
///
/// # Errors
/// As [`find_instances`], and what the source says.
pub fn find_instances_of(
    models: &dyn ModelSource,
    scene: &Scan<'_>,
    settings: &FindSettings,
    monitor: &Monitor,
) -> Result<Vec<Instance>, Error> {
    with_threads(settings.threads, || {
        let scan = CenteredScan::new(scene);
        let radius = (0..models.count()).map(|number| models.radius(number)).fold(f64::INFINITY, f64::min);
        if scan.points.len() < MIN_POINTS || models.count() == 0 {
            return Ok(Vec::new());
        }
        let mut scene = Scene::new(scan, radius, settings, monitor)?;
        monitor.add(1);
        let mut candidates = Vec::new();
        for number in possible_models(models, &mut scene, settings, monitor)? {
            monitor.check()?;
            let model = models.whole(number)?;
            model.check()?;
            let search = ModelSearch::new(number, model, &mut scene, settings, monitor)?;
            candidates.extend(search.candidates(monitor)?);
            monitor.add(FIND_STEPS_PER_MODEL - 1);
        }
        let found = accepted(candidates, &scene, settings, monitor)?;
        monitor.add(1);
        Ok(found)
    })?
}

/// Numbers of the models that may be in the scene, ascending: of several those for which a brief search finds a transform
/// that is not much worse than what is given up; of many the best ones.
fn possible_models(
    models: &dyn ModelSource,
    scene: &mut Scene<'_>,
    settings: &FindSettings,
    monitor: &Monitor,
) -> Result<Vec<usize>, Error> {
    if models.count() == 1 || scene.viewpoint.is_none() {
        monitor.add(models.count());
        return Ok((0..models.count()).collect());
    }
    let least = least_before_fit(settings) - settings.brief_deficit;
    let mut possible = Vec::new();
    for number in 0..models.count() {
        monitor.check()?;
        let model = models.brief(number)?;
        model.check()?;
        let log_odds = ModelSearch::briefly(number, model, scene, settings, monitor)?;
        if log_odds >= least {
            possible.push((number, log_odds));
            monitor.add(1);
        } else {
            monitor.add(FIND_STEPS_PER_MODEL);
        }
    }
    possible.sort_by(|(_, a), (_, b)| b.total_cmp(a));
    // Those of which it cannot tell are searched beside these.
    let untold = possible.iter().filter(|(_, log_odds)| *log_odds == f64::INFINITY).count();
    let most = settings.searched.saturating_add(untold);
    monitor.add((FIND_STEPS_PER_MODEL - 1) * possible.len().saturating_sub(most));
    possible.truncate(most);
    let mut numbers: Vec<usize> = possible.into_iter().map(|(number, _)| number).collect();
    numbers.sort_unstable();
    Ok(numbers)
}

/// Logarithm of the odds of a probability.
fn log_odds(probability: f64) -> f64 {
    (probability / (1.0 - probability)).ln()
}

#[cfg(test)]
mod tests;
