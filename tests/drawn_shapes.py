"""Points drawn from a unit sphere, a unit cylinder and a square, with noise across the surface."""

import numpy as np
from surface_points import Array


def sphere(rng: np.random.Generator, lowest: float, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of a unit sphere about 0, as far down as the lowest z."""
    z, turn = rng.uniform(lowest, 1, count), rng.uniform(0, 2 * np.pi, count)
    width = np.sqrt(1 - z * z)
    points = np.column_stack([width * np.cos(turn), width * np.sin(turn), z])
    return points * (1 + noise * rng.normal(size=(count, 1)))


def cylinder(rng: np.random.Generator, arc: float, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of a unit cylinder along z, of length 2, over an arc."""
    turn = rng.uniform(-arc / 2, arc / 2, count)
    radius = 1 + noise * rng.normal(size=count)
    return np.column_stack([radius * np.cos(turn), radius * np.sin(turn), rng.uniform(-1, 1, count)])


def plane(rng: np.random.Generator, noise: float = 0.0, count: int = 400) -> Array:
    """Give points of the plane z = 0, in a square of side 2."""
    return np.column_stack([rng.uniform(-1, 1, (count, 2)), noise * rng.normal(size=count)])
