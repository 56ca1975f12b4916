"""`fuse_scans`: one map of many scans whose poses are known."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, progress_callback
from surfsig.curvature import extract
from surfsig.errors import InvalidInputError
from surfsig.files.sequence import Scans, timed_scans
from surfsig.missing_returns import remove_missing_returns
from surfsig.point_cloud import PointCloud

_NEIGHBORS = 16
"""Nearest points of the map to which its normals are fitted: two rings about a point of a plane in voxels."""


def fuse_scans(
    scans: Scans,
    poses: ArrayLike,
    *,
    voxel: float,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> PointCloud:
    """Join scans to one map, with a point for each voxel.

    Parameters
    ----------
    scans
        In the order of the poses, each in its sensor's frame; as for `surfsig.estimate_odometry`. They are
        read one by one: memory grows with the map only.
    poses
        T_world_scan, (n, 4, 4); scans without a pose (NaN) are left out.
    voxel
        Edge of the voxels, in the scans' unit.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of scans done and their total.

    Returns
    -------
    PointCloud
        The mean of the points in each voxel, float64, in the world's frame; fields nx, ny, nz: unit normals
        towards the sensors, NaN where the points determine none; scans: how many scans saw the voxel.

    Raises
    ------
    InvalidInputError
        If there is not one pose for each scan, or the voxel has no meaning.
    """
    matrices = np.asarray(poses, np.float64)
    if matrices.ndim != 3 or matrices.shape[1:] != (4, 4):
        raise InvalidInputError(f"poses must be of shape (n, 4, 4), not {matrices.shape}")
    tell = progress_callback(progress)
    fused = _surfsig.FusedMap(positive_length(voxel, "voxel"))
    count = 0
    for count, scan in enumerate(timed_scans(scans), start=1):
        if count > len(matrices):
            raise InvalidInputError(f"there are {len(matrices)} poses, but more scans")
        if np.isfinite(matrices[count - 1]).all():
            _add(fused, remove_missing_returns(scan.cloud), matrices[count - 1])
        if tell is not None:
            tell(count, len(matrices))
    if count != len(matrices):
        raise InvalidInputError(f"there are {len(matrices)} poses, but {count} scans")
    cloud = _map_of(fused)
    if not len(cloud):
        return cloud
    found = extract(cloud, neighbors=_NEIGHBORS, threads=threads)
    normals = dict(zip(("nx", "ny", "nz"), found.normals.T.copy(), strict=True))
    return PointCloud(cloud.offsets, cloud.origin, fields={**normals, "scans": cloud.fields["scans"]})


def _add(fused: _surfsig.FusedMap, cloud: PointCloud, T_map_scan: NDArray[np.float64]) -> None:
    """Add a scan, seen from its viewpoint, or from (0, 0, 0)."""
    viewpoint = np.zeros(3) if cloud.viewpoint is None else cloud.viewpoint
    fused.add(
        cloud.offsets,
        origin=cloud.origin.tolist(),
        T_map_scan=T_map_scan.tolist(),
        viewpoint=viewpoint.tolist(),
    )


def _map_of(fused: _surfsig.FusedMap) -> PointCloud:
    """Give the map; its normals are the directions to the sensors."""
    arrays = fused.arrays()
    directions = dict(zip(("nx", "ny", "nz"), arrays["directions_to_sensor"].T.copy(), strict=True))
    return PointCloud(arrays["points"], fields={**directions, "scans": arrays["scans"]})
