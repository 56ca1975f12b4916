"""Fits by orthogonal distance: of all points, or without those that are far from the surface."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.shapes.surface import Array, Surface

FAR = 3.0
"""A point this many standard deviations from the surface is an outlier, as for `surfsig.extract`."""

DEVIATIONS_PER_MEDIAN = 1.4826
"""Standard deviations per median of the absolute values, for normal noise."""

ROUNDING = 1e-12
"""Distances, in units of the points' extent, that rounding alone makes."""

MAX_PASSES = 50
"""Passes after which the choice of points is taken as it is; some ten are usual."""

_SINGULAR = 1e-9
"""A column of the Jacobian of which the others leave less than this part is a combination of theirs."""

_TOLERANCE = 1e-12
_MOST_EVALUATIONS = 500


def surface_through(kind: type[Surface], points: Array) -> Surface | None:
    """Fit a surface by the sum of squared distances, from the algebraic one on.

    Parameters
    ----------
    kind
        Which surface.
    points
        (n, 3).

    Returns
    -------
    Surface or None
        None where the points are too few, determine none, or the fit does not settle.
    """
    # Moments lose digits far from 0.
    middle, unit = frame_of(points)
    local = (points - middle) / unit
    start = kind.through(local)
    surface = None if start is None else refined(start, local)
    return None if surface is None else surface.placed(unit, middle)


def frame_of(points: Array) -> tuple[Array, float]:
    """Give the points' mean, and their extent: the root mean square of the distances from it."""
    middle = points.mean(axis=0)
    return middle, float(np.sqrt(((points - middle) ** 2).sum(axis=1).mean())) or 1.0


def refined(start: Surface, points: Array) -> Surface | None:
    """Fit the surface anew, from a start; None where the points are too few or the fit does not settle."""
    if len(points) <= start.unknowns:
        return None
    # SciPy takes long to import.
    from scipy.optimize import least_squares

    solution = least_squares(
        lambda step: start.moved(step).distances(points),
        np.zeros(start.unknowns),
        lambda step: start.jacobian(points, step),
        method="lm",
        xtol=_TOLERANCE,
        ftol=_TOLERANCE,
        gtol=_TOLERANCE,
        max_nfev=_MOST_EVALUATIONS,
    )
    surface = start.moved(solution.x)
    return None if solution.status == 0 or surface.radius <= 0 else surface


def settled(kind: type[Surface], points: Array, *, robust: bool) -> tuple[Surface, NDArray[np.bool_]] | None:
    """Fit a surface, and say which points count; `robust` leaves out those that are far from it.

    What is far is judged by the median distance of all points, which outliers hardly move; points leave and
    come back until the choice stands.
    """
    surface = surface_through(kind, points)
    inliers = np.ones(len(points), np.bool_)
    for _ in range(MAX_PASSES if robust else 0):
        if surface is None:
            break
        distances = surface.distances(points)
        chosen = near(distances, distances)
        if np.array_equal(chosen, inliers):
            break
        inliers = chosen
        surface = refined(surface, points[inliers])
    return None if surface is None else (surface, inliers)


def determined(surface: Surface, points: Array) -> bool:
    """Tell whether the points fix all unknowns of a surface; those of a circle fix no sphere."""
    triangle = np.linalg.qr(surface.jacobian(points, np.zeros(surface.unknowns)))[1]
    diagonal = np.abs(np.diag(triangle))
    return bool(diagonal.min() > _SINGULAR * diagonal.max())


def near(distances: Array, judges: Array) -> NDArray[np.bool_]:
    """Tell which distances are no outliers, by the median of those that judge."""
    limit = FAR * DEVIATIONS_PER_MEDIAN * float(np.median(np.abs(judges)))
    return np.abs(distances) <= max(limit, ROUNDING)
