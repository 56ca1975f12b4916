"""What the sensor saw around a piece: which places are on a surface, hidden, or known to be empty."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]
Mask = NDArray[np.bool_]

_REACH = 1.5
"""Pixels around a point of the scan that it speaks for; a pixel is a point spacing wide."""
_MARGIN = 0.6
"""Of the piece's extent, seen around it."""
_ALIKE = 0.8
"""Cosine between normals that face alike; those of narrow surfaces and of edges are smoothed."""
_BESIDE = 4.0
"""Tolerances from the surface within which another surface would have been told from it."""
_LOST = 2.5
"""Pixels from the next point of the scan on where nothing was measured."""
_FACING = 0.64
"""Cosine to the line of sight from which on a surface is not too steep to be measured (50 degrees)."""
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
    low: float
    pixel: float
    nearest: NDArray[np.int64]
    """(h, w), row of the nearest of `points`."""
    gap: Array
    """(h, w), pixels to that point."""
    front: Array
    """(h, w), smallest depth in the 3 x 3 pixels around; NaN where no point of the scan is in the pixel
    itself, as in shadows and along rims too steep to be measured."""
    points: Array
    normals: Array
    own: Mask
    """Which points belong to the piece itself."""

    def project(self, places: Array) -> tuple[NDArray[np.int64], Array]:
        """Give flat pixel numbers (-1 outside) and depths of places (..., 3)."""
        local = (places - self.eye) @ self.axes.T
        depth = local[..., 2]
        cell = np.floor((local[..., :2] / depth[..., None] - self.low) / self.pixel).astype(np.int64)
        side = len(self.nearest)
        inside = ((cell >= 0) & (cell < side)).all(axis=-1) & (depth > 0)
        return np.where(inside, cell[..., 0] * side + cell[..., 1], -1), depth

    def judge(self, places: Array, normals: Array, tolerance: float) -> tuple[Mask, Mask, Mask, Mask]:
        """Tell what the scan says about surface points at places (..., 3) with normals (..., 3).

        Returns
        -------
        Four (...) boolean arrays: confirmed (on the piece's own surface, facing alike), contradicted (the
        sensor saw through that place), astray (visible, neither in front nor behind, but not confirmed: at
        another angle, or just beneath the surface), and missing (in front and facing the sensor, but nothing
        was measured there).
        """
        cell, depth = self.project(places)
        near, known = self._seen(cell)
        height, alike = self._relation(places, normals, near)
        confirmed = known & self.own[near] & (np.abs(height) <= tolerance) & (alike > _ALIKE)
        contradicted = known & (depth < self.front.ravel()[np.maximum(cell, 0)] - 2.0 * tolerance)
        beside = self.own[near] & (np.abs(height) <= _BESIDE * tolerance)
        towards = (self.eye - places) / np.linalg.norm(self.eye - places, axis=-1, keepdims=True)
        facing = np.einsum("...i,...i->...", normals, towards) > _FACING
        nothing = (cell >= 0) & (self.gap.ravel()[np.maximum(cell, 0)] > _LOST)
        missing: Mask = nothing & facing & (height > -tolerance)
        return confirmed, contradicted, known & beside & ~confirmed & ~contradicted, missing

    def correspondences(self, places: Array, normals: Array, tolerance: float) -> tuple[Mask, Array, Array]:
        """Give which places (n, 3) are on the piece or beside it, and the points and normals seen there."""
        near, known = self._seen(self.project(places)[0])
        height, alike = self._relation(places, normals, near)
        kept = known & self.own[near] & (np.abs(height) <= _BESIDE * tolerance) & (alike > _ALIKE)
        return kept, self.points[near], self.normals[near]

    def _seen(self, cell: NDArray[np.int64]) -> tuple[NDArray[np.int64], Mask]:
        """Give the scan's points in pixels, and where there is one."""
        inside = np.maximum(cell, 0)
        return self.nearest.ravel()[inside], (cell >= 0) & (self.gap.ravel()[inside] <= _REACH)

    def _relation(self, places: Array, normals: Array, near: NDArray[np.int64]) -> tuple[Array, Array]:
        """Give the heights of places above the tangent planes there, and the cosines between the normals."""
        height = np.einsum("...i,...i->...", places - self.points[near], self.normals[near])
        return height, np.einsum("...i,...i->...", normals, self.normals[near])


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
    low = -reach / distance
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
    nearest = nearest[rows, columns]
    front = np.where(gap == 0, front, np.nan)
    return Sight(
        eye, axes, low, pixel, nearest, gap, front, points, cloud_normals[around], np.isin(around, piece)
    )
