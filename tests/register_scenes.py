"""Scans whose poses are known."""

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]


def terrain(rng: np.random.Generator, count: int, low: float, high: float, noise: float = 0.002) -> Array:
    """Give points of one uneven surface, from x = low to high and y = -1 to 1."""
    x, y = rng.uniform(low, high, count), rng.uniform(-1, 1, count)
    waves = 0.15 * np.sin(3 * x + 1) * np.cos(2.5 * y) + 0.04 * np.cos(7 * x + 4 * y)
    bumps = [(0.3, -0.4, 0.12), (-0.6, 0.5, 0.15), (1.1, 0.1, 0.1), (0.1, 0.7, -0.1), (-0.2, -0.8, 0.1)]
    z = waves + sum(size * np.exp(-((x - a) ** 2 + (y - b) ** 2) / 0.02) for a, b, size in bumps)
    return np.column_stack([x, y, z]) + noise * rng.normal(size=(count, 3))


def pose(rng: np.random.Generator, shift: float = 1.0) -> Array:
    """Give any turn, and a shift."""
    motion = np.eye(4)
    motion[:3, :3] = Rotation.from_rotvec(rng.normal(size=3) * 2).as_matrix()
    motion[:3, 3] = shift * rng.normal(size=3)
    return motion


def moved(points: NDArray[np.floating], motion: NDArray[np.floating]) -> Array:
    """Move points (n, 3) by a pose."""
    return np.asarray(points @ motion[:3, :3].T + motion[:3, 3])


def error(found: Array, truth: Array, center: Array) -> Array:
    """Give the motion (rotation vector, then translation) about a place that brings one pose onto another."""
    left = truth @ np.linalg.inv(found)
    turn = Rotation.from_matrix(left[:3, :3]).as_rotvec()
    return np.concatenate([turn, left[:3, :3] @ center + left[:3, 3] - center])
