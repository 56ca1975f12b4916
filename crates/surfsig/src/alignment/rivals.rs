//! Whether another transform, of those that were proposed, explains as much as the best one.

use super::doubt::Doubt;
use super::explained::{Closeness, Explained, HIDDEN, explained_share};
use super::point_to_surface::PointToSurfaceSettings;
use super::scale::Scale;
use super::target_surface::TargetSurface;
use crate::geometry::RigidTransform;

/// A surface to which transforms are fitted anew, from starts that may be far off.
pub(crate) trait FittedSurface: Sync {
    /// The transform that a start leads to; `None` where the source hardly meets the surface.
    fn fitted(&self, source: &[[f64; 3]], start: RigidTransform) -> Option<RigidTransform>;

    /// How near what a transform moves lies to the surface.
    #[allow(non_snake_case)]
    fn closeness(&self, source: &[[f64; 3]], T_target_source: &RigidTransform) -> Closeness;

    /// Where that is of which `closeness` tells, for each: neighbours err alike.
    fn places(&self, source: &[[f64; 3]]) -> Vec<[f64; 3]> {
        source.to_vec()
    }
}

/// From when on a source counts as larger or smaller than the target. By default the logarithm of its scale must be half a
/// hundredth, as ranges of sensors differ by a thousandth, and differ from 0 by four standard errors.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct ScaleLimits {
    /// Logarithm of the scale.
    pub doubted: f64,
    /// The same in its standard errors.
    pub deviations: f64,
}

impl ScaleLimits {
    pub const DEFAULT: Self = Self { doubted: 0.005, deviations: 4.0 };
}

/// A target's surface with the distance up to which points count.
pub(crate) struct FittedTarget<'a> {
    pub surface: &'a TargetSurface,
    /// Of inliers, at most.
    pub farthest: f64,
    /// How transforms that are far off are fitted.
    pub fit: PointToSurfaceSettings,
    /// Whether a point cannot have been seen from where the target was: what the target lacks there speaks neither for
    /// a transform nor against it. An empty hall whose sensors are mirrored by a half turn is explained best by that.
    pub is_hidden: &'a (dyn Fn([f64; 3]) -> bool + Sync),
}

impl FittedTarget<'_> {
    /// The scale of points that a transform has brought near, and the doubt whether it is 1: where another one differs
    /// from it significantly and explains more.
    pub fn scale(
        &self,
        moved: &[[f64; 3]],
        best: &Explained,
        limits: ScaleLimits,
    ) -> (Option<Scale>, Option<Doubt>) {
        let Some(found) = self.surface.scale_of(moved, &self.fit) else { return (None, None) };
        let Scale { scale, standard_error, .. } = found;
        let off = scale.ln().abs();
        let is_significant = off > limits.deviations * standard_error / scale && off > limits.doubted;
        let explains_more =
            || best.deficit_of(&self.closeness_of(&found.points)).is_some_and(|(deficit, _)| deficit < 0.0);
        let doubt = (is_significant && explains_more()).then_some(Doubt::Scale { scale, standard_error });
        (Some(found), doubt)
    }

    /// How near points, in the target's coordinates, lie to its surface.
    pub fn closeness_of(&self, moved: &[[f64; 3]]) -> Closeness {
        let mut closeness = self.surface.closeness(moved, self.farthest, &self.fit);
        for (one, point) in closeness.iter_mut().zip(moved) {
            // What lies on the surface is seen, whatever the range image's pixels say.
            if one.is_some_and(|share| share <= 0.0) && (self.is_hidden)(*point) {
                *one = Some(HIDDEN);
            }
        }
        closeness
    }
}

impl FittedSurface for FittedTarget<'_> {
    fn fitted(&self, source: &[[f64; 3]], start: RigidTransform) -> Option<RigidTransform> {
        Some(self.surface.align(source, start, &self.fit)?.T_target_source)
    }

    #[allow(non_snake_case)]
    fn closeness(&self, source: &[[f64; 3]], T_target_source: &RigidTransform) -> Closeness {
        self.closeness_of(&T_target_source.transform_points(source))
    }
}

