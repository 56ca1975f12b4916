//! Registration of two scans.

use crate::arrays::{array, numbers, present, put};
use crate::cloud::{given, surfsig_cloud};
use crate::code::{Failure, guarded, set, surfsig_code};
use crate::options::thread_count;
use crate::progress::{Progress, surfsig_progress};
use crate::transform::surfsig_transform;
use std::ffi::c_void;
use surfsig::{Doubt, FreeDirection, REGISTRATION_STEPS, Registration, RegistrationSettings, Scan, register};

/// A scan: its points, and what is known of where they were seen from.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_scan {
    /// The points.
    pub cloud: *const surfsig_cloud,
    /// Where the sensor stood, in the cloud's coordinates: 3 doubles, finite; null where nobody knows.
    pub viewpoint: *const f64,
    /// In place of a viewpoint: for each point a vector of any length to the side from which it was seen, such as its
    /// normal, (count, 3) floats, packed; null for none. Models and scenes in which they are looked for may have both.
    pub directions: *const f32,
}

impl surfsig_scan {
    /// # Safety
    /// Each pointer is null or points to what its comment says, for as long as the result lives.
    pub(crate) unsafe fn checked<'a>(&self, name: &str) -> Result<Scan<'a>, Failure> {
        // SAFETY: the condition is the same.
        let scan = unsafe { self.with_both(name) }?;
        if scan.viewpoint.is_some() && scan.directions.is_some() {
            return Err(Failure::invalid_input(format!(
                "{name}: viewpoint and directions exclude each other"
            )));
        }
        Ok(scan)
    }

    /// The same of a scan that may have a viewpoint and directions.
    ///
    /// # Safety
    /// Each pointer is null or points to what its comment says, for as long as the result lives.
    pub(crate) unsafe fn with_both<'a>(&self, name: &str) -> Result<Scan<'a>, Failure> {
        // SAFETY: the condition is the same.
        let cloud = given(unsafe { self.cloud.as_ref() }).map_err(|failure| failure.of(name))?.view();
        let viewpoint = if self.viewpoint.is_null() {
            None
        } else {
            // SAFETY: the condition is the same.
            let viewpoint: [f64; 3] = unsafe { present(numbers(self.viewpoint), "viewpoint") }?;
            if !viewpoint.iter().all(|x| x.is_finite()) {
                return Err(Failure::invalid_input(format!(
                    "{name}: the viewpoint must be finite, not {viewpoint:?}"
                )));
            }
            Some(viewpoint)
        };
        let directions = if self.directions.is_null() {
            None
        } else {
            // SAFETY: the condition is the same; a cloud's count has been checked when it was made.
            Some(unsafe { array(self.directions.cast::<[f32; 3]>(), cloud.len(), "directions") }?)
        };
        Ok(Scan { cloud, viewpoint, directions })
    }
}

/// A motion that does not change a surface, so that a transform of it is not determined in that direction.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_free_direction {
    /// Unit vector along a translation or a rotation's axis; NaN for rotations about every axis through the point.
    pub axis: [f64; 3],
    /// A point on the rotation's axis; NaN for a translation.
    pub point: [f64; 3],
}

impl surfsig_free_direction {
    const NONE: Self = Self { axis: [f64::NAN; 3], point: [f64::NAN; 3] };

    fn of(direction: &FreeDirection) -> Self {
        match *direction {
            FreeDirection::Translation { axis } => Self { axis, ..Self::NONE },
            FreeDirection::Rotation { axis, point } => Self { axis, point },
            FreeDirection::RotationAboutPoint { point } => Self { point, ..Self::NONE },
        }
    }

    /// NaN beyond the last.
    pub(crate) fn array_of(directions: &[FreeDirection]) -> [Self; SURFSIG_FREE_DIRECTIONS] {
        let mut all = [Self::NONE; SURFSIG_FREE_DIRECTIONS];
        for (place, direction) in all.iter_mut().zip(directions) {
            *place = Self::of(direction);
        }
        all
    }
}

/// Most directions in which a transform can be free.
pub const SURFSIG_FREE_DIRECTIONS: usize = 6;

/// Most alternatives that are given.
pub const SURFSIG_ALTERNATIVES: usize = 8;

