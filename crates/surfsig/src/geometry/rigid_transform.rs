//! Rigid transforms: a rotation and a translation.

use nalgebra::{Matrix3, Matrix4, Quaternion, Rotation3, UnitQuaternion, Vector3};
use std::ops::Mul;

/// Largest entry of R^T R - 1 at which a matrix counts as a rotation: what is left of one that was printed with four
/// decimals.
const ROTATION_TOLERANCE: f64 = 1e-4;
/// The same, up to which a rotation is as good as float64 makes it and its bits are kept.
const ROUNDING: f64 = 1e-12;
/// Radians below which the coefficients of the exponential and of the logarithm are taken from their series, whose
/// first left-out term is then below the rounding of float64.
const SMALL_ANGLE: f64 = 0.1;

/// Why a matrix is no rigid transform.
///
/// ```
/// use surfsig::{RigidTransform, TransformError};
///
/// let mut matrix = RigidTransform::identity().to_matrix();
/// matrix[2][2] = -1.0;
/// assert_eq!(RigidTransform::from_matrix(&matrix), Err(TransformError::Mirrored));
/// ```
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
#[non_exhaustive]
pub enum TransformError {
    /// An entry is infinite or not a number.
    #[error("a transform must have finite entries")]
    NotFinite,
    /// The last row is another one.
    #[error("a transform must have 0, 0, 0, 1 in its last row")]
    LastRow,
    /// The columns are not unit vectors at right angles: the matrix scales or shears.
    #[error(
        "a transform must rotate and translate, not scale or shear: R^T R differs from 1 by {deviation:.1e}"
    )]
    NotARotation {
        /// Largest entry of R^T R - 1.
        deviation: f64,
    },
    /// The determinant is -1.
    #[error("a transform must rotate and translate, not mirror")]
    Mirrored,
}

/// A rotation and a translation in float64: a point p of the source is at R p + t of the target.
///
/// Written T_target_source, so that T_a_b * T_b_c = T_a_c. Twists are a rotation vector in radians and then a
/// translation.
///
/// ```
/// use surfsig::RigidTransform;
///
/// // A quarter turn about z, and one along x.
/// let quarter = std::f64::consts::FRAC_PI_2;
/// let transform = RigidTransform::from_rotation_vector([0.0, 0.0, quarter], [1.0, 0.0, 0.0]);
/// let moved = transform.transform_point([1.0, 0.0, 5.0]);
/// assert!(moved.iter().zip([1.0, 1.0, 5.0]).all(|(a, b)| (a - b).abs() < 1e-15));
/// ```
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigidTransform {
    pub(crate) rotation: Matrix3<f64>,
    pub(crate) translation: Vector3<f64>,
}

impl RigidTransform {
    /// The transform that leaves everything where it is.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    /// assert_eq!(RigidTransform::identity().transform_point([1.0, 2.0, 3.0]), [1.0, 2.0, 3.0]);
    /// ```
    pub fn identity() -> Self {
        Self { rotation: Matrix3::identity(), translation: Vector3::zeros() }
    }

    /// A matrix, row by row.
    ///
    /// R^T R may differ from 1 by 1e-4 in each entry, as that of a printed matrix does: then the nearest rotation is
    /// taken. A rotation that is exact within 1e-12 keeps its bits.
    ///
    /// # Errors
    /// If the matrix is not finite, its last row is not 0, 0, 0, 1, or it scales, shears or mirrors.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let matrix = [[0.0, -1.0, 0.0, 2.0], [1.0, 0.0, 0.0, 3.0], [0.0, 0.0, 1.0, 4.0], [0.0, 0.0, 0.0, 1.0]];
    /// let transform = RigidTransform::from_matrix(&matrix)?;
    /// assert_eq!(transform.transform_point([1.0, 0.0, 0.0]), [2.0, 4.0, 4.0]);
    /// # Ok::<(), surfsig::TransformError>(())
    /// ```
    pub fn from_matrix(matrix: &[[f64; 4]; 4]) -> Result<Self, TransformError> {
        if !matrix.iter().flatten().all(|entry| entry.is_finite()) {
            return Err(TransformError::NotFinite);
        }
        if matrix[3] != [0.0, 0.0, 0.0, 1.0] {
            return Err(TransformError::LastRow);
        }
        let rotation = Matrix3::from_fn(|row, column| matrix[row][column]);
        let deviation = (rotation.transpose() * rotation - Matrix3::identity()).amax();
        if deviation > ROTATION_TOLERANCE {
            return Err(TransformError::NotARotation { deviation });
        }
        if rotation.determinant() < 0.0 {
            return Err(TransformError::Mirrored);
        }
        let translation = Vector3::from_fn(|row, _| matrix[row][3]);
        let rotation = if deviation > ROUNDING { nearest_rotation(&rotation) } else { rotation };
        Ok(Self { rotation, translation })
    }

