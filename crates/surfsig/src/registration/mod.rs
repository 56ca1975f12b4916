//! How a scan lies in another: [`register`].
//!
//! Keypoints are matched by their field signatures ([`crate::match_fields`]), the matches agree on a transform
//! ([`crate::ConsensusSettings`]), generalised ICP refines it ([`crate::gicp`]), the last steps fit points to the
//! surface and tell how sure it is, and then it is tried to refute the result ([`Doubt`]). Where matches prove nothing,
//! faces of buildings propose transforms ([`FaceSettings`]), of which free space chooses.

mod face_search;
mod free_space;
mod judgement;
mod result;
mod settings;
mod trial;

pub use result::Registration;
pub use settings::{FaceSettings, FreeSpaceSettings, RegistrationSettings};

use face_search::Faced;
use free_space::BothSensors;
use judgement::{Judge, Judgement};
use trial::{Trial, Tried};

use crate::alignment::{
    Alternative, Correspondences, Doubt, GicpCloud, TargetSurface, even_sample, infinite_along,
    information_without,
};
use crate::field::{KeypointOptions, keypoints_within, match_fields};
use crate::geometry::RigidTransform;
use crate::orientation::directions_within;
use crate::scan::CenteredScan;
use crate::visibility::estimated_viewpoint;
use crate::voxels::voxel_means;
use crate::{Error, FieldOptions, FieldPlaces, Monitor, PointCloud, Radius, Scan, with_threads};
use nalgebra::{Matrix3, Vector3};

/// Steps of which [`Monitor::done`] counts each.
pub const REGISTRATION_STEPS: usize = 5;

/// Matches without which they propose no transform: three places determine one.
const MIN_MATCHES: usize = 3;

/// Finds how a source lies in a target, from any start; or refines `start` (T_target_source) where one is given.
///
/// The result is the same whatever the number of threads. Where nothing is found its transform is `None`.
///
/// # Errors
/// [`Error::Threads`], [`Error::Cancelled`], and [`Error::InvalidRadius`] for a radius that is none.
///
/// ```
/// use surfsig::{register, Monitor, PointCloud, RegistrationSettings, RigidTransform, Scan};
///
/// let bump = |x: f64, y: f64, h: f64| h * (-3.0 * (x * x + 2.0 * y * y)).exp();
/// let height = |x: f64, y: f64| bump(x - 1.0, y - 1.2, 0.5) - bump(y - 2.5, x - 2.2, 0.4) + bump(x - 3.0, y - 0.8, 0.3);
/// let target: Vec<[f64; 3]> = (0..6400)
///     .map(|i| (f64::from(i % 80) * 0.05, f64::from(i / 80) * 0.05))
///     .map(|(x, y)| [x, y, height(x, y)])
///     .collect();
/// let truth = RigidTransform::from_rotation_vector([0.2, -0.1, 1.4], [3.0, 2.0, 1.0]);
/// let source = truth.inverse().transform_points(&target);
/// let viewpoint = [2.0, 2.0, 10.0];
/// let found = register(
///     &Scan::new(PointCloud::new_f64(&source)).seen_from(truth.inverse().transform_point(viewpoint)),
///     &Scan::new(PointCloud::new_f64(&target)).seen_from(viewpoint),
///     None,
///     &RegistrationSettings::default(),
///     &Monitor::default(),
/// )?;
/// let off = truth.inverse() * found.T_target_source.expect("there is one");
/// assert!(found.trusted && off.log().iter().all(|component| component.abs() < 1e-3));
/// # Ok::<(), surfsig::Error>(())
/// ```
pub fn register(
    source: &Scan<'_>,
    target: &Scan<'_>,
    start: Option<&RigidTransform>,
    settings: &RegistrationSettings,
    monitor: &Monitor,
) -> Result<Registration, Error> {
    settings.radius.map(Radius::new).transpose()?;
    with_threads(settings.threads, || {
        let scans = [source, target].map(oriented);
        registered(&scans[0], &scans[1], start, settings, monitor)
    })?
}

/// A scan about its middle; where nothing says from where it was seen, its points may ([`estimated_viewpoint`]).
fn oriented(scan: &Scan<'_>) -> CenteredScan {
    let centered = CenteredScan::new(scan);
    let viewpoint =
        if scan.is_oriented() { centered.viewpoint } else { estimated_viewpoint(&centered.points) };
    CenteredScan { viewpoint, ..centered }
}

