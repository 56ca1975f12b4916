"""The cylinder without ends, by a point of its axis, the axis, and the radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from surfsig import _surfsig
from surfsig.shapes.surface import Array, Surface, across, upward

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class Cylinder(Surface):
    """Unknowns: two shifts across the axis, two tilts about the center, and the radius."""

    kind = "cylinder"
    unknowns = 5

    center: Array
    axis: Array
    radius: float

    @classmethod
    def through(cls, points: Array) -> Self | None:
        """Give Taubin's cylinder, off the points' moments."""
        found = _surfsig.fit_cylinder(points)
        return None if found is None else cls(np.array(found[0]), np.array(found[1]), found[2])

    def moved(self, step: Array) -> Self:
        """Shift and tilt the axis, and let the radius grow; the center stays the axis's point next to 0."""
        u, v = across(self.axis)
        axis = self.axis + step[2] * u + step[3] * v
        axis /= np.linalg.norm(axis)
        center = self.center + step[0] * u + step[1] * v
        return type(self)(center - (center @ axis) * axis, axis, self.radius + float(step[4]))

    def placed(self, unit: float, origin: Array) -> Self:
        """Scale and shift it."""
        return type(self)(unit * self.center + origin, upward(self.axis), unit * self.radius)

    def distances(self, points: Array) -> Array:
        """Give the distances from the axis, less the radius."""
        offsets = points - self.center
        away = offsets - np.outer(offsets @ self.axis, self.axis)
        distances: Array = np.linalg.norm(away, axis=1) - self.radius
        return distances

    def jacobian(self, points: Array, step: Array) -> Array:
        """Give what a shift does, a tilt (the same, times the place along the axis), and the radius."""
        u, v = across(self.axis)
        axis = self.axis + step[2] * u + step[3] * v
        length = np.linalg.norm(axis)
        axis /= length
        offsets = points - (self.center + step[0] * u + step[1] * v)
        along = offsets @ axis
        outward = offsets - np.outer(along, axis)
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
        shift = -np.column_stack([outward @ u, outward @ v])
        return np.column_stack([shift, shift * (along / length)[:, None], np.full(len(points), -1.0)])

    def embedding(self) -> Array:
        """Give center across the axis, axis, radius: (7, 5)."""
        embedding = np.zeros((7, 5))
        embedding[:3, :2] = embedding[3:6, 2:4] = np.column_stack(across(self.axis))
        embedding[6, 4] = 1.0
        return embedding