    /// The matrix, row by row.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let matrix = RigidTransform::from_rotation_vector([0.0; 3], [1.0, 2.0, 3.0]).to_matrix();
    /// assert_eq!([matrix[0][3], matrix[1][3], matrix[2][3], matrix[3][3]], [1.0, 2.0, 3.0, 1.0]);
    /// ```
    pub fn to_matrix(&self) -> [[f64; 4]; 4] {
        let (r, t) = (&self.rotation, &self.translation);
        let row = |i: usize| [r[(i, 0)], r[(i, 1)], r[(i, 2)], t[i]];
        [row(0), row(1), row(2), [0.0, 0.0, 0.0, 1.0]]
    }

    /// A rotation about an axis through 0 by the length of a vector along it, in radians; then a translation.
    ///
    /// The translation is made as it is given, unlike that of [`RigidTransform::exp`].
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let half_turn = RigidTransform::from_rotation_vector([0.0, 0.0, std::f64::consts::PI], [0.0, 0.0, 1.0]);
    /// let moved = half_turn.transform_point([1.0, 0.0, 0.0]);
    /// assert!(moved.iter().zip([-1.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-15));
    /// ```
    pub fn from_rotation_vector(rotation_vector: [f64; 3], translation: [f64; 3]) -> Self {
        let vector = Vector3::from(rotation_vector);
        let (sine, cosine, _) = exponential_coefficients(vector.norm());
        let cross = vector.cross_matrix();
        let rotation = Matrix3::identity() + cross * sine + cross * cross * cosine;
        Self { rotation, translation: translation.into() }
    }

    /// The rotation of [`RigidTransform::from_rotation_vector`], about a centre, and then the translation.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let transform = RigidTransform::about([1.0, 2.0, 3.0], [0.3, -0.2, 0.1], [0.0, 0.0, 1.0]);
    /// let moved = transform.transform_point([1.0, 2.0, 3.0]);
    /// assert!(moved.iter().zip([1.0, 2.0, 4.0]).all(|(a, b)| (a - b).abs() < 1e-15));
    /// ```
    pub fn about(center: [f64; 3], rotation_vector: [f64; 3], translation: [f64; 3]) -> Self {
        let turned = Self::from_rotation_vector(rotation_vector, translation);
        let center = Vector3::from(center);
        Self { translation: center - turned.rotation * center + turned.translation, ..turned }
    }

    /// The transform that takes points to others with the least sum of squared distances.
    ///
    /// By the unit quaternion of Horn (Closed-form solution of absolute orientation using unit quaternions, 1987), so
    /// that nothing is mirrored; at least three pairs that are not on a line determine it.
    ///
    /// # Panics
    /// If there is not one target for each source.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let truth = RigidTransform::from_rotation_vector([0.3, -0.2, 2.5], [1.0, 2.0, 3.0]);
    /// let source = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 2.0, 0.0], [0.5, 0.0, 1.0]];
    /// let found = RigidTransform::from_correspondences(&source, &truth.transform_points(&source));
    /// assert!((truth.inverse() * found).log().iter().all(|component| component.abs() < 1e-12));
    /// ```
    pub fn from_correspondences(source: &[[f64; 3]], target: &[[f64; 3]]) -> Self {
        assert_eq!(source.len(), target.len(), "one target for each source");
        let mean = |points: &[[f64; 3]]| {
            points.iter().map(|point| Vector3::from(*point)).sum::<Vector3<f64>>()
                / points.len().max(1) as f64
        };
        let (ours, theirs) = (mean(source), mean(target));
        let products = source
            .iter()
            .zip(target)
            .map(|(a, b)| (Vector3::from(*a) - ours) * (Vector3::from(*b) - theirs).transpose());
        let m = products.sum::<Matrix3<f64>>();
        let trace = m.trace();
        let mut quadratic = Matrix4::zeros();
        quadratic[(0, 0)] = trace;
        for i in 0..3 {
            let (j, k) = ((i + 1) % 3, (i + 2) % 3);
            quadratic[(0, i + 1)] = m[(j, k)] - m[(k, j)];
            quadratic[(i + 1, 0)] = quadratic[(0, i + 1)];
            for l in 0..3 {
                quadratic[(i + 1, l + 1)] = m[(i, l)] + m[(l, i)] - if i == l { trace } else { 0.0 };
            }
        }
        let eigen = quadratic.symmetric_eigen();
        let q = eigen.eigenvectors.column(eigen.eigenvalues.imax());
        let quaternion = UnitQuaternion::from_quaternion(Quaternion::new(q[0], q[1], q[2], q[3]));
        let rotation = *quaternion.to_rotation_matrix().matrix();
        Self { rotation, translation: theirs - rotation * ours }
    }

