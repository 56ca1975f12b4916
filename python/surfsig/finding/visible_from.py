"""Whether a sensor at a place can have seen all points of a cloud."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.recurrences.shadows import hidden_from

Array = NDArray[np.float64]

_HIDDEN = 0.1
"""Share of hidden points from which on nobody saw all from there: noise hides few (0.3 to 9 % on real scans
from one place), a closed surface half, and an eighth at least of scans from several places, or of none."""


_FINEST = 1000.0
"""Of the median distance, the inverse spacing of the finest sights: they must be few enough to be held."""


def seen_from(eye: Array, points: Array, spacing: float) -> bool:
    """Tell whether points (n, 3) can all have been seen from a place (3,): whether few hide others.

    A file's viewpoint often is a default, and a model of a whole object has none.
    """
    ways = points - eye
    distances = np.linalg.norm(ways, axis=1)
    if not len(points) or distances.min() == 0.0:
        return False
    # Angles about an axis square to the mean way, as lengths at the median distance: sights are parallel.
    forward = ways.mean(axis=0)
    pole = np.cross(forward, np.eye(3)[np.abs(forward).argmin()])
    pole /= np.linalg.norm(pole) or 1.0
    side = np.cross(pole, forward)
    side /= np.linalg.norm(side) or 1.0
    ahead = np.cross(side, pole)
    middle = float(np.median(distances))
    angles = np.arctan2(ways @ side, ways @ ahead), np.arcsin(np.clip(ways @ pole / distances, -1.0, 1.0))
    # Of the distance the logarithm, as spacing and noise grow with it.
    depth = middle * np.log(distances / middle)
    spacing = max(spacing, middle / _FINEST)
    sights = np.column_stack([middle * angles[0], middle * angles[1], -depth])
    return float(hidden_from(np.array([0.0, 0.0, 1.0]), sights, sights, spacing).mean()) < _HIDDEN
