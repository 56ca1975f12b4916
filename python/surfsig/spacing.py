"""How far apart the points of a surface are."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig


def point_spacing(points: NDArray[np.float64]) -> float:
    """Median distance of a point to its nearest other one; of many points, by a fixed choice of them."""
    return _surfsig.point_spacing(np.ascontiguousarray(points, np.float64))
