//! Models, and where instances of them are in a scene.

use crate::arrays::{array, present, put, put_new};
use crate::code::{Failure, guarded, surfsig_code};
use crate::columns::first_entry;
use crate::find_options::surfsig_find_options;
use crate::registration::{SURFSIG_FREE_DIRECTIONS, surfsig_free_direction, surfsig_scan};
use crate::transform::surfsig_transform;
use surfsig::{FIND_STEPS_PER_MODEL, Instance, MODEL_STEPS, Model, find_instances};

/// What is looked for, prepared once. Made by surfsig_model_new(), freed by surfsig_model_free(). It refers to nothing
/// of the caller's, and may be looked for by several threads at once.
pub struct surfsig_model {
    model: Model,
}

/// Prepares a model: a whole object, or one view of it.
///
/// @param scan Its points, at least 50 finite ones that lie on a surface. May have directions and a viewpoint: then the
/// directions say which side is the outer one. A viewpoint alone says so where all points can have been seen from there.
/// @param options How many threads, and who is told the progress; null for the default.
/// @param model Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_model_new(
    scan: *const surfsig_scan,
    options: Option<&surfsig_find_options>,
    model: *mut *mut surfsig_model,
) -> surfsig_code {
    let made = || {
        // SAFETY: the caller gives a scan whose pointers are as they say.
        let scan = unsafe { array(scan, 1, "scan")?[0].with_both("scan")? };
        let default = surfsig_find_options::default();
        let surfsig_find_options { settings, progress } = options.unwrap_or(&default);
        let work = |monitor: &_| Model::new(&scan, settings.threads, monitor);
        Ok(surfsig_model { model: progress.watched(MODEL_STEPS, work)? })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(model, "model", made) })
}

/// Frees a model; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_model_free(model: Option<Box<surfsig_model>>) {
    drop(model);
}

/// Number of the model's finite points; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_model_size(model: Option<&surfsig_model>) -> usize {
    model.map_or(0, |model| model.model.points.len())
}

/// Radius of the smallest patches that describe the model, in its unit: about 0.4 times the median distance of its
/// points from their middle, and about 8 times their spacing at least; NaN for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_model_radius(model: Option<&surfsig_model>) -> f64 {
    model.map_or(f64::NAN, |model| model.model.places.radius)
}

/// Median distance of the model's points to their nearest other ones, in its unit; NaN for null. Where it is many times
/// that of the scene's points, the two may be in different units.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_model_spacing(model: Option<&surfsig_model>) -> f64 {
    model.map_or(f64::NAN, |model| model.model.spacing)
}

/// A model that is in a scene.
#[allow(non_snake_case, reason = "the name says from where to where")]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_instance {
    /// The model's number among those that were looked for, from 0.
    pub model: usize,
    /// Takes the model's points to the scene.
    pub T_scene_model: surfsig_transform,
    /// Of the small twist (rotation vector in radians, then translation) in the scene's axes, about the center, that
    /// takes the given transform to the true one: 6 x 6, row by row.
    pub covariance: [f64; 36],
    /// Middle of what lies on the scene's points, in the scene's coordinates.
    pub center: [f64; 3],
    /// Probability that the transform is right: within a tenth of the model's diameter. Learnt on simulated scenes.
    pub score: f64,
    /// Share of the surface facing the sensor that is seen, 0 to 1; of all of it where the viewpoint is not known.
    pub visible: f64,
    /// Share of the model's whole surface that lies on the scene's, 0 to 1.
    pub overlap: f64,
    /// Root mean square of the distances there, in the scans' unit.
    pub rms: f64,
    /// Number of free directions.
    pub free_direction_count: usize,
    /// Motions of the model, in the scene's coordinates, that what is seen does not determine; NaN beyond the last.
    pub free_directions: [surfsig_free_direction; SURFSIG_FREE_DIRECTIONS],
    /// Number of the scene's points that are the instance's.
    pub point_count: usize,
}

impl surfsig_instance {
    fn of(found: &Instance) -> Self {
        let mut covariance = [f64::NAN; 36];
        covariance.copy_from_slice(found.covariance.as_flattened());
        Self {
            model: found.model,
            T_scene_model: surfsig_transform::of(&found.T_scene_model),
            covariance,
            center: found.center,
            score: found.score,
            visible: found.visible,
            overlap: found.overlap,
            rms: found.rms,
            free_direction_count: found.free_directions.len(),
            free_directions: surfsig_free_direction::array_of(&found.free_directions),
            point_count: found.indices.len(),
        }
    }
}

