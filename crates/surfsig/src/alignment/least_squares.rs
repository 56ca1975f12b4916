//! Normal equations of six unknowns, solved in the directions that they determine.

use crate::geometry::RigidTransform;
use nalgebra::{Matrix6, Vector3, Vector6};

/// Distances of points along normals, linearised: how each changes with a small twist about the points' centre.
pub(crate) struct LinearisedDistances {
    pub center: Vector3<f64>,
    /// Rotations in units of this length move points as far as translations do.
    pub unit: f64,
    /// A row for each point: (p - center) / unit x n, and n.
    pub design: Vec<[f64; 6]>,
    /// The sum of the rows' outer products.
    pub information: Matrix6<f64>,
    gradient: Vector6<f64>,
}

impl LinearisedDistances {
    /// Takes a point, a unit normal and a distance along it for each row.
    pub fn new(rows: &[(Vector3<f64>, Vector3<f64>, f64)]) -> Self {
        let count = rows.len().max(1) as f64;
        let center = rows.iter().map(|(point, ..)| point).sum::<Vector3<f64>>() / count;
        let square = rows.iter().map(|(point, ..)| (point - center).norm_squared()).sum::<f64>() / count;
        let unit = if square > 0.0 { square.sqrt() } else { 1.0 };
        let row = |(point, normal, _): &(Vector3<f64>, Vector3<f64>, f64)| -> [f64; 6] {
            let rotational = ((point - center) / unit).cross(normal);
            [rotational.x, rotational.y, rotational.z, normal.x, normal.y, normal.z]
        };
        let design: Vec<[f64; 6]> = rows.iter().map(row).collect();
        let (mut information, mut gradient) = (Matrix6::zeros(), Vector6::zeros());
        for (row, (.., distance)) in design.iter().zip(rows) {
            let row = Vector6::from(*row);
            information += row * row.transpose();
            gradient += row * *distance;
        }
        Self { center, unit, design, information, gradient }
    }

    /// The motion that makes the sum of squares least, without a part in directions that are not determined, and its
    /// length, in the unit of the points.
    pub fn step(&self, least_share: f64) -> (RigidTransform, f64) {
        let change = -solve_determined(self.information, &self.gradient, least_share);
        let [x, y, z, translation @ ..] = <[f64; 6]>::from(change);
        let rotation_vector = [x, y, z].map(|angle| angle / self.unit);
        (RigidTransform::about(self.center.into(), rotation_vector, translation), change.norm())
    }
}

/// The eigenvalues of a symmetric matrix that are above a share of the largest, with their directions.
fn determined(matrix: Matrix6<f64>, least_share: f64) -> Vec<(f64, Vector6<f64>)> {
    let eigen = matrix.symmetric_eigen();
    let least = least_share * eigen.eigenvalues.amax();
    let pairs = eigen.eigenvalues.iter().zip(eigen.eigenvectors.column_iter());
    pairs.filter(|(value, _)| **value > least).map(|(value, vector)| (*value, vector.into_owned())).collect()
}

/// The x of A x = b without a part in directions whose eigenvalue is at most `least_share` of the largest.
pub(crate) fn solve_determined(matrix: Matrix6<f64>, right: &Vector6<f64>, least_share: f64) -> Vector6<f64> {
    determined(matrix, least_share)
        .iter()
        .map(|(value, direction)| direction * (direction.dot(right) / value))
        .sum()
}

/// The inverse in those directions; 0 in the others.
pub(crate) fn pseudo_inverse(matrix: Matrix6<f64>, least_share: f64) -> Matrix6<f64> {
    determined(matrix, least_share)
        .iter()
        .map(|(value, direction)| direction * direction.transpose() / *value)
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_is_not_determined_stays_zero() {
        let matrix = Matrix6::from_diagonal(&Vector6::new(1.0, 2.0, 4.0, 1e-9, 8.0, 0.0));
        let solution = solve_determined(matrix, &Vector6::repeat(8.0), 1e-6);
        assert_eq!(solution, Vector6::new(8.0, 4.0, 2.0, 0.0, 1.0, 0.0));
        let inverse = pseudo_inverse(matrix, 1e-6);
        assert_eq!(inverse.diagonal(), Vector6::new(1.0, 0.5, 0.25, 0.0, 0.125, 0.0));
        assert_eq!(solve_determined(Matrix6::zeros(), &Vector6::repeat(1.0), 1e-6), Vector6::zeros());
    }
}
