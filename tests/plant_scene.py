"""A simulated plant: a hall with many pipes, most of which have few of the points."""

import math
from typing import Any

import numpy as np
import surface_scenes
from numpy.typing import NDArray
from surface_points import Array

CELL = 1.5
"""Edge of the cube in which a pipe has its place, in metres."""


def plant(pipes: int, count: int, *, noise: float, seed: int) -> surface_scenes.Known:
    """Give about `count` points of a floor, two walls, and pipes of 0.05 to 0.2 m radius along x, y or z.

    Each pipe is alone in a cube of 1.5 m; the density is the same everywhere. The parts are the floor and the
    walls, then the pipes.
    """
    rng = np.random.default_rng(seed)
    side = math.ceil(pipes ** (1 / 3))
    width = side * CELL
    radii = rng.uniform(0.05, 0.2, pipes)
    lengths = rng.uniform(0.3, 1.2, pipes)
    areas = np.array([width**2] * 3 + list(2 * math.pi * radii * lengths))
    counts = np.round(count * areas / areas.sum()).astype(int)
    parts = []
    for axis in range(3):
        flat = rng.uniform(0, width, (counts[axis], 3))
        flat[:, axis] = noise * rng.normal(size=counts[axis])
        parts.append(flat)
    cells = np.stack(np.unravel_index(rng.permutation(side**3)[:pipes], (side,) * 3), axis=1)
    for cell, radius, length, points in zip(cells, radii, lengths, counts[3:], strict=True):
        parts.append((cell + 0.5) * CELL + pipe(rng, radius, length, int(points), noise))
    return surface_scenes.joined(parts)


def pipe(rng: np.random.Generator, radius: float, length: float, count: int, noise: float) -> Array:
    """Give points of a pipe about 0, along one of the axes."""
    angles, heights = rng.uniform(0, 2 * math.pi, count), rng.uniform(-0.5, 0.5, count) * length
    away = radius + noise * rng.normal(size=count)
    along_z = np.column_stack([away * np.cos(angles), away * np.sin(angles), heights])
    return np.roll(along_z, rng.integers(3), axis=1)


def f1(owners: NDArray[np.integer[Any]], labels: NDArray[np.integer[Any]]) -> float:
    """Give the harmonic mean of precision and recall of surfaces: a match covers half of the union."""
    known, found = np.bincount(owners), np.bincount(labels[labels >= 0])
    inside = labels >= 0
    both = np.zeros((len(known), len(found)), dtype=int)
    np.add.at(both, (owners[inside], labels[inside]), 1)
    union = known[:, None] + found[None, :] - both
    matched = np.count_nonzero(both > 0.5 * union)
    return 2 * matched / (np.count_nonzero(known) + len(found))