fn registered(
    source: &CenteredScan,
    target: &CenteredScan,
    start: Option<&RigidTransform>,
    settings: &RegistrationSettings,
    monitor: &Monitor,
) -> Result<Registration, Error> {
    let size = source.size().min(target.size());
    let radius = settings.radius.unwrap_or(settings.radius_share * size);
    if source.points.len().min(target.points.len()) < settings.min_points || radius == 0.0 {
        return Ok(Registration::nothing(radius, 0));
    }
    let patch = Radius::new(radius)?;
    let [from_source, to_target] =
        [source.center, target.center].map(|center| RigidTransform::from_rotation_vector([0.0; 3], center));
    let (proposals, matches) = match start {
        Some(start) => {
            monitor.add(2);
            (vec![to_target.inverse() * *start * from_source], None)
        }
        None => {
            let thinned =
                [source, target].map(|scan| scan.thinned(radius / settings.description_voxels_per_radius));
            let matches = matched(&thinned[0], &thinned[1], patch, settings, monitor)?;
            let rivals = settings.rivals;
            let distance = rivals.distance * radius;
            let proposals = if matches.len() < MIN_MATCHES {
                Vec::new()
            } else {
                matches.agreed_transforms(rivals.proposals, rivals.least_score, distance)
            };
            (proposals, Some(matches))
        }
    };
    let count = matches.as_ref().map_or(0, Correspondences::len);
    monitor.check()?;
    let voxel = radius / settings.voxels_per_radius;
    let clouds = [source, target].map(|scan| GicpCloud::new(voxel_means(&scan.points, voxel)));
    let [ours, theirs] = [0, 1].map(|side: usize| clouds[side].len());
    if ours.min(theirs) < settings.min_voxels {
        return Ok(Registration::nothing(radius, count));
    }
    let sample = even_sample(&source.points, ours.min(settings.max_points), voxel);
    let surface = TargetSurface::new(even_sample(&target.points, theirs, voxel), voxel);
    monitor.add(1);
    let sensors = BothSensors::new([source, target], [&sample, surface.points()], voxel, settings.free_space);
    let sides = sensors
        .viewpoints()
        .map(|viewpoints| [0, 1].map(|k| Faced::new(&clouds[k], viewpoints[k], &settings.faces)));
    let trial = Trial {
        judge: Judge {
            surface: &surface,
            clouds: &clouds,
            voxel,
            sample: &sample,
            sensors,
            radius,
            settings,
        },
        sides,
        matches: matches.as_ref(),
        monitor,
    };
    let Some(Tried { found, mut judged, inliers, is_by_faces }) = trial.best(&proposals)? else {
        return Ok(Registration::nothing(radius, count));
    };
    monitor.add(1);
    if let (true, false, Some(own)) = (judged.doubts.is_empty(), is_by_faces, inliers) {
        let agreement = own as f64 / (count as f64 * found.overlap);
        if agreement < settings.doubted_agreement {
            let (inliers, transform) = mirrored(source, target, patch, settings, monitor)?;
            if inliers as f64 > settings.mirrored_inliers * own as f64
                && trial.judge.is_refuted_by_mirror(&found, judged.free_space, transform)
            {
                judged.doubts.push(Doubt::Mirrored { inliers });
            }
        }
    }
    let Judgement { doubts, free_directions, alternatives, .. } = judged;
    monitor.add(1);
    let open: Vec<_> = free_directions.iter().flat_map(|direction| direction.twists(found.center)).collect();
    let in_scans = |transform: RigidTransform| to_target * transform * from_source.inverse();
    let alternatives = alternatives
        .into_iter()
        .map(|rival: Alternative| Alternative { T_target_source: in_scans(rival.T_target_source), ..rival });
    Ok(Registration {
        T_target_source: Some(in_scans(found.T_target_source)),
        covariance: infinite_along(&found.covariance, &open, radius).into(),
        information: information_without(&found.covariance, &open, radius).into(),
        center: to_target.transform_point(found.center),
        trusted: doubts.is_empty(),
        doubts,
        free_directions: free_directions.iter().map(|direction| direction.transformed(&to_target)).collect(),
        alternatives: alternatives.collect(),
        matches: count,
        inliers: inliers.unwrap_or(0),
        overlap: found.overlap,
        explained: judged.explained,
        free_space: judged.free_space,
        scale: judged.scale,
        scale_standard_error: judged.scale_standard_error,
        rms: found.rms,
        radius,
    })
}

