//! Whether a source has another scale than the target: a similarity transform fitted to the distances from the surface.

use super::clustered_covariance::{block_count, block_numbers};
use super::observability::UNOBSERVABLE;
use super::point_to_surface::PointToSurfaceSettings;
use super::target_surface::{Residual, TargetSurface};
use nalgebra::{SMatrix, SVector, Vector3};
use rayon::prelude::*;

/// Six of the twist, and the logarithm of the scale.
const UNKNOWNS: usize = 7;
/// Of the largest eigenvalue, below which a direction is not determined.
const UNDETERMINED: f64 = 1e-6;
/// Part of the scale in an undetermined motion of unit length, below which it has none.
const NO_PART: f64 = 0.01;
/// The largest change of the scale's logarithm in one step: correspondences are looked up again before the next.
const LARGEST_STEP: f64 = 0.05;
/// The logarithm of a scale beyond which nothing is said.
const FARTHEST: f64 = 0.7;

/// How many times as large a source is as the target.
#[derive(Debug, Clone)]
pub(crate) struct Scale {
    /// 1 where both are of one size.
    pub scale: f64,
    /// Its standard error; only sums over blocks of neighbours count as independent.
    pub standard_error: f64,
    /// The points, shrunk and moved so that they fit.
    pub points: Vec<[f64; 3]>,
}

impl TargetSurface {
    /// Fits a similarity transform to points that a rigid one has brought near; `None` where the surface does not
    /// determine a scale.
    pub fn scale_of(&self, points: &[[f64; 3]], settings: &PointToSurfaceSettings) -> Option<Scale> {
        let mut points = points.to_vec();
        let mut logarithm = 0.0_f64;
        for step in 0.. {
            let (inliers, _) = self.inliers(&points, settings)?;
            if inliers.len() < settings.min_inliers + UNKNOWNS {
                return None;
            }
            let system = Similarity::new(&points, &inliers);
            let change = system.step()?;
            if step == settings.max_iterations || change.norm() < settings.epsilon {
                let standard_error = system.standard_error(&points, &inliers)?;
                // Noise of the normals seems to hold a scale that two planes or a cylinder do not.
                if system.observability() <= UNOBSERVABLE {
                    return None;
                }
                // What the points had to be enlarged by, the target is larger by.
                let scale = (-logarithm).exp();
                return Some(Scale { scale, standard_error: scale * standard_error, points });
            }
            logarithm += change[6];
            if logarithm.abs() > FARTHEST {
                return None;
            }
            points = system.moved(&points, &change);
        }
        None
    }
}

/// Normal equations of a similarity transform about the inliers' centre.
struct Similarity {
    center: Vector3<f64>,
    unit: f64,
    rows: Vec<SVector<f64, UNKNOWNS>>,
    inverse: SMatrix<f64, UNKNOWNS, UNKNOWNS>,
    /// Whether no undetermined motion changes the scale.
    is_determined: bool,
    gradient: SVector<f64, UNKNOWNS>,
}

