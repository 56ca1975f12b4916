//! How an extraction is done. The object is opaque, so that it can grow without a new binary interface.

use crate::arrays::{array, position};
use crate::code::{Failure, set, surfsig_code};
use crate::progress::{Progress, surfsig_progress};
use std::ffi::{c_int, c_void};
use surfsig::{
    ExtractOptions, FitAxes, FitKind, FitUsed, PointCloud, Queries, Radius, voxel_representatives,
};

/// Most threads that can be asked for.
const MAX_THREADS: u32 = 1024;

/// In which axes the paraboloid's height is measured.
#[repr(C)]
pub enum surfsig_axes {
    /// The surface's own: results turn with the object, and do not depend on where the sensor stood.
    Surface = 0,
    /// The cloud's, as the paper fits: z runs away from the sensor.
    Sensor = 1,
}

/// Which surface is fitted to the points of a neighbourhood.
#[repr(C)]
pub enum surfsig_fit {
    /// The paper's paraboloid, eq. (5): the smallest spread, and a bias where the ball is not small against the radius
    /// of curvature.
    Paraboloid = 0,
    /// A general quadric with Taubin's normalisation: exact on spheres, cylinders, cones and ellipsoids of any size,
    /// where they rise out of the noise; the paraboloid elsewhere.
    Quadric = 1,
    /// For each query what errs less.
    Auto = 2,
}

/// Whose curvature a query has.
#[repr(u8)]
pub enum surfsig_fit_used {
    /// There is no curvature.
    None = 0,
    /// The paraboloid's.
    Paraboloid = 1,
    /// The quadric's.
    Quadric = 2,
}

// Columns of the core are handed out as they are: the numbers must be the same.
const _: () = {
    assert!(surfsig_fit_used::None as u8 == FitUsed::None as u8);
    assert!(surfsig_fit_used::Paraboloid as u8 == FitUsed::Paraboloid as u8);
    assert!(surfsig_fit_used::Quadric as u8 == FitUsed::Quadric as u8);
};

// C may give any number, which an enum of Rust's must not hold.
const AXES: [(c_int, FitAxes); 2] =
    [(surfsig_axes::Surface as c_int, FitAxes::Surface), (surfsig_axes::Sensor as c_int, FitAxes::Sensor)];
const FITS: [(c_int, FitKind); 3] = [
    (surfsig_fit::Paraboloid as c_int, FitKind::Paraboloid),
    (surfsig_fit::Quadric as c_int, FitKind::Quadric),
    (surfsig_fit::Auto as c_int, FitKind::Auto),
];

/// What a number of C's stands for.
fn chosen<T: Copy>(among: &[(c_int, T)], number: c_int, name: &str) -> Result<T, Failure> {
    let found = among.iter().find(|(listed, _)| *listed == number);
    found
        .map(|(_, meaning)| *meaning)
        .ok_or_else(|| Failure::invalid_input(format!("{name} must be a surfsig_{name}, not {number}")))
}

/// The number of threads that C asks for; all cores where it is `None`.
pub(crate) fn thread_count(threads: u32) -> Result<Option<usize>, Failure> {
    if threads > MAX_THREADS {
        return Err(Failure::invalid_input(format!("threads must be 0 to {MAX_THREADS}, not {threads}")));
    }
    Ok((threads > 0).then_some(threads as usize))
}

/// Where curvature is asked for.
#[derive(Default)]
enum Asked {
    #[default]
    All,
    Indices(Vec<u32>),
    Positions(Vec<[f64; 3]>),
    Voxel(Radius),
}

/// How an extraction is done. Made by surfsig_options_new(), freed by surfsig_options_free().
#[derive(Default)]
pub struct surfsig_options {
    axes: FitAxes,
    fit: FitKind,
    viewpoint: Option<[f64; 3]>,
    normals: Option<Vec<[f32; 3]>>,
    robust: bool,
    asked: Asked,
    pub(crate) threads: Option<usize>,
    /// Of the points within the radius, at most so many, the nearest.
    pub(crate) neighbors: Option<usize>,
    pub(crate) progress: Progress,
}