/// When another transform explains as much; lengths are in radii of a patch. `benchmarks/trust.py --setting` shows what
/// other values do in simulated places.
///
/// ```
/// assert_eq!(surfsig::RivalSettings::default().proposals, 8);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RivalSettings {
    /// Points of the source that tell transforms apart, at most.
    pub points: usize,
    /// Proposed transforms that are tried beside the best one, at most.
    pub proposals: usize,
    /// The score of a proposal over the best one's, at least: matches prefer what was seen from the same side, so that
    /// equal poses of an empty room have a fifth of the best one's.
    pub least_score: f64,
    /// Root mean square of the distances by which a rival moves points elsewhere, at least.
    pub distance: f64,
    /// The root mean square of the distances from the surface over the points' paths, below which a motion is weakly
    /// held.
    pub weak: f64,
    /// Share of what the target's normals say about a weak motion that those of both scans say alike, from which on the
    /// surface holds it: 0.7 and more of what corridors with niches hold, 0.3 and less of smooth corridors
    /// (`benchmarks/trust.py`).
    pub held_share: f64,
    /// What both say alike, in standard errors, likewise.
    pub held_deviations: f64,
    /// What a rival explains less, as a share of what the best one explains, to be refuted.
    pub deficit: f64,
    /// The same in its standard errors.
    pub deviations: f64,
}

impl Default for RivalSettings {
    fn default() -> Self {
        Self {
            points: 600,
            proposals: 8,
            least_score: 0.1,
            distance: 1.0,
            weak: 0.25,
            held_share: 0.5,
            held_deviations: 3.0,
            deficit: 0.03,
            deviations: 3.0,
        }
    }
}

/// A transform that explains as much of the source as the best one.
///
/// ```
/// use surfsig::{Alternative, RigidTransform};
/// let same = Alternative { T_target_source: RigidTransform::identity(), explained: 0.8, free_space: 0.0 };
/// assert!(same.explained > same.free_space);
/// ```
#[allow(non_snake_case)]
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Alternative {
    /// Takes the source's points to the target.
    pub T_target_source: RigidTransform,
    /// Share of the source that lies on the target's surface, near points counting more, 0 to 1.
    pub explained: f64,
    /// The larger share of one scan's points in the free space of the other's sensor; NaN where no viewpoint is known.
    pub free_space: f64,
}

/// A surface, a source, and the best transform.
#[allow(non_snake_case)]
pub(crate) struct Rivals<'a, S> {
    pub surface: S,
    /// Some of the source's points.
    pub source: &'a [[f64; 3]],
    /// The best transform.
    pub T_target_source: RigidTransform,
    /// Of the patches.
    pub radius: f64,
    pub settings: RivalSettings,
}

impl<S: FittedSurface> Rivals<'_, S> {
    /// What the best transform explains.
    pub fn explained(&self) -> Explained {
        Explained::new(self.closeness(&self.T_target_source), &self.surface.places(self.source))
    }

    /// Whether another transform explains so much less that it is no chance, by more than a share that is allowed.
    pub fn refutes(&self, other: &RigidTransform, allowed: f64) -> bool {
        self.is_refuted(&self.explained(), &self.closeness(other), allowed)
    }

    fn closeness(&self, transform: &RigidTransform) -> Closeness {
        self.surface.closeness(self.source, transform)
    }

    /// The transform that a start leads to, and the share that it explains, if that is as much as the best one does, but
    /// for a deficit that depends on the transform.
    fn as_good(
        &self,
        explained: &Explained,
        start: RigidTransform,
        deficit: impl Fn(&RigidTransform) -> f64,
    ) -> Option<(RigidTransform, f64)> {
        let found = self.surface.fitted(self.source, start)?;
        let closeness = self.closeness(&found);
        let is_refuted = self.is_refuted(explained, &closeness, deficit(&found));
        (!is_refuted).then(|| (found, explained_share(&closeness)))
    }

    /// Those of proposed transforms that explain as much and lead elsewhere; `deficit` is the share of what the best one
    /// explains that each may lack.
    pub fn as_good_as_the_best(
        &self,
        explained: &Explained,
        proposed: &[RigidTransform],
        deficit: impl Fn(&RigidTransform) -> f64,
    ) -> Vec<(RigidTransform, f64)> {
        let mut found: Vec<(RigidTransform, f64)> = Vec::new();
        for start in proposed {
            let Some((transform, share)) = self.as_good(explained, *start, &deficit) else { continue };
            let is_elsewhere = |other: &RigidTransform| {
                self.displacement(&transform, other) > self.settings.distance * self.radius
            };
            let others = found.iter().map(|(other, _)| other);
            if others.chain([&self.T_target_source]).all(is_elsewhere) {
                found.push((transform, share));
            }
        }
        found
    }

    /// Whether so much less is explained that it is no chance; also where much less of the surface is met.
    fn is_refuted(&self, explained: &Explained, closeness: &Closeness, allowed: f64) -> bool {
        explained
            .deficit_of(closeness)
            .is_none_or(|(deficit, error)| deficit > allowed && deficit > self.settings.deviations * error)
    }

    fn displacement(&self, one: &RigidTransform, other: &RigidTransform) -> f64 {
        one.displacement_from(other, self.source.iter().copied())
    }
}
