//! Sums over the points of a surface by which the nearest one is found without them: those of several sets of points add.
//!
//! Near its minimum a sum of squared distances d is d^T d + 2 g^T s + s^T N s for a step s of the parameters, with
//! N = J^T J and g = J^T d: Gauss and Newton's step -N^-1 g leads there. Kept for each block of neighbours, they also tell
//! how sure the parameters are.

use super::FoundSurface;
use super::measurement::{described, is_at_limit, variance_factor};
use crate::primitive::{BlockEquations, Blocks, Primitive, Uncertainty, Vector, uncertainty_of_equations};
use nalgebra::{DMatrix, DVector};

/// Blocks that are kept, at most: beyond them neighbouring ones are put together. Of so many a standard error is itself
/// known to some 4 %.
const MOST_BLOCKS: usize = 256;

/// Sums over points of one surface.
#[derive(Debug, Clone, PartialEq)]
pub struct SurfaceSums {
    /// Number of the points.
    pub count: usize,
    /// Sum of the squared distances.
    pub squares: f64,
    /// Points whose distance is nearly the largest that counts.
    pub at_limit: usize,
    /// How many times as large a variance is as the blocks tell, by what points on either side of their borders have in
    /// common; the mean over the points.
    pub crossing: f64,
    /// Of each block J^T d, and J^T J row by row.
    pub blocks: Vec<Vec<f64>>,
}

impl SurfaceSums {
    /// Of points about a surface that is near the nearest one, up to a distance from it.
    ///
    /// ```
    /// use surfsig::{fit_primitive, SurfaceKind, SurfaceSums};
    /// let height = |i: i32| 0.01 * f64::from(i * i % 7);
    /// let points: Vec<[f64; 3]> =
    ///     (0..900).map(|i| [f64::from(i % 30), f64::from(i / 30), height(i)]).collect();
    /// let some: Vec<[f64; 3]> = points.iter().copied().step_by(7).collect();
    /// let near = fit_primitive(&some, SurfaceKind::Plane, None).unwrap();
    /// let mut sums = SurfaceSums::new(&near, &points[..500], 0.1);
    /// sums.add(&SurfaceSums::new(&near, &points[500..], 0.1));
    /// let found = sums.fitted(&near).unwrap();
    /// let all = fit_primitive(&points, SurfaceKind::Plane, None).unwrap();
    /// let distance = all.distances(&[found.point])[0];
    /// assert!(distance.abs() < 1e-6 && found.count == 900);
    /// ```
    pub fn new(near: &Primitive, points: &[[f64; 3]], limit: f64) -> Self {
        let points: Vec<Vector> = points.iter().map(|&point| Vector::from(point)).collect();
        let (chart, parameters) = (near.chart(), near.kind.parameters());
        let rows: Vec<_> = points.iter().map(|point| chart.distance_and_derivatives(point)).collect();
        let mut whole = vec![0.0; parameters * (parameters + 1)];
        rows.iter().for_each(|(distance, by)| add_row(&mut whole, parameters, *distance, by));
        let BlockEquations { normal, gradient } = equations(&whole);
        // What the surface is off by, all points have in common: it is no error of theirs.
        let step = normal.cholesky().map(|normal| -normal.solve(&gradient));
        let mut residuals: Vec<f64> = rows.iter().map(|(distance, _)| *distance).collect();
        if let Some(step) = step {
            for (residual, (_, by)) in residuals.iter_mut().zip(&rows) {
                *residual += step.iter().zip(by).map(|(step, by)| step * by).sum::<f64>();
            }
        }
        let cut = Blocks::of_residuals(&points, &residuals, parameters);
        let count = cut.labels.iter().max().map_or(0, |last| last + 1);
        let mut blocks = vec![vec![0.0; parameters * (parameters + 1)]; count];
        for ((distance, by), &label) in rows.iter().zip(&cut.labels) {
            add_row(&mut blocks[label], parameters, *distance, by);
        }
        Self {
            count: points.len(),
            squares: rows.iter().map(|(distance, _)| distance * distance).sum(),
            at_limit: rows.iter().filter(|(distance, _)| is_at_limit(*distance, limit)).count(),
            crossing: cut.crossing,
            blocks,
        }
    }

    /// Adds those of other points, about the same surface.
    pub fn add(&mut self, other: &Self) {
        let count = (self.count + other.count).max(1) as f64;
        self.crossing = (self.count as f64 * self.crossing + other.count as f64 * other.crossing) / count;
        self.count += other.count;
        self.squares += other.squares;
        self.at_limit += other.at_limit;
        self.blocks.extend(other.blocks.iter().cloned());
        while self.blocks.len() > MOST_BLOCKS {
            self.blocks = self.blocks.chunks(2).map(together).collect();
        }
    }

