//! The surface that a target's points lie on, and how far other points are from it.

use super::point_to_surface::PointToSurfaceSettings;
use crate::kd_tree::KdTree;
use crate::statistics::{DEVIATIONS_PER_MEDIAN, median};
use nalgebra::{Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};
use rayon::prelude::*;
use std::sync::OnceLock;

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
/// Of a quadratic term's sum of squares, what the terms before it leave over, below which the neighbours do not determine
/// it and the surface is a plane: points on two scan lines leave 0.01 and less, points that are spread a third.
const UNDETERMINED_TERM: f64 = 0.05;
/// Points that a thread works on at a time.
const PART: usize = 128;

/// A target's points, whose surface at a place is a paraboloid (eq. (5)) through the nearest ones.
pub(crate) struct TargetSurface {
    points: Vec<[f64; 3]>,
    tree: KdTree,
    voxel: f64,
    /// Whether the surface around each point goes on beyond its nearest neighbours. Those may all lie on one scan
    /// line, which in a corner lies in a plane of its own that is none of the scene's. Told when it is first asked for:
    /// sources often meet a small part of a target.
    goes_on: Vec<OnceLock<bool>>,
}

/// How far a point is above the surface, and what the surface there rests on.
pub(super) struct Residual {
    /// Of the source's point.
    pub number: usize,
    /// Along the normal.
    pub distance: f64,
    pub normal: Vector3<f64>,
    /// The target's points that tell the distance.
    pub neighbors: [u32; NEIGHBORS],
    /// What each adds to the distance, per its own error along the normal.
    pub weights: [f64; NEIGHBORS],
    /// Of the neighbours about the surface.
    pub variance: f64,
}

impl TargetSurface {
    /// Points spread evenly over the surface, about a voxel apart.
    pub fn new(points: Vec<[f64; 3]>, voxel: f64) -> Self {
        let goes_on = (0..points.len()).map(|_| OnceLock::new()).collect();
        Self { tree: KdTree::new(&points), points, voxel, goes_on }
    }

    /// See [`TargetSurface::goes_on`].
    fn goes_on(&self, number: usize) -> bool {
        *self.goes_on[number].get_or_init(|| {
            let mut found = Vec::new();
            self.tree.nearest_k(self.points[number], SURROUNDING, &mut found);
            let around: Vec<Vector3<f64>> =
                found.iter().map(|&(_, index)| self.points[index as usize].into()).collect();
            surface_goes_on(&around)
        })
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
        if found.len() < NEIGHBORS || !is_near || !self.goes_on(nearest as usize) {
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_is_that_to_the_sphere_through_the_points() {
        let radius = 30.0;
        let sphere = |x: f64, y: f64| [x, y, (radius * radius - x * x - y * y).sqrt()];
        let points: Vec<[f64; 3]> =
            (0..1600).map(|i| sphere(f64::from(i % 40) - 19.5, f64::from(i / 40) - 19.5)).collect();
        let surface = TargetSurface::new(points, 1.0);
        let settings = PointToSurfaceSettings::default();
        for (direction, off) in [([0.1, 0.2, 1.0], 0.3), ([-0.3, 0.1, 1.0], -0.5), ([0.0, -0.4, 1.0], 0.0)] {
            let normal = Vector3::from(direction).normalize();
            let point: [f64; 3] = (normal * (radius + off)).into();
            let found = surface.residual(0, point, &settings, &mut Vec::new()).unwrap();
            let outwards = normal.dot(&found.normal).signum();
            assert!((found.distance * outwards - off).abs() < 2e-3, "{} {off}", found.distance);
            assert!((normal.dot(&found.normal).abs() - 1.0).abs() < 1e-4);
            // A common error of all neighbours along the normal is one of the distance.
            let sum: f64 = found.weights.iter().sum();
            assert!((sum.abs() - 1.0).abs() < 0.02, "{sum}");
        }
        assert!(surface.residual(0, [0.0, 0.0, 40.0], &settings, &mut Vec::new()).is_none(), "too far");
        assert!(surface.residual(0, [22.0, 0.0, 20.0], &settings, &mut Vec::new()).is_none(), "off the rim");
    }
}
