"""Places of a cloud at which something is asked for."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, query_places
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud

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
    query, indices = query_places(at, len(cloud))
    return query, indices, query if indices is None else cloud.points[indices]
