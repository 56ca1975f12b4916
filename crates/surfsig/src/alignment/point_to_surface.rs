//! The last steps of a transform, by the distances of points from a surface; and how sure it then is.

use super::clustered_covariance::{blocks, clustered_covariance};
use super::halves::{halves, systematic_covariance};
use super::least_squares::{LinearisedDistances, pseudo_inverse};
use crate::geometry::RigidTransform;
use crate::kd_tree::KdTree;
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};
use nalgebra::{Matrix3, Matrix6, SMatrix, SVector, SymmetricEigen, Vector3, Vector6};
use rayon::prelude::*;

/// Nearest points of the target that its surface is fitted to.
const NEIGHBORS: usize = 20;
/// Nearest points that show whether the surface through the first ones goes on around them.
const SURROUNDING: usize = 60;
/// Largest sine of the angle between the surface and points around it that it passes through.
const LARGEST_SLOPE: f64 = 0.5;
/// Share of the points around that it must pass through.
const LEAST_SHARE: f64 = 0.5;
/// Coefficients of the paraboloid.
const UNKNOWNS: usize = 6;
/// Of the largest eigenvalue, below which a direction is not determined by the residuals.
const UNDETERMINED: f64 = 1e-8;
/// Of a quadratic term's sum of squares, what the terms before it leave over, below which the neighbours do not determine
/// it and the surface is a plane: points on two scan lines leave 0.01 and less, points that are spread a third.
const UNDETERMINED_TERM: f64 = 0.05;
/// Rounding, likewise.
const ROUNDING: f64 = 1e-12;
/// Points that a thread works on at a time.
const PART: usize = 128;

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

/// A target's points, whose surface at a place is a paraboloid (eq. (5)) through the nearest ones.
pub(crate) struct TargetSurface {
    points: Vec<[f64; 3]>,
    tree: KdTree,
    voxel: f64,
    /// Whether the surface around each point goes on beyond its nearest neighbours. Those may all lie on one scan
    /// line, which in a corner lies in a plane of its own that is none of the scene's.
    goes_on: Vec<bool>,
}

/// How far a point is above the surface, and what the surface there rests on.
pub(super) struct Residual {
    /// Of the source's point.
    pub number: usize,
    /// Along the normal.
    pub distance: f64,
    pub normal: Vector3<f64>,
    /// The target's points that tell the distance.
    neighbors: [u32; NEIGHBORS],
    /// What each adds to the distance, per its own error along the normal.
    weights: [f64; NEIGHBORS],
    /// Of the neighbours about the surface.
    variance: f64,
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
    /// Points spread evenly over the surface, about a voxel apart.
    pub fn new(points: Vec<[f64; 3]>, voxel: f64) -> Self {
        let tree = KdTree::new(&points);
        let goes_on = |found: &mut Vec<(f64, u32)>, point: &[f64; 3]| {
            tree.nearest_k(*point, SURROUNDING, found);
            let around: Vec<Vector3<f64>> =
                found.iter().map(|&(_, index)| points[index as usize].into()).collect();
            surface_goes_on(&around)
        };
        let goes_on = points.par_iter().with_min_len(PART).map_init(Vec::new, goes_on).collect();
        Self { points, tree, voxel, goes_on }
    }

    pub fn points(&self) -> &[[f64; 3]] {
        &self.points
    }

    pub fn voxel(&self) -> f64 {
        self.voxel
    }

    /// Of one point; `None` where the target has no surface.
    fn residual(
        &self,
        number: usize,
        point: [f64; 3],
        settings: &PointToSurfaceSettings,
        found: &mut Vec<(f64, u32)>,
    ) -> Option<Residual> {
        self.tree.nearest_k(point, NEIGHBORS, found);
        let [(square, nearest), ..] = found[..] else { return None };
        let is_near = square < (settings.max_distance * self.voxel).powi(2);
        if found.len() < NEIGHBORS || !is_near || !self.goes_on[nearest as usize] {
            return None;
        }
        let mut neighbors = [0; NEIGHBORS];
        let mut around = [Vector3::zeros(); NEIGHBORS];
        for (k, &(_, index)) in found.iter().enumerate() {
            neighbors[k] = index;
            around[k] = Vector3::from(self.points[index as usize]) - Vector3::from(point);
        }
        let mean = around.iter().sum::<Vector3<f64>>() / NEIGHBORS as f64;
        let spread = around.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>()
            / NEIGHBORS as f64;
        let eigen = SymmetricEigen::new(spread);
        let mut order = [0, 1, 2];
        order.sort_by(|&a, &b| eigen.eigenvalues[b].total_cmp(&eigen.eigenvalues[a]));
        let [long, middle, short] = order.map(|k| eigen.eigenvalues[k].max(0.0).sqrt());
        let axes = Matrix3::from_columns(&order.map(|k| eigen.eigenvectors.column(k).into_owned()));
        let off_center = (axes.transpose() * mean).xy().norm();
        if off_center >= settings.max_off_center * (middle + long) || short >= settings.max_thickness * middle
        {
            return None;
        }
        // z = f + d x + e y + (a x^2 + 2 b x y + c y^2) / 2, eq. (5), in axes along the points' spread.
        let scale = long.max(f64::MIN_POSITIVE);
        let local = around.map(|p| axes.transpose() * p / scale);
        let design = SMatrix::<f64, NEIGHBORS, UNKNOWNS>::from_fn(|row, column| {
            let [x, y] = [local[row].x, local[row].y];
            [1.0, x, y, 0.5 * x * x, x * y, 0.5 * y * y][column]
        });
        let z = SVector::<f64, NEIGHBORS>::from_fn(|row, _| local[row].z);
        let (fit, share, unknowns) = paraboloid_or_plane(&design, &z)?;
        let slope = Vector3::new(-fit[1], -fit[2], 1.0);
        let steep = 1.0 / slope.norm();
        // The point is at 0: the surface is f above it, measured along the normal.
        let rest = (z - design * fit).norm_squared();
        Some(Residual {
            number,
            distance: -fit[0] * scale * steep,
            normal: axes * slope * steep,
            neighbors,
            weights: std::array::from_fn(|k| -share[k] * steep),
            variance: rest * (scale * steep).powi(2) / (NEIGHBORS - unknowns) as f64,
        })
    }

