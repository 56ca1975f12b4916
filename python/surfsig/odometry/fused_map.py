"""What all scans of a sequence saw, as one cloud: a point for each voxel."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_NORMAL_RADIUS = 2.5
"""Voxels around a point whose points give its normal: some twenty on a surface."""
_PENDING = 2_000_000
"""Voxels of single scans that wait to be joined, at most, so that memory is that of the map."""


class FusedMap:
    """Sums over the points of each voxel, to which scans are added."""

    def __init__(self, voxel: float) -> None:
        self._voxel = voxel
        self._keys: NDArray[np.int64] = np.empty((0, 3), np.int64)
        self._sums: Array = np.empty((0, 8))
        """Of points, of unit vectors to the sensors, the number of points and that of scans."""
        self._waiting: list[tuple[NDArray[np.int64], Array]] = []

    def add(self, points: Array, sensor: Array) -> None:
        """Add the points of a scan, (n, 3), and where its sensor was, in the world."""
        finite = points[np.isfinite(points).all(axis=1)]
        if not len(finite):
            return
        to_sensor = sensor - finite
        to_sensor /= np.maximum(np.linalg.norm(to_sensor, axis=1, keepdims=True), np.finfo(float).tiny)
        ones = np.ones((len(finite), 1))
        keys, sums = _joined(
            np.floor(finite / self._voxel).astype(np.int64),
            np.concatenate([finite, to_sensor, ones, 0.0 * ones], axis=1),
        )
        sums[:, 7] = 1.0
        self._waiting.append((keys, sums))
        if sum(len(waiting) for waiting, _ in self._waiting) > _PENDING:
            self._join()

    def _join(self) -> None:
        keys = np.concatenate([self._keys, *(waiting for waiting, _ in self._waiting)])
        sums = np.concatenate([self._sums, *(waiting for _, waiting in self._waiting)])
        self._waiting = []
        self._keys, self._sums = _joined(keys, sums)

    def cloud(self) -> PointCloud:
        """Give the mean of each voxel's points, with normals towards the sensors and the number of scans."""
        self._join()
        count = self._sums[:, 6:7]
        points = self._sums[:, :3] / np.maximum(count, 1.0)
        origin = np.round(points.mean(axis=0)) if len(points) else np.zeros(3)
        normals = _normals(points - origin, self._sums[:, 3:6], _NORMAL_RADIUS * self._voxel)
        fields = {name: normals[:, k].astype(np.float32) for k, name in enumerate(("nx", "ny", "nz"))}
        fields["scans"] = self._sums[:, 7].astype(np.int32)
        return PointCloud((points - origin).astype(np.float32), origin=origin, fields=fields)


def fused_map(scans: Iterable[PointCloud], poses: Array, voxel: float) -> PointCloud:
    """Fuse scans at their poses.

    Parameters
    ----------
    scans
        Each in its own frame, without the sensor's motion within it.
    poses
        T_world_scan, (n, 4, 4); scans whose pose is NaN are left out.
    voxel
        Edge of the voxels, of which each has one point.

    Returns
    -------
    PointCloud
        In the world: the mean of each voxel's points, with the fields nx, ny, nz, the unit normal on the
        side of the sensors (NaN where neighbours are too few), and scans, by how many scans a voxel was seen.
    """
    fused = FusedMap(voxel)
    for cloud, pose in zip(scans, poses, strict=False):
        if np.isfinite(pose).all():
            sensor = np.zeros(3) if cloud.viewpoint is None else cloud.viewpoint
            rotation, translation = pose[:3, :3], pose[:3, 3]
            fused.add(
                (cloud.offsets + cloud.origin) @ rotation.T + translation, rotation @ sensor + translation
            )
    return fused.cloud()


def _joined(keys: NDArray[np.int64], sums: Array) -> tuple[NDArray[np.int64], Array]:
    """Add up the rows of equal voxels; voxels in ascending order."""
    order = np.lexsort(keys.T[::-1])
    keys, sums = keys[order], sums[order]
    if not len(keys):
        return keys, sums
    first = np.flatnonzero(np.concatenate([[True], (np.diff(keys, axis=0) != 0).any(axis=1)]))
    return keys[first], np.add.reduceat(sums, first, axis=0)


def _normals(points: Array, towards: Array, radius: float) -> Array:
    """Give the normal of the plane through each point's neighbours, on the side that is pointed to."""
    from scipy.spatial import cKDTree

    normals = np.full((len(points), 3), np.nan)
    if len(points) < 4:
        return normals
    _, neighbor = cKDTree(points).query(points, k=min(16, len(points)), distance_upper_bound=radius)
    known = neighbor < len(points)
    enough = known.sum(axis=1) >= 4
    around = points[np.where(known, neighbor, 0)]
    weight = known[:, :, None].astype(np.float64)
    mean = (weight * around).sum(axis=1) / weight.sum(axis=1)
    offsets = weight * (around - mean[:, None])
    _, vectors = np.linalg.eigh(np.einsum("nki,nkj->nij", offsets, offsets)[enough])
    normals[enough] = vectors[:, :, 0]
    return np.where(np.einsum("ni,ni->n", normals, towards)[:, None] < 0.0, -normals, normals)
