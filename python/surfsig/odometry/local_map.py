"""The places around the sensor that earlier scans have seen."""

from __future__ import annotations

import numpy as np
import small_gicp
from numpy.typing import NDArray

Array = NDArray[np.float64]

_NEIGHBOURS = 20
"""Nearest places that a surface's normal is taken from."""
_MIDDLE = 1 << 20
_WITHIN = (1 << 21) - 1


class LocalMap:
    """One place for each voxel, the first one that was seen; lengths are in voxels.

    A mean over scans would wander with the poses' errors; the first place stays where it is.
    """

    def __init__(self, threads: int) -> None:
        self._threads = threads
        self._keys = np.zeros(0, np.int64)
        self.points: Array = np.zeros((0, 3))
        self.scans: NDArray[np.int64] = np.zeros(0, np.int64)
        """Which scan each place came from."""
        self._prepared: tuple[small_gicp.PointCloud, small_gicp.KdTree, Array] | None = None

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.points)

    def add(self, points: Array, scan: int) -> None:
        """Add those points (n, 3) of a scan that are in voxels of their own."""
        keys, first = np.unique(_keys(points), return_index=True)
        new = ~np.isin(keys, self._keys)
        if not new.any():
            return
        self._keys = np.concatenate([self._keys, keys[new]])
        self.points = np.concatenate([self.points, points[first[new]]])
        self.scans = np.concatenate([self.scans, np.full(new.sum(), scan)])
        self._prepared = None

    def keep_within(self, center: Array, distance: float) -> None:
        """Forget what is farther from a place."""
        near = ((self.points - center) ** 2).sum(axis=1) <= distance**2
        if not near.all():
            self._keys, self.points, self.scans = self._keys[near], self.points[near], self.scans[near]
            self._prepared = None

    def prepared(self) -> tuple[small_gicp.PointCloud, small_gicp.KdTree, Array]:
        """Give the places for small_gicp, with their covariances, and their unit normals, (n, 3)."""
        if self._prepared is None:
            cloud, tree = prepared(self.points, self._threads)
            self._prepared = cloud, tree, np.asarray(cloud.normals())[:, :3]
        return self._prepared


def prepared(points: Array, threads: int) -> tuple[small_gicp.PointCloud, small_gicp.KdTree]:
    """Give points with normals and covariances, and their tree.

    Each place's values come from its own neighbours: any number of threads gives the same.
    """
    cloud = small_gicp.PointCloud(points)
    tree = small_gicp.KdTree(cloud, num_threads=1)
    small_gicp.estimate_normals_covariances(cloud, tree, num_neighbors=_NEIGHBOURS, num_threads=threads)
    return cloud, tree


def _keys(points: Array) -> NDArray[np.int64]:
    """Give the numbers of voxels; those a million apart share their number, as no map holds both."""
    steps = (np.floor(points).astype(np.int64) + _MIDDLE) & _WITHIN
    return np.asarray(steps @ np.array([1 << 42, 1 << 21, 1]))