/// All instances in a scene, the best first. Made by surfsig_find_instances(), freed by surfsig_instances_free(). It
/// refers to nothing of the caller's.
pub struct surfsig_instances {
    instances: Vec<surfsig_instance>,
    indices: Vec<Vec<u32>>,
}

/// Finds every instance of models in a scene. That there is none is no failure.
///
/// Each place of the scene proposes a transform by the place of a model whose field signature is most similar. Those that
/// many agree on are fitted to the scene's surface and judged by what the sensor saw: what of the model is confirmed by
/// points, less what it saw through and where it saw nothing. The best is taken, with its points, and the others are
/// judged again without these. The result is always the same.
///
/// @param models What is looked for, each in the scene's unit; null only if count is 0.
/// @param count How many they are.
/// @param scene The scene; it may have directions and a viewpoint. Free space counts where all points can have been seen
/// from the viewpoint, or from the origin of the scene's coordinates where none is given; otherwise only what is
/// confirmed does, and a higher score leaves out what is there by chance. Points at (0, 0, 0), as sensors write them
/// where they measured nothing, must not be among its points: NaN may.
/// @param options How; null for the default.
/// @param instances Where the result is put; null is put there where the call fails.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_find_instances(
    models: *const *const surfsig_model,
    count: usize,
    scene: *const surfsig_scan,
    options: Option<&surfsig_find_options>,
    instances: *mut *mut surfsig_instances,
) -> surfsig_code {
    let made = || {
        // SAFETY: the caller gives `count` pointers, each null or to a model, and a scan whose pointers are as they say.
        let (models, scene) = unsafe {
            let models = array(models, count, "models")?.iter();
            let model =
                |model: &*const surfsig_model| Ok(&present(model.as_ref(), "each of the models")?.model);
            let models = models.map(model).collect::<Result<Vec<&Model>, Failure>>()?;
            (models, array(scene, 1, "scene")?[0].with_both("scene")?)
        };
        let default = surfsig_find_options::default();
        let surfsig_find_options { settings, progress } = options.unwrap_or(&default);
        let work = |monitor: &_| find_instances(&models, &scene, settings, monitor);
        let found = progress.watched(2 + FIND_STEPS_PER_MODEL * models.len(), work)?;
        let indices = |found: &Instance| found.indices.iter().map(|&index| index as u32).collect();
        Ok(surfsig_instances {
            instances: found.iter().map(surfsig_instance::of).collect(),
            indices: found.iter().map(indices).collect(),
        })
    };
    // SAFETY: the caller gives room for a pointer, or null.
    guarded(|| unsafe { put_new(instances, "instances", made) })
}

/// Frees instances and their indices; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_instances_free(instances: Option<Box<surfsig_instances>>) {
    drop(instances);
}

/// Number of instances; 0 for null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_instances_size(instances: Option<&surfsig_instances>) -> usize {
    instances.map_or(0, |instances| instances.instances.len())
}

/// Gives an instance.
///
/// @param instances The instances.
/// @param index Number of an instance, from 0.
/// @param instance Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_instances_get(
    instances: Option<&surfsig_instances>,
    index: usize,
    instance: *mut surfsig_instance,
) -> surfsig_code {
    guarded(|| {
        let all = &present(instances, "instances")?.instances;
        let outside =
            || Failure::invalid_input(format!("instance {index} is outside a result of {}", all.len()));
        let found = all.get(index).ok_or_else(outside)?;
        // SAFETY: the caller gives room for a result, or null.
        unsafe { put(instance, *found, "instance") }
    })
}

/// Numbers of the scene's points that are an instance's, ascending: (point_count) numbers that live as long as the
/// instances. Null for an instance that is none.
///
/// @param instances The instances.
/// @param index Number of an instance, from 0.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_instances_indices(
    instances: Option<&surfsig_instances>,
    index: usize,
) -> *const u32 {
    first_entry(instances, |instances| instances.indices.get(index).map_or(&[], Vec::as_slice))
}
