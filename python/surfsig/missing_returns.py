"""Missing returns of a lidar, which many drivers write as points at (0, 0, 0)."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.point_cloud import PointCloud

FEWEST = 2
"""Points at exactly (0, 0, 0) from which on they are missing returns: a surface may pass there once."""


def missing_returns(cloud: PointCloud) -> NDArray[np.bool_]:
    """Tell which points are missing returns: those at exactly (0, 0, 0), where there are two or more.

    Parameters
    ----------
    cloud
        In the sensor's coordinates; where its origin is elsewhere, no point is one.

    Returns
    -------
    numpy.ndarray
        A mask (n,).
    """
    # Column by column, and the rest only where x is 0: a pass over (n, 3) takes several times as long.
    missing = cloud.offsets[:, 0] == -cloud.origin[0]
    numbers = np.flatnonzero(missing)
    at_origin = (cloud.offsets[numbers] == -cloud.origin).all(axis=1)
    missing[numbers] = at_origin if int(at_origin.sum()) >= FEWEST else False
    return np.asarray(missing)


def missing_returns_text(missing: int, points: int) -> str:
    """Say how many points are missing returns."""
    return f"{missing} of {points} points are at (0, 0, 0), where a lidar's missing returns are written"


def warn_of_missing_returns(cloud: PointCloud, name: str) -> None:
    """Warn where points of a cloud are missing returns."""
    missing = int(missing_returns(cloud).sum())
    if missing:
        told = missing_returns_text(missing, len(cloud))
        warnings.warn(f"{name}: {told}; remove_missing_returns (clean --no-returns) drops them", stacklevel=3)


def without_missing_returns(cloud: PointCloud, name: str) -> PointCloud:
    """Drop missing returns as `remove_missing_returns` does; a warning calls the cloud by its name."""
    kept = remove_missing_returns(cloud)
    if len(kept) < len(cloud):
        told = missing_returns_text(len(cloud) - len(kept), len(cloud))
        warnings.warn(f"{name}: {told}; they are left out", stacklevel=3)
    return kept


def remove_missing_returns(cloud: PointCloud | ArrayLike) -> PointCloud:
    """Drop the missing returns of a lidar scan: points at exactly (0, 0, 0), where there are two or more.

    Drivers of Ouster, Livox, SICK and other lidars write such points where nothing came back. `register` and
    `estimate_odometry` leave them out by themselves, and so does `remove_outliers`.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes.

    Returns
    -------
    PointCloud
        The other points, in their order, with their fields; the cloud itself where none is missing.
    """
    cloud = PointCloud.of(cloud)
    missing = missing_returns(cloud)
    return cloud.at(np.flatnonzero(~missing)) if missing.any() else cloud
