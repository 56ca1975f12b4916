"""Why a place has the values that it has, and whose curvature that is."""

from __future__ import annotations

import enum

import numpy as np
from numpy.typing import NDArray


class Status(enum.IntEnum):
    """Why a point has the values that it has."""

    OK = 0
    """All values are there."""
    NOT_FINITE = 1
    """A coordinate is not finite: no values."""
    TOO_FEW_POINTS = 2
    """Fewer than six points in the ball: no curvature; a normal where three span a plane."""
    DEGENERATE = 3
    """The points lie on a line or a conic and determine no paraboloid: no curvature."""
    NOT_CONVERGED = 4
    """The surface's own axes did not converge: the values are of the last iteration (edges, corners)."""
    OUTSIDE_VOCABULARY = 5
    """More curved than any atom of the frame: curvature, but no signature."""
    ONE_SIDED = 6
    """The points lie mostly on one side of the place (a rim): all values are there, with larger standard
    errors, and biased where the surface is no paraboloid."""
    TOO_COARSE = 7
    """Coordinates come in steps too large for the radius (float32 at UTM coordinates): no curvature, and a
    normal of the points as they are."""


def count_statuses(statuses: NDArray[np.uint8]) -> dict[str, int]:
    """Count the places of each status, by its name in lower case; none that has no place."""
    counts = np.bincount(statuses, minlength=len(Status))
    return {status.name.lower(): int(counts[status]) for status in Status if counts[status]}


class FitUsed(enum.IntEnum):
    """Whose curvature a place has."""

    NONE = 0
    """There is none."""
    PARABOLOID = 1
    """The paraboloid's."""
    QUADRIC = 2
    """The implicit quadric's."""
