//! What is known of one surface before it is fitted.

use crate::arrays::{array, position};
use crate::code::{Failure, set, surfsig_code};
use crate::primitive::surfsig_primitive;
use surfsig::{Primitive, PrimitiveFitOptions, SurfaceKind};

/// What is known of a surface before surfsig_fit_primitive_with() fits it. Made by surfsig_primitive_options_new(), freed
/// by surfsig_primitive_options_free().
#[derive(Default)]
pub struct surfsig_primitive_options {
    start: Option<Primitive>,
    weights: Option<Vec<f64>>,
    radius: Option<f64>,
    axis: Option<[f64; 3]>,
}

impl surfsig_primitive_options {
    /// For a surface of a kind that is fitted to so many points.
    pub(crate) fn of(&self, kind: SurfaceKind, count: usize) -> Result<PrimitiveFitOptions<'_>, Failure> {
        let name = kind.name();
        let wrong = if self.start.is_some_and(|start| start.kind() != kind) {
            format!("start must be a {name} too")
        } else if self.radius.is_some() && !kind.has_free_radius() {
            format!("a {name} keeps no radius")
        } else if self.axis.is_some() && kind == SurfaceKind::Sphere {
            format!("a {name} has no axis")
        } else {
            match self.weights.as_ref().map(Vec::len) {
                Some(weights) if weights != count => {
                    format!("weights must be one of each of the {count} points, not {weights}")
                }
                _ => {
                    let (start, weights) = (self.start.as_ref(), self.weights.as_deref());
                    return Ok(PrimitiveFitOptions { start, weights, radius: self.radius, axis: self.axis });
                }
            }
        };
        Err(Failure::invalid_input(wrong))
    }
}

/// Makes options of the default values: everything is fitted, all points count alike.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_options_new() -> Box<surfsig_primitive_options> {
    Box::default()
}

/// Frees options; does nothing with null.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_options_free(options: Option<Box<surfsig_primitive_options>>) {
    drop(options);
}

/// Chooses the surface from which the fit begins.
///
/// @param options The options to change.
/// @param start A surface of the same kind near the points, which is copied; null to begin from what the points tell.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_options_set_start(
    options: Option<&mut surfsig_primitive_options>,
    start: Option<&surfsig_primitive>,
) -> surfsig_code {
    set(options, |options| {
        options.start = start.map(surfsig_primitive::fitted);
        Ok(())
    })
}

/// Says by how much the squared distance of each point counts, such as one over the variance of its noise. Their common
/// factor means nothing.
///
/// @param options The options to change.
/// @param weights Finite and not below 0; they are copied. Null for none: all points count alike.
/// @param count How many they are: one for each point of the cloud; another number is an error of the fit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_primitive_options_set_weights(
    options: Option<&mut surfsig_primitive_options>,
    weights: *const f64,
    count: usize,
) -> surfsig_code {
    set(options, |options| {
        options.weights = None;
        if !weights.is_null() {
            // SAFETY: the caller gives `count` numbers.
            let weights = unsafe { array(weights, count, "weights") }?;
            if !weights.iter().all(|weight| weight.is_finite() && *weight >= 0.0) {
                return Err(Failure::invalid_input("weights must be finite and not below 0"));
            }
            options.weights = Some(weights.to_vec());
        }
        Ok(())
    })
}

/// Gives the radius of a sphere, cylinder or circle, where it is known: only the rest is fitted.
///
/// @param options The options to change.
/// @param radius In the cloud's unit, finite; 0 to have it fitted. With another kind it is an error of the fit.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_primitive_options_set_radius(
    options: Option<&mut surfsig_primitive_options>,
    radius: f64,
) -> surfsig_code {
    set(options, |options| {
        if !(radius >= 0.0 && radius.is_finite()) {
            let message = format!("radius must be finite and not below 0, not {radius}");
            return Err(Failure::invalid_input(message));
        }
        options.radius = (radius > 0.0).then_some(radius);
        Ok(())
    })
}

/// Gives the direction of the axis or normal, where it is known: only the rest is fitted.
///
/// @param options The options to change.
/// @param axis x, y, z, finite, of any length above 0; null to have it fitted. A sphere has none: it is then an error of
/// the fit.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_primitive_options_set_axis(
    options: Option<&mut surfsig_primitive_options>,
    axis: *const f64,
) -> surfsig_code {
    set(options, |options| {
        // SAFETY: the caller gives three numbers, or null.
        let axis = unsafe { position(axis, "axis") }?;
        if axis.is_some_and(|axis| axis == [0.0; 3]) {
            return Err(Failure::invalid_input("axis must be longer than 0"));
        }
        // In units of its longest component: squares of very small or large numbers are none.
        let longest = |axis: [f64; 3]| axis.iter().fold(0.0, |longest: f64, c| longest.max(c.abs()));
        options.axis = axis.map(|axis| axis.map(|c| c / longest(axis)));
        Ok(())
    })
}
