"""A small town in files, for what is worked on in tiles."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig import Extraction, PointCloud, write

RADIUS = 0.9
ORIGIN = np.array([389_000.0, 5_819_000.0, 40.0])


def town(count: int = 12_000, seed: int = 5) -> PointCloud:
    """Points on rolling ground with two blocks on it, of 40 by 24 m, on steps of a millimetre."""
    rng = np.random.default_rng(seed)
    x, y = rng.uniform(0, 40, count), rng.uniform(0, 24, count)
    z = 0.6 * np.sin(0.4 * x) * np.cos(0.3 * y) + rng.normal(0, 0.01, count)
    z += 3.0 * ((abs(x - 12) < 4) & (abs(y - 10) < 3)) + 5.0 * ((abs(x - 28) < 3) & (abs(y - 15) < 5))
    offsets = np.round(np.column_stack([x, y, z]), 3)
    fields: dict[str, NDArray[Any]] = {
        "intensity": rng.integers(0, 60_000, count).astype(np.uint16),
        "gps_time": np.sort(rng.uniform(0, 100, count)),
        "red": rng.integers(0, 256, count).astype(np.uint8),
        "green": rng.integers(0, 256, count).astype(np.uint8),
        "blue": rng.integers(0, 256, count).astype(np.uint8),
        "height": rng.normal(0, 1, count).astype(np.float32),
    }
    return PointCloud(offsets, ORIGIN, viewpoint=ORIGIN + np.array([20.0, 10, 60]), fields=fields)


def town_files(folder: Path, count: int = 12_000, suffix: str = ".laz", files: int = 3) -> list[Path]:
    """Write the town into files, one behind the other in no order of place."""
    cloud = town(count)
    folder.mkdir(parents=True, exist_ok=True)
    paths = []
    for number, part in enumerate(np.array_split(np.arange(count), files)):
        paths.append(folder / f"part_{number}{suffix}")
        write(paths[-1], cloud.at(part))
    return paths


def bits(found: Extraction) -> dict[str, bytes]:
    """Give all columns as bytes."""
    return {name: np.ascontiguousarray(values).tobytes() for name, values in found.columns().items()}


def in_order(parts: PointCloud) -> PointCloud:
    """Give the points of parts in the order of the input, by their numbers."""
    return parts.at(np.argsort(parts.fields["point_number"]))


def check_equal(parts: PointCloud, whole: PointCloud, found: Extraction) -> None:
    """Compare the points of all parts with the whole cloud and its extraction, bit by bit."""
    np.testing.assert_array_equal(
        np.sort(parts.fields["point_number"]), np.arange(len(whole)), "each point is written once"
    )
    parts = in_order(parts)
    np.testing.assert_array_equal(parts.points, whole.points)
    columns = found.columns()
    for name, values in {**whole.fields, **columns}.items():
        stored = parts.fields[name]
        expected = np.ascontiguousarray(values)
        assert np.ascontiguousarray(stored.astype(expected.dtype)).tobytes() == expected.tobytes(), name
