"""Fits without the points that are far from the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.progress import Progress, ProgressCallback
from surfsig.shapes.surface import Kind

Array = NDArray[np.float64]

FAR = 3.0
"""A point this many standard deviations from the surface is an outlier, as for `surfsig.extract`."""

DEVIATIONS_PER_MEDIAN = 1.4826
"""Standard deviations per median of the absolute values, for normal noise."""

ROUNDING = 1e-12
"""Distances, in units of the points' extent, that rounding alone makes."""

MAX_PASSES = 50
"""Passes after which the choice of points is taken as it is; some ten are usual."""


def fitted_to_inliers(
    kind: Kind, points: Array, *, robust: bool, progress: ProgressCallback | None = None
) -> tuple[_surfsig.Primitive, NDArray[np.bool_]] | None:
    """Fit a surface, and say which points count; `robust` leaves out those that are far from it.

    What is far is judged by the median distance of all points, which outliers hardly move; points leave and
    come back until the choice stands.
    """
    passes = MAX_PASSES if robust else 0
    done = Progress(progress, 1 + passes)
    surface = _surfsig.fit_primitive(points, kind)
    done.advance(1)
    if surface is None:
        return None
    inliers = np.ones(len(points), np.bool_)
    rounding = rounding_of(points)
    for _ in range(passes):
        distances = surface.distances(points)
        chosen = near(distances, distances, rounding)
        if np.array_equal(chosen, inliers):
            break
        inliers = chosen
        surface = _surfsig.fit_primitive(points[inliers], kind, surface)
        done.advance(1)
        if surface is None:
            return None
    done.advance(passes)
    return surface, inliers


def rounding_of(points: Array) -> float:
    """Give the distances that rounding makes: of the root mean square of the distances from the mean."""
    return ROUNDING * float(np.sqrt(points.var(axis=0).sum()))


def near(distances: Array, judges: Array, rounding: float) -> NDArray[np.bool_]:
    """Tell which distances are no outliers, by the median of those that judge."""
    limit = FAR * DEVIATIONS_PER_MEDIAN * float(np.median(np.abs(judges)))
    return np.abs(distances) <= max(limit, rounding)
