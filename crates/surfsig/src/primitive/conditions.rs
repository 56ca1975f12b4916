//! What a fit keeps, and how much each point counts.

use super::SurfaceKind;
use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use std::borrow::Cow;

/// The weights of some points.
type Weights<'a> = Cow<'a, [f64]>;

/// What is known of a surface before [`crate::fit_primitive_with`] fits it.
///
/// ```
/// use surfsig::{fit_primitive_with, PrimitiveFitOptions, SurfaceKind};
/// // A tenth of a ball of 0.5 tells its centre better where its radius is known.
/// let points: Vec<[f64; 3]> = (0..50)
///     .map(|i| (0.1 * f64::from(i).sqrt(), 2.4 * f64::from(i)))
///     .map(|(t, u)| [0.5 * t.sin() * u.cos(), 0.5 * t.sin() * u.sin(), 0.5 * t.cos()])
///     .collect();
/// let options = PrimitiveFitOptions { radius: Some(0.5), ..Default::default() };
/// let ball = fit_primitive_with(&points, SurfaceKind::Sphere, &options).unwrap();
/// assert!(ball.radius() == 0.5 && ball.point()[2].abs() < 1e-12);
/// ```
#[derive(Debug, Clone, Copy, Default)]
pub struct PrimitiveFitOptions<'a> {
    /// A surface of the same kind near the points, from which the fit begins; by default what the points tell.
    pub start: Option<&'a Primitive>,
    /// By how much each point's squared distance counts: finite, none negative; by default all alike.
    pub weights: Option<&'a [f64]>,
    /// The radius of a sphere, cylinder or circle, where it is known.
    pub radius: Option<f64>,
    /// The direction of the axis or normal, of any length, where it is known; a sphere has none.
    pub axis: Option<[f64; 3]>,
}

impl PrimitiveFitOptions<'_> {
    /// Whether these mean something for so many points and this kind.
    pub(super) fn are_valid(&self, kind: SurfaceKind, count: usize) -> bool {
        let counts = |weights: &[f64]| weights.iter().all(|w| w.is_finite() && *w >= 0.0);
        self.weights.is_none_or(|weights| weights.len() == count && counts(weights))
            && self.start.is_none_or(|start| start.kind == kind)
            && self.radius.is_none_or(|radius| kind.has_free_radius() && radius > 0.0 && radius.is_finite())
            && self.axis.is_none_or(|axis| {
                let length = Vector::from(axis).norm();
                kind != SurfaceKind::Sphere && length > 0.0 && length.is_finite()
            })
    }

    /// The points that have a weight, with it: another tells nothing, not even where the others are.
    pub(super) fn counted<'a>(
        &'a self,
        points: &'a [[f64; 3]],
    ) -> (Cow<'a, [[f64; 3]]>, Option<Weights<'a>>) {
        match self.weights {
            Some(weights) if weights.contains(&0.0) => {
                let counted = || (0..points.len()).filter(|&i| weights[i] > 0.0);
                let weights = counted().map(|i| weights[i]).collect();
                (counted().map(|i| points[i]).collect(), Some(weights))
            }
            weights => (points.into(), weights.map(Into::into)),
        }
    }

    /// The same for the least squares.
    pub(super) fn conditions(&self, kind: SurfaceKind) -> Conditions<'_> {
        let fixed = |parameter: usize| {
            (self.radius.is_some() && parameter == kind.size())
                || (self.axis.is_some() && kind.is_tilt(parameter))
        };
        let free = std::array::from_fn(|parameter| parameter < kind.parameters() && !fixed(parameter));
        Conditions { weights: self.weights, free }
    }
}

/// Which parameters a fit may change, and by how much each point counts.
#[derive(Clone, Copy)]
pub(super) struct Conditions<'a> {
    pub weights: Option<&'a [f64]>,
    pub free: [bool; MOST_PARAMETERS],
}

impl Conditions<'_> {
    /// All parameters are free, and all points count alike.
    pub fn none(kind: SurfaceKind) -> Self {
        PrimitiveFitOptions::default().conditions(kind).unweighted()
    }

    /// The numbers of the free parameters.
    pub fn free_parameters(&self) -> Vec<usize> {
        (0..MOST_PARAMETERS).filter(|&parameter| self.free[parameter]).collect()
    }

    /// The weight of a point.
    pub fn weight(&self, point: usize) -> f64 {
        self.weights.map_or(1.0, |weights| weights[point])
    }

    /// The same where all points count alike.
    pub fn unweighted<'b>(&self) -> Conditions<'b> {
        Conditions { weights: None, free: self.free }
    }
}