    /// How far points are from the surface, along its normal; `None` where there is none.
    pub fn distances(&self, points: &[[f64; 3]], settings: &PointToSurfaceSettings) -> Vec<Option<f64>> {
        let distance = |found: &mut Vec<(f64, u32)>, (number, point): (usize, &[f64; 3])| {
            self.residual(number, *point, settings, found).map(|residual| residual.distance)
        };
        points.par_iter().enumerate().with_min_len(PART).map_init(Vec::new, distance).collect()
    }

    /// Those of inliers: near the surface, where the target is smooth; and how far away they are at most.
    pub(super) fn inliers(
        &self,
        moved: &[[f64; 3]],
        settings: &PointToSurfaceSettings,
    ) -> Option<(Vec<Residual>, f64)> {
        let residual = |found: &mut Vec<(f64, u32)>, (number, point): (usize, &[f64; 3])| {
            self.residual(number, *point, settings, found)
        };
        let all: Vec<Residual> =
            moved.par_iter().enumerate().with_min_len(PART).map_init(Vec::new, residual).flatten().collect();
        if all.len() < settings.min_inliers {
            return None;
        }
        let deviation = DEVIATIONS_PER_MEDIAN * median(all.iter().map(|one| one.distance.abs()).collect())?;
        let farthest = settings.max_deviations * deviation.max(settings.min_deviation * self.voxel);
        // Where the target's own points lie off their surface more than elsewhere, there is an edge.
        let largest = settings.max_variance * median(all.iter().map(|one| one.variance).collect())?;
        let is_inlier = |one: &Residual| one.variance <= largest && one.distance.abs() < farthest;
        Some((all.into_iter().filter(is_inlier).collect(), farthest))
    }

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
            if step == settings.max_iterations || length < settings.epsilon * self.voxel {
                let result = system.result(transform, &inliers, source.len());
                return Some(PointToSurface { farthest, ..result });
            }
            transform = change * transform;
        }
        None
    }
}

/// Whether the plane through the nearest points, which come first, passes through the others, too.
fn surface_goes_on(points: &[Vector3<f64>]) -> bool {
    if points.len() <= NEIGHBORS {
        return true;
    }
    let (near, others) = points.split_at(NEIGHBORS);
    let mean = near.iter().sum::<Vector3<f64>>() / NEIGHBORS as f64;
    let spread = near.iter().map(|p| (p - mean) * (p - mean).transpose()).sum::<Matrix3<f64>>();
    let eigen = SymmetricEigen::new(spread);
    let normal = eigen.eigenvectors.column(eigen.eigenvalues.imin());
    let is_passed = |p: &&Vector3<f64>| normal.dot(&(*p - mean)).abs() <= LARGEST_SLOPE * (*p - mean).norm();
    others.iter().filter(is_passed).count() as f64 >= LEAST_SHARE * others.len() as f64
}

/// The coefficients of eq. (5) by least squares, what the first one takes from each z, and how many are determined.
///
/// Where points lie along two lines, a paraboloid may rise between them as it likes: a plane is fitted there.
fn paraboloid_or_plane(
    design: &SMatrix<f64, NEIGHBORS, UNKNOWNS>,
    z: &SVector<f64, NEIGHBORS>,
) -> Option<(SVector<f64, UNKNOWNS>, SVector<f64, NEIGHBORS>, usize)> {
    const PLANE: usize = 3;
    let products = design.tr_mul(design) + SMatrix::<f64, UNKNOWNS, UNKNOWNS>::identity() * 1e-9;
    let right = design.tr_mul(z);
    let factored = products.cholesky()?;
    // The square of a diagonal element is what the terms before leave of its own.
    let left = factored.l_dirty();
    if (PLANE..UNKNOWNS).all(|k| left[(k, k)].powi(2) >= UNDETERMINED_TERM * products[(k, k)]) {
        let share = design * factored.solve(&SVector::<f64, UNKNOWNS>::ith(0, 1.0));
        return Some((factored.solve(&right), share, UNKNOWNS));
    }
    let factored = products.fixed_view::<PLANE, PLANE>(0, 0).into_owned().cholesky()?;
    let fit = factored.solve(&right.fixed_rows::<PLANE>(0).into_owned());
    let first = factored.solve(&SVector::<f64, PLANE>::ith(0, 1.0));
    let share = design.fixed_columns::<PLANE>(0) * first;
    let mut coefficients = SVector::<f64, UNKNOWNS>::zeros();
    coefficients.fixed_rows_mut::<PLANE>(0).copy_from(&fit);
    Some((coefficients, share, PLANE))
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
