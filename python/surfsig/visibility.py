"""What can have been seen from where: whether a cloud's viewpoint can be true."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.point_cloud import PointCloud
from surfsig.spacing import point_spacing

Array = NDArray[np.float64]

_SAMPLE = 4096
"""Points that tell whether a file's viewpoint can be true."""


def hidden_from(direction: Array, places: Array, points: Array, spacing: float) -> NDArray[np.bool_]:
    """Tell which places (m, 3) have points of a scan before them, seen from far away along a unit vector."""
    across = np.linalg.svd(direction[None])[2][1:]
    places, points = (np.ascontiguousarray(array, np.float64) for array in (places, points))
    return _surfsig.hidden_from(direction.tolist(), across.tolist(), places, points, spacing)


def without_false_viewpoint(cloud: PointCloud, source: str) -> PointCloud:
    """Take away a viewpoint at (0, 0, 0), as programs write it who know none, where it cannot be true.

    Parameters
    ----------
    cloud
        As it was read.
    source
        The file's name, for the warning.

    Warns
    -----
    UserWarning
        If the viewpoint is taken away.
    """
    if cloud.viewpoint is None or cloud.viewpoint.any():
        return cloud
    points = cloud.origin + cloud.offsets[:: max(1, len(cloud) // _SAMPLE)].astype(np.float64)
    points = np.unique(points[np.isfinite(points).all(axis=1) & points.any(axis=1)], axis=0)
    if len(points) < 3 or _surfsig.measured_from_origin(points, point_spacing(points)):
        return cloud
    warnings.warn(
        f"{source}: its viewpoint is (0, 0, 0), the default of many programs, and no sensor can have seen "
        "all points from there: it is taken as unknown; give the viewpoint if it is known",
        stacklevel=3,
    )
    return replace(cloud, viewpoint=None)
