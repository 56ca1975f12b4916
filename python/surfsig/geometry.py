"""Rigid transforms and directions: the one place where they are made, checked, inverted and applied.

A transform is a matrix (4, 4) named by its frames: ``T_target_source`` takes a point p of the source to R p +
t of the target, so that ``T_a_b @ T_b_c`` is ``T_a_c``. A twist is (6,): a rotation vector in radians, then a
translation. The core's `RigidTransform` has the same conventions. Here all is NumPy: inverting a pose takes
6 microseconds, no more than a call of the core, and moving many points is one matrix product.
"""

from __future__ import annotations

import numpy as np
import scipy
from numpy.typing import ArrayLike, NDArray

from surfsig.errors import InvalidInputError

Array = NDArray[np.float64]

_ROTATION_TOLERANCE = 1e-4
"""Largest entry of R^T R - 1 at which a matrix counts as a rotation: what is left of one that was printed
with four decimals."""
_ROUNDING = 1e-12
"""The same, up to which a rotation is as good as float64 makes it and keeps its bits."""
_SMALL_ANGLE = 0.1
"""Radians below which the coefficients of `exp_twist` and `log_pose` are taken from their series, whose first
left-out term is then below the rounding of float64."""


def pose_array(value: ArrayLike, name: str) -> Array:
    """Check a pose that somebody gives.

    Parameters
    ----------
    value
        A matrix (4, 4). Its rotation may be off by 1e-4, as a printed one is: then a rotation next to it is
        taken.
    name
        What it is called, for the message.

    Returns
    -------
    (4, 4) float64.

    Raises
    ------
    InvalidInputError
        If it is no rotation and translation; its text says why.
    """
    try:
        pose = np.asarray(value, np.float64)
    except (TypeError, ValueError):
        pose = None
    cause = "it is no array of numbers" if pose is None else _what_is_wrong(pose)
    if pose is None or cause is not None:
        raise InvalidInputError(f"{name} must be a pose (4, 4) of a rotation and a translation: {cause}")
    is_exact = np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max() <= _ROUNDING
    return pose if is_exact else orthonormal(pose)


def _what_is_wrong(pose: Array) -> str | None:
    if pose.shape != (4, 4):
        return f"its shape is {pose.shape}"
    if not np.isfinite(pose).all():
        return "it is not finite"
    if (pose[3] != (0.0, 0.0, 0.0, 1.0)).any():
        return "its last row is not 0, 0, 0, 1"
    deviation = float(np.abs(pose[:3, :3].T @ pose[:3, :3] - np.eye(3)).max())
    if deviation > _ROTATION_TOLERANCE:
        return f"it scales or shears (R^T R differs from 1 by {deviation:.1g})"
    return "it mirrors" if np.linalg.det(pose[:3, :3]) < 0.0 else None


def orthonormal(pose: Array) -> Array:
    """Take away what rounding has made of a rotation that is the product of many.

    Parameters
    ----------
    pose
        (4, 4), nearly a pose.

    Returns
    -------
    (4, 4): a pose.
    """
    result = pose.copy()
    result[:3, :3] = scipy.spatial.transform.Rotation.from_matrix(pose[:3, :3]).as_matrix()
    return result


def inverse(poses: Array) -> Array:
    """Invert poses, exactly in their rotations.

    Parameters
    ----------
    poses
        T_target_source, (4, 4), or many, (..., 4, 4).

    Returns
    -------
    T_source_target, of the same shape.
    """
    back = np.zeros_like(poses)
    back[..., :3, :3] = poses[..., :3, :3].swapaxes(-1, -2)
    back[..., :3, 3] = -np.einsum("...ij,...j->...i", back[..., :3, :3], poses[..., :3, 3])
    back[..., 3, 3] = 1.0
    return back


def transform_points(pose: Array, points: NDArray[np.floating]) -> Array:
    """Take points from the source to the target.

    Parameters
    ----------
    pose
        T_target_source, (4, 4).
    points
        (n, 3) or (3,), in the source.

    Returns
    -------
    The same shape, in the target.
    """
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def rotate(pose: Array, vectors: NDArray[np.floating]) -> Array:
    """Take vectors from the source to the target: rotated, not translated; normals are such vectors.

    Parameters
    ----------
    pose
        T_target_source, (4, 4).
    vectors
        (n, 3) or (3,), in the source.

    Returns
    -------
    The same shape, in the target.
    """
    return np.asarray(vectors @ pose[:3, :3].T)


def from_translation(translation: Array) -> Array:
    """Give the pose that only translates.

    Parameters
    ----------
    translation
        (3,).

    Returns
    -------
    (4, 4).
    """
    pose = np.eye(4)
    pose[:3, 3] = translation
    return pose


def from_rotation_vector(rotation_vector: Array, translation: Array) -> Array:
    """Give poses that rotate about 0 and then translate.

    The translation is made as it is given, unlike that of `exp_twist`.

    Parameters
    ----------
    rotation_vector
        Along the axis, as long as the angle in radians; (3,), or many, (n, 3).
    translation
        (3,), or many, (n, 3).

    Returns
    -------
    (4, 4), or (n, 4, 4).
    """
    pose = np.zeros((*np.shape(rotation_vector)[:-1], 4, 4))
    pose[..., :3, :3] = scipy.spatial.transform.Rotation.from_rotvec(rotation_vector).as_matrix()
    pose[..., :3, 3] = translation
    pose[..., 3, 3] = 1.0
    return pose


