"""Long surfaces with known sizes in files, for surfaces that go on from tile to tile."""

from __future__ import annotations

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from surfsig import PointCloud, write

ORIGIN = np.array([389_000.0, 5_819_000.0, 40.0])
NOISE = 0.01
LENGTH = 60.0
RADIUS = 0.3


def wall(rng: np.random.Generator, count: int, y: float, x: tuple[float, float]) -> NDArray[np.float64]:
    """Points of a wall along x, 3 m high, with noise across it."""
    place = rng.uniform(x[0], x[1], count), y + rng.normal(0, NOISE, count), rng.uniform(0, 3, count)
    return np.column_stack(place)


def pipe(rng: np.random.Generator, count: int, y: float, x: tuple[float, float]) -> NDArray[np.float64]:
    """Points of the front of a pipe along x, with noise of its radius."""
    turn = rng.uniform(-2.2, 2.2, count)
    away = RADIUS + rng.normal(0, NOISE, count)
    return np.column_stack(
        [rng.uniform(x[0], x[1], count), y - away * np.cos(turn), 1.5 + away * np.sin(turn)]
    )


def plant(seed: int = 3, density: float = 50.0) -> tuple[PointCloud, NDArray[np.int64]]:
    """A wall, two parallel pipes, and a wall with a step of eight standard deviations in its middle.

    The second array says which of the five surfaces each point is of.
    """
    rng = np.random.default_rng(seed)
    everywhere = 0.0, LENGTH
    parts = [
        wall(rng, int(3 * LENGTH * density), 0.0, everywhere),
        pipe(rng, int(1.4 * LENGTH * density), 3.0, everywhere),
        pipe(rng, int(1.4 * LENGTH * density), 3.8, everywhere),
        wall(rng, int(1.5 * LENGTH * density), 6.0, (0.0, LENGTH / 2)),
        wall(rng, int(1.5 * LENGTH * density), 6.0 + 8 * NOISE, (LENGTH / 2, LENGTH)),
    ]
    truth = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
    order = rng.permutation(len(truth))
    points = np.round(np.concatenate(parts)[order], 4)
    fields = {"truth": truth[order].astype(np.uint8)}
    return PointCloud(points, ORIGIN, fields=fields), truth[order]


def plant_files(folder: Path, files: int = 2, **scene: float) -> list[Path]:
    """Write the plant into files, each with points from everywhere."""
    cloud, _ = plant(**scene)  # type: ignore[arg-type]
    folder.mkdir(parents=True)
    paths = []
    for number, part in enumerate(np.array_split(np.arange(len(cloud)), files)):
        paths.append(folder / f"part_{number}.laz")
        write(paths[-1], cloud.at(part))
    return paths
