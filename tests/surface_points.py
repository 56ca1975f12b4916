"""Points on surfaces whose curvature is known, for the tests of the extraction."""

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

UTM = np.array([500_000.0, 4_500_000.0, 100.0])


def rotation(rng: np.random.Generator) -> Array:
    """Return a rotation, every one as likely as any other."""
    q, r = np.linalg.qr(rng.normal(size=(3, 3)))
    q *= np.sign(np.diag(r))
    turned: Array = q * np.sign(np.linalg.det(q))
    return turned


def turn(axis: int, degrees: float) -> Array:
    """Return the rotation about a coordinate axis."""
    c, s = np.cos(np.radians(degrees)), np.sin(np.radians(degrees))
    matrix = np.eye(3)
    i, j = (axis + 1) % 3, (axis + 2) % 3
    matrix[i, i], matrix[i, j], matrix[j, i], matrix[j, j] = c, -s, s, c
    return matrix


@dataclass(frozen=True)
class Shape:
    """A surface through 0 with the normal +z there, and its curvature as seen from +z, x along k1."""

    name: str
    k1: float
    k2: float
    height: Callable[[Array, Array], Array]

    def points(self, rng: np.random.Generator, radius: float, count: int = 1500) -> Array:
        """Return points (count, 3) about 0, about a third of them within the radius."""
        x, y = 1.6 * radius * rng.uniform(-1, 1, (2, count))
        return np.column_stack([x, y, self.height(x, y)])


def plane() -> Shape:
    """Return z = 0."""
    return Shape("plane", 0.0, 0.0, lambda x, y: 0 * x)


def sphere(radius: float) -> Shape:
    """Return a sphere's top: table I, K = 1 / r^2, H = 1 / r."""
    return Shape("sphere", 1 / radius, 1 / radius, lambda x, y: np.sqrt(radius**2 - x**2 - y**2) - radius)


def cylinder(radius: float) -> Shape:
    """Return a cylinder along y: table I, K = 0, H = 1 / 2 r."""
    return Shape("cylinder", 1 / radius, 0.0, lambda x, y: np.sqrt(radius**2 - x**2) - radius)


def paraboloid(k1: float, k2: float) -> Shape:
    """Return a paraboloid; a saddle where the signs differ."""
    return Shape("saddle", k1, k2, lambda x, y: -0.5 * (k1 * x**2 + k2 * y**2))


def rough_surface(seed: int, count: int = 1200) -> Array:
    """Return a bumpy, noisy height field over the square from -1 to 1, (count, 3): for radii of about 0.3."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(-1, 1, (2, count))
    a, b, c = rng.uniform(-0.4, 0.4, 3)
    z = a * x**2 + b * y**2 + c * x * y + 0.1 * np.sin(3 * x + 1) * np.cos(2 * y) + 0.2 * x - 0.1 * y
    return np.column_stack([x, y, z + rng.normal(0, 0.01, count)])
