"""Time surfsig's curvature as a cloud gets denser, and its kinds of fit: tables for BENCHMARKS.md.

python benchmarks/density.py

All in one process, in turns; the medians are printed, and the ranges of the ratios.
"""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from clouds import bumpy_square
from numpy.typing import NDArray
from timing import seconds_of

import surfsig

ROUNDS, RADIUS, DENSEST = 5, 0.02, 2_000_000


def main() -> None:
    """Print both tables."""
    densest = bumpy_square(DENSEST)
    clouds = [bumpy_square(200_000), densest]
    # A hundred times as dense as the first: all points of a square whose area is a tenth of the second's.
    clouds.append(_squeezed(densest, 10**-0.5))
    print("| neighbours | points | points/s | cost per point (range) |\n| --- | --- | --- | --- |")
    _table([(lambda cloud=cloud: surfsig.extract(cloud, RADIUS)) for cloud in clouds])  # type: ignore[misc]
    sparse = clouds[0]
    print("\n| fit | points | points/s | cost per point (range) |\n| --- | --- | --- | --- |")
    jobs: list[Callable[[], surfsig.Extraction]] = [
        lambda: surfsig.extract(sparse, RADIUS),
        lambda: surfsig.extract(sparse, RADIUS, fit="quadric"),
        lambda: surfsig.extract(sparse, RADIUS, fit="auto"),
        lambda: surfsig.extract(sparse, RADIUS, robust=True),
        lambda: surfsig.extract(sparse, neighbors=235),
    ]
    _table(jobs, ["paraboloid", "quadric", "auto", "paraboloid, robust", "paraboloid, 235 nearest"])


def _squeezed(cloud: NDArray[np.float32], factor: float) -> NDArray[np.float32]:
    """Bring the points closer in x and y, over bumps as wide as before, with the noise as it was."""
    x, y = (factor * cloud[:, axis].astype(np.float64) for axis in (0, 1))
    bumps = 0.05 * np.sin(7 * x) * np.cos(9 * y) + 0.01 * np.sin(40 * x + 3) * np.sin(31 * y)
    z = bumps + np.random.default_rng(2).normal(0, 2e-4, len(cloud))
    return np.column_stack([x, y, z]).astype(np.float32)


def _table(jobs: list[Callable[[], surfsig.Extraction]], names: list[str] | None = None) -> None:
    found = [job() for job in jobs]
    seconds = np.array([[seconds_of(job) for job in jobs] for _ in range(ROUNDS)])
    per_point = seconds / [len(s) for s in found]
    ratios = per_point / per_point[:, :1]
    for i, s in enumerate(found):
        name = names[i] if names else f"{s.count.mean():,.0f}"
        low, middle, high = np.quantile(ratios[:, i], (0, 0.5, 1))
        rate = 1 / np.median(per_point[:, i])
        print(f"| {name} | {len(s):,} | {rate:,.0f} | {middle:.2f} ({low:.2f} to {high:.2f}) |")


if __name__ == "__main__":
    main()