    /// The transform that takes the target back to the source.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let transform = RigidTransform::from_rotation_vector([0.3, -0.2, 0.1], [1.0, 2.0, 3.0]);
    /// let back = transform.inverse().transform_point(transform.transform_point([4.0, 5.0, 6.0]));
    /// assert!(back.iter().zip([4.0, 5.0, 6.0]).all(|(a, b)| (a - b).abs() < 1e-14));
    /// ```
    #[must_use]
    pub fn inverse(&self) -> Self {
        let rotation = self.rotation.transpose();
        Self { rotation, translation: -(rotation * self.translation) }
    }

    /// Where a point is in the target.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let transform = RigidTransform::from_rotation_vector([0.0; 3], [1.0, 2.0, 3.0]);
    /// assert_eq!(transform.transform_point([1.0, 1.0, 1.0]), [2.0, 3.0, 4.0]);
    /// ```
    pub fn transform_point(&self, point: [f64; 3]) -> [f64; 3] {
        (self.rotation * Vector3::from(point) + self.translation).into()
    }

    /// Where many points are in the target.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let transform = RigidTransform::from_rotation_vector([0.0; 3], [0.0, 0.0, 3.0]);
    /// let moved = transform.transform_points(&[[0.0; 3], [1.0, 1.0, 1.0]]);
    /// assert_eq!(moved, [[0.0, 0.0, 3.0], [1.0, 1.0, 4.0]]);
    /// ```
    pub fn transform_points(&self, points: &[[f64; 3]]) -> Vec<[f64; 3]> {
        points.iter().map(|&point| self.transform_point(point)).collect()
    }

    /// What a vector is in the target: rotated, not translated. Normals are such vectors.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let transform = RigidTransform::from_rotation_vector([0.0; 3], [1.0, 2.0, 3.0]);
    /// assert_eq!(transform.transform_vector([0.0, 0.0, 1.0]), [0.0, 0.0, 1.0]);
    /// ```
    pub fn transform_vector(&self, vector: [f64; 3]) -> [f64; 3] {
        (self.rotation * Vector3::from(vector)).into()
    }

    /// The transform of a twist: what a motion at this constant velocity, in axes that stay, has made after one unit
    /// of time.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// // A screw about z: half a turn while going up by one.
    /// let screw = RigidTransform::exp([0.0, 0.0, std::f64::consts::PI, 0.0, 0.0, 1.0]);
    /// let moved = screw.transform_point([1.0, 0.0, 0.0]);
    /// assert!(moved.iter().zip([-1.0, 0.0, 1.0]).all(|(a, b)| (a - b).abs() < 1e-15));
    /// ```
    pub fn exp(twist: [f64; 6]) -> Self {
        let [x, y, z, velocity @ ..] = twist;
        let vector = Vector3::new(x, y, z);
        let (_, cosine, rest) = exponential_coefficients(vector.norm());
        let cross = vector.cross_matrix();
        let velocity = Vector3::from(velocity);
        let along = cross * velocity;
        let translation = velocity + along * cosine + cross * along * rest;
        Self::from_rotation_vector([x, y, z], translation.into())
    }

    /// The twist whose exponential this is, with a rotation of pi at most; at pi one of the two.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// let twist = [0.3, -0.2, 0.1, 1.0, 2.0, 3.0];
    /// let back = RigidTransform::exp(twist).log();
    /// assert!(back.iter().zip(twist).all(|(a, b)| (a - b).abs() < 1e-14));
    /// ```
    pub fn log(&self) -> [f64; 6] {
        let rotation = Rotation3::from_matrix_unchecked(self.rotation);
        let quaternion = UnitQuaternion::from_rotation_matrix(&rotation);
        // A quaternion and its negative are one rotation: that of the smaller angle is taken.
        let sign = if quaternion.w < 0.0 { -1.0 } else { 1.0 };
        let (scalar, imaginary) = (sign * quaternion.w, sign * quaternion.imag());
        let sine = imaginary.norm();
        let vector = if sine > 0.0 { imaginary * (2.0 * sine.atan2(scalar) / sine) } else { imaginary };
        let along = vector.cross(&self.translation);
        let coefficient = logarithm_coefficient(vector.norm());
        let velocity = self.translation - 0.5 * along + coefficient * vector.cross(&along);
        [vector.x, vector.y, vector.z, velocity.x, velocity.y, velocity.z]
    }

