//! Rigid transforms.

use crate::arrays::{array, numbers, points, present, put, room};
use crate::code::{Failure, guarded, surfsig_code};
use surfsig::RigidTransform;

/// A rotation and a translation: a point p of the source is at R p + t of the target. Written T_target_source, so that
/// T_a_b T_b_c = T_a_c.
///
/// The matrix is that of Eigen::Map<const Eigen::Matrix<double, 4, 4, Eigen::RowMajor>>(transform.matrix), and its
/// transpose that of a column-major matrix. A twist is a rotation vector in radians, and then a translation.
#[repr(C)]
#[derive(Clone, Copy)]
pub struct surfsig_transform {
    /// R and t, and 0, 0, 0, 1: 4 x 4, row by row.
    pub matrix: [f64; 16],
}

impl surfsig_transform {
    pub(crate) fn of(transform: &RigidTransform) -> Self {
        let mut matrix = [0.0; 16];
        matrix.copy_from_slice(transform.to_matrix().as_flattened());
        Self { matrix }
    }

    /// NaN where there is none.
    pub(crate) fn or_nan(transform: Option<&RigidTransform>) -> Self {
        transform.map_or(Self { matrix: [f64::NAN; 16] }, Self::of)
    }

    pub(crate) fn checked(&self) -> Result<RigidTransform, Failure> {
        let row = |i: usize| std::array::from_fn(|j| self.matrix[4 * i + j]);
        Ok(RigidTransform::from_matrix(&[row(0), row(1), row(2), row(3)])?)
    }
}

/// The transform that leaves everything where it is.
#[unsafe(no_mangle)]
pub extern "C" fn surfsig_transform_identity() -> surfsig_transform {
    surfsig_transform::of(&RigidTransform::identity())
}

/// Checks a matrix. R^T R may differ from 1 by 1e-4 in each entry, as that of a printed matrix does: then the nearest
/// rotation is taken. A rotation that is exact within 1e-12 keeps its bits. Every function that takes a transform does
/// the same.
///
/// @param matrix 16 doubles, row by row, finite, with 0, 0, 0, 1 in the last row; must neither scale, shear nor mirror.
/// @param transform Where the result is put; may be where the matrix is.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_from_matrix(
    matrix: *const f64,
    transform: *mut surfsig_transform,
) -> surfsig_code {
    // SAFETY: the caller gives 16 numbers, and room for a transform.
    unsafe {
        transformed(transform, || {
            let matrix = present(numbers(matrix), "matrix")?;
            surfsig_transform { matrix }.checked()
        })
    }
}

/// Makes a rotation about an axis through 0, and then a translation.
///
/// @param rotation_vector Along the axis, as long as the angle in radians: 3 doubles, finite; null for none.
/// @param translation 3 doubles, finite; null for none.
/// @param transform Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_from_rotation_vector(
    rotation_vector: *const f64,
    translation: *const f64,
    transform: *mut surfsig_transform,
) -> surfsig_code {
    // SAFETY: the caller gives numbers or null, and room for a transform.
    unsafe {
        transformed(transform, || {
            let rotation = finite(numbers(rotation_vector).unwrap_or_default(), "rotation_vector")?;
            let translation = finite(numbers(translation).unwrap_or_default(), "translation")?;
            Ok(RigidTransform::from_rotation_vector(rotation, translation))
        })
    }
}

/// Makes the transform of a twist: what a motion at this constant velocity, in axes that stay, has made after one unit
/// of time.
///
/// @param twist A rotation vector in radians, and a translation: 6 doubles, finite.
/// @param transform Where the result is put.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_exp(
    twist: *const f64,
    transform: *mut surfsig_transform,
) -> surfsig_code {
    // SAFETY: the caller gives 6 numbers, and room for a transform.
    unsafe {
        transformed(transform, || {
            let twist: [f64; 6] = finite(present(numbers(twist), "twist")?, "twist")?;
            Ok(RigidTransform::exp(twist))
        })
    }
}

/// Gives the twist whose exponential a transform is, with a rotation of pi at most; at pi one of the two.
///
/// @param transform The transform.
/// @param twist Where the rotation vector in radians and the translation are put: 6 doubles.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_log(
    transform: *const surfsig_transform,
    twist: *mut f64,
) -> surfsig_code {
    // SAFETY: the caller gives a transform, and room for 6 numbers.
    guarded(|| unsafe { put(twist.cast(), given(transform, "transform")?.log(), "twist") })
}

/// Gives the matrix that takes twists in the source's axes to the same motions in the target's:
/// T exp(twist) T^-1 = exp(Ad twist).
///
/// @param transform The transform.
/// @param adjoint Where the matrix is put, 6 x 6 doubles, row by row.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_adjoint(
    transform: *const surfsig_transform,
    adjoint: *mut f64,
) -> surfsig_code {
    // SAFETY: the caller gives a transform, and room for 36 numbers.
    guarded(|| unsafe { put(adjoint.cast(), given(transform, "transform")?.adjoint(), "adjoint") })
}

