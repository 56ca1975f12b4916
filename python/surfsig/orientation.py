"""From which side a surface was seen: the viewpoint, or normals that came with the cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud, coordinate_array, position_array


def orientation(
    cloud: PointCloud,
    viewpoint: ArrayLike | None,
    normals: ArrayLike | None,
    indices: NDArray[np.int64] | None,
) -> tuple[NDArray[np.float64] | None, NDArray[np.float32] | None]:
    """Choose what says on which side the sensor was.

    Parameters
    ----------
    cloud
        May have normals, a viewpoint, or a viewpoint for each of its scans.
    viewpoint, normals
        What the caller says, (3,) and (n, 3); it counts before what the cloud says.
    indices
        Numbers of the points that are asked for, (m,); None for places of their own.

    Returns
    -------
    A position (3,), or for each point asked for a vector to its side, (m, 3); both None where nobody knows.

    Raises
    ------
    InvalidInputError
        If both are given, or have the wrong shape.
    """
    if viewpoint is not None:
        if normals is not None:
            raise InvalidInputError("viewpoint and normals exclude each other")
        return position_array(viewpoint, "viewpoint"), None
    known = _normals_of(cloud) if normals is None else coordinate_array(normals, "normals")
    if known is not None and len(known) != len(cloud):
        raise InvalidInputError(f"normals must be one of each of the {len(cloud)} points, not {len(known)}")
    if known is not None and indices is not None:
        return None, _usable(known[indices])
    if cloud.viewpoint is not None:
        return cloud.viewpoint, None
    if cloud.viewpoints is not None and indices is not None:
        scans = cloud.fields["scan"][indices]
        return None, _usable(cloud.viewpoints[scans] - (cloud.origin + cloud.offsets[indices]))
    return None, None


def _normals_of(cloud: PointCloud) -> NDArray[np.floating] | None:
    fields = cloud.fields
    if all(name in fields and fields[name].ndim == 1 for name in ("nx", "ny", "nz")):
        return np.column_stack([fields[name] for name in ("nx", "ny", "nz")])
    for name in ("normals", "normal"):
        if name in fields and fields[name].shape == (len(cloud), 3):
            return fields[name]
    if all(f"normal_{axis}" in fields and fields[f"normal_{axis}"].ndim == 1 for axis in "xyz"):
        return np.column_stack([fields[f"normal_{axis}"] for axis in "xyz"])
    return None


def _usable(vectors: NDArray[np.floating]) -> NDArray[np.float32]:
    """Scale vectors to where float32 holds them; those that say nothing become 0."""
    with np.errstate(invalid="ignore", divide="ignore", over="ignore"):
        largest = np.abs(vectors).max(axis=1, keepdims=True, initial=0.0)
        scaled = vectors / np.where(largest > 0, largest, 1)
    return np.ascontiguousarray(
        np.where(np.isfinite(scaled).all(axis=1, keepdims=True), scaled, 0), np.float32
    )
