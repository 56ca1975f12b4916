"""Cleaning a cloud before its surface is fitted: a box, fewer points, no stray ones.

Voxels are grouped by NumPy, because fields go with the points, which the libraries' own functions drop.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import (
    MOST_NEIGHBORS,
    positive_length,
    progress_callback,
    thread_count,
    whole_number,
)
from surfsig.defaults import OUTLIER_NEIGHBORS, OUTLIER_STD_RATIO
from surfsig.errors import InvalidInputError
from surfsig.files.options import box_array, cropped
from surfsig.missing_returns import remove_missing_returns
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress, ProgressCallback
from surfsig.threads import map_in_threads

LATTICE_LIMIT = 1 << 43
"""Voxels from 0 to a point along an axis, at most; as in the core's own voxels."""

COORDINATE_LIMIT = 1e150
"""Beyond, the square of a distance leaves float64."""

_COLOURS = ("red", "green", "blue", "alpha")
_NORMALS = ("nx", "ny", "nz")


def crop(cloud: PointCloud | ArrayLike, box: ArrayLike) -> PointCloud:
    """Keep the points in a box.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes.
    box
        (2, 3), its lowest and its highest corner, in the cloud's coordinates; both belong to it.

    Returns
    -------
    PointCloud
        In the order of the points, with their fields; points that are not finite are in no box.

    Raises
    ------
    InvalidInputError
        If the box has no meaning.
    """
    return cropped(PointCloud.of(cloud), box_array(box))


