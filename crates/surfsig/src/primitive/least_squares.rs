//! Surfaces fitted by orthogonal distance: Levenberg and Marquardt's steps, then Gauss and Newton's to the last digits.

use super::MANY;
use super::conditions::Conditions;
use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use super::linear::Linear;
use nalgebra::{Cholesky, DMatrix, DVector};

/// When the iterations of a fit end.
#[derive(Clone, Copy)]
pub(crate) struct Termination {
    /// Iterations, at most.
    max_iterations: usize,
    /// It has converged where a step gains less than this share of the sum of squares.
    relative_gain: f64,
    /// Radius, in the points' extents, from which on the surface is a plane.
    pub(super) flat: f64,
}

/// Among noise: what is left to gain is less than noise.
pub(crate) const QUICK: Termination = Termination { max_iterations: 30, relative_gain: 1e-4, flat: 100.0 };

/// Without noise, along the narrow valleys of small patches: to the exact surface.
pub(crate) const EXACT: Termination = Termination { max_iterations: 200, relative_gain: 1e-7, flat: 100.0 };

/// For points that somebody chose: to where [`polish`] goes on.
pub(super) const EXHAUSTIVE: Termination =
    Termination { max_iterations: 500, relative_gain: 1e-13, flat: 1e6 };

/// To tell which of many starts lead to a small sum.
pub(super) const SCREENING: Termination = Termination { max_iterations: 15, relative_gain: 1e-3, flat: 1e4 };

/// Along the narrow valleys of short arcs, to where one minimum is told from another.
pub(super) const SLIDING: Termination = Termination { max_iterations: 150, relative_gain: 1e-6, flat: 1e6 };

/// Steps of [`polish`]; three are enough where the residuals are small beside the radius.
const MAX_POLISHING_STEPS: usize = 200;

/// Halvings of a step of [`polish`] that does not come closer.
const MAX_HALVINGS: u32 = 5;

/// Relative error of a sum of squares that is rounding's.
const ROUNDING_OF_SUM: f64 = 1e-12;

/// What may be left of the gradient where [`polish`] ends, in units of the residuals' length: of their standard errors,
/// the parameters lack so much times the root of the points' number.
const NEARLY: f64 = 1e-8;

/// A step with many points is the last one where it is so small a part of the parameters' standard errors: of itself it
/// leaves no more than such a part.
const CERTAIN: f64 = 1e-5;

/// Distances that are nothing, in units of the points' extent.
const NOTHING: f64 = 1e-12;

/// A surface that was fitted to points.
#[derive(Clone, Copy)]
pub(crate) struct Fitted {
    pub primitive: Primitive,
    /// Root mean square of the distances.
    pub rms: f64,
}

/// A surface to which [`polish`] came.
#[derive(Clone, Copy)]
pub(super) struct Polished {
    pub primitive: Primitive,
    /// Whether nothing is left of the gradient.
    pub converged: bool,
}

/// The nearest surface of the same kind for which the sum of squared distances is least; `None` where there is none,
/// or the points are fewer than its parameters.
pub(crate) fn refine(
    start: Primitive,
    points: &[Vector],
    extent: f64,
    termination: Termination,
) -> Option<Fitted> {
    refine_with(start, points, extent, &Conditions::none(start.kind), termination)
}

/// The same with weights, and some parameters kept. The mean square is a weighted mean.
pub(super) fn refine_with(
    start: Primitive,
    points: &[Vector],
    extent: f64,
    conditions: &Conditions,
    termination: Termination,
) -> Option<Fitted> {
    let free = conditions.free_parameters();
    let parameters = free.len();
    if points.len() * start.kind.components() <= parameters || !start.is_valid(extent, termination.flat) {
        return None;
    }
    let mut damping = 1e-4;
    let mut primitive = start;
    let (mut normal, mut gradient, mut sum) = equations(&primitive, points, conditions, &free);
    let count: f64 = (0..points.len()).map(|point| conditions.weight(point)).sum();
    let nothing = (NOTHING * extent).powi(2) * count;
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
        let moved = primitive.chart().moved(&all_parameters(&step, &free));
        let (new_normal, new_gradient, new_sum) = equations(&moved, points, conditions, &free);
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
    valid.then(|| Fitted { primitive, rms: (sum / count).sqrt() })
}

