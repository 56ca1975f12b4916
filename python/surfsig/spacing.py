"""How far apart the points of a surface are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

_MEASURED = 20_000
"""Points that tell the spacing of all."""


def point_spacing(points: NDArray[np.float64]) -> float:
    """Median distance of a point to its nearest other one; of many points, by a fixed choice of them."""
    asked = points
    if len(points) > _MEASURED:
        asked = points[np.random.default_rng(0).choice(len(points), _MEASURED, replace=False)]
    distances, _ = cKDTree(points).query(asked, k=2)
    return float(np.median(distances[:, 1]))
