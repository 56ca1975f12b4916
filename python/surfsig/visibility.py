"""What can have been seen from where: whether a viewpoint can be true, and from where a scan was measured."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

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


def estimate_viewpoint(cloud: PointCloud | ArrayLike) -> Array | None:
    """Tell by the density of a scan's points from where it was measured.

    A sensor sends its rays evenly over directions: a surface at distance r, whose normal makes the angle a
    with the ray, holds points for an area as cos(a) / r^2. That fits for the true viewpoint only. `register`
    and `find_instances` do so themselves where nothing says from where a scan was seen.

    Parameters
    ----------
    cloud
        A scan from one place, all of its points or some at random; `PointCloud`, an array (n, 3), or any
        other that `PointCloud.of` takes. Viewpoint and normals that it has are not used.

    Returns
    -------
    (3,), in the cloud's coordinates and unit: within some hundredths of the scan's size of the true one, or
    in its direction where that is many sizes away. None where the density does not tell, as of scans that
    were thinned evenly or fused of several, where not all could be seen from there, and where nothing stands
    before anything else.

    Examples
    --------
    >>> import surfsig
    >>> scan = surfsig.simulate.scan(surfsig.simulate.room(5), surfsig.simulate.Lidar(noise=0.01), seed=1)
    >>> viewpoint = surfsig.estimate_viewpoint(scan)
    >>> bool(abs(viewpoint - scan.viewpoint).max() < 0.1)
    True
    """
    whole = PointCloud.of(cloud)
    offsets = whole.offsets[np.isfinite(whole.offsets).all(axis=1)].astype(np.float64)
    found = _surfsig.estimated_viewpoint(np.ascontiguousarray(offsets))
    return None if found is None else np.asarray(whole.origin + found)


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
