"""An ellipsoid: a free-form surface to whoever knows planes, spheres, cylinders, cones and tori only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from .poses import Array
from .ray_crossings import round_crossings
from .surfaces import Surface


@dataclass(frozen=True)
class Ellipsoid(Surface):
    """An ellipsoid about the origin.

    Parameters
    ----------
    semi_axes : (float, float, float)
        Along x, y and z, in metres.
    """

    semi_axes: tuple[float, float, float]

    def __post_init__(self) -> None:
        self._check_lengths()

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return max(self.semi_axes)

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 2."""
        # Scaled along its axes it is the unit sphere, and the ray's parameters stay what they are.
        return round_crossings(origins / self.semi_axes, directions / self.semi_axes, 1.0)

    def implicit(self, points: Array) -> Array:
        """Distance from the middle in semi-axes, less one, times the shortest of them."""
        return np.asarray((np.linalg.norm(points / self.semi_axes, axis=1) - 1.0) * min(self.semi_axes))

    def normals(self, points: Array) -> Array:
        """Along the gradient of the sum of (x / a)^2."""
        gradient = points / np.square(self.semi_axes)
        return np.asarray(gradient / np.linalg.norm(gradient, axis=1, keepdims=True))

    def curvatures(self, points: Array) -> Array:
        """From the mean and Gaussian curvature of an implicit quadric."""
        squares = np.square(self.semi_axes)
        steepness = np.sum((points / squares) ** 2, axis=1)
        gaussian = 1.0 / (np.prod(squares) * steepness**2)
        mean = (squares.sum() - np.sum(points**2, axis=1)) / (2.0 * np.prod(squares) * steepness**1.5)
        half = np.sqrt(np.maximum(mean**2 - gaussian, 0.0))
        return np.stack([mean + half, mean - half], axis=1)
