"""Time surfsig's curvature as a cloud gets denser, kinds of fit, several radii: tables for BENCHMARKS.md.

python benchmarks/density.py --write

All in one process, in turns; the medians are reported, and the ranges of the ratios.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import numpy as np
from clouds import SCALING_POINTS, bumpy_square, bumpy_tenth
from machine import measured_here
from numpy.typing import NDArray
from report import TARGET_POINTS, TARGET_RADIUS, Row, markdown_table, measured_on, publish
from timing import times_of

import surfsig

ROUNDS = 5
CLOSE_RADII = (0.6, 0.7, 0.8, 0.9, 1.0)
RADII_LADDER = (1 / 4, 1 / 2.83, 1 / 2, 1 / 1.41, 1.0)
COLUMNS = ("neighbours", "points", "points/s", "cost per point (range)", "the same in processor time")

Job = Callable[[], surfsig.Extraction]


def main() -> None:
    """Print the tables, and write them into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    facts = measured_here()
    sparse = bumpy_square(TARGET_POINTS)
    clouds = (sparse, bumpy_square(SCALING_POINTS), bumpy_tenth(SCALING_POINTS))
    parts = [
        table("cloud", [(f"{len(c):,} points", one_radius(c)) for c in clouds]),
        table("fit", kinds_of_fit(sparse)),
        table("radii", several_radii(sparse)),
        table("radii", several_radii(bumpy_tenth(TARGET_POINTS))),
        "\n".join(f"- {note}" for note in measured_on(facts)),
    ]
    text = "\n\n".join(parts)
    publish(text, "python benchmarks/density.py --write", arguments.write)


def one_radius(cloud: NDArray[np.float32]) -> Job:
    """Return the extraction at one radius, with everything at its default."""
    return lambda: surfsig.extract(cloud, TARGET_RADIUS)


def kinds_of_fit(cloud: NDArray[np.float32]) -> list[tuple[str, Job]]:
    """Return an extraction with each kind of fit, and one with nearest points."""
    return [
        ("paraboloid", one_radius(cloud)),
        ("quadric", lambda: surfsig.extract(cloud, TARGET_RADIUS, fit="quadric")),
        ("auto", lambda: surfsig.extract(cloud, TARGET_RADIUS, fit="auto")),
        ("paraboloid, robust", lambda: surfsig.extract(cloud, TARGET_RADIUS, robust=True)),
        ("paraboloid, 235 nearest", lambda: surfsig.extract(cloud, neighbors=235)),
    ]


def several_radii(cloud: NDArray[np.float32]) -> list[tuple[str, Job]]:
    """Return the extraction at the largest radius, at five of them, and where each point chooses its own."""

    def one_pass(shares: tuple[float, ...]) -> surfsig.Extraction:
        return surfsig.extract_radii(cloud, [share * TARGET_RADIUS for share in shares])[-1]

    def one_by_one(shares: tuple[float, ...]) -> surfsig.Extraction:
        return [surfsig.extract(cloud, share * TARGET_RADIUS) for share in shares][-1]

    return [
        ("r = 0.02", one_radius(cloud)),
        ("0.6 r, 0.7 r, 0.8 r, 0.9 r, r", lambda: one_pass(CLOSE_RADII)),
        ("the same, one by one", lambda: one_by_one(CLOSE_RADII)),
        ("r/4, r/2.83, r/2, r/1.41, r", lambda: one_pass(RADII_LADDER)),
        ("the same, one by one", lambda: one_by_one(RADII_LADDER)),
        ('"auto"', lambda: surfsig.extract(cloud, "auto")),
    ]


def table(title: str, jobs: list[tuple[str, Job]]) -> str:
    """Time the jobs in turns and compare each one's cost per point with the first one's in the same round."""
    found = [job() for _, job in jobs]
    points = np.array([len(s) for s in found])
    times = np.array([[times_of(job) for _, job in jobs] for _ in range(ROUNDS)])
    cost = times / points[:, None]
    low, middle, high = np.quantile(cost / cost[:, :1], (0, 0.5, 1), axis=0)
    rates = 1 / np.median(cost[:, :, 0], axis=0)
    rows: list[Row] = []
    for i, (name, _) in enumerate(jobs):
        ratios = [f"{middle[i, t]:.2f} ({low[i, t]:.2f} to {high[i, t]:.2f})" for t in (0, 1)]
        rows.append((name, f"{found[i].count.mean():,.0f}", f"{points[i]:,}", f"{rates[i]:,.0f}", *ratios))
    return markdown_table((title, *COLUMNS), rows)


if __name__ == "__main__":
    main()