/// The queries of an extraction, with what is known about each.
pub(crate) struct Prepared<'a> {
    asked: &'a Asked,
    /// Their numbers in the cloud, where only some of its points are asked for.
    pub indices: Vec<u32>,
    directions: Option<Vec<[f32; 3]>>,
    options: &'a surfsig_options,
}

impl surfsig_options {
    /// What belongs to the points of this cloud.
    pub(crate) fn prepared(&self, cloud: &PointCloud<'_>) -> Result<Prepared<'_>, Failure> {
        if self.viewpoint.is_some() && self.normals.is_some() {
            return Err(Failure::invalid_input("viewpoint and normals exclude each other"));
        }
        let indices = match &self.asked {
            Asked::All | Asked::Positions(_) => Vec::new(),
            Asked::Indices(indices) => indices.clone(),
            Asked::Voxel(voxel) => voxel_representatives(cloud, *voxel)?,
        };
        let directions = self.normals.as_deref().map(|normals| self.directions(normals, &indices, cloud));
        Ok(Prepared { asked: &self.asked, indices, directions: directions.transpose()?, options: self })
    }

    /// The normals of the queries.
    fn directions(
        &self,
        normals: &[[f32; 3]],
        indices: &[u32],
        cloud: &PointCloud<'_>,
    ) -> Result<Vec<[f32; 3]>, Failure> {
        let (expected, of) = match &self.asked {
            Asked::Positions(positions) => (positions.len(), "positions"),
            _ => (cloud.len(), "points"),
        };
        if normals.len() != expected {
            let message =
                format!("normals must be one of each of the {expected} {of}, not {}", normals.len());
            return Err(Failure::invalid_input(message));
        }
        Ok(match &self.asked {
            Asked::All | Asked::Positions(_) => normals.to_vec(),
            // The core says which index is outside.
            _ => indices.iter().map(|&i| normals.get(i as usize).copied().unwrap_or_default()).collect(),
        })
    }
}

impl Prepared<'_> {
    pub fn queries(&self) -> Queries<'_> {
        match self.asked {
            Asked::All => Queries::All,
            Asked::Indices(_) | Asked::Voxel(_) => Queries::Indices(&self.indices),
            Asked::Positions(positions) => Queries::Positions(PointCloud::new_f64(positions)),
        }
    }

    pub fn options(&self) -> ExtractOptions<'_> {
        let surfsig_options { axes, fit, viewpoint, robust, threads, .. } = *self.options;
        let directions = self.directions.as_deref();
        ExtractOptions { axes, fit, viewpoint, directions, robust, threads, instruction_set: None }
    }
}

/// Makes options of the default values: paraboloids in the surface's axes, no viewpoint, all cores, every point.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_new() -> Box<surfsig_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_free(options: Option<Box<surfsig_options>>) {
    drop(options);
}

/// Chooses the axes in which the paraboloids are fitted.
///
/// @param options The options to change.
/// @param axes A surfsig_axes; any other number is SURFSIG_CODE_INVALID_INPUT.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_axes(
    options: Option<&mut surfsig_options>,
    axes: c_int,
) -> surfsig_code {
    set(options, |options| {
        options.axes = chosen(&AXES, axes, "axes")?;
        Ok(())
    })
}

/// Chooses which surface is fitted; only paraboloids in the sensor's axes.
///
/// @param options The options to change.
/// @param fit A surfsig_fit; any other number is SURFSIG_CODE_INVALID_INPUT.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_fit(options: Option<&mut surfsig_options>, fit: c_int) -> surfsig_code {
    set(options, |options| {
        options.fit = chosen(&FITS, fit, "fit")?;
        Ok(())
    })
}

/// Says where the sensor stood; normals then point to it, and a bump seen from there has a positive
/// curvature. Without a viewpoint the side of each normal is a convention: its z is positive (in the
/// sensor's axes negative).
///
/// @param options The options to change.
/// @param viewpoint x, y, z in the cloud's coordinates, finite; null for none.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_viewpoint(
    options: Option<&mut surfsig_options>,
    viewpoint: *const f64,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives three numbers, or null.
        options.viewpoint = unsafe { position(viewpoint, "viewpoint") }?;
        Ok(())
    })
}

