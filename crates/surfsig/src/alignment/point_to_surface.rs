//! The last steps of a transform, by the distances of points from a surface; and how sure it then is.

use super::clustered_covariance::{blocks, clustered_covariance};
use super::halves::{halves, systematic_covariance};
use super::least_squares::{LinearisedDistances, pseudo_inverse};
use super::target_surface::{Residual, TargetSurface};
use crate::geometry::RigidTransform;
use nalgebra::{Matrix6, SMatrix, Vector3, Vector6};

/// Of the largest eigenvalue, below which a direction is not determined by the residuals.
const UNDETERMINED: f64 = 1e-8;
/// Rounding, likewise.
const ROUNDING: f64 = 1e-12;

/// How points are fitted to a surface; lengths are in voxels, the distance between points.
///
/// ```
/// assert_eq!(surfsig::PointToSurfaceSettings::default().max_iterations, 6);
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct PointToSurfaceSettings {
    /// Largest distance to the target's nearest point, in voxels: beyond, there is no surface to measure from.
    pub max_distance: f64,
    /// Where the neighbours' mean lies from the point, over their spread along the surface, at most: beyond, the point
    /// is off the surface's rim.
    pub max_off_center: f64,
    /// Smallest over middle standard deviation of the neighbours, at most: beyond, they lie on no surface.
    pub max_thickness: f64,
    /// Standard deviations within which a residual is an inlier.
    pub max_deviations: f64,
    /// Smallest standard deviation of the residuals, in voxels: surfaces without noise still differ by the fit.
    pub min_deviation: f64,
    /// Medians of the neighbours' variance about the fit, from which on there is an edge and no surface.
    pub max_variance: f64,
    /// Of every so many points one brings the transform near; then all fit it.
    pub coarse_step: usize,
    /// Points without which all do both.
    pub min_coarse_points: usize,
    /// Steps of either, at most.
    pub max_iterations: usize,
    /// Length of a step, in voxels, below which the transform has converged: a tenth of the standard error of a
    /// thousand points with a noise of a tenth of a voxel.
    pub epsilon: f64,
    /// Inliers without which there is no result: twice the unknowns.
    pub min_inliers: usize,
}

impl Default for PointToSurfaceSettings {
    fn default() -> Self {
        Self {
            max_distance: 3.0,
            max_off_center: 0.6,
            max_thickness: 0.35,
            max_deviations: 4.0,
            min_deviation: 0.02,
            max_variance: 4.0,
            coarse_step: 4,
            min_coarse_points: 500,
            max_iterations: 6,
            epsilon: 3e-4,
            min_inliers: 12,
        }
    }
}

/// Source points that lie on the target's surface, after the transform was fitted to them.
#[allow(non_snake_case)]
#[derive(Debug, Clone)]
pub(crate) struct PointToSurface {
    pub T_target_source: RigidTransform,
    /// Of the twist, rotation first, in the target's axes about `center`.
    pub covariance: Matrix6<f64>,
    pub center: [f64; 3],
    /// Inliers, in the target.
    pub points: Vec<[f64; 3]>,
    /// The target's unit normals there.
    pub normals: Vec<[f64; 3]>,
    /// Share of the source's points that are inliers.
    pub overlap: f64,
    /// Of the inliers' distances.
    pub rms: f64,
    /// The distance up to which a point is an inlier.
    pub farthest: f64,
}

impl TargetSurface {
    /// Fits a transform that is nearly right, and says how sure it is; `None` where hardly a point meets the surface.
    ///
    /// Some of the points bring it near, all of them fit it.
    pub fn align(
        &self,
        source: &[[f64; 3]],
        start: RigidTransform,
        settings: &PointToSurfaceSettings,
    ) -> Option<PointToSurface> {
        let some: Vec<[f64; 3]> = source.iter().copied().step_by(settings.coarse_step).collect();
        let near = if some.len() >= settings.min_coarse_points {
            self.converged(&some, start, settings)
        } else {
            None
        };
        let start = near.map_or(start, |near| near.T_target_source);
        self.converged(source, start, settings)
    }

    fn converged(
        &self,
        source: &[[f64; 3]],
        start: RigidTransform,
        settings: &PointToSurfaceSettings,
    ) -> Option<PointToSurface> {
        let mut transform = start;
        for step in 0.. {
            let moved = transform.transform_points(source);
            let (inliers, farthest) = self.inliers(&moved, settings)?;
            if inliers.len() < settings.min_inliers {
                return None;
            }
            let system = System::new(&inliers, &moved);
            let (change, length) = system.linearised.step(UNDETERMINED);
            if step == settings.max_iterations || length < settings.epsilon * self.voxel() {
                let result = system.result(transform, &inliers, source.len());
                return Some(PointToSurface { farthest, ..result });
            }
            transform = change * transform;
        }
        None
    }
}

