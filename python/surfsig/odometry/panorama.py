"""How far a scan saw in each direction: a map that stands in between is that of another place."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy import ndimage

Array = NDArray[np.float64]

_PIXEL = np.radians(3.0)
_MARGIN = 2.0
"""Voxels before what was seen within which a place is on it,"""
_MARGIN_PART = 0.05
"""and part of the distance."""


class Panorama:
    """A depth image about the sensor, by azimuth and elevation; lengths are in voxels."""

    def __init__(self, points: Array) -> None:
        pixels, distances = _seen(points)
        shape = _shape()
        self._front = np.full(shape, np.inf)
        self._back = np.zeros(shape)
        np.minimum.at(self._front, pixels, distances)
        np.maximum.at(self._back, pixels, distances)
        self._measured = self._back > 0
        # A surface that is seen at a low angle is at many distances within a pixel.
        around = ("nearest", "wrap")
        self._front = ndimage.minimum_filter(self._front, 3, mode=around)
        self._back = ndimage.maximum_filter(self._back, 3, mode=around)

    def seen_through(self, places: Array) -> float:
        """Give the share of places that the sensor looked through, of those that it should have seen.

        Parameters
        ----------
        places
            On surfaces, in the scan's axes, (n, 3).
        """
        through, met = self._judged(places)
        return float(through.sum() / max(1, (through | met).sum()))

    def covers(self, places: Array) -> NDArray[np.bool_]:
        """Tell which places (n, 3), in the scan's axes, it must have seen if they were there, (n,)."""
        through, met = self._judged(places)
        return through | met

    def _judged(self, places: Array) -> tuple[NDArray[np.bool_], NDArray[np.bool_]]:
        """Tell which places were looked through, and which are about where a surface was met."""
        pixels, distances = _seen(places)
        margin = _MARGIN + _MARGIN_PART * distances
        measured = self._measured[pixels]
        through = measured & (distances < self._front[pixels] - margin)
        return through, measured & ~through & (distances < self._back[pixels] + margin)


def _shape() -> tuple[int, int]:
    return round(np.pi / _PIXEL), round(2.0 * np.pi / _PIXEL)


def _seen(points: Array) -> tuple[tuple[NDArray[np.int64], NDArray[np.int64]], Array]:
    """Give the pixels of points, (rows, columns), and their distances."""
    rows, columns = _shape()
    distances = np.linalg.norm(points, axis=1)
    height = np.arctan2(points[:, 2], np.hypot(points[:, 0], points[:, 1])) + np.pi / 2
    turned = np.arctan2(points[:, 1], points[:, 0]) + np.pi
    row = np.minimum((height / np.pi * rows).astype(np.int64), rows - 1)
    column = (turned / (2.0 * np.pi) * columns).astype(np.int64) % columns
    return (row, column), distances
