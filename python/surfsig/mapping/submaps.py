"""Short parts of a trajectory, with what the sensor saw along each."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig, geometry
from surfsig.errors import InvalidInputError
from surfsig.mapping.fusion import add_scan, map_of
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_LENGTH = 2.0
"""Of a submap along the trajectory, in median distances of its scans' points from the sensor: neighbouring
submaps see half of the same, and drift within one is below the noise."""


@dataclass(frozen=True, eq=False)
class Submap:
    """Scans that follow one another, joined in the frame of the first of them."""

    first: int
    """Number of its first scan."""
    end: int
    """Number of the scan after its last."""
    path: float
    """Length of the trajectory up to its first scan."""
    length: float
    """That it was to have along the trajectory."""
    cloud: PointCloud
    """A point for each voxel, with directions to the sensor as normals."""


def submaps_of(clouds: Iterable[PointCloud], poses: Array, voxel: float) -> list[Submap]:
    """Cut a trajectory into submaps, reading each scan once; scans without a pose (NaN) belong to none.

    Raises
    ------
    InvalidInputError
        If there is not one scan for each pose.
    """
    path = path_lengths(poses)
    found: list[Submap] = []
    fused, first, ranges = _surfsig.FusedMap(voxel), -1, list[float]()
    number = -1
    for number, cloud in enumerate(clouds):
        if number >= len(poses):
            raise InvalidInputError(f"there are {len(poses)} poses, but more scans")
        if not np.isfinite(poses[number]).all():
            continue
        if first >= 0 and path[number] - path[first] >= _LENGTH * float(np.median(ranges)):
            length = _LENGTH * float(np.median(ranges))
            found.append(Submap(first, number, float(path[first]), length, map_of(fused)))
            fused, first, ranges = _surfsig.FusedMap(voxel), -1, []
        first = number if first < 0 else first
        add_scan(fused, cloud, geometry.inverse(poses[first]) @ poses[number])
        ranges.append(_median_range(cloud))
    if number + 1 != len(poses):
        raise InvalidInputError(f"there are {len(poses)} poses, but {number + 1} scans")
    if first >= 0:
        length = _LENGTH * float(np.median(ranges))
        found.append(Submap(first, len(poses), float(path[first]), length, map_of(fused)))
    return found


def path_lengths(poses: Array) -> Array:
    """Give the length of the trajectory up to each scan, (n,); a scan without a pose adds nothing."""
    known = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2)))
    path = np.zeros(len(poses))
    steps = np.linalg.norm(np.diff(poses[known, :3, 3], axis=0), axis=1)
    path[known[1:]] = np.cumsum(steps)
    return np.asarray(np.maximum.accumulate(path))


def _median_range(cloud: PointCloud) -> float:
    """Give the median distance of a scan's points from its sensor."""
    viewpoint = np.zeros(3) if cloud.viewpoint is None else cloud.viewpoint
    distances = np.linalg.norm(cloud.offsets + (cloud.origin - viewpoint), axis=1)
    return float(np.nanmedian(distances))
