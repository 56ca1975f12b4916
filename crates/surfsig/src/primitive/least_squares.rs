//! Surfaces fitted by orthogonal distance: Levenberg and Marquardt's steps.

use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use nalgebra::{Cholesky, DMatrix, DVector};

/// When the iterations of a fit end.
#[derive(Clone, Copy)]
pub(crate) struct Termination {
    /// Iterations, at most.
    max_iterations: usize,
    /// It has converged where a step gains less than this share of the sum of squares.
    relative_gain: f64,
    /// Radius, in the points' extents, from which on the surface is a plane.
    flat: f64,
}

/// Among noise: what is left to gain is less than noise.
pub(crate) const QUICK: Termination = Termination { max_iterations: 30, relative_gain: 1e-4, flat: 100.0 };

/// Without noise, along the narrow valleys of small patches: to the exact surface.
pub(crate) const EXACT: Termination = Termination { max_iterations: 200, relative_gain: 1e-7, flat: 100.0 };

/// To the last digits, for points that somebody chose.
pub(super) const EXHAUSTIVE: Termination =
    Termination { max_iterations: 500, relative_gain: 1e-13, flat: 1e6 };

/// Distances that are nothing, in units of the points' extent.
const NOTHING: f64 = 1e-12;

/// A surface that was fitted to points.
pub(crate) struct Fitted {
    pub primitive: Primitive,
    /// Root mean square of the distances.
    pub rms: f64,
}

/// The nearest surface of the same kind for which the sum of squared distances is least; `None` where there is none,
/// or the points are fewer than its parameters.
pub(crate) fn refine(
    start: Primitive,
    points: &[Vector],
    extent: f64,
    termination: Termination,
) -> Option<Fitted> {
    let parameters = start.kind.parameters();
    if points.len() <= parameters || !start.is_valid(extent, termination.flat) {
        return None;
    }
    let mut damping = 1e-4;
    let mut primitive = start;
    let (mut normal, mut gradient, mut sum) = equations(&primitive, points);
    let nothing = (NOTHING * extent).powi(2) * points.len() as f64;
    for _ in 0..termination.max_iterations {
        if sum <= nothing {
            break;
        }
        let mut damped = normal.clone();
        for i in 0..parameters {
            damped[(i, i)] *= 1.0 + damping;
        }
        let Some(solver) = Cholesky::new(damped) else {
            damping = 10.0 * f64::max(damping, 1e-6);
            if damping > 1e8 {
                return None;
            }
            continue;
        };
        let step = -solver.solve(&gradient);
        let moved = primitive.chart().moved(step.as_slice());
        let (new_normal, new_gradient, new_sum) = equations(&moved, points);
        if new_sum <= sum {
            let gain = sum - new_sum;
            (primitive, normal, gradient) = (moved, new_normal, new_gradient);
            damping *= 0.1;
            let converged = gain <= termination.relative_gain * sum;
            sum = new_sum;
            if converged {
                break;
            }
        } else {
            damping *= 10.0;
            // What is not a number comes here too, and ends here.
            if damping > 1e8 {
                break;
            }
        }
    }
    let valid = primitive.is_valid(extent, termination.flat) && sum.is_finite();
    valid.then(|| Fitted { primitive, rms: (sum / points.len() as f64).sqrt() })
}

/// J^T J, J^T d and d^T d.
fn equations(primitive: &Primitive, points: &[Vector]) -> (DMatrix<f64>, DVector<f64>, f64) {
    let parameters = primitive.kind.parameters();
    let chart = primitive.chart();
    let mut normal = [[0.0; MOST_PARAMETERS]; MOST_PARAMETERS];
    let mut gradient = [0.0; MOST_PARAMETERS];
    let mut sum = 0.0;
    for point in points {
        let (distance, by) = chart.distance_and_derivatives(point);
        sum += distance * distance;
        for i in 0..parameters {
            gradient[i] += by[i] * distance;
            for j in 0..=i {
                normal[i][j] += by[i] * by[j];
            }
        }
    }
    let normal = DMatrix::from_fn(parameters, parameters, |i, j| normal[i.max(j)][i.min(j)]);
    (normal, DVector::from_column_slice(&gradient[..parameters]), sum)
}

#[cfg(test)]
mod tests {
    use super::super::SurfaceKind;
    use super::*;

    #[test]
    fn a_torus_is_found_again_from_a_poor_start() {
        let truth = Primitive {
            kind: SurfaceKind::Torus,
            point: Vector::new(1.0, -2.0, 0.5),
            axis: Vector::new(0.36, 0.48, 0.8),
            radius: 0.3,
            major_radius: 1.2,
            half_angle: 0.0,
        };
        let across = truth.axis.cross(&Vector::x()).normalize();
        let other = truth.axis.cross(&across);
        let points: Vec<Vector> = (0..200)
            .map(|i| (0.01 * f64::from(i), 0.37 * f64::from(i)))
            .map(|(turn, tube)| {
                let out = turn.cos() * across + turn.sin() * other;
                truth.point + (1.2 + 0.3 * tube.cos()) * out + 0.3 * tube.sin() * truth.axis
            })
            .collect();
        let start = Primitive {
            point: truth.point + Vector::new(0.1, 0.05, -0.1),
            axis: Vector::new(0.3, 0.5, 0.8).normalize(),
            radius: 0.2,
            major_radius: 1.4,
            ..truth
        };
        let fitted = refine(start, &points, 3.0, EXACT).unwrap();
        assert!(fitted.rms < 1e-10);
        assert!((fitted.primitive.radius - 0.3).abs() < 1e-9);
        assert!((fitted.primitive.point - truth.point).norm() < 1e-9);
    }
}
