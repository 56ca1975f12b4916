//! The triangle of a fit's Jacobian: its steps, and whether the points determine the parameters.

use super::conditions::Conditions;
use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use nalgebra::{DMatrix, DVector};

/// A column of the Jacobian of which the others leave less than this part is a combination of theirs.
const SINGULAR: f64 = 1e-9;

/// Rows that are taken into the triangle at a time.
const ROWS: usize = 128;

/// A fit near its solution, in its free parameters.
pub(super) struct Linear {
    pub parameters: usize,
    /// Derivatives of the residuals by the parameters, one row for each component of each point's distance.
    pub jacobian: Vec<[f64; MOST_PARAMETERS]>,
    /// Times the roots of the weights, as the derivatives.
    pub residuals: Vec<f64>,
    /// The inverse of the Jacobian's triangle R, of J = Q R with columns of unit length at right angles in Q.
    pub inverse: DMatrix<f64>,
}

impl Linear {
    /// `None` where the points do not determine the parameters.
    pub fn of(primitive: &Primitive, points: &[Vector], conditions: &Conditions) -> Option<Self> {
        let chart = primitive.chart();
        let free = conditions.free_parameters();
        let components = primitive.kind.components();
        let mut jacobian = Vec::with_capacity(points.len() * components);
        let mut residuals = Vec::with_capacity(points.len() * components);
        for (number, point) in points.iter().enumerate() {
            let root = conditions.weight(number).sqrt();
            for (distance, by) in chart.components(point).into_iter().take(components) {
                let mut row = [0.0; MOST_PARAMETERS];
                for (entry, &parameter) in row.iter_mut().zip(&free) {
                    *entry = root * by[parameter];
                }
                jacobian.push(row);
                residuals.push(root * distance);
            }
        }
        Self::new(free.len(), jacobian, residuals)
    }

    pub fn new(
        parameters: usize,
        jacobian: Vec<[f64; MOST_PARAMETERS]>,
        residuals: Vec<f64>,
    ) -> Option<Self> {
        if jacobian.len() < parameters {
            return None;
        }
        let mut triangle = DMatrix::<f64>::zeros(parameters, parameters);
        for rows in jacobian.chunks(ROWS) {
            let stacked = DMatrix::from_fn(parameters + rows.len(), parameters, |i, j| {
                if i < parameters { triangle[(i, j)] } else { rows[i - parameters][j] }
            });
            triangle = stacked.qr().r();
        }
        let determined =
            (0..parameters).all(|i| triangle[(i, i)].abs() > SINGULAR * triangle.column(i).norm());
        let inverse = triangle.solve_upper_triangular(&DMatrix::identity(parameters, parameters))?;
        determined.then_some(Self { parameters, jacobian, residuals, inverse })
    }

    /// A row of Q.
    pub fn orthonormal(&self, row: &[f64; MOST_PARAMETERS]) -> [f64; MOST_PARAMETERS] {
        let mut q = [0.0; MOST_PARAMETERS];
        for (i, entry) in q.iter_mut().enumerate().take(self.parameters) {
            *entry = (0..=i).map(|j| row[j] * self.inverse[(j, i)]).sum();
        }
        q
    }

    /// Gauss and Newton's step -R^-1 Q^T d, and the length of Q^T d.
    pub fn step(&self) -> (DVector<f64>, f64) {
        let mut projected = DVector::zeros(self.parameters);
        for (row, residual) in self.jacobian.iter().zip(&self.residuals) {
            let q = self.orthonormal(row);
            for i in 0..self.parameters {
                projected[i] += q[i] * residual;
            }
        }
        (-(&self.inverse * &projected), projected.norm())
    }

    /// Sum of the squares.
    pub fn sum(&self) -> f64 {
        self.residuals.iter().map(|r| r * r).sum()
    }

    /// Variance of a residual of weight 1.
    pub fn variance(&self) -> f64 {
        self.sum() / (self.residuals.len() - self.parameters) as f64
    }

    /// The variance of a parameter if the residuals were independent and of one size.
    pub fn independent_variance(&self, parameter: usize) -> f64 {
        self.variance() * self.inverse.row(parameter).norm_squared()
    }
}