/// A doubt: nothing was found.
pub const SURFSIG_DOUBT_NOT_FOUND: u32 = 1;
/// A doubt: few matches agree.
pub const SURFSIG_DOUBT_FEW_MATCHES: u32 = 2;
/// A doubt: little of the source lies on the target.
pub const SURFSIG_DOUBT_LITTLE_OVERLAP: u32 = 4;
/// A doubt: the overlap does not determine all motions.
pub const SURFSIG_DOUBT_FREE_DIRECTIONS: u32 = 8;
/// A doubt: points of one scan lie where the other's sensor looked through.
pub const SURFSIG_DOUBT_FREE_SPACE: u32 = 16;
/// A doubt: other transforms explain as much.
pub const SURFSIG_DOUBT_AMBIGUOUS: u32 = 32;
/// A doubt: the source is larger or smaller than the target.
pub const SURFSIG_DOUBT_SCALE: u32 = 64;
/// A doubt: the source's mirror image fits better.
pub const SURFSIG_DOUBT_MIRRORED: u32 = 128;

fn flag(doubt: &Doubt) -> u32 {
    match doubt {
        Doubt::NotFound => SURFSIG_DOUBT_NOT_FOUND,
        Doubt::FewMatches { .. } => SURFSIG_DOUBT_FEW_MATCHES,
        Doubt::LittleOverlap { .. } => SURFSIG_DOUBT_LITTLE_OVERLAP,
        Doubt::FreeDirections { .. } => SURFSIG_DOUBT_FREE_DIRECTIONS,
        Doubt::FreeSpace { .. } => SURFSIG_DOUBT_FREE_SPACE,
        Doubt::Ambiguous { .. } => SURFSIG_DOUBT_AMBIGUOUS,
        Doubt::Scale { .. } => SURFSIG_DOUBT_SCALE,
        Doubt::Mirrored { .. } => SURFSIG_DOUBT_MIRRORED,
    }
}

/// How a source lies in a target, and how sure that is.
#[allow(non_snake_case, reason = "the name says from where to where")]
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_registration {
    /// Whether a transform was found; otherwise it and its covariance are NaN.
    pub found: bool,
    /// Whether the transform is right, by what was seen: no test has refuted it.
    pub trusted: bool,
    /// Why it is not trusted: the sum of the SURFSIG_DOUBT_... that hold; 0 where it is.
    pub doubts: u32,
    /// Takes the source's points to the target.
    pub T_target_source: surfsig_transform,
    /// Of the small twist (rotation vector in radians, then translation) in the target's axes, about the center, that
    /// takes the given transform to the true one: 6 x 6, row by row.
    pub covariance: [f64; 36],
    /// Middle of the overlap, in the target's coordinates.
    pub center: [f64; 3],
    /// Number of free directions.
    pub free_direction_count: usize,
    /// Motions of the source, in the target's coordinates, that the overlap does not determine; NaN beyond the last.
    pub free_directions: [surfsig_free_direction; SURFSIG_FREE_DIRECTIONS],
    /// Keypoints that were matched; 0 where a start was given.
    pub matches: usize,
    /// Those of them that agree with the transform.
    pub inliers: usize,
    /// Share of the source's surface that lies on the target's, 0 to 1.
    pub overlap: f64,
    /// The same, where points count the more the nearer they are.
    pub explained: f64,
    /// The larger share of one scan's points that lie where the other's sensor looked through; NaN where no viewpoint
    /// is known from which all was seen.
    pub free_space: f64,
    /// How many times as large as the target the source is; NaN where the overlap does not determine it.
    pub scale: f64,
    /// Its standard error.
    pub scale_standard_error: f64,
    /// Number of alternatives.
    pub alternative_count: usize,
    /// Other transforms that explain as much; NaN beyond the last.
    pub alternatives: [surfsig_transform; SURFSIG_ALTERNATIVES],
    /// Root mean square of the distances there, in the scans' unit.
    pub rms: f64,
    /// Of the patches that were matched, in the scans' unit.
    pub radius: f64,
}

impl surfsig_registration {
    fn of(found: &Registration) -> Self {
        let mut covariance = [f64::NAN; 36];
        covariance.copy_from_slice(found.covariance.as_flattened());
        let mut alternatives = [surfsig_transform::or_nan(None); SURFSIG_ALTERNATIVES];
        for (place, one) in alternatives.iter_mut().zip(&found.alternatives) {
            *place = surfsig_transform::or_nan(Some(&one.T_target_source));
        }
        Self {
            found: found.T_target_source.is_some(),
            trusted: found.trusted,
            doubts: found.doubts.iter().map(flag).sum(),
            T_target_source: surfsig_transform::or_nan(found.T_target_source.as_ref()),
            covariance,
            center: found.center,
            free_direction_count: found.free_directions.len(),
            free_directions: surfsig_free_direction::array_of(&found.free_directions),
            matches: found.matches,
            inliers: found.inliers,
            overlap: found.overlap,
            explained: found.explained,
            free_space: found.free_space,
            scale: found.scale,
            scale_standard_error: found.scale_standard_error,
            alternative_count: found.alternatives.len().min(SURFSIG_ALTERNATIVES),
            alternatives,
            rms: found.rms,
            radius: found.radius,
        }
    }
}