    /// The surface for which the sum of squares is least, and how sure that is, from the one that the sums are about;
    /// `None` where the points do not determine it.
    pub fn fitted(&self, near: &Primitive) -> Option<FoundSurface> {
        let parameters = near.kind.parameters();
        let mut equations: Vec<BlockEquations> = self.blocks.iter().map(|sums| equations(sums)).collect();
        if self.count <= parameters || equations.iter().any(|one| one.gradient.len() != parameters) {
            return None;
        }
        let normal = equations.iter().map(|one| &one.normal).sum::<DMatrix<f64>>();
        let gradient = equations.iter().map(|one| &one.gradient).sum::<DVector<f64>>();
        let step = -normal.cholesky()?.solve(&gradient);
        // d^T d + 2 g^T s + s^T N s, where N s = -g.
        let squares = (self.squares + gradient.dot(&step)).max(0.0);
        for one in &mut equations {
            one.gradient += &one.normal * &step;
        }
        let sure = uncertainty_of_equations(&equations, near.kind.size());
        let sure = sure.map(|sure| Uncertainty {
            covariance: sure.covariance * self.crossing * variance_factor(self.at_limit, self.count),
            ..sure
        });
        let deviation = (squares / (self.count - parameters) as f64).sqrt();
        let fitted = near.chart().moved(step.as_slice()).upward();
        let found = described(&fitted, deviation, Vector::zeros(), sure);
        Some(FoundSurface { count: self.count, ..found })
    }
}

/// Adds a point's distance, and its derivatives, to J^T d and J^T J.
fn add_row(sums: &mut [f64], parameters: usize, distance: f64, by: &[f64]) {
    let (gradient, normal) = sums.split_at_mut(parameters);
    for i in 0..parameters {
        gradient[i] += by[i] * distance;
        for j in 0..parameters {
            normal[parameters * i + j] += by[i] * by[j];
        }
    }
}

/// The sum of neighbouring blocks.
fn together(blocks: &[Vec<f64>]) -> Vec<f64> {
    let mut sum = blocks[0].clone();
    for block in &blocks[1..] {
        sum.iter_mut().zip(block).for_each(|(sum, value)| *sum += value);
    }
    sum
}

fn equations(sums: &[f64]) -> BlockEquations {
    // p + p^2 numbers.
    let parameters = (0..).take_while(|p| p * (p + 1) < sums.len()).count();
    let (gradient, normal) = sums.split_at(parameters.min(sums.len()));
    let entry = |i, j| normal.get(parameters * i + j).copied().unwrap_or(f64::NAN);
    BlockEquations {
        normal: DMatrix::from_fn(parameters, parameters, entry),
        gradient: DVector::from_column_slice(gradient),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fit::samples::Draws;
    use crate::{SurfaceKind, fit_primitive};

    /// Of a pipe of radius 0.5 along x, 20 long.
    fn pipe(count: usize, draws: &mut Draws) -> Vec<[f64; 3]> {
        let place = |_| {
            let (x, turn) = (draws.between(0.0, 20.0), draws.between(0.0, 3.0));
            let away = 0.5 + 0.01 * draws.normal();
            [x, away * turn.cos(), away * turn.sin()]
        };
        (0..count).map(place).collect()
    }

    #[test]
    fn sums_of_parts_give_the_fit_to_all_points() {
        let mut draws = Draws(21);
        let mut points = pipe(8000, &mut draws);
        // Parts lie side by side, as tiles do.
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        let some: Vec<[f64; 3]> = points.iter().copied().step_by(20).collect();
        let near = fit_primitive(&some, SurfaceKind::Cylinder, None).unwrap();
        let all = fit_primitive(&points, SurfaceKind::Cylinder, Some(&near)).unwrap();
        let mut sums = SurfaceSums::new(&near, &points[..1000], 1.0);
        for part in points[1000..].chunks(700) {
            sums.add(&SurfaceSums::new(&near, part, 1.0));
        }
        let found = sums.fitted(&near).unwrap();
        let sure = all.uncertainty(&points);
        let error = sure.covariance[24].sqrt();
        assert!((found.radius - all.radius()).abs() < 0.1 * error, "{} {}", found.radius, all.radius());
        // The largest over several sizes of blocks, which of many small parts is up to 1.6 times as large.
        let ratio = found.radius_std / error;
        assert!((0.8..1.7).contains(&ratio), "{ratio} {}", sums.crossing);
        assert!(all.distances(&[found.point])[0] + 0.5 < 1e-3 * 0.5);
        assert!((found.deviation / 0.01 - 1.0).abs() < 0.03 && found.count == 8000);
        assert!(sums.blocks.len() <= MOST_BLOCKS);
    }

    #[test]
    fn the_radius_errs_as_much_as_sums_say() {
        let mut draws = Draws(22);
        let (mut squares, runs) = (0.0, 200);
        for _ in 0..runs {
            let points = pipe(600, &mut draws);
            let near = fit_primitive(&points[..100], SurfaceKind::Cylinder, None).unwrap();
            let mut sums = SurfaceSums::new(&near, &points[..300], 1.0);
            sums.add(&SurfaceSums::new(&near, &points[300..], 1.0));
            let found = sums.fitted(&near).unwrap();
            squares += ((found.radius - 0.5) / found.radius_std).powi(2);
        }
        let deviation = (squares / f64::from(runs)).sqrt();
        assert!((0.85..1.2).contains(&deviation), "{deviation}");
    }

    #[test]
    fn sums_that_tell_nothing_give_nothing() {
        let plane = fit_primitive(&pipe(50, &mut Draws(23)), SurfaceKind::Plane, None).unwrap();
        assert!(SurfaceSums::new(&plane, &[], 1.0).fitted(&plane).is_none());
        assert!(SurfaceSums::new(&plane, &[[1.0, 2.0, 3.0]; 9], 1.0).fitted(&plane).is_none());
        let broken = SurfaceSums { blocks: vec![vec![1.0; 5]], ..SurfaceSums::new(&plane, &[], 1.0) };
        assert!(SurfaceSums { count: 99, ..broken }.fitted(&plane).is_none());
    }
}
