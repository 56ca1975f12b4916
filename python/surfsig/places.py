"""Places of a cloud at which something is asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud, coordinate_array, plain_array

Query = NDArray[np.uint32] | NDArray[np.float64] | None


def places(
    cloud: PointCloud, at: ArrayLike | None, voxel: float | None
) -> tuple[Query, NDArray[np.int64] | None, NDArray[Any]]:
    """Return the places as the core takes them, their numbers in the cloud, and where they are.

    Parameters
    ----------
    cloud
        Whose points they are.
    at
        Numbers of points (m,), a mask, or places of their own (m, 3); None for every point.
    voxel
        In place of `at`: one point of each voxel of this size.

    Raises
    ------
    InvalidInputError
        If both are given, or have no meaning.
    """
    if at is not None and voxel is not None:
        raise InvalidInputError("at and voxel exclude each other")
    if voxel is not None:
        size = positive_length(voxel, "voxel")
        chosen = _surfsig.voxel_representatives(cloud.offsets, origin=cloud.origin.tolist(), voxel=size)
        return chosen, chosen.astype(np.int64), cloud.points[chosen]
    if at is None:
        return None, np.arange(len(cloud)), cloud.points
    query, indices = _query_places(at, len(cloud))
    return query, indices, query if indices is None else cloud.points[indices]


def _query_places(
    at: ArrayLike, count: int
) -> tuple[NDArray[np.uint32] | NDArray[np.float64], NDArray[np.int64] | None]:
    """Return what the core takes, and the points' numbers where they are points."""
    try:
        array = plain_array(at)
    except ValueError:
        raise InvalidInputError("at must be places (m, 3); its rows differ in length") from None
    if array.ndim == 2:
        return coordinate_array(array, "at").astype(np.float64), None
    indices = place_numbers(array, count).astype(np.int64)
    return indices.astype(np.uint32), indices


def place_numbers(at: ArrayLike | None, count: int) -> NDArray[np.int64]:
    """Return numbers of places from numbers, of which negative ones count from the end, or a mask."""
    if at is None:
        return np.arange(count)
    array = plain_array(at)
    if array.dtype == np.bool_:
        if array.shape != (count,):
            raise InvalidInputError(f"at: a mask must have the shape ({count},), not {array.shape}")
        return np.flatnonzero(array)
    if array.size == 0:
        return np.zeros(0, np.int64)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InvalidInputError(
            f"at must be whole numbers (m,), a mask, or places (m, 3), not {array.dtype} {array.shape}"
        )
    # Before unsigned numbers can wrap round.
    if array.dtype.kind == "u" and array.max() >= count:
        raise InvalidInputError(f"at: index {array.max()} is outside a cloud of {count} points")
    numbers = array.astype(np.int64)
    wrong = (numbers < -count) | (numbers >= count)
    if wrong.any():
        raise InvalidInputError(f"at: index {numbers[wrong][0]} is outside a cloud of {count} points")
    return np.where(numbers < 0, numbers + count, numbers)