impl Similarity {
    fn new(points: &[[f64; 3]], inliers: &[Residual]) -> Self {
        let position = |one: &Residual| Vector3::from(points[one.number]);
        let count = inliers.len() as f64;
        let center = inliers.iter().map(position).sum::<Vector3<f64>>() / count;
        let square = inliers.iter().map(|one| (position(one) - center).norm_squared()).sum::<f64>() / count;
        let unit = square.sqrt().max(f64::MIN_POSITIVE);
        let row = |one: &Residual| {
            let arm = (position(one) - center) / unit;
            let (n, rotational) = (one.normal, arm.cross(&one.normal));
            // The logarithm of the scale moves a point along its arm.
            SVector::from([rotational.x, rotational.y, rotational.z, n.x, n.y, n.z, arm.dot(&n)])
        };
        let rows: Vec<SVector<f64, UNKNOWNS>> = inliers.iter().map(row).collect();
        let mut products = SMatrix::<f64, UNKNOWNS, UNKNOWNS>::zeros();
        let mut gradient = SVector::zeros();
        for (row, one) in rows.iter().zip(inliers) {
            products += row * row.transpose();
            gradient += row * one.distance;
        }
        let eigen = products.symmetric_eigen();
        let least = UNDETERMINED * eigen.eigenvalues.amax();
        let mut inverse = SMatrix::zeros();
        let mut is_determined = true;
        for (value, vector) in eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter()) {
            if *value > least {
                inverse += vector * vector.transpose() / *value;
            } else {
                is_determined &= vector[6].abs() < NO_PART;
            }
        }
        Self { center, unit, rows, inverse, is_determined, gradient }
    }

    /// Rotation vector, translation and the scale's logarithm; `None` where no scale is determined.
    fn step(&self) -> Option<SVector<f64, UNKNOWNS>> {
        let change = -self.inverse * self.gradient / self.unit;
        let is_determined = self.is_determined && change.iter().all(|x| x.is_finite());
        is_determined.then(|| change * (LARGEST_STEP / change.amax()).min(1.0))
    }

    /// The root mean square of the distances that a change of the scale makes which rigid motions do not undo, over that
    /// of its points' paths.
    fn observability(&self) -> f64 {
        1.0 / (self.inverse[(6, 6)] * self.rows.len() as f64).sqrt()
    }

    fn moved(&self, points: &[[f64; 3]], change: &SVector<f64, UNKNOWNS>) -> Vec<[f64; 3]> {
        let rotation = nalgebra::Rotation3::new(change.fixed_rows::<3>(0).into_owned());
        let translation = self.unit * change.fixed_rows::<3>(3).into_owned();
        let enlarged = change[6].exp();
        let moved = |point: &[f64; 3]| {
            let arm = Vector3::from(*point) - self.center;
            (self.center + translation + enlarged * (rotation * arm)).into()
        };
        points.par_iter().with_min_len(256).map(moved).collect()
    }

    /// Of the scale's logarithm: what the sums over blocks of neighbours add to it.
    fn standard_error(&self, points: &[[f64; 3]], inliers: &[Residual]) -> Option<f64> {
        let positions: Vec<[f64; 3]> = inliers.iter().map(|one| points[one.number]).collect();
        let block = block_numbers(&positions);
        let count = block_count(&block);
        if count <= UNKNOWNS {
            return None;
        }
        let mut parts = vec![0.0; count];
        let influence = self.inverse.row(6) / self.unit;
        for ((row, one), &block) in self.rows.iter().zip(inliers).zip(&block) {
            parts[block as usize] += (influence * row)[0] * one.distance;
        }
        let freedom = count as f64 / (count - UNKNOWNS) as f64;
        Some((parts.iter().map(|part| part * part).sum::<f64>() * freedom).sqrt())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::uniform;

    /// Three faces of a box of 40 x 30 x 20 with a bump on one.
    fn corner(count: usize, seed: usize, noise: f64) -> Vec<[f64; 3]> {
        (0..count)
            .map(|i| {
                let number = |k| uniform(seed * 1_000_003 + i, k);
                let (u, v) = (number(0), number(1));
                let off = noise * (2..14).map(|k| number(k) - 0.5).sum::<f64>();
                let bump = 3.0 * (-30.0 * ((u - 0.5).powi(2) + (v - 0.4).powi(2))).exp();
                match i % 3 {
                    0 => [40.0 * u, 30.0 * v, off + bump],
                    1 => [40.0 * u, off, 20.0 * v],
                    _ => [off, 30.0 * u, 20.0 * v],
                }
            })
            .collect()
    }

    #[test]
    fn a_source_that_is_too_large_says_by_how_much() {
        let surface = TargetSurface::new(corner(3000, 1, 0.1), 1.0);
        let wide = PointToSurfaceSettings { max_iterations: 15, ..Default::default() };
        for true_scale in [1.0, 0.98, 1.03] {
            let source: Vec<[f64; 3]> =
                corner(900, 2, 0.1).iter().map(|point| point.map(|x| x * true_scale)).collect();
            let found = surface.scale_of(&source, &wide).unwrap();
            let off = (found.scale - true_scale).abs();
            assert!(found.standard_error < 0.004, "{}", found.standard_error);
            assert!(off < 4.0 * found.standard_error + 2e-4, "{off} {}", found.standard_error);
        }
    }

    #[test]
    fn a_plane_has_no_scale() {
        let plane: Vec<[f64; 3]> = (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30), 0.0]).collect();
        let surface = TargetSurface::new(plane.clone(), 1.0);
        assert!(surface.scale_of(&plane, &PointToSurfaceSettings::default()).is_none());
        assert!(surface.scale_of(&[], &PointToSurfaceSettings::default()).is_none());
    }
}
