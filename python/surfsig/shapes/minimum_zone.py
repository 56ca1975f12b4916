"""The shape whose largest distance from the points is least (Chebyshev): flatness, roundness, cylindricity.

The distances are made linear in the parameters, and a linear programme (SciPy's HiGHS) finds the step after
which the largest is least; steps are repeated within a radius of trust until none is left. It is the minimum
next to the least squares.
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.geometry import axes_across
from surfsig.shapes.surface import ShapeKind

Array = NDArray[np.float64]

MAX_STEPS = 100
"""Linear programmes; some ten are enough."""

CONVERGED = 1e-13
"""A step that lowers the largest distance by less, in units of the points' extent, is the last."""

FEWEST_BOUNDS = 64
"""Points with the largest distances that bound the first step; those beyond the result are added."""

FIRST_TRUST = 0.1
"""Length of the first step at most, in units of the points' extent."""


def minimum_zone(
    kind: ShapeKind, start: _surfsig.Primitive, points: Array, *, fixed_axis: bool
) -> tuple[Array, Array, float]:
    """Give point, axis and radius of the plane, circle or cylinder whose largest distance is least.

    Parameters
    ----------
    kind
        "plane", "circle" or "cylinder".
    start
        The least squares. A circle stays in its plane.
    points
        (n, 3).
    fixed_axis
        Whether the axis or normal stays as it is.
    """
    unit = float(np.linalg.norm(np.ptp(points, axis=0)))
    local = (points - start.point) / unit
    tilts = not fixed_axis and kind != "circle"
    position, axis = np.zeros(3), start.axis
    radius = 0.0 if kind == "plane" else start.radius / unit
    distances, jacobian = _linear(kind, local, position, axis, radius, tilts)
    trust = FIRST_TRUST
    for _ in range(MAX_STEPS):
        zone = float(np.abs(distances).max())
        step = _step(distances, jacobian, trust)
        if step is None:
            break
        moved = _moved(kind, position, axis, radius, step, tilts)
        next_distances, next_jacobian = _linear(kind, local, *moved, tilts)
        gain = zone - float(np.abs(next_distances).max())
        if gain > 0:
            position, axis, radius = moved
            distances, jacobian = next_distances, next_jacobian
            trust *= 2
        else:
            trust = 0.25 * min(trust, float(np.abs(step).max()))
        if gain <= CONVERGED and trust < CONVERGED:
            break
    # The point beside the mean, as that of the least squares.
    middle = local.mean(axis=0) - position
    along = float(middle @ axis)
    if kind == "plane":
        position = position + middle - along * axis
    elif kind == "cylinder":
        position = position + along * axis
    return start.point + unit * position, axis, float("nan") if kind == "plane" else unit * radius


def _linear(
    kind: ShapeKind, points: Array, position: Array, axis: Array, radius: float, tilts: bool
) -> tuple[Array, Array]:
    """Give the distances, and their derivatives by two shifts and a radius (a plane: a shift), then tilts."""
    across = np.stack(axes_across(axis))
    offset = points - position
    flat = offset @ across.T
    heights = offset @ axis
    if kind == "plane":
        columns = [-np.ones((len(points), 1)), flat] if tilts else [-np.ones((len(points), 1))]
        return heights, np.concatenate(columns, axis=1)
    away = np.linalg.norm(flat, axis=1)
    outward = flat / np.where(away > 0, away, 1.0)[:, None]
    columns = [-outward, -np.ones((len(points), 1))]
    if tilts:
        columns.append(-heights[:, None] * outward)
    return away - radius, np.concatenate(columns, axis=1)


def _moved(
    kind: ShapeKind, position: Array, axis: Array, radius: float, step: Array, tilts: bool
) -> tuple[Array, Array, float]:
    """Change the parameters by a step, in the order of `_linear`."""
    across = np.stack(axes_across(axis))
    if kind == "plane":
        position = position + step[0] * axis
    else:
        position = position + step[:2] @ across
        radius = radius + float(step[2])
    if tilts:
        axis = axis + step[-2:] @ across
        axis = axis / np.linalg.norm(axis)
    return position, axis, radius


def _step(distances: Array, jacobian: Array, trust: float) -> Array | None:
    """Give the step after which the largest of the linear distances is least; None where there is none.

    Points far within the zone bound nothing: those with the largest distances are taken first, and then those
    that the step leaves outside.
    """
    from scipy.optimize import linprog

    unknowns = jacobian.shape[1]
    count = min(len(distances), FEWEST_BOUNDS)
    bounding = np.argpartition(-np.abs(distances), count - 1)[:count]
    while True:
        some, rows = distances[bounding], jacobian[bounding]
        ones = np.ones((len(bounding), 1))
        # In units of the zone: the solver's tolerances are absolute.
        scale = float(np.abs(some).max())
        if not scale > 0:
            return None
        solved = linprog(
            np.append(np.zeros(unknowns), 1.0),
            A_ub=np.block([[rows, -ones], [-rows, -ones]]),
            b_ub=np.concatenate([-some, some]) / scale,
            bounds=[(-trust / scale, trust / scale)] * unknowns + [(0, None)],
            method="highs",
        )
        if solved.status != 0:
            return None
        step = scale * np.asarray(solved.x[:unknowns], np.float64)
        beyond = np.abs(distances + jacobian @ step)
        outside = np.flatnonzero(beyond > scale * float(solved.x[-1]) * (1 + 1e-9))
        fresh = np.setdiff1d(outside, bounding)
        if not len(fresh):
            return step
        bounding = np.concatenate([bounding, fresh[np.argsort(-beyond[fresh])][:FEWEST_BOUNDS]])
