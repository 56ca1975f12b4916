//! Covariance of a fit whose residuals are neither independent nor of one size.
//!
//! A scanner errs along its ray, and neighbouring points err alike: the number of points alone promises too much. The
//! points are cut into blocks of neighbours, and only whole blocks count as independent: the cluster-robust covariance
//! J+ (sum of r r^T over blocks) J+^T, with the residuals of each block corrected for what the fit took away from them
//! (Bell and McCaffrey 2002, "CR2"). It is unbiased for independent noise of any size per point, and holds for a
//! correlation that is short against the blocks. An interval takes Student's t with the degrees of freedom that the
//! blocks leave.

use super::blocks::Blocks;
use super::conditions::{Conditions, PrimitiveFitOptions};
use super::geometry::{MOST_PARAMETERS, Primitive, Vector};
use super::linear::{Linear, Row, visit_rows};
use nalgebra::{DMatrix, DVector};

/// Of a block's points alone, this part of what determines a parameter is all of it.
const ALL: f64 = 1.0 - 1e-9;

/// How sure the parameters of a surface are.
#[derive(Debug, Clone)]
pub struct PrimitiveUncertainty {
    /// Covariance of the parameters, row by row; not a number where one block of the points is all that determines
    /// some. A plane's shift along its normal and the normal's tilts; a sphere's centre and radius; of all others the
    /// shifts of the point, the tilts of the axis, and then the radius (cylinder), the radius and the half angle (cone),
    /// the shift along the axis, the major radius and the tube's radius (torus), the shift along the axis and the radius
    /// (circle). Shifts and tilts are along `across`.
    pub covariance: Vec<f64>,
    /// Two unit vectors across the axis.
    pub across: [[f64; 3]; 2],
    /// Degrees of freedom of the radius's variance (a plane's: of the shift's), for Student's t.
    pub freedom: f64,
}

/// Covariance of a surface's parameters, in the order of [`super::geometry::Chart`].
pub(crate) struct Uncertainty {
    pub covariance: DMatrix<f64>,
    /// Degrees of freedom of the variance of its size (Satterthwaite's, as for independent noise).
    pub freedom: f64,
}

/// From what the residuals have in common within blocks. `None` where the points, or all but those of one block, do not
/// determine the parameters.
pub(crate) fn uncertainty(primitive: &Primitive, points: &[Vector]) -> Option<Uncertainty> {
    uncertainty_with(primitive, points, &Conditions::none(primitive.kind))
}

/// The same of a fit with weights, or that kept parameters: these have no variance and no covariance.
fn uncertainty_with(
    primitive: &Primitive,
    points: &[Vector],
    conditions: &Conditions,
) -> Option<Uncertainty> {
    let linear = Linear::of(primitive, points, conditions)?;
    let components = primitive.kind.components();
    let chart = primitive.chart();
    let residual = |(number, point)| conditions.weight(number).sqrt() * chart.components(point)[0].0;
    let first: Vec<f64> = points.iter().enumerate().map(residual).collect();
    // Noise is as wide as a block of a curve: blocks are pieces of the curve, not sides of it.
    let feet: Option<Vec<Vector>> =
        (components > 1).then(|| points.iter().map(|point| chart.foot_on_curve(point)).collect());
    let free = conditions.free_parameters();
    let blocks = Blocks::of_residuals(feet.as_deref().unwrap_or(points), &first, free.len());
    // Of a radius that is kept no degrees of freedom are asked for.
    let size = free.iter().position(|&parameter| parameter == primitive.kind.size()).unwrap_or(0);
    let mut sums = vec![BlockSums::default(); blocks.labels.iter().max()? + 1];
    let mut labels = blocks.labels.iter().flat_map(|&label| std::iter::repeat_n(label, components));
    visit_rows(primitive, points, conditions, |row, residual| {
        if let Some(label) = labels.next() {
            sums[label].add(&linear, row, residual);
        }
    });
    let of_free = of_blocks(&linear.inverse, &sums, size)?;
    let parameters = primitive.kind.parameters();
    let mut covariance = DMatrix::zeros(parameters, parameters);
    for (i, &row) in free.iter().enumerate() {
        for (j, &column) in free.iter().enumerate() {
            covariance[(row, column)] = blocks.crossing * of_free.covariance[(i, j)];
        }
    }
    Some(Uncertainty { covariance, ..of_free })
}

