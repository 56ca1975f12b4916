"""Fits without the points that are far from the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.progress import Progress, ProgressCallback
from surfsig.shapes.known import NOTHING_KNOWN, Known
from surfsig.shapes.surface import ShapeKind

Array = NDArray[np.float64]

FAR = 3.0
"""A point this many standard deviations from the surface is an outlier, as for `surfsig.extract`."""

DEVIATIONS_PER_MEDIAN = 1.4826
"""Standard deviations per median of the absolute values, for normal noise."""

ROUNDING = 1e-12
"""Distances, in units of the points' extent, that rounding alone makes."""

_LAST = 0.1
"""Part of the limit in which the density of the distances at the limit is counted."""

_MOST_ANSWER = 0.5
"""What a shift brings in and out is at most this part of it: more is no density of noise."""

MAX_PASSES = 50
"""Passes after which the choice of points is taken as it is; some ten are usual."""


def fitted_to_inliers(
    kind: ShapeKind,
    points: Array,
    *,
    robust: bool,
    progress: ProgressCallback | None = None,
    known: Known = NOTHING_KNOWN,
) -> tuple[_surfsig.Primitive, NDArray[np.bool_]] | None:
    """Fit a surface, and say which points count; `robust` leaves out those that are far from it.

    What is far is judged by the median distance of all points, which outliers hardly move; points leave and
    come back until the choice stands.
    """
    passes = MAX_PASSES if robust else 0
    done = Progress(progress, 1 + passes)
    surface = known.fit(kind, points)
    done.advance(1)
    if surface is None:
        return None
    inliers = np.ones(len(points), np.bool_)
    rounding = rounding_of(points) if robust else 0.0
    for _ in range(passes):
        distances = surface.distances(points)
        chosen = near(distances, distances, rounding)
        if np.array_equal(chosen, inliers):
            break
        inliers = chosen
        surface = known.fit(kind, points, inliers, surface)
        done.advance(1)
        if surface is None:
            return None
    done.advance(passes)
    return surface, inliers


def variance_factor(distances: Array) -> float:
    """Give by how much a parameter's variance grows because far points were left out.

    The residuals that are left vary less, but which are left depends on the fit: where it moves, points leave
    on one side and come in on the other. The sum of residuals within +-T so changes by 1 - 2 T f(T) times a
    translation, with their density f, instead of by once (the asymptotic variance of a skipped mean). The
    density is counted in the last tenth before T.

    Parameters
    ----------
    distances
        (m,), of the points that were left.
    """
    sizes = np.abs(distances)
    limit = FAR * DEVIATIONS_PER_MEDIAN * float(np.median(sizes))
    if not limit > 0:
        return 1.0
    share = float(np.mean(sizes > (1 - _LAST) * limit)) / _LAST
    return 1.0 / (1.0 - min(share, _MOST_ANSWER)) ** 2


def rounding_of(points: Array) -> float:
    """Give the distances that rounding makes: of the root mean square of the distances from the mean."""
    return ROUNDING * float(np.sqrt(points.var(axis=0).sum()))


def near(distances: Array, judges: Array, rounding: float) -> NDArray[np.bool_]:
    """Tell which distances are no outliers, by the median of those that judge."""
    limit = FAR * DEVIATIONS_PER_MEDIAN * float(np.median(np.abs(judges)))
    return np.abs(distances) <= max(limit, rounding)
