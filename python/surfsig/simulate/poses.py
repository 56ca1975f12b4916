"""Rigid poses: 4 x 4 matrices that place an object in a scene.

``T_scene_object`` maps coordinates in the object's own axes to the scene's. Objects stand upright in their
own axes (``+z`` is up, away from what they rest on); in a scene, up is :data:`UP`, towards the scanner.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import numpy.typing as npt

from ..errors import InvalidInputError
from ..geometry import pose_array, skew

Array = npt.NDArray[np.float64]

#: Direction towards the scanner, in scene axes: heights grow along negative z.
UP = (0.0, 0.0, -1.0)


def unit(direction: Sequence[float] | Array) -> Array:
    """Scale a direction to length 1.

    Parameters
    ----------
    direction : (3,) array_like
        Any vector but zero.

    Returns
    -------
    (3,) ndarray

    Raises
    ------
    InvalidInputError
        If it is not three finite numbers, or all are zero.
    """
    vector = np.asarray(direction, dtype=np.float64)
    length = float(np.linalg.norm(vector)) if vector.shape == (3,) else 0.0
    if not np.isfinite(length) or length == 0.0:
        raise InvalidInputError(f"a direction is three finite numbers, not all zero; got {direction!r}")
    return np.asarray(vector / length)


def turn(axis: Sequence[float] | Array, angle: float) -> Array:
    """Rotation about an axis through the origin, by the right-hand rule.

    Parameters
    ----------
    axis : (3,) array_like
        Direction of the axis, of any length but zero.
    angle : float
        Radians.

    Returns
    -------
    (3, 3) ndarray
    """
    cross = skew(unit(axis))
    return np.asarray(np.eye(3) + np.sin(angle) * cross + (1.0 - np.cos(angle)) * (cross @ cross))


def facing(direction: Sequence[float] | Array) -> Array:
    """Shortest rotation that carries the object's ``+z`` to a direction.

    Parameters
    ----------
    direction : (3,) array_like
        Where the object's ``+z`` is to point, in the target's axes. Straight back (``-z``) is reached by half
        a turn about x.

    Returns
    -------
    (3, 3) ndarray
    """
    target = unit(direction)
    axis = np.cross((0.0, 0.0, 1.0), target)
    sine = float(np.linalg.norm(axis))
    if sine < 1e-12:
        return np.eye(3) if target[2] > 0.0 else np.diag([1.0, -1.0, -1.0])
    return turn(axis, float(np.arctan2(sine, target[2])))


def pose(position: Sequence[float] | Array, rotation: Array | None = None) -> Array:
    """Pose of an object from its position and rotation.

    Parameters
    ----------
    position : (3,) array_like
        Where the object's origin lies, in metres.
    rotation : (3, 3) array, optional
        Columns are the object's axes in the target's; without it the axes coincide.

    Returns
    -------
    (4, 4) ndarray
        T_target_object.
    """
    matrix = np.eye(4)
    matrix[:3, 3] = position
    if rotation is not None:
        matrix[:3, :3] = rotation
    return pose_array(matrix, "pose")