/// Of a block q^T q and q^T r, in the basis q of the Jacobian's columns.
#[derive(Clone, Default)]
struct BlockSums {
    normal: [[f64; MOST_PARAMETERS]; MOST_PARAMETERS],
    gradient: [f64; MOST_PARAMETERS],
}

impl BlockSums {
    fn add(&mut self, linear: &Linear, row: &Row, residual: f64) {
        let q = linear.orthonormal(row);
        for i in 0..linear.parameters {
            self.gradient[i] += q[i] * residual;
            for j in 0..=i {
                self.normal[i][j] += q[i] * q[j];
            }
        }
    }
}

/// Of the points of a block J^T J and J^T d, with the Jacobian J of their distances d.
pub(crate) struct BlockEquations {
    pub normal: DMatrix<f64>,
    pub gradient: DVector<f64>,
}

/// From the equations of blocks of neighbours where the sum of all gradients is 0, with the freedom of one parameter's
/// variance. `None` where all points, or all but those of one block, do not determine the parameters.
pub(crate) fn uncertainty_of_equations(blocks: &[BlockEquations], parameter: usize) -> Option<Uncertainty> {
    let normal = blocks.iter().map(|block| &block.normal).sum::<DMatrix<f64>>();
    // J^T J = R^T R, with the triangle R of the Jacobian.
    let triangle = normal.cholesky()?.l().transpose();
    let parameters = triangle.ncols();
    let inverse = triangle.solve_upper_triangular(&DMatrix::identity(parameters, parameters))?;
    let of_block = |block: &BlockEquations| {
        let (normal, gradient) = (inverse.tr_mul(&block.normal) * &inverse, inverse.tr_mul(&block.gradient));
        let mut sums = BlockSums::default();
        for i in 0..parameters {
            sums.gradient[i] = gradient[i];
            (0..=i).for_each(|j| sums.normal[i][j] = normal[(i, j)]);
        }
        sums
    };
    of_blocks(&inverse, &blocks.iter().map(of_block).collect::<Vec<_>>(), parameter)
}

/// The covariance with independent blocks, and the freedom of one parameter's variance.
fn of_blocks(inverse: &DMatrix<f64>, blocks: &[BlockSums], parameter: usize) -> Option<Uncertainty> {
    let parameters = inverse.ncols();
    let count = blocks.len();
    let mut middle = DMatrix::<f64>::zeros(parameters, parameters);
    let mut gram = DMatrix::<f64>::zeros(count, count);
    // What the parameter's error is to each block's residuals: q (1 - q^T q)^-1/2 c.
    let mut errors = DMatrix::<f64>::zeros(parameters, count);
    for (number, BlockSums { normal, gradient }) in blocks.iter().enumerate() {
        let normal = DMatrix::from_fn(parameters, parameters, |i, j| normal[i.max(j)][i.min(j)]);
        let gradient = DVector::from_column_slice(&gradient[..parameters]);
        let taken = normal.clone().symmetric_eigen();
        if taken.eigenvalues.max() > ALL {
            return None;
        }
        let scale = taken.eigenvalues.map(|share| 1.0 / (1.0 - share).sqrt());
        let turn = &taken.eigenvectors;
        let correction = turn * DMatrix::from_diagonal(&scale) * turn.transpose();
        let score = &correction * gradient;
        middle.ger(1.0, &score, &score, 1.0);
        let weights = correction * inverse.row(parameter).transpose();
        let error = normal * &weights;
        gram[(number, number)] = weights.dot(&error);
        errors.set_column(number, &error);
    }
    gram -= errors.tr_mul(&errors);
    Some(Uncertainty {
        covariance: inverse * middle * inverse.transpose(),
        freedom: gram.trace().powi(2) / gram.norm_squared(),
    })
}

impl Primitive {
    /// How sure its parameters are, fitted to these points: from blocks of neighbours, for neighbouring points of a
    /// scanner err alike.
    ///
    /// ```
    /// use surfsig::{fit_primitive, SurfaceKind};
    /// // A plane with a ripple of 0.01, which so many points average out.
    /// let points: Vec<[f64; 3]> = (0..900)
    ///     .map(|i| [f64::from(i % 30), f64::from(i / 30), if i % 2 == 0 { 0.01 } else { -0.01 }])
    ///     .collect();
    /// let plane = fit_primitive(&points, SurfaceKind::Plane, None).unwrap();
    /// let shift = plane.uncertainty(&points).covariance[0].sqrt();
    /// assert!(shift < 0.01 / 30.0);
    /// ```
    pub fn uncertainty(&self, points: &[[f64; 3]]) -> PrimitiveUncertainty {
        self.uncertainty_with(points, &PrimitiveFitOptions::default())
    }

