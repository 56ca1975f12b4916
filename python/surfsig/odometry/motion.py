"""Small motions: (rotation vector, translation), in the axes of what is moved."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def moved(pose: Array, points: Array) -> Array:
    """Move points, (n, 3)."""
    return np.asarray(points @ pose[:3, :3].T + pose[:3, 3])


def small(motion: Array) -> Array:
    """Give the pose of a small motion, (6,)."""
    result = np.eye(4)
    result[:3, :3] = Rotation.from_rotvec(motion[:3]).as_matrix()
    result[:3, 3] = motion[3:]
    return result


def orthonormal(pose: Array) -> Array:
    """Take away what rounding has made of a rotation that is the product of many."""
    result = pose.copy()
    result[:3, :3] = Rotation.from_matrix(pose[:3, :3]).as_matrix()
    return result


def adjoint(pose: Array) -> Array:
    """Give the matrix (6, 6) that takes small motions of b into those of a, by T_a_b."""
    rotation, (x, y, z) = pose[:3, :3], pose[:3, 3]
    result = np.zeros((6, 6))
    result[:3, :3] = result[3:, 3:] = rotation
    result[3:, :3] = np.array([[0.0, -z, y], [z, 0.0, -x], [-y, x, 0.0]]) @ rotation
    return result


def turned_by(pose: Array) -> float:
    """Give the angle of a pose's rotation, in radians."""
    return float(Rotation.from_matrix(pose[:3, :3]).magnitude())
