//! Singular values of a small matrix by one-sided Jacobi rotations.
//!
//! Of our own, since nalgebra's `svd` (0.35) leaves errors of 2e-6 of the largest singular value in the
//! frames' decompositions, at any tolerance, and the smallest are 3e-7 of it. One-sided Jacobi finds
//! small singular values to the precision of their columns.

use nalgebra::DMatrix;

/// Sweeps after which any matrix has converged; eight are usual.
const MAX_SWEEPS: usize = 60;

/// Cosine of the angle between two columns that counts as a right one.
const RIGHT_ANGLE: f64 = 1e-15;

/// Singular values, and left singular vectors as columns, of a square matrix.
pub(super) fn left_singular_vectors(mut matrix: DMatrix<f64>) -> (Vec<f64>, DMatrix<f64>) {
    let columns = matrix.ncols();
    for _ in 0..MAX_SWEEPS {
        let mut turned = false;
        for p in 0..columns {
            for q in p + 1..columns {
                let (a, b) = (matrix.column(p).norm_squared(), matrix.column(q).norm_squared());
                let c = matrix.column(p).dot(&matrix.column(q));
                if c.abs() <= RIGHT_ANGLE * (a * b).sqrt() {
                    continue;
                }
                turned = true;
                let cotangent = (b - a) / (2.0 * c);
                let tangent = cotangent.signum() / (cotangent.abs() + cotangent.hypot(1.0));
                let cosine = 1.0 / tangent.hypot(1.0);
                let sine = tangent * cosine;
                for row in 0..matrix.nrows() {
                    let (x, y) = (matrix[(row, p)], matrix[(row, q)]);
                    matrix[(row, p)] = cosine * x - sine * y;
                    matrix[(row, q)] = sine * x + cosine * y;
                }
            }
        }
        if !turned {
            break;
        }
    }
    let values: Vec<f64> = matrix.column_iter().map(|column| column.norm()).collect();
    for (mut column, &value) in matrix.column_iter_mut().zip(&values) {
        // A column of zeros has no direction; a frame with one fails its check.
        if value > 0.0 {
            column /= value;
        }
    }
    (values, matrix)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn small_singular_values_keep_their_precision() {
        // Q D P with orthonormal Q, P and singular values over nine decades.
        let noise = |seed: f64| DMatrix::from_fn(12, 12, |i, j| (seed * (17 * i + 5 * j + 1) as f64).sin());
        let (q, p) = (noise(1.3).qr().q(), noise(0.7).qr().q());
        let expected: Vec<f64> = (0..12).map(|i| 10f64.powf(-0.75 * f64::from(i))).collect();
        let scaled = DMatrix::from_fn(12, 12, |i, j| q[(i, j)] * expected[j]);
        let (mut values, vectors) = left_singular_vectors(&scaled * p);
        assert!((vectors.transpose() * &vectors - DMatrix::identity(12, 12)).amax() < 1e-7);
        values.sort_by(|a, b| b.total_cmp(a));
        for (value, expected) in values.iter().zip(&expected) {
            assert!((value - expected).abs() < 1e-15 + 1e-7 * expected, "{value} {expected}");
        }
    }
}
