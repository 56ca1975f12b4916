"""How far a point's nearest neighbour typically is: what a radius is chosen by."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

SAMPLES = 2000
# Clouds with more points are looked at in some cubes only, a sixteenth of their extent wide.
WHOLE = 500_000
BLOCKS = 16
# A cell holds all points within its size in the 27 cells around a point.
_AROUND = np.stack(np.meshgrid(*[[-1, 0, 1]] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
# Large odd numbers mix three cell numbers into one key. Cells that share a key cost time, nothing else.
_MIX = np.array([73856093, 19349663, 83492791], np.int64) * np.array([1, 1_000_003, 998_244_353], np.int64)


def median_spacing(points: NDArray[Any]) -> float | None:
    """Estimate the median distance to the nearest other place, from a sample of the points.

    Parameters
    ----------
    points
        (n, 3) finite coordinates. Points at the very same place count as one.

    Returns
    -------
    float or None
        In the cloud's unit; None if there are fewer than two places.
    """
    if len(points) < 2:
        return None
    rng = np.random.default_rng(0)
    sample = points[rng.choice(len(points), min(SAMPLES, len(points)), replace=False)].astype(np.float64)
    centre = np.median(sample, axis=0)
    # Between the tenth and the ninetieth percentile, so that an outlier far away does not set the cell size.
    extent = float(np.ptp(np.quantile(sample, (0.1, 0.9), axis=0), axis=0).max())
    extent = extent or float(np.ptp(points.astype(np.float64), axis=0).max())
    if extent == 0:
        return None
    size = extent / np.sqrt(len(points))
    if len(points) > WHOLE:
        local, inner = _in_some_blocks(points, centre, extent / 16, rng)
    else:
        local = points - centre
        inner = np.arange(len(local))
    chosen = rng.choice(inner, min(SAMPLES, len(inner)), replace=False)
    while True:
        nearest = _nearest_within(local, chosen, size)
        # The median is known as soon as it is within the cell size: all nearer points have been seen.
        middle = float(np.median(nearest))
        if middle <= size:
            return middle
        if size > 4 * extent:
            return middle if np.isfinite(middle) else None
        size *= 2


def _in_some_blocks(
    points: NDArray[Any], centre: NDArray[np.float64], side: float, rng: np.random.Generator
) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
    """Take the points of some cubes, and say which lie deep enough inside to see all their neighbours."""
    corner = centre + side * rng.random(3)
    seeds = points[rng.choice(len(points), BLOCKS, replace=False)] - corner
    wanted = np.unique((np.floor(seeds / side).astype(np.int64) * _MIX).sum(axis=1))
    parts = []
    for start in range(0, len(points), 1 << 18):
        local = points[start : start + (1 << 18)] - corner
        keys = (np.floor(local / side).astype(np.int64) * _MIX).sum(axis=1)
        parts.append(local[wanted[np.searchsorted(wanted, keys).clip(max=len(wanted) - 1)] == keys])
    taken = np.concatenate(parts)
    place = taken / side - np.floor(taken / side)
    inner = np.flatnonzero(((place > 0.125) & (place < 0.875)).all(axis=1))
    return taken, inner if len(inner) else np.arange(len(taken))


def _nearest_within(
    points: NDArray[np.float64], chosen: NDArray[np.intp], size: float
) -> NDArray[np.float64]:
    """Give the nearest positive distance of the chosen points, right where it is at most `size`."""
    with np.errstate(over="ignore"):
        cells = np.floor(points / size).astype(np.int64)
        keys = (cells * _MIX).sum(axis=1)
        order = np.argsort(keys, kind="stable")
        ordered = keys[order]
        wanted = ((cells[chosen, None, :] + _AROUND) * _MIX).sum(axis=2)
    first = np.searchsorted(ordered, wanted.ravel(), "left")
    counts = np.searchsorted(ordered, wanted.ravel(), "right") - first
    nearest = np.full(len(chosen), np.inf)
    # A few queries at a time keep the list of candidates short.
    for start in range(0, len(chosen), 100):
        part = slice(start * len(_AROUND), (start + 100) * len(_AROUND))
        ends = np.cumsum(counts[part])
        if not ends[-1]:
            continue
        steps = np.arange(ends[-1]) - np.repeat(ends - counts[part], counts[part])
        candidates = order[np.repeat(first[part], counts[part]) + steps]
        queries = np.repeat(np.arange(start, start + len(ends) // len(_AROUND)), len(_AROUND))
        owners = np.repeat(queries, counts[part])
        distances = np.linalg.norm(points[candidates] - points[chosen[owners]], axis=1)
        distances[distances == 0] = np.inf
        np.minimum.at(nearest, owners, distances)
    return nearest