    /// The root mean square of the distances between points after this transform and after another; 0 of no points.
    ///
    /// ```
    /// use surfsig::RigidTransform;
    /// let shift = RigidTransform::from_rotation_vector([0.0; 3], [3.0, 4.0, 0.0]);
    /// assert_eq!(shift.displacement_from(&RigidTransform::identity(), [[1.0; 3], [2.0; 3]]), 5.0);
    /// ```
    pub fn displacement_from(&self, other: &Self, points: impl IntoIterator<Item = [f64; 3]>) -> f64 {
        let (rotation, translation) = (self.rotation - other.rotation, self.translation - other.translation);
        let (mut sum, mut count) = (0.0, 0_usize);
        for point in points {
            sum += (rotation * Vector3::from(point) + translation).norm_squared();
            count += 1;
        }
        (sum / count.max(1) as f64).sqrt()
    }

    /// The matrix, row by row, that takes twists in the source's axes to the same motions in the target's:
    /// T exp(twist) T^-1 = exp(Ad twist).
    ///
    /// ```
    /// use surfsig::RigidTransform;
    ///
    /// // A turn about an axis through 0 also translates what is elsewhere.
    /// let adjoint = RigidTransform::from_rotation_vector([0.0; 3], [1.0, 0.0, 0.0]).adjoint();
    /// assert_eq!(adjoint.map(|row| row[2]), [0.0, 0.0, 1.0, 0.0, -1.0, 0.0]);
    /// ```
    pub fn adjoint(&self) -> [[f64; 6]; 6] {
        let lower = self.translation.cross_matrix() * self.rotation;
        let entry = |row: usize, column: usize| match (row < 3, column < 3) {
            (true, true) => self.rotation[(row, column)],
            (false, false) => self.rotation[(row - 3, column - 3)],
            (false, true) => lower[(row - 3, column)],
            (true, false) => 0.0,
        };
        std::array::from_fn(|row| std::array::from_fn(|column| entry(row, column)))
    }
}

/// Applies the right transform first: T_a_b * T_b_c = T_a_c.
///
/// ```
/// use surfsig::RigidTransform;
///
/// let up = RigidTransform::from_rotation_vector([0.0; 3], [0.0, 0.0, 1.0]);
/// assert_eq!((up * up).transform_point([0.0; 3]), [0.0, 0.0, 2.0]);
/// ```
impl Mul for RigidTransform {
    type Output = Self;

    fn mul(self, first: Self) -> Self {
        Self {
            rotation: self.rotation * first.rotation,
            translation: self.rotation * first.translation + self.translation,
        }
    }
}

/// The rotation that differs least from a matrix: the orthogonal part of its polar decomposition.
fn nearest_rotation(matrix: &Matrix3<f64>) -> Matrix3<f64> {
    let parts = matrix.svd(true, true);
    match (parts.u, parts.v_t) {
        (Some(u), Some(v_t)) => u * v_t,
        _ => *matrix,
    }
}

/// sin(a) / a, (1 - cos(a)) / a^2 and (a - sin(a)) / a^3 of an angle.
fn exponential_coefficients(angle: f64) -> (f64, f64, f64) {
    let square = angle * angle;
    if angle < SMALL_ANGLE {
        return (
            series(square, &[1.0, -1.0 / 6.0, 1.0 / 120.0, -1.0 / 5040.0, 1.0 / 362_880.0]),
            series(square, &[0.5, -1.0 / 24.0, 1.0 / 720.0, -1.0 / 40_320.0, 1.0 / 3_628_800.0]),
            series(square, &[1.0 / 6.0, -1.0 / 120.0, 1.0 / 5040.0, -1.0 / 362_880.0, 1.0 / 39_916_800.0]),
        );
    }
    let half = (0.5 * angle).sin();
    (angle.sin() / angle, 2.0 * half * half / square, (angle - angle.sin()) / (square * angle))
}

/// (1 - (a / 2) cot(a / 2)) / a^2 of an angle.
fn logarithm_coefficient(angle: f64) -> f64 {
    let square = angle * angle;
    if angle < SMALL_ANGLE {
        return series(
            square,
            &[1.0 / 12.0, 1.0 / 720.0, 1.0 / 30_240.0, 1.0 / 1_209_600.0, 1.0 / 47_900_160.0],
        );
    }
    let (sine, cosine) = (0.5 * angle).sin_cos();
    (1.0 - 0.5 * angle * cosine / sine) / square
}

/// A polynomial, by Horner's rule.
fn series(x: f64, coefficients: &[f64]) -> f64 {
    coefficients.iter().rev().fold(0.0, |sum, coefficient| sum * x + coefficient)
}

#[cfg(test)]
mod tests;