/// The larger share of one scan's points that lie in the other sensor's free space after a transform, of those that it
/// would have measured; NaN where no viewpoint is known from which all was seen, or nothing is in sight.
///
/// # Errors
/// [`Error::Threads`]; [`Error::InvalidRadius`] for a radius that is none.
///
/// ```
/// use surfsig::{free_space_share, PointCloud, RegistrationSettings, RigidTransform, Scan};
/// let wall = |x: f64| -> Vec<[f64; 3]> {
///     (0..3600).map(|i| [x, f64::from(i % 60) * 0.05 - 1.5, f64::from(i / 60) * 0.05 - 1.5]).collect()
/// };
/// let (near, far) = (wall(2.0), wall(4.0));
/// let [near, far] = [&near, &far].map(|wall| Scan::new(PointCloud::new_f64(wall)).seen_from([0.0; 3]));
/// let share = |source, target| {
///     free_space_share(source, target, &RigidTransform::identity(), &RegistrationSettings::default())
/// };
/// assert_eq!(share(&far, &far)?, 0.0);
/// assert!(share(&near, &far)? > 0.9, "the far wall was seen through the near one");
/// # Ok::<(), surfsig::Error>(())
/// ```
#[allow(non_snake_case)]
pub fn free_space_share(
    source: &Scan<'_>,
    target: &Scan<'_>,
    T_target_source: &RigidTransform,
    settings: &RegistrationSettings,
) -> Result<f64, Error> {
    settings.radius.map(Radius::new).transpose()?;
    with_threads(settings.threads, || {
        let scans = [source, target].map(oriented);
        let size = scans[0].size().min(scans[1].size());
        let voxel = settings.radius.unwrap_or(settings.radius_share * size) / settings.voxels_per_radius;
        if voxel.is_nan() || voxel <= 0.0 {
            return f64::NAN;
        }
        let samples = [0, 1].map(|k| even_sample(&scans[k].points, settings.max_points, voxel));
        let sensors =
            BothSensors::new([&scans[0], &scans[1]], [&samples[0], &samples[1]], voxel, settings.free_space);
        let [from_source, to_target] =
            [0, 1].map(|k| RigidTransform::from_rotation_vector([0.0; 3], scans[k].center));
        sensors.free_space(&(to_target.inverse() * *T_target_source * from_source))
    })
}

/// How many matches of the source's mirror image agree with one transform, and this, which mirrors the source.
fn mirrored(
    source: &CenteredScan,
    target: &CenteredScan,
    patch: Radius,
    settings: &RegistrationSettings,
    monitor: &Monitor,
) -> Result<(usize, RigidTransform), Error> {
    let thinned = |scan: &CenteredScan| scan.thinned(patch.get() / settings.description_voxels_per_radius);
    let mirrored = thinned(source).mirrored();
    let matches = matched(&mirrored, &thinned(target), patch, settings, &monitor.apart())?;
    let agreed = matches.agreed_transform();
    let mirror = Matrix3::from_diagonal(&Vector3::new(-1.0, 1.0, 1.0));
    Ok((matches.inlier_count(&agreed), RigidTransform { rotation: agreed.rotation * mirror, ..agreed }))
}

/// Matches keypoints; where it is not known for both scans from where they were seen, both sides of the source's
/// surface.
fn matched(
    source: &CenteredScan,
    target: &CenteredScan,
    radius: Radius,
    settings: &RegistrationSettings,
    monitor: &Monitor,
) -> Result<Correspondences, Error> {
    let oriented = |scan: &CenteredScan| -> Result<Option<Vec<[f32; 3]>>, Error> {
        let voxel = radius.get() / settings.orientation_voxels_per_radius;
        Ok(Some(directions_within(&scan.points, voxel, monitor)?))
    };
    let is_known = [source, target].map(|scan| scan.scan().is_oriented());
    let theirs = if is_known[1] { None } else { oriented(target)? };
    let theirs = described(target, theirs.as_deref(), radius, settings, monitor)?;
    monitor.add(1);
    let consensus = |ours: &FieldPlaces| {
        Correspondences::new(&match_fields(ours, &theirs, true), ours, &theirs, settings.consensus)
    };
    if is_known == [true; 2] {
        let ours = described(source, None, radius, settings, monitor)?;
        monitor.add(1);
        return Ok(consensus(&ours));
    }
    let one_side = oriented(source)?.unwrap_or_default();
    let other_side: Vec<[f32; 3]> = one_side.iter().map(|direction| direction.map(|x| -x)).collect();
    let sides = [&one_side, &other_side].map(|side| described(source, Some(side), radius, settings, monitor));
    let [one, other] = sides;
    monitor.add(1);
    Ok(consensus(&one?).joined(consensus(&other?)))
}

/// Keypoints of a scan, with directions of its own or others.
fn described(
    scan: &CenteredScan,
    directions: Option<&[[f32; 3]]>,
    radius: Radius,
    settings: &RegistrationSettings,
    monitor: &Monitor,
) -> Result<FieldPlaces, Error> {
    let keypoints = KeypointOptions {
        count: settings.keypoints,
        candidates_per_radius: settings.candidates_per_radius,
        ..KeypointOptions::default()
    };
    let own = scan.scan();
    let options = match directions {
        Some(directions) => FieldOptions { directions: Some(directions), ..Default::default() },
        None => FieldOptions { viewpoint: own.viewpoint, directions: own.directions, ..Default::default() },
    };
    keypoints_within(&PointCloud::new_f64(&scan.points), radius, &keypoints, &options, &monitor.apart())
}