def downsample(
    cloud: PointCloud | ArrayLike,
    voxel: float,
    *,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> PointCloud:
    """Put the mean of its points into each voxel that has any, as PCL's VoxelGrid does.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes. Points that are not finite are dropped.
    voxel
        Edge of the voxels, in the cloud's unit. Their lattice is anchored at 0: the same voxels for every
        cloud in the same coordinates.
    threads
        Number of threads that columns are shared among; all cores by default. The result is the same.
    progress
        Called with the number of columns (x, y, z, fields that are averaged) done, and of all.

    Returns
    -------
    PointCloud
        One point per voxel, in the order of the voxels' first points, in the cloud's precision. Fields of
        floating-point numbers are averaged (NaN where one is NaN), and so are colours; normals are then made
        unit vectors. Other whole numbers (labels) and flags are those of the voxel's first point.

    Raises
    ------
    InvalidInputError
        If the voxel is no length, or too small for the coordinates.
    """
    cloud = _finite_part(PointCloud.of(cloud))
    edge = positive_length(voxel, "voxel")
    workers, tell = thread_count(threads), progress_callback(progress)
    if not len(cloud):
        return cloud
    # An axis a row: along the short axis of (n, 3), NumPy is several times slower.
    axes = np.ascontiguousarray(cloud.offsets.T)
    steps = np.floor((cloud.origin[:, None] + axes) / edge)
    if np.abs(steps).max() > LATTICE_LIMIT:
        raise InvalidInputError(f"voxel {edge:g} is too small for coordinates as large as these")
    first, group = _groups(steps.astype(np.int64))
    counts = np.bincount(group)

    def mean(values: NDArray[Any]) -> NDArray[np.float64]:
        means = np.empty((len(counts), *values.shape[1:]))
        for column, result in zip(np.atleast_2d(values.T), np.atleast_2d(means.T), strict=True):
            result[:] = np.bincount(group, column) / counts
        return means

    def mean_of_axis(number: int) -> NDArray[Any]:
        axis = axes[number]
        # About each voxel's first point, where sums lose nothing at large coordinates.
        anchor = axis[first].astype(np.float64)
        return np.asarray((anchor + mean(axis - anchor[group])).astype(axis.dtype))

    def mean_of_field(name: str) -> NDArray[Any]:
        values, means = cloud.fields[name], mean(cloud.fields[name])
        return (np.round(means) if values.dtype == np.uint8 else means).astype(values.dtype)

    names = [
        name
        for name, values in cloud.fields.items()
        if values.dtype.kind == "f" or (name in _COLOURS and values.dtype == np.uint8)
    ]
    done = Progress(tell, 3 + len(names))

    def column_done(_number: int, _columns: int) -> None:
        done.advance(1)

    offsets = map_in_threads(mean_of_axis, range(3), workers, column_done)
    fields = dict(zip(names, map_in_threads(mean_of_field, names, workers, column_done), strict=True))
    result = cloud.at(first)
    result.offsets = np.column_stack(offsets)
    result.fields |= fields | _unit_normals(fields)
    return result


def remove_outliers(
    cloud: PointCloud | ArrayLike,
    neighbors: int = OUTLIER_NEIGHBORS,
    std_ratio: float = OUTLIER_STD_RATIO,
    *,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> PointCloud:
    """Drop stray points, as PCL's StatisticalOutlierRemoval does.

    For each point the mean distance to its nearest other points is taken; a point is dropped where that is
    above the mean over the cloud by more than `std_ratio` standard deviations. Open3D's
    ``remove_statistical_outlier`` counts the point itself among its neighbours: its 21 are 20 here.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes. Points that are not finite are dropped, and so are missing returns
        (`remove_missing_returns`), whose many copies of one place would pass for dense surface.
    neighbors
        How many nearest points; at least 1. A cloud that has fewer is measured with what there is.
    std_ratio
        Standard deviations, at least 0: the smaller, the more points go.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of points whose neighbours have been found, and of all.

    Returns
    -------
    PointCloud
        What stays, in the order of the points, with their fields.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning.
    """
    neighbors = whole_number(neighbors, "neighbors", MOST_NEIGHBORS)
    try:
        ratio = float(std_ratio)
    except (TypeError, ValueError):
        raise InvalidInputError(f"std_ratio must be a number, not {std_ratio!r:.40}") from None
    if not 0 <= ratio < np.inf:
        raise InvalidInputError(f"std_ratio must be a finite number from 0 on, not {ratio:g}")
    cloud = _finite_part(remove_missing_returns(cloud))
    workers, tell = thread_count(threads), progress_callback(progress)
    # With two points, both are as far from their nearest: there is nothing to compare.
    if len(cloud) < 3:
        return cloud
    if float(np.abs(cloud.offsets).max()) > COORDINATE_LIMIT:
        raise InvalidInputError(f"coordinates must be within {COORDINATE_LIMIT:g} to measure distances")
    points = np.ascontiguousarray(cloud.offsets, np.float64)
    count = min(neighbors, len(cloud) - 1)
    distances = _surfsig.mean_neighbor_distances(points, count=count, threads=workers, progress=tell)
    limit = distances.mean() + ratio * distances.std(ddof=1)
    stays = distances <= limit
    return cloud if stays.all() else cloud.at(np.flatnonzero(stays))


def _finite_part(cloud: PointCloud) -> PointCloud:
    finite = cloud.finite
    return cloud if finite.all() else cloud.at(np.flatnonzero(finite))


def _groups(steps: NDArray[np.int64]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give the number of each voxel's first point, ascending, and each point's voxel in that order.

    Voxels are the columns of `steps`, (3, n).
    The order in which a sort leaves equal keys, which differs between processors, shows in neither.
    """
    x, y, z = steps - steps.min(axis=1, keepdims=True)
    sides = [int(axis.max()) + 1 for axis in (x, y, z)]
    if sides[0] * sides[1] * sides[2] < 1 << 63:
        key = (x * sides[1] + y) * sides[2] + z
        order = np.argsort(key)
        change = np.diff(key[order]) != 0
    else:
        order = np.lexsort(steps)
        change = (np.diff(steps[:, order]) != 0).any(axis=0)
    starts = np.concatenate(([0], np.flatnonzero(change) + 1))
    first = np.minimum.reduceat(order, starts)
    rank = np.empty(len(first), np.int64)
    rank[np.argsort(first)] = np.arange(len(first))
    group = np.empty(len(order), np.int64)
    group[order] = np.repeat(rank, np.diff(np.append(starts, len(order))))
    return np.sort(first), group


def _unit_normals(fields: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    """Give the normals among the fields as unit vectors; those that cancel each other out stay 0."""
    parts = [fields[name] for name in _NORMALS if name in fields]
    if len(parts) < 3 or any(part.ndim != 1 for part in parts):
        return {}
    lengths = np.sqrt(sum(part.astype(np.float64) ** 2 for part in parts))
    lengths[lengths == 0] = 1.0
    return {name: (part / lengths).astype(part.dtype) for name, part in zip(_NORMALS, parts, strict=True)}
