"""Scenes of surfaces that are known, for the tests of what is found in them."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from surface_points import Array

TAU = 2 * np.pi


@dataclass(frozen=True)
class Known:
    """Points, and which part each is of."""

    points: Array
    owners: NDArray[np.intp]


def joined(parts: Sequence[Array]) -> Known:
    """Put parts together."""
    return Known(np.concatenate(parts), np.repeat(np.arange(len(parts)), [len(part) for part in parts]))


def on_a_plane(noise: float = 0.001, seed: int = 3) -> Known:
    """Give half a sphere of radius 0.3 at (0.6, 0, 0), a pipe of radius 0.2 along x = -0.6, y = 0, z = 0 to
    0.8, and the floor z = 0 around them, 3 x 3."""
    rng = np.random.default_rng(seed)
    towards = rng.normal(size=(3000, 3))
    towards /= np.linalg.norm(towards, axis=1)[:, None]
    towards[:, 2] = abs(towards[:, 2])
    ball = (0.3 + noise * rng.normal(size=(3000, 1))) * towards + [0.6, 0, 0]
    turns, distance = rng.uniform(0, TAU, 4000), 0.2 + noise * rng.normal(size=4000)
    height = rng.uniform(0, 0.8, 4000)
    pipe = np.column_stack([-0.6 + distance * np.cos(turns), distance * np.sin(turns), height])
    x, y = rng.uniform(-1.5, 1.5, (2, 12_000))
    floor = np.column_stack([x, y, noise * rng.normal(size=12_000)])
    away = np.minimum(np.hypot(x - 0.6, y) - 0.3, np.hypot(x + 0.6, y) - 0.2)
    return joined([ball, pipe, floor[away > 0]])


def box(sides: tuple[float, float, float] = (2.0, 1.0, 0.5), noise: float = 0.001) -> Known:
    """Give a box about 0: its sides across x from below and above, then y, then z."""
    rng = np.random.default_rng(4)
    parts = []
    for axis, other in ((0, (1, 2)), (1, (2, 0)), (2, (0, 1))):
        for side in (-0.5, 0.5):
            count = int(4000 * sides[other[0]] * sides[other[1]])
            part = rng.uniform(-0.5, 0.5, (count, 3))
            part[:, axis] = side
            part *= sides
            part[:, axis] += noise * rng.normal(size=count)
            parts.append(part)
    return joined(parts)


def cone(half_angle: float, noise: float = 0.001, count: int = 6000) -> Array:
    """Give a cone along z with its apex at 0, of the heights 0.5 to 1.5."""
    rng = np.random.default_rng(5)
    height = np.sqrt(rng.uniform(0.25, 2.25, count))
    turns, off = rng.uniform(0, TAU, count), noise * rng.normal(size=count)
    radius = height * np.tan(half_angle) + off * np.cos(half_angle)
    height = height - off * np.sin(half_angle)
    return np.column_stack([radius * np.cos(turns), radius * np.sin(turns), height])


def torus(major_radius: float, radius: float, noise: float = 0.001, count: int = 8000) -> Array:
    """Give a torus about z with its center at 0."""
    rng = np.random.default_rng(6)
    around, tube = rng.uniform(0, TAU, (2, 2 * count))
    kept = rng.uniform(0, major_radius + radius, 2 * count) < major_radius + radius * np.cos(tube)
    around, tube = around[kept][:count], tube[kept][:count]
    thick = radius + noise * rng.normal(size=len(tube))
    away = major_radius + thick * np.cos(tube)
    return np.column_stack([away * np.cos(around), away * np.sin(around), thick * np.sin(tube)])
