//! The triangle of a fit's Jacobian: its steps, and whether the points determine the parameters.

use super::conditions::Conditions;
use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use nalgebra::{DMatrix, DVector};

/// A column of the Jacobian of which the others leave less than this part is a combination of theirs.
const SINGULAR: f64 = 1e-9;

/// Rows that are taken into the triangle at a time: their columns stay in the nearest cache.
const ROWS: usize = 128;

/// Columns of the Jacobian, and the residuals behind them.
const MOST_COLUMNS: usize = MOST_PARAMETERS + 1;

/// The derivatives of one residual by the free parameters.
pub(super) type Row = [f64; MOST_PARAMETERS];

/// A fit near its solution, in its free parameters.
pub(super) struct Linear {
    pub parameters: usize,
    /// Number of the residuals.
    pub count: usize,
    /// Sum of their squares.
    pub sum: f64,
    /// The inverse of the Jacobian's triangle R, of J = Q R with columns of unit length at right angles in Q.
    pub inverse: DMatrix<f64>,
    /// The same for loops over points, with zeros.
    rows_of_inverse: [Row; MOST_PARAMETERS],
    /// Q^T d of the residuals d.
    projected: DVector<f64>,
}

/// Visits the rows of the Jacobian with the residuals, one for each component of each point's distance, times the roots
/// of the weights. A plain loop: an iterator that holds both components of each point takes twice as long.
pub(super) fn visit_rows(
    primitive: &Primitive,
    points: &[Vector],
    conditions: &Conditions,
    mut visit: impl FnMut(&Row, f64),
) {
    let (chart, free) = (primitive.chart(), conditions.free_parameters());
    let (is_curve, are_all_free) =
        (primitive.kind.components() > 1, free.len() == primitive.kind.parameters());
    let mut visit_component = |number: usize, (distance, by): (f64, Row)| {
        if conditions.weights.is_none() && are_all_free {
            return visit(&by, distance);
        }
        let root = conditions.weight(number).sqrt();
        let mut row = [0.0; MOST_PARAMETERS];
        for (entry, &parameter) in row.iter_mut().zip(&free) {
            *entry = root * by[parameter];
        }
        visit(&row, root * distance);
    };
    for (number, point) in points.iter().enumerate() {
        if is_curve {
            for component in chart.components(point) {
                visit_component(number, component);
            }
        } else {
            visit_component(number, chart.distance_and_derivatives(point));
        }
    }
}

impl Linear {
    /// `None` where the points do not determine the parameters.
    pub fn of(primitive: &Primitive, points: &[Vector], conditions: &Conditions) -> Option<Self> {
        let mut triangle = Triangle::new(conditions.free_parameters().len() + 1);
        visit_rows(primitive, points, conditions, |row, residual| triangle.add(row, residual));
        Self::of_triangle(triangle)
    }

    /// `None` where the rows that are in the triangle do not determine the parameters.
    fn of_triangle(triangle: Triangle) -> Option<Self> {
        let parameters = triangle.width - 1;
        let (count, entries) = triangle.finished();
        if count < parameters {
            return None;
        }
        let whole = DMatrix::from_fn(parameters + 1, parameters + 1, |i, j| entries[i][j]);
        let triangle = whole.view((0, 0), (parameters, parameters));
        let determined =
            (0..parameters).all(|i| triangle[(i, i)].abs() > SINGULAR * triangle.column(i).norm());
        let inverse = triangle.solve_upper_triangular(&DMatrix::identity(parameters, parameters))?;
        let projected = whole.view((0, parameters), (parameters, 1)).column(0).into_owned();
        let sum = whole.column(parameters).norm_squared();
        let entry = |i: usize, j: usize| if i.max(j) < parameters { inverse[(i, j)] } else { 0.0 };
        let rows_of_inverse = std::array::from_fn(|i| std::array::from_fn(|j| entry(i, j)));
        determined.then_some(Self { parameters, count, sum, inverse, rows_of_inverse, projected })
    }

    /// A row of Q.
    pub fn orthonormal(&self, row: &Row) -> Row {
        let mut q = [0.0; MOST_PARAMETERS];
        for (entry, of_inverse) in row.iter().zip(&self.rows_of_inverse).take(self.parameters) {
            for (q, inverse) in q.iter_mut().zip(of_inverse) {
                *q += entry * inverse;
            }
        }
        q
    }

    /// Gauss and Newton's step -R^-1 Q^T d.
    pub fn step(&self) -> DVector<f64> {
        -(&self.inverse * &self.projected)
    }

    /// What is left of the gradient, in the metric in which the sum of squares is round: the length of Q^T d.
    pub fn gradient_left(&self) -> f64 {
        self.projected.norm()
    }

    /// What rounding leaves of the gradient, of points that extend by 1: each distance is rounded by some epsilons, and
    /// each reflection of rows by one of the residuals' length.
    pub fn rounding(&self) -> f64 {
        f64::EPSILON * (4.0 + self.sum.sqrt()) * self.count.div_ceil(ROWS) as f64
    }

    /// Variance of a residual of weight 1.
    pub fn variance(&self) -> f64 {
        self.sum / (self.count - self.parameters) as f64
    }