/// The inliers' distances, linearised.
struct System {
    points: Vec<[f64; 3]>,
    linearised: LinearisedDistances,
}

impl System {
    fn new(inliers: &[Residual], moved: &[[f64; 3]]) -> Self {
        let points: Vec<[f64; 3]> = inliers.iter().map(|one| moved[one.number]).collect();
        let rows: Vec<_> = points
            .iter()
            .zip(inliers)
            .map(|(p, one)| (Vector3::from(*p), one.normal, one.distance))
            .collect();
        Self { points, linearised: LinearisedDistances::new(&rows) }
    }

    fn result(self, transform: RigidTransform, inliers: &[Residual], of: usize) -> PointToSurface {
        let distances: Vec<f64> = inliers.iter().map(|one| one.distance).collect();
        let independent = self.independent_covariance(inliers);
        let covariance =
            independent * self.alike(&distances, &independent) + self.systematic(&distances, inliers);
        let unit =
            Matrix6::from_diagonal(&Vector6::from_fn(
                |k, _| if k < 3 { 1.0 / self.linearised.unit } else { 1.0 },
            ));
        let square = distances.iter().map(|distance| distance * distance).sum::<f64>();
        PointToSurface {
            T_target_source: transform,
            covariance: unit * covariance * unit,
            center: self.linearised.center.into(),
            normals: inliers.iter().map(|one| one.normal.into()).collect(),
            overlap: inliers.len() as f64 / of as f64,
            rms: (square / inliers.len() as f64).sqrt(),
            points: self.points,
            farthest: f64::INFINITY,
        }
    }

    /// The covariance if the points of both err independently of each other.
    ///
    /// A point of the target has a part in the distances of many of the source's: its error is in all of them, along
    /// the normal of each.
    fn independent_covariance(&self, inliers: &[Residual]) -> Matrix6<f64> {
        let mean = |of: &dyn Fn(&Residual) -> f64| inliers.iter().map(of).sum::<f64>() / inliers.len() as f64;
        let of_target = mean(&|one| one.variance);
        let shares = mean(&|one| one.weights.iter().map(|weight| weight * weight).sum());
        let of_source = (mean(&|one| one.distance * one.distance) - of_target * shares).max(0.0);
        // Of each target point with a part: for each axis of its error, how the gradient changes with it.
        let last = inliers.iter().flat_map(|one| one.neighbors).max().unwrap_or(0) as usize;
        let mut parts = vec![SMatrix::<f64, 6, 3>::zeros(); last + 1];
        for (one, row) in inliers.iter().zip(&self.linearised.design) {
            let part = Vector6::from(*row) * one.normal.transpose();
            for (&neighbor, &weight) in one.neighbors.iter().zip(&one.weights) {
                parts[neighbor as usize] += part * weight;
            }
        }
        let together = parts.iter().map(|part| part * part.transpose()).sum::<Matrix6<f64>>();
        let inverse = pseudo_inverse(self.linearised.information, ROUNDING);
        inverse * (self.linearised.information * of_source + together * of_target) * inverse
    }

    /// What halves of the overlap say beyond.
    fn systematic(&self, distances: &[f64], inliers: &[Residual]) -> Matrix6<f64> {
        let Some(block) = blocks(&self.points) else { return Matrix6::zeros() };
        let about_center = |point: &[f64; 3]| (Vector3::from(*point) - self.linearised.center).into();
        let points: Vec<[f64; 3]> = self.points.iter().map(about_center).collect();
        let normals: Vec<[f64; 3]> = inliers.iter().map(|one| one.normal.into()).collect();
        systematic_covariance(&self.linearised.design, distances, &halves(&points, &normals), &block)
    }

    /// How much more the sums over blocks of neighbours vary than those of independent errors, 1 at least.
    fn alike(&self, distances: &[f64], independent: &Matrix6<f64>) -> f64 {
        let Some(block) = blocks(&self.points) else { return 1.0 };
        let clustered = clustered_covariance(&self.linearised.design, distances, &block);
        let expected = (independent * self.linearised.information).trace();
        // Without any noise nothing varies.
        if expected > 0.0 {
            ((clustered * self.linearised.information).trace() / expected).max(1.0)
        } else {
            1.0
        }
    }
}

#[cfg(test)]
mod tests;