/// Gauss and Newton's steps by a triangle of the Jacobian, until rounding alone is left of the gradient; `None` where the
/// points do not determine the parameters.
///
/// The gradient, in the metric in which the sum of squares is round, is what becomes 0: a sum of squares stops to change
/// where the parameters have half of their digits.
pub(super) fn polish(start: Primitive, points: &[Vector], conditions: &Conditions) -> Option<Polished> {
    let free = conditions.free_parameters();
    let (mut primitive, mut linear) = (start, Linear::of(&start, points, conditions)?);
    for _ in 0..MAX_POLISHING_STEPS {
        let left = linear.gradient_left();
        if left <= linear.rounding() {
            break;
        }
        let (step, most) = (linear.step(), linear.sum * (1.0 + ROUNDING_OF_SUM));
        if points.len() > MANY && left <= CERTAIN * linear.variance().sqrt() {
            // Nothing will be left of the gradient, and to look at so many points takes long.
            let primitive = primitive.chart().moved(&all_parameters(&step, &free));
            return Some(Polished { primitive, converged: true });
        }
        let better = (0..=MAX_HALVINGS).find_map(|halving| {
            let step = &step * 0.5_f64.powi(halving as i32);
            let moved = primitive.chart().moved(&all_parameters(&step, &free));
            let next = Linear::of(&moved, points, conditions)?;
            (next.sum <= most && next.gradient_left() < left).then_some((moved, next))
        });
        let Some(better) = better else { break };
        (primitive, linear) = better;
    }
    let converged = linear.gradient_left() <= NEARLY * linear.sum.sqrt() + linear.rounding();
    Some(Polished { primitive, converged })
}

/// d^T W d.
pub(super) fn sum_of_squares(primitive: &Primitive, points: &[Vector], conditions: &Conditions) -> f64 {
    let chart = primitive.chart();
    let square = |(number, point)| conditions.weight(number) * chart.distance(point).powi(2);
    points.iter().enumerate().map(square).sum()
}

/// A step of all parameters, 0 for those that are kept.
fn all_parameters(step: &DVector<f64>, free: &[usize]) -> [f64; MOST_PARAMETERS] {
    let mut all = [0.0; MOST_PARAMETERS];
    for (&parameter, &value) in free.iter().zip(step.iter()) {
        all[parameter] = value;
    }
    all
}

/// J^T W J, J^T W d and d^T W d of the free parameters.
fn equations(
    primitive: &Primitive,
    points: &[Vector],
    conditions: &Conditions,
    free: &[usize],
) -> (DMatrix<f64>, DVector<f64>, f64) {
    let parameters = primitive.kind.parameters();
    let chart = primitive.chart();
    let mut normal = [[0.0; MOST_PARAMETERS]; MOST_PARAMETERS];
    let mut gradient = [0.0; MOST_PARAMETERS];
    let mut sum = 0.0;
    let mut add = |weight: f64, distance: f64, by: &[f64; MOST_PARAMETERS]| {
        sum += weight * distance * distance;
        for i in 0..parameters {
            let weighted = weight * by[i];
            gradient[i] += weighted * distance;
            for j in 0..=i {
                normal[i][j] += weighted * by[j];
            }
        }
    };
    if primitive.kind.components() == 1 {
        for (number, point) in points.iter().enumerate() {
            let (distance, by) = chart.distance_and_derivatives(point);
            add(conditions.weight(number), distance, &by);
        }
    } else {
        for (number, point) in points.iter().enumerate() {
            for (component, by) in chart.components(point) {
                add(conditions.weight(number), component, &by);
            }
        }
    }
    let of = |i: usize| free[i];
    let normal = DMatrix::from_fn(free.len(), free.len(), |i, j| normal[of(i.max(j))][of(i.min(j))]);
    (normal, DVector::from_iterator(free.len(), free.iter().map(|&i| gradient[i])), sum)
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