/// Multiplies transforms: T_a_b T_b_c = T_a_c, which applies the second one first.
///
/// @param a_b The transform that is applied last.
/// @param b_c The transform that is applied first.
/// @param a_c Where the product is put; may be one of the two.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_compose(
    a_b: *const surfsig_transform,
    b_c: *const surfsig_transform,
    a_c: *mut surfsig_transform,
) -> surfsig_code {
    // SAFETY: the caller gives two transforms, and room for one.
    unsafe { transformed(a_c, || Ok(given(a_b, "a_b")? * given(b_c, "b_c")?)) }
}

/// Inverts a transform: T_target_source becomes T_source_target.
///
/// @param transform The transform.
/// @param inverse Where the result is put; may be the transform itself.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_inverse(
    transform: *const surfsig_transform,
    inverse: *mut surfsig_transform,
) -> surfsig_code {
    // SAFETY: the caller gives a transform, and room for one.
    unsafe { transformed(inverse, || Ok(given(transform, "transform")?.inverse())) }
}

/// Applies a transform to points: R p + t.
///
/// @param transform The transform.
/// @param points x of the first point; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of points.
/// @param stride Bytes from one point's x to the next one's, at least 24.
/// @param moved Where the results are put, (count, 3) doubles, packed; may be the points themselves where these are
/// packed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_points(
    transform: *const surfsig_transform,
    points: *const f64,
    count: usize,
    stride: usize,
    moved: *mut f64,
) -> surfsig_code {
    // SAFETY: the caller gives a transform, points, and room for as many.
    unsafe { apply(transform, points, count, stride, moved, RigidTransform::transform_point) }
}

/// Applies a transform to vectors, such as normals: R v, without the translation.
///
/// @param transform The transform.
/// @param vectors x of the first vector; its y and z follow it. May have any alignment; null only if count is 0.
/// @param count Number of vectors.
/// @param stride Bytes from one vector's x to the next one's, at least 24.
/// @param rotated Where the results are put, (count, 3) doubles, packed; may be the vectors themselves where these are
/// packed.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn surfsig_transform_vectors(
    transform: *const surfsig_transform,
    vectors: *const f64,
    count: usize,
    stride: usize,
    rotated: *mut f64,
) -> surfsig_code {
    // SAFETY: the caller gives a transform, vectors, and room for as many.
    unsafe { apply(transform, vectors, count, stride, rotated, RigidTransform::transform_vector) }
}

/// # Safety
/// `transform` is null or points to one, `first` is null or points to `count` points that are `stride` bytes apart,
/// `results` is null or points to room for as many.
unsafe fn apply(
    transform: *const surfsig_transform,
    first: *const f64,
    count: usize,
    stride: usize,
    results: *mut f64,
    function: impl Fn(&RigidTransform, [f64; 3]) -> [f64; 3],
) -> surfsig_code {
    guarded(|| {
        // SAFETY: the condition is the same.
        let transform = unsafe { given(transform, "transform") }?;
        let moved: Vec<[f64; 3]> = {
            // SAFETY: the condition is the same; the slice is gone before the results, which may be in its place, are
            // written.
            let rows = unsafe { points(first, count, stride) }?;
            rows.iter().map(|&row| function(&transform, row)).collect()
        };
        // SAFETY: the condition is the same.
        unsafe { room(results.cast::<[f64; 3]>(), count, "results") }?.copy_from_slice(&moved);
        Ok(())
    })
}

/// Puts a transform where the caller wants it.
///
/// # Safety
/// `result` is null or points to where a transform can be written.
unsafe fn transformed(
    result: *mut surfsig_transform,
    work: impl FnOnce() -> Result<RigidTransform, Failure>,
) -> surfsig_code {
    // SAFETY: the condition is the same.
    guarded(|| unsafe { put(result, surfsig_transform::of(&work()?), "the result") })
}

/// # Safety
/// `transform` is null or points to one that nobody changes meanwhile.
unsafe fn given(transform: *const surfsig_transform, name: &str) -> Result<RigidTransform, Failure> {
    // SAFETY: the condition is the same.
    unsafe { array(transform, 1, name) }?[0].checked()
}

/// Numbers of which none is infinite or not a number.
pub(crate) fn finite<const N: usize>(numbers: [f64; N], name: &str) -> Result<[f64; N], Failure> {
    if numbers.iter().all(|number| number.is_finite()) {
        return Ok(numbers);
    }
    Err(Failure::invalid_input(format!("{name} must be finite, not {numbers:?}")))
}
