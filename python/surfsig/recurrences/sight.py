"""What the sensor saw around a piece: which places are on a surface, hidden, or known to be empty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

_REACH = 2.5
"""Pixels around a point of the scan that it speaks for; a pixel is a point spacing wide."""
_MARGIN = 0.6
"""Of the piece's extent, seen around it."""
_MOST_PIXELS = 512
"""Along a side, however dense the scan."""


@dataclass(frozen=True, eq=False)
class Sight:
    """A depth image of a piece and its surroundings from where the sensor stood.

    The image plane is square to the line of sight `axes[2]`; a pixel holds the number of the nearest scan
    point and the smallest depth around it.
    """

    eye: Array
    axes: Array
    low: Array
    pixel: float
    nearest: NDArray[np.int64]
    """(h, w), row of `points`; -1 where no point of the scan is near."""
    front: Array
    """(h, w), smallest depth in the 3 x 3 pixels around; NaN where a pixel has none."""
    points: Array
    normals: Array
    own: NDArray[np.bool_]
    """Which points belong to the piece itself."""

    def project(self, places: Array) -> tuple[NDArray[np.int64], Array]:
        """Give flat pixel numbers (-1 outside) and depths of places (..., 3)."""
        local = (places - self.eye) @ self.axes.T
        depth = local[..., 2]
        cell = np.floor((local[..., :2] / depth[..., None] - self.low) / self.pixel).astype(np.int64)
        height, width = self.nearest.shape
        inside = (cell[..., 0] >= 0) & (cell[..., 0] < height) & (cell[..., 1] >= 0) & (cell[..., 1] < width)
        return np.where(inside & (depth > 0), cell[..., 0] * width + cell[..., 1], -1), depth

    def judge(self, places: Array, normals: Array, tolerance: float) -> tuple[Array, Array, Array]:
        """Tell what the scan says about surface points at places (..., 3) with normals (..., 3).

        Returns
        -------
        Three (...) boolean arrays: confirmed (on the piece's own surface, facing alike), contradicted (the
        sensor saw through that place), and astray (visible, neither in front nor behind, but not confirmed:
        at another angle, or just beneath the surface).
        """
        cell, depth = self.project(places)
        near = self.nearest.ravel()[np.maximum(cell, 0)]
        known = (cell >= 0) & (near >= 0)
        near = np.maximum(near, 0)
        offset = places - self.points[near]
        height = np.einsum("...i,...i->...", offset, self.normals[near])
        alike = np.einsum("...i,...i->...", normals, self.normals[near])
        on = known & (np.abs(height) <= tolerance)
        confirmed = on & self.own[near] & (alike > 0.8)
        contradicted = known & (depth < self.front.ravel()[np.maximum(cell, 0)] - 2.0 * tolerance)
        astray = known & ~confirmed & ~contradicted & self.own[near] & (np.abs(height) <= 4.0 * tolerance)
        return confirmed, contradicted, astray


def sight_of(
    piece: NDArray[np.int64], cloud_points: Array, cloud_normals: Array, eye: Array, spacing: float
) -> Sight:
    """Take the depth image of the piece with these point numbers, seen from `eye`."""
    middle = cloud_points[piece].mean(axis=0)
    distance = float(np.linalg.norm(middle - eye))
    forward = (middle - eye) / distance
    side = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    side /= np.linalg.norm(side)
    axes = np.stack([side, np.cross(forward, side), forward])
    extent = float(np.linalg.norm(cloud_points[piece] - middle, axis=1).max())
    reach = extent * (1.0 + _MARGIN)
    around = np.flatnonzero(np.linalg.norm(cloud_points - middle, axis=1) <= 2.0 * reach)
    points = cloud_points[around]
    local = (points - eye) @ axes.T
    image = local[:, :2] / local[:, 2:]
    pixel = max(spacing, 2.0 * reach / _MOST_PIXELS) / distance
    side_pixels = int(np.ceil(2.0 * reach / distance / pixel)) + 1
    low = (middle - eye) @ axes[:2].T / distance - reach / distance
    cell = np.floor((image - low) / pixel).astype(np.int64)
    inside = ((cell >= 0) & (cell < side_pixels)).all(axis=1)
    around, points, cell, depth = around[inside], points[inside], cell[inside], local[inside, 2]
    nearest = np.full((side_pixels, side_pixels), -1, np.int64)
    front = np.full(nearest.shape, np.inf)
    # The nearest of several in a pixel is written last.
    order = np.argsort(-depth, kind="stable")
    nearest[cell[order, 0], cell[order, 1]] = order
    front[cell[order, 0], cell[order, 1]] = depth[order]
    front = ndimage.minimum_filter(front, 3, mode="nearest")
    gap, (rows, columns) = ndimage.distance_transform_edt(nearest < 0, return_indices=True)
    nearest = np.where(gap <= _REACH, nearest[rows, columns], -1)
    front = np.where(gap <= _REACH, np.minimum(front, front[rows, columns]), np.nan)
    return Sight(
        eye, axes, low, pixel, nearest, front, points, cloud_normals[around], np.isin(around, piece)
    )
