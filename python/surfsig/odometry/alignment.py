"""A scan put onto the map: GICP, the last steps by point to plane, and how well it then lies."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.alignment.blocks import blocks, clustered_covariance
from surfsig.alignment.refinement import gicp
from surfsig.clean import downsample
from surfsig.geometry import from_rotation_vector, inverse, orthonormal, transform_points
from surfsig.odometry.local_map import LocalMap, prepared
from surfsig.odometry.panorama import Panorama
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]
Known = Callable[[Array, Array], NDArray[np.bool_]]

_MOST_STEPS = 30
_SETTLED = 1e-4, 1e-4
"""Radians, and voxels: a step that is none."""
_LAST_STEPS = 2
_NEAR = 2.0
"""Voxels between a place and the nearest one of the map that may be the same."""
_ON = 0.5
"""Voxels from the map's surface within which a place lies on it, at most."""
_BESIDE = 1.2
"""Voxels to the map's next place within which one is explained, whatever the normal there."""
_STRAY = 3.0
"""Standard deviations from it, likewise."""
_FLOOR = 0.02
"""Voxels: a deviation below it is none."""
_HELD = 5e-3
"""Mean square of the heights that the least of all motions makes, below which it is free."""
_FEWEST = 30
"""Places that must meet the map."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """How a scan lies in the map; lengths are in voxels."""

    pose: Array
    """T_map_scan."""
    covariance: Array
    """(6, 6), of the small motion in the scan's axes that is missing."""
    overlap: float
    """Share of the scan's places that lie on the map's surface."""
    seen_through: float
    """Share of the map's places that the sensor looked through, of those that it should have seen."""
    unexplained: float
    """Share of the scan's places that the map lacks, of those that earlier scans should have seen."""
    held: bool
    """Whether the surfaces hold the scan in all directions."""
    scans: NDArray[np.int64]
    """Which scans the places came from that it lies on."""


class Scan:
    """A scan's points about its sensor, (n, 3), in voxels."""

    def __init__(self, points: Array, threads: int) -> None:
        self._points = points
        self.points = downsample(PointCloud(points), 1.0).points
        """Its places: the mean of each voxel's points, (m, 3)."""
        self.cloud, _ = prepared(self.points, threads)
        self.panorama = Panorama(self.points)

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.points)

    def detail(self) -> Array:
        """Give the means of voxels of half the size: signatures need more than the pose does."""
        return downsample(PointCloud(self._points), 0.5).points


def align(
    scan: Scan, around: LocalMap, start: Array, reach: float, should_be_known: Known
) -> Alignment | None:
    """Find a scan's pose in a map from a start nearby; None where they hardly touch.

    Parameters
    ----------
    scan
        The scan.
    around
        The map.
    start
        T_map_scan, (4, 4).
    reach
        Voxels between partners, at most, to begin with.
    should_be_known
        Tells by a scan's pose which of its places (n, 3) earlier scans should have seen, (n,).
    """
    if len(around) < _FEWEST:
        return None
    cloud, tree, normals = around.prepared()
    pose = start
    for distance in (reach, min(reach, _NEAR)):
        pose, partners = gicp(cloud, scan.cloud, tree, pose, distance, _MOST_STEPS, _SETTLED)
        if partners < _FEWEST:
            return None
    for step in range(_LAST_STEPS + 1):
        places = transform_points(pose, scan.points)
        numbers, squares = tree.batch_nearest_neighbor_search(places)
        nearest = np.asarray(numbers)
        near = np.asarray(squares) < _NEAR**2
        heights = np.einsum("ij,ij->i", normals[nearest], places - around.points[nearest])
        spread = 1.4826 * float(np.median(np.abs(heights[near]))) if near.any() else 0.0
        on = near & (np.abs(heights) < min(_ON, _STRAY * max(spread, _FLOOR)))
        if on.sum() < _FEWEST:
            return None
        # The height above the map changes so with a small motion of the scan in its own axes.
        own = normals[nearest[on]] @ pose[:3, :3]
        design = np.hstack([np.cross(scan.points[on], own), own])
        if step < _LAST_STEPS:
            change = -np.linalg.lstsq(design.T @ design, design.T @ heights[on], rcond=1e-9)[0]
            pose = orthonormal(pose @ from_rotation_vector(change[:3], change[3:]))
    # Not all that the map has is on its surface, by noise and at edges.
    explained = (near & (np.abs(heights) < _ON)) | (np.asarray(squares) < _BESIDE**2)
    known = should_be_known(pose, scan.points)
    return Alignment(
        pose,
        _covariance(design, heights[on], scan.points[on]),
        float(on.mean()),
        scan.panorama.seen_through(transform_points(inverse(pose), around.points)),
        float((known & ~explained).sum() / max(1, known.sum())),
        _is_held(design),
        around.scans[nearest[on]],
    )


def _is_held(design: Array) -> bool:
    unit = float(np.sqrt((design[:, :3] ** 2).sum(axis=1).mean())) or 1.0
    scaled = design / np.repeat([unit, 1.0], 3)
    return float(np.linalg.eigvalsh(scaled.T @ scaled)[0]) > _HELD * len(design)


def _covariance(design: Array, heights: Array, points: Array) -> Array:
    """Give the motion's covariance, (6, 6): whole blocks count, or places where these are few."""
    block = blocks(points)
    return clustered_covariance(design, heights, np.arange(len(points)) if block is None else block)