/// How scans are registered. Made by surfsig_registration_options_new(), freed by surfsig_registration_options_free().
#[derive(Default)]
pub struct surfsig_registration_options {
    settings: RegistrationSettings,
    progress: Progress,
}

/// Makes options of the default values: the radius by the scans' size, 1,000 keypoints, all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_registration_options_new() -> Box<surfsig_registration_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_registration_options_free(options: Option<Box<surfsig_registration_options>>) {
    drop(options);
}

/// Chooses the radius of the patches that are matched.
///
/// @param options The options to change.
/// @param radius In the scans' unit; 0 for the default: 0.4 times the median distance of the points from their middle,
/// of the smaller scan.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_registration_options_set_radius(
    options: Option<&mut surfsig_registration_options>,
    radius: f64,
) -> surfsig_code {
    set(options, |options| {
        options.settings.radius =
            if radius == 0.0 { None } else { Some(surfsig::Radius::new(radius)?.get()) };
        Ok(())
    })
}

/// Chooses the number of keypoints of each scan.
///
/// @param options The options to change.
/// @param keypoints At least 1; 0 for the default.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_registration_options_set_keypoints(
    options: Option<&mut surfsig_registration_options>,
    keypoints: u32,
) -> surfsig_code {
    set(options, |options| {
        let default = RegistrationSettings::default().keypoints;
        options.settings.keypoints = if keypoints == 0 { default } else { keypoints as usize };
        Ok(())
    })
}

/// Chooses the number of threads. The result is the same, bit for bit.
///
/// @param options The options to change.
/// @param threads 1 to 1024; 0 for all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_registration_options_set_threads(
    options: Option<&mut surfsig_registration_options>,
    threads: u32,
) -> surfsig_code {
    set(options, |options| {
        options.settings.threads = thread_count(threads)?;
        Ok(())
    })
}

/// Chooses a function that is told the progress, and may stop the registration.
///
/// @param options The options to change.
/// @param progress Called with the number of steps done, and of all; null for none.
/// @param data Given to it; must live as long as the options are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_registration_options_set_progress(
    options: Option<&mut surfsig_registration_options>,
    progress: surfsig_progress,
    data: *mut c_void,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives a function that takes the data.
        options.progress = unsafe { Progress::new(progress, data) };
        Ok(())
    })
}

/// Finds how a scan lies in another, from any start, without a parameter.
///
/// Keypoints are matched by their field signatures, the transform that most matches agree with is refined by
/// generalised ICP, and the last steps fit points to the surface, which tells how sure it is. The result is always the
/// same. That nothing was found is no failure: `found` is false then.
///
/// @param source The scan that is moved.
/// @param target The scan that stays, in the same unit.
/// @param start T_target_source, roughly, which is then refined and not searched; null where nobody knows it.
/// @param options How; null for the default.
/// @param registration Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_register(
    source: *const surfsig_scan,
    target: *const surfsig_scan,
    start: *const surfsig_transform,
    options: Option<&surfsig_registration_options>,
    registration: *mut surfsig_registration,
) -> surfsig_code {
    let found = || -> Result<_, Failure> {
        // SAFETY: the caller gives scans whose pointers are as they say, and a transform or null.
        let (source, target, start) = unsafe {
            (
                array(source, 1, "source")?[0].checked("source")?,
                array(target, 1, "target")?[0].checked("target")?,
                start.as_ref().map(surfsig_transform::checked).transpose()?,
            )
        };
        let default = surfsig_registration_options::default();
        let surfsig_registration_options { settings, progress } = options.unwrap_or(&default);
        let work = |monitor: &_| register(&source, &target, start.as_ref(), settings, monitor);
        let found = progress.watched(REGISTRATION_STEPS, work)?;
        Ok(surfsig_registration::of(&found))
    };
    // SAFETY: the caller gives room for a result, or null.
    guarded(|| unsafe { put(registration, found()?, "registration") })
}
