//! Normal equations of six unknowns, solved in the directions that they determine.

use nalgebra::{Matrix6, Vector6};

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