    /// The same where [`crate::fit_primitive_with`] had these options: what it kept has no error.
    ///
    /// ```
    /// use surfsig::{fit_primitive_with, PrimitiveFitOptions, SurfaceKind};
    /// let points: Vec<[f64; 3]> = (0..90)
    ///     .map(|i| (2.4 * f64::from(i), 0.01 * f64::from(i)))
    ///     .map(|(t, z)| [t.cos() * (0.5 + 0.1 * z), t.sin() * 0.5, z])
    ///     .collect();
    /// let options = PrimitiveFitOptions { radius: Some(0.5), ..Default::default() };
    /// let pipe = fit_primitive_with(&points, SurfaceKind::Cylinder, &options).unwrap();
    /// let covariance = pipe.uncertainty_with(&points, &options).covariance;
    /// assert!(covariance[0] > 0.0 && covariance[24] == 0.0);
    /// ```
    pub fn uncertainty_with(
        &self,
        points: &[[f64; 3]],
        options: &PrimitiveFitOptions,
    ) -> PrimitiveUncertainty {
        let parameters = self.kind.parameters();
        let found = if options.are_valid(self.kind, points.len()) {
            let (points, weights) = options.counted(points);
            let options = PrimitiveFitOptions { weights: weights.as_deref(), ..*options };
            uncertainty_with(
                &self.shifted(&-self.point),
                &self.local(&points),
                &options.conditions(self.kind),
            )
        } else {
            None
        };
        PrimitiveUncertainty {
            covariance: found.as_ref().map_or_else(
                || vec![f64::NAN; parameters * parameters],
                |found| found.covariance.as_slice().to_vec(),
            ),
            across: self.chart().across.map(Into::into),
            freedom: found.map_or(f64::NAN, |found| found.freedom),
        }
    }

    /// The standard error of its radius (of a plane's shift) that the points' number promises if none err alike; not a
    /// number where they do not determine the surface.
    pub fn independent_error(&self, points: &[[f64; 3]]) -> f64 {
        if points.len() <= self.kind.parameters() {
            return f64::NAN;
        }
        let conditions = Conditions::none(self.kind);
        let linear = Linear::of(&self.shifted(&-self.point), &self.local(points), &conditions);
        linear.map_or(f64::NAN, |linear| linear.independent_variance(self.kind.size()).sqrt())
    }

