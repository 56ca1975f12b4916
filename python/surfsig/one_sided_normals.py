"""Which side of a surface is which, where nobody knows where the sensor stood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]


def one_sided_normals(cloud: PointCloud, voxel: float, threads: int | None) -> Array:
    """Give normals (n, 3) that are on one side of each piece of surface, which side is open.

    The side is handed on from neighbour to neighbour, where normals differ least first (Hoppe et al., Surface
    reconstruction from unorganized points, 1992).
    """
    points = np.ascontiguousarray(cloud.points, np.float64)
    return _surfsig.consistent_directions(points, voxel=voxel, threads=threads).astype(np.float64)