/// Gives normals that are known, in place of a viewpoint: they choose the side of the fitted normals and nothing
/// else. Their length does not matter; one that is zero or not finite says nothing.
///
/// @param options The options to change.
/// @param normals x, y, z of each normal, (count, 3), packed; they are copied. Null for none.
/// @param count How many they are: one for each point of the cloud, or for each position where positions are asked
/// for; another number is an error of the extraction.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_normals(
    options: Option<&mut surfsig_options>,
    normals: *const f32,
    count: usize,
) -> surfsig_code {
    set(options, |options| {
        options.normals = None;
        if !normals.is_null() {
            // SAFETY: the caller gives `count` vectors.
            options.normals = Some(unsafe { array(normals.cast::<[f32; 3]>(), count, "normals") }?.to_vec());
        }
        Ok(())
    })
}

/// Chooses the number of threads. The result is the same, bit for bit.
///
/// @param options The options to change.
/// @param threads 1 to 1024; 0 for all cores.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_threads(
    options: Option<&mut surfsig_options>,
    threads: u32,
) -> surfsig_code {
    set(options, |options| {
        options.threads = thread_count(threads)?;
        Ok(())
    })
}

/// Counts only the nearest of the points within the radius of surfsig_extract(); an error of the other extractions.
///
/// @param options The options to change.
/// @param neighbors At most this many, the query itself included; 0 for all of them.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_neighbors(
    options: Option<&mut surfsig_options>,
    neighbors: u32,
) -> surfsig_code {
    set(options, |options| {
        options.neighbors = (neighbors > 0).then_some(neighbors as usize);
        Ok(())
    })
}

/// Leaves out points farther from the fitted surface than three standard deviations of the others, and
/// fits again, until none is left out or comes back; the count is then that of the points that stay.
///
/// @param options The options to change.
/// @param robust 1 to do so, 0 (the default) not to.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_robust(
    options: Option<&mut surfsig_options>,
    robust: c_int,
) -> surfsig_code {
    set(options, |options| {
        options.robust = robust != 0;
        Ok(())
    })
}

/// Asks for curvature at every point of the cloud, as new options do.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_all(options: Option<&mut surfsig_options>) -> surfsig_code {
    set(options, |options| {
        options.asked = Asked::All;
        Ok(())
    })
}

/// Asks for curvature at some points; the others are neighbours only. An index that the cloud does not have is an
/// error of the extraction.
///
/// @param options The options to change.
/// @param indices Numbers of points, from 0; they are copied. Null only if count is 0.
/// @param count How many they are; 0 asks for no point at all.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_indices(
    options: Option<&mut surfsig_options>,
    indices: *const u32,
    count: usize,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives `count` numbers.
        options.asked = Asked::Indices(unsafe { array(indices, count, "indices") }?.to_vec());
        Ok(())
    })
}

/// Asks for curvature at positions that need not be points of the cloud.
///
/// @param options The options to change.
/// @param positions x, y, z of each in the cloud's coordinates, (count, 3), packed; they are copied. Null only if
/// count is 0.
/// @param count How many they are.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_positions(
    options: Option<&mut surfsig_options>,
    positions: *const f64,
    count: usize,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives `count` positions.
        let positions = unsafe { array(positions.cast::<[f64; 3]>(), count, "positions") }?;
        options.asked = Asked::Positions(positions.to_vec());
        Ok(())
    })
}

/// Asks for curvature at one point of each voxel that holds any, the one nearest to the mean of the voxel's points;
/// surfsig_extraction_indices() says which they are.
///
/// @param options The options to change.
/// @param voxel Edge of the voxels, in the cloud's unit; finite and above 0.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_options_set_voxel(
    options: Option<&mut surfsig_options>,
    voxel: f64,
) -> surfsig_code {
    set(options, |options| {
        options.asked = Asked::Voxel(Radius::new(voxel)?);
        Ok(())
    })
}

/// Chooses a function that is told the progress, and may stop the extraction.
///
/// @param options The options to change.
/// @param progress Called with the number of queries that are done and of all, each counted once for each radius;
/// null for none.
/// @param data Given to it; must live as long as the options are used.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_options_set_progress(
    options: Option<&mut surfsig_options>,
    progress: surfsig_progress,
    data: *mut c_void,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives a function that takes the data.
        options.progress = unsafe { Progress::new(progress, data) };
        Ok(())
    })
}