    /// Points about its own.
    fn local(&self, points: &[[f64; 3]]) -> Vec<Vector> {
        points.iter().map(|&point| Vector::from(point) - self.point).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::super::blocks::spatial_blocks;
    use super::super::least_squares::{EXACT, refine};
    use super::super::linear::tests::of_rows;
    use super::super::{SurfaceKind, fit_primitive};
    use super::*;
    use crate::fit::samples::Draws;

    fn cylinder() -> Primitive {
        Primitive {
            kind: SurfaceKind::Cylinder,
            point: Vector::zeros(),
            axis: Vector::z(),
            radius: 1.0,
            major_radius: 0.0,
            half_angle: 0.0,
        }
    }

    /// Points of two thirds of a turn, with noise.
    fn strip(count: usize, draws: &mut Draws) -> Vec<Vector> {
        let place = |_| {
            let (turn, height) = (draws.between(0.0, 2.0), draws.between(0.0, 2.0));
            let radius = 1.0 + 0.01 * draws.normal();
            Vector::new(radius * turn.cos(), radius * turn.sin(), height)
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn a_cylinders_radius_errs_as_much_as_is_said() {
        let mut draws = Draws(11);
        let (mut squares, count) = (0.0, 300);
        for _ in 0..count {
            let points = strip(400, &mut draws);
            let fitted = refine(cylinder(), &points, 3.0, EXACT).unwrap();
            let said = uncertainty(&fitted.primitive, &points).unwrap();
            squares += (fitted.primitive.radius - 1.0).powi(2) / said.covariance[(4, 4)];
        }
        let deviation = (squares / f64::from(count)).sqrt();
        assert!((0.9..1.15).contains(&deviation), "{deviation}");
    }

    #[test]
    fn the_error_of_independent_points_is_that_of_the_formula() {
        // Of a sphere seen from all sides: noise / sqrt(n).
        let mut draws = Draws(12);
        let directions = (0..2000).map(|_| Vector::from_fn(|_, _| draws.normal()).normalize());
        let directions: Vec<Vector> = directions.collect();
        let points: Vec<[f64; 3]> =
            directions.iter().map(|direction| ((1.0 + 0.01 * draws.normal()) * direction).into()).collect();
        let sphere = fit_primitive(&points, SurfaceKind::Sphere, None).unwrap();
        let expected = 0.01 / 2000.0_f64.sqrt();
        assert!((sphere.independent_error(&points) / expected - 1.0).abs() < 0.05);
        let by_blocks = sphere.uncertainty(&points);
        assert!((by_blocks.covariance[15].sqrt() / expected - 1.0).abs() < 0.5);
        assert!((10.0..32.0).contains(&by_blocks.freedom));
        assert!(sphere.independent_error(&points[..4]).is_nan());
        assert!(sphere.uncertainty(&points[..4]).covariance.iter().all(|c| c.is_nan()));
    }

    #[test]
    fn blocks_of_one_point_give_the_known_covariance() {
        // White's estimator HC2: the sum of x x^T r^2 / (1 - leverage).
        let mut draws = Draws(9);
        let rows: Vec<(Row, f64)> = (0..40)
            .map(|_| (std::array::from_fn(|i| if i < 3 { draws.normal() } else { 0.0 }), draws.normal()))
            .collect();
        let x = DMatrix::from_fn(40, 3, |i, j| rows[i].0[j]);
        let inverse = x.tr_mul(&x).try_inverse().unwrap();
        let hat = &x * &inverse * x.transpose();
        let rest = DVector::from_fn(40, |i, _| 1.0 - hat[(i, i)]);
        let meat = DMatrix::from_diagonal(&DVector::from_fn(40, |i, _| rows[i].1.powi(2) / rest[i]));
        let expected = &inverse * x.tr_mul(&meat) * &x * &inverse;
        let linear = of_rows(3, &rows).unwrap();
        let mut blocks = vec![BlockSums::default(); 40];
        blocks.iter_mut().zip(&rows).for_each(|(block, (row, residual))| block.add(&linear, row, *residual));
        let found = of_blocks(&linear.inverse, &blocks, 2).unwrap();
        assert!((&found.covariance - &expected).norm() < 1e-10 * expected.norm());
        // Satterthwaite's: (sum of eigenvalues)^2 / sum of squares, of the quadratic form in the noise.
        let mut weights = DMatrix::identity(40, 40) - hat;
        let parameter = &x * inverse.column(2);
        for (i, mut column) in weights.column_iter_mut().enumerate() {
            column *= parameter[i] / rest[i].sqrt();
        }
        let values = weights.tr_mul(&weights).symmetric_eigenvalues();
        let freedom = values.sum().powi(2) / values.norm_squared();
        assert!((found.freedom / freedom - 1.0).abs() < 1e-10, "{} {freedom}", found.freedom);
    }

    #[test]
    fn points_that_err_alike_are_less_sure() {
        let mut draws = Draws(13);
        let mut points = strip(3000, &mut draws);
        let patches = spatial_blocks(&points, 100);
        let steps: Vec<f64> = (0..100).map(|_| 0.02 * draws.normal()).collect();
        for (point, patch) in points.iter_mut().zip(patches) {
            *point += steps[patch] * Vector::new(point.x, point.y, 0.0);
        }
        let fitted = refine(cylinder(), &points, 3.0, EXACT).unwrap().primitive;
        let said = uncertainty(&fitted, &points).unwrap().covariance[(4, 4)].sqrt();
        let linear = Linear::of(&fitted, &points, &Conditions::none(fitted.kind)).unwrap();
        assert!(said > 3.0 * linear.independent_variance(4).sqrt());
    }

    #[test]
    fn a_block_that_alone_determines_a_parameter_leaves_its_error_unknown() {
        // Four points of a circle, and one beside it: without that one there is no sphere.
        let points = [[1.0, 0.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, -1.0, 0.0], [0.0, 0.0, 1.0]];
        let sphere = fit_primitive(&points, SurfaceKind::Sphere, None).unwrap();
        assert!((sphere.radius() - 1.0).abs() < 1e-12);
        assert!(sphere.uncertainty(&points).covariance[15].is_nan());
    }
}