def about(center: Array, rotation_vector: Array, translation: Array) -> Array:
    """Give the pose that rotates about a centre and then translates.

    Parameters
    ----------
    center
        Where the rotation leaves what is there, (3,).
    rotation_vector
        Along the axis, as long as the angle in radians, (3,).
    translation
        (3,).

    Returns
    -------
    (4, 4).
    """
    pose = from_rotation_vector(rotation_vector, translation)
    pose[:3, 3] = center - pose[:3, :3] @ center + translation
    return pose


def exp_twist(twist: Array) -> Array:
    """Give the pose of a twist: the motion after one unit of time at this constant velocity.

    Parameters
    ----------
    twist
        Rotation vector in radians, then translation: (6,), or many, (n, 6).

    Returns
    -------
    (4, 4), or (n, 4, 4).
    """
    vector, velocity = twist[..., :3], twist[..., 3:]
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    square = angle * angle
    is_small = angle < _SMALL_ANGLE
    large = np.where(is_small, 1.0, angle)
    first = np.where(
        is_small,
        _series(square, 1 / 2, -1 / 24, 1 / 720, -1 / 40_320, 1 / 3_628_800),
        2.0 * np.sin(0.5 * large) ** 2 / large**2,
    )
    second = np.where(
        is_small,
        _series(square, 1 / 6, -1 / 120, 1 / 5040, -1 / 362_880, 1 / 39_916_800),
        (large - np.sin(large)) / large**3,
    )
    along = np.cross(vector, velocity)
    return from_rotation_vector(vector, velocity + first * along + second * np.cross(vector, along))


def log_pose(pose: Array) -> Array:
    """Give the twist of a pose, with a rotation of pi at most: `exp_twist` of it is the pose.

    Parameters
    ----------
    pose
        (4, 4), or many, (n, 4, 4).

    Returns
    -------
    (6,), or (n, 6): rotation vector in radians, then translation.
    """
    vector = scipy.spatial.transform.Rotation.from_matrix(pose[..., :3, :3]).as_rotvec()
    translation = pose[..., :3, 3]
    angle = np.linalg.norm(vector, axis=-1, keepdims=True)
    square = angle * angle
    is_small = angle < _SMALL_ANGLE
    large = np.where(is_small, 1.0, angle)
    coefficient = np.where(
        is_small,
        _series(square, 1 / 12, 1 / 720, 1 / 30_240, 1 / 1_209_600, 1 / 47_900_160),
        (1.0 - 0.5 * large / np.tan(0.5 * large)) / large**2,
    )
    along = np.cross(vector, translation)
    velocity = translation - 0.5 * along + coefficient * np.cross(vector, along)
    return np.concatenate([vector, velocity], axis=-1)


def _series(x: Array, *coefficients: float) -> Array:
    """Evaluate a polynomial, by Horner's rule."""
    result = np.zeros_like(x)
    for coefficient in reversed(coefficients):
        result = result * x + coefficient
    return result


def adjoint(pose: Array) -> Array:
    """Give the matrix that takes twists in the source's axes to the same motions in the target's.

    T exp(twist) T^-1 = exp(adjoint(T) twist).

    Parameters
    ----------
    pose
        T_target_source, (4, 4), or many, (n, 4, 4).

    Returns
    -------
    (6, 6), or (n, 6, 6).
    """
    rotation = pose[..., :3, :3]
    result = np.zeros((*pose.shape[:-2], 6, 6))
    result[..., :3, :3] = result[..., 3:, 3:] = rotation
    result[..., 3:, :3] = skew(pose[..., :3, 3]) @ rotation
    return result


def rotation_angle(pose: Array) -> float:
    """Give the angle of a pose's rotation.

    Parameters
    ----------
    pose
        (4, 4).

    Returns
    -------
    Radians, 0 to pi.
    """
    return float(scipy.spatial.transform.Rotation.from_matrix(pose[:3, :3]).magnitude())


def skew(vector: Array) -> Array:
    """Give the matrix of the cross product: ``skew(a) @ b`` is a x b.

    Parameters
    ----------
    vector
        (3,), or many, (n, 3).

    Returns
    -------
    (3, 3), or (n, 3, 3).
    """
    result = np.zeros((*vector.shape, 3))
    for k in range(3):
        result[..., (k + 2) % 3, (k + 1) % 3] = vector[..., k]
        result[..., (k + 1) % 3, (k + 2) % 3] = -vector[..., k]
    return result


def axes_across(direction: Array) -> tuple[Array, Array]:
    """Give two unit vectors u and v square to unit directions d and to each other, right-handed: u x v = d.

    u is d x e, scaled to length 1, where e is the coordinate axis that is farthest from d (the first of
    several), and v is d x u. The same direction always gives the same axes. Where another coordinate becomes
    the smallest they jump, near a coordinate axis by a quarter turn; no choice is continuous for all
    directions. The core makes the same one.

    Parameters
    ----------
    direction
        (3,), or many, (n, 3); unit vectors.

    Returns
    -------
    Two arrays of the same shape.
    """
    first = np.cross(direction, np.eye(3)[np.abs(direction).argmin(axis=-1)])
    first /= np.linalg.norm(first, axis=-1, keepdims=True)
    return first, np.cross(direction, first)


def fit_transform(source: Array, target: Array) -> Array:
    """Fit the pose that takes points to others with the least sum of squares (Kabsch).

    Parameters
    ----------
    source, target
        (n, 3), at least three pairs that are not on a line.

    Returns
    -------
    T_target_source, (4, 4).
    """
    ours, theirs = source.mean(axis=0), target.mean(axis=0)
    rotation, _ = scipy.spatial.transform.Rotation.align_vectors(target - theirs, source - ours)
    pose = np.eye(4)
    pose[:3, :3] = rotation.as_matrix()
    pose[:3, 3] = theirs - pose[:3, :3] @ ours
    return pose
