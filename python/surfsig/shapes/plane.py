"""The plane, by a point of it and its normal."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from surfsig.shapes.surface import Array, Surface, across, upward

if TYPE_CHECKING:
    from typing_extensions import Self

_LINE = 1e-12
"""Points whose second variance is below this part of the first lie on a line, to within rounding."""


@dataclass(frozen=True, eq=False)
class Plane(Surface):
    """Unknowns: two tilts about the center, and the shift along the normal."""

    kind = "plane"
    unknowns = 3
    radius = float("nan")

    center: Array
    axis: Array

    @classmethod
    def through(cls, points: Array) -> Self | None:
        """Give the plane of least squares: across it the covariance of the points is least."""
        mean = points.mean(axis=0)
        variances, directions = np.linalg.eigh((points - mean).T @ (points - mean))
        if not variances[1] > _LINE * variances[2]:
            return None
        return cls(mean, directions[:, 0])

    def moved(self, step: Array) -> Self:
        """Tilt it about its center, and shift it along its normal; the center is then its point next to 0."""
        u, v = across(self.axis)
        axis = self.axis + step[0] * u + step[1] * v
        axis /= np.linalg.norm(axis)
        return type(self)(((self.center + step[2] * self.axis) @ axis) * axis, axis)

    def placed(self, unit: float, origin: Array) -> Self:
        """Scale and shift it."""
        return type(self)(unit * self.center + origin, upward(self.axis))

    def distances(self, points: Array) -> Array:
        """Give the heights above it."""
        distances: Array = (points - self.center) @ self.axis
        return distances

    def jacobian(self, points: Array, step: Array) -> Array:
        """Give the places along both tilts, and what a shift does."""
        u, v = across(self.axis)
        axis = self.axis + step[0] * u + step[1] * v
        length = np.linalg.norm(axis)
        axis /= length
        offsets = points - (self.center + step[2] * self.axis)
        height = offsets @ axis
        tilts = [(offsets @ w - height * (axis @ w)) / length for w in (u, v)]
        return np.column_stack([*tilts, np.full(len(points), -(self.axis @ axis))])

    def embedding(self) -> Array:
        """Give center along the normal, and normal: (6, 3)."""
        embedding = np.zeros((6, 3))
        embedding[:3, 2] = self.axis
        embedding[3:6, :2] = np.column_stack(across(self.axis))
        return embedding
