"""Lengths that a sequence is worked with, taken from its scans."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

FEWEST = 50
"""Places of a scan without which it cannot be told where it was."""
_PLACES = 4000
"""Voxels of a scan that have points."""
_MOST_OF_ALL = 0.8
"""Part of a sparse scan's points that are in voxels of their own."""
_MOST = 99.0
"""Percent of the points by which lengths are taken."""
_HALVINGS = 24
_PATCH = 0.35
"""Radius of the patches that find a place again, in units of the median distance from the median."""


@dataclass(frozen=True)
class Scale:
    """Lengths, in the scans' unit."""

    voxel: float
    """In which scans and the map are thinned; all else is counted in it."""
    reach: float
    """Median distance from the sensor."""
    patch: float
    """Radius of the patches of signatures."""

    @classmethod
    def of(cls, points: Array, voxel: float | None) -> Scale:
        """Take the lengths from a scan, (n, 3), about its sensor."""
        spread = np.linalg.norm(points - np.median(points, axis=0), axis=1)
        # A stray point may be anywhere.
        most = points[spread <= np.percentile(spread, _MOST)]
        size = _voxel(most) if voxel is None else voxel
        return cls(size, float(np.median(np.linalg.norm(points, axis=1))), _PATCH * float(np.median(spread)))


def _voxel(points: Array) -> float:
    """Find the voxel of which the scan fills as many as are wanted, by halving the interval."""
    wanted = min(_PLACES, _MOST_OF_ALL * len(points))
    largest = float(np.ptp(points, axis=0).max())
    low, high = np.log(largest * 1e-6), np.log(largest)
    for _ in range(_HALVINGS):
        middle = 0.5 * (low + high)
        steps = np.floor(points / np.exp(middle)).astype(np.int64)
        steps -= steps.min(axis=0)
        # Three whole numbers below 2^21 make one.
        filled = len(np.unique(steps @ np.array([1 << 42, 1 << 21, 1])))
        low, high = (middle, high) if filled > wanted else (low, middle)
    return float(np.exp(high))
