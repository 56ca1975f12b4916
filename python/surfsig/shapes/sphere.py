"""The sphere, by its center and radius."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from surfsig import _surfsig
from surfsig.shapes.surface import Array, Surface

if TYPE_CHECKING:
    from typing_extensions import Self


@dataclass(frozen=True, eq=False)
class Sphere(Surface):
    """Unknowns: the center's three coordinates, and the radius."""

    kind = "sphere"
    unknowns = 4
    axis = None

    center: Array
    radius: float

    @classmethod
    def through(cls, points: Array) -> Self | None:
        """Give Taubin's sphere, off the points' moments."""
        found = _surfsig.fit_sphere(points)
        return None if found is None else cls(np.array(found[0]), found[1])

    def moved(self, step: Array) -> Self:
        """Move the center, and let the radius grow."""
        return type(self)(self.center + step[:3], self.radius + float(step[3]))

    def placed(self, unit: float, origin: Array) -> Self:
        """Scale and shift it."""
        return type(self)(unit * self.center + origin, unit * self.radius)

    def distances(self, points: Array) -> Array:
        """Give the distances from the center, less the radius."""
        distances: Array = np.linalg.norm(points - self.center, axis=1) - self.radius
        return distances

    def jacobian(self, points: Array, step: Array) -> Array:
        """Give minus the outward normals, and -1."""
        outward = points - (self.center + step[:3])
        outward /= np.maximum(np.linalg.norm(outward, axis=1, keepdims=True), np.finfo(float).tiny)
        return np.column_stack([-outward, np.full(len(points), -1.0)])

    def embedding(self) -> Array:
        """Give the identity: the unknowns are what is reported."""
        return np.eye(4)