    /// The variance of a parameter if the residuals were independent and of one size.
    pub fn independent_variance(&self, parameter: usize) -> f64 {
        self.variance() * self.inverse.row(parameter).norm_squared()
    }
}

/// The triangle R of a matrix that is given row by row, by Householder's reflections.
struct Triangle {
    width: usize,
    /// Rows so far.
    count: usize,
    entries: [[f64; MOST_COLUMNS]; MOST_COLUMNS],
    /// The rows that are not in it yet, column by column.
    columns: [[f64; ROWS]; MOST_COLUMNS],
    filled: usize,
}

impl Triangle {
    fn new(width: usize) -> Self {
        let (entries, columns) = ([[0.0; MOST_COLUMNS]; MOST_COLUMNS], [[0.0; ROWS]; MOST_COLUMNS]);
        Self { width, count: 0, entries, columns, filled: 0 }
    }

    fn add(&mut self, row: &Row, residual: f64) {
        for (column, &entry) in self.columns.iter_mut().zip(row).take(self.width - 1) {
            column[self.filled] = entry;
        }
        self.columns[self.width - 1][self.filled] = residual;
        self.filled += 1;
        if self.filled == ROWS {
            self.reflect();
        }
    }

    /// Takes in the rows that wait: a reflection for each column, which only one row of the triangle has part in.
    fn reflect(&mut self) {
        // Rows of zeros change nothing.
        self.columns.iter_mut().for_each(|column| column[self.filled..].fill(0.0));
        self.count += self.filled;
        self.filled = 0;
        for k in 0..self.width {
            let (before, after) = self.columns.split_at_mut(k + 1);
            let reflected = &mut before[k];
            let corner = self.entries[k][k];
            let square = dot(reflected, reflected);
            if square == 0.0 {
                continue;
            }
            let length = -(corner * corner + square).sqrt().copysign(corner);
            // The reflection is 1 - factor v v^T with v = (1, reflected).
            let factor = (length - corner) / length;
            let scale = 1.0 / (corner - length);
            reflected.iter_mut().for_each(|entry| *entry *= scale);
            self.entries[k][k] = length;
            for (column, entry) in
                after.iter_mut().zip(&mut self.entries[k][k + 1..]).take(self.width - k - 1)
            {
                let along = factor * (*entry + dot(reflected, column));
                *entry -= along;
                column.iter_mut().zip(reflected.iter()).for_each(|(c, v)| *c -= along * v);
            }
        }
    }

    /// The number of rows, and the triangle.
    fn finished(mut self) -> (usize, [[f64; MOST_COLUMNS]; MOST_COLUMNS]) {
        self.reflect();
        (self.count, self.entries)
    }
}

/// In four sums, so that they need not wait for each other.
fn dot(a: &[f64; ROWS], b: &[f64; ROWS]) -> f64 {
    let mut sums = [0.0; 4];
    for (a, b) in a.chunks_exact(4).zip(b.chunks_exact(4)) {
        for i in 0..4 {
            sums[i] += a[i] * b[i];
        }
    }
    (sums[0] + sums[1]) + (sums[2] + sums[3])
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::fit::samples::Draws;

    pub fn of_rows(parameters: usize, rows: &[(Row, f64)]) -> Option<Linear> {
        let mut triangle = Triangle::new(parameters + 1);
        rows.iter().for_each(|(row, residual)| triangle.add(row, *residual));
        Linear::of_triangle(triangle)
    }

    #[test]
    fn the_triangle_is_that_of_the_normal_equations() {
        let mut draws = Draws(21);
        for count in [5, 127, 128, 129, 700] {
            let rows: Vec<(Row, f64)> = (0..count)
                .map(|_| (std::array::from_fn(|i| if i < 3 { draws.normal() } else { 0.0 }), draws.normal()))
                .collect();
            let linear = of_rows(3, &rows).unwrap();
            let jacobian = DMatrix::from_fn(count, 3, |i, j| rows[i].0[j]);
            let residuals = DVector::from_fn(count, |i, _| rows[i].1);
            let covariance = jacobian.tr_mul(&jacobian).try_inverse().unwrap();
            let found = &linear.inverse * linear.inverse.transpose();
            assert!((&found - &covariance).norm() < 1e-10 * covariance.norm(), "{count}");
            let step = -&covariance * jacobian.tr_mul(&residuals);
            assert!((linear.step() - &step).norm() < 1e-9 * step.norm());
            assert!((linear.sum / residuals.norm_squared() - 1.0).abs() < 1e-13);
            assert_eq!(linear.count, count);
            let q: f64 = rows.iter().map(|(row, _)| linear.orthonormal(row)[1].powi(2)).sum();
            assert!((q - 1.0).abs() < 1e-12);
        }
    }

    #[test]
    fn columns_that_others_make_up_are_not_determined() {
        let rows = (0..300).map(|i| (f64::from(i).sin(), f64::from(i).cos()));
        let alike: Vec<(Row, f64)> =
            rows.map(|(a, b)| ([a, b, 2.0 * a - b, 0.0, 0.0, 0.0, 0.0], 1.0)).collect();
        assert!(of_rows(3, &alike).is_none());
        assert!(of_rows(2, &alike).is_some());
        assert!(of_rows(2, &alike[..1]).is_none());
    }
}
