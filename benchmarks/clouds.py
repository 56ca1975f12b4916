"""The clouds that everything here is timed on."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

SCALING_POINTS = 2_000_000
"""Points of the large clouds: 2,350 neighbours each at a radius of 0.02, ten times as many on a tenth."""

NEIGHBOUR_SAMPLE = 1000
"""At how many points the mean number of neighbours is taken, the same ones for every method."""


def bumpy_square(points: int) -> npt.NDArray[np.float32]:
    """Return a bumpy unit square in random order, with noise of 0.0002.

    Parameters
    ----------
    points : int
        How many points; at 200,000 a ball of radius 0.02 holds 235 of them.

    Returns
    -------
    (points, 3) float32
        The same values on every machine: the seed is fixed.
    """
    random = np.random.default_rng(1)
    x, y = random.uniform(0, 1, (2, points))
    return _bumpy(x, y, random)


def bumpy_tenth(points: int) -> npt.NDArray[np.float32]:
    """Return the points of `bumpy_square` brought closer: a tenth of the area, over bumps as wide as before.

    Parameters
    ----------
    points : int
        How many points; at 2,000,000 a ball of radius 0.02 holds 22,300 of them.

    Returns
    -------
    (points, 3) float32
        Ten times as dense as the square, with the same noise, and the same values on every machine.
    """
    x, y = 10**-0.5 * bumpy_square(points)[:, :2].T.astype(np.float64)
    return _bumpy(x, y, np.random.default_rng(2))


def _bumpy(
    x: npt.NDArray[np.float64], y: npt.NDArray[np.float64], random: np.random.Generator
) -> npt.NDArray[np.float32]:
    bumps = 0.05 * np.sin(7 * x) * np.cos(9 * y) + 0.01 * np.sin(40 * x + 3) * np.sin(31 * y)
    return np.column_stack([x, y, bumps + random.normal(0, 2e-4, len(x))]).astype(np.float32)


def evenly_spaced(wanted: int, available: int) -> npt.NDArray[np.int64]:
    """Return the indices of `wanted` points spread over the file's order (0: all of them)."""
    count = min(wanted, available) if wanted else available
    return np.arange(count, dtype=np.int64) * available // count


def mean_neighbours(cloud: npt.NDArray[np.float32], radius: float) -> float:
    """Return how many points lie within `radius` of a point, itself included, on average over a sample."""
    doubles = np.ascontiguousarray(cloud.T, dtype=np.float64)
    counts = []
    for index in evenly_spaced(NEIGHBOUR_SAMPLE, len(cloud)):
        near = np.flatnonzero(np.abs(doubles[0] - doubles[0, index]) <= radius)
        offsets = doubles[:, near] - doubles[:, index, None]
        counts.append(np.count_nonzero(np.einsum("ij,ij->j", offsets, offsets) <= radius**2))
    return float(np.mean(counts))
