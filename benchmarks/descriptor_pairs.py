"""Pairs of scans with known motions, on which descriptors are compared."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

import surfsig

Array = NDArray[np.float64]

PLACES = 2500
"""Random points of each scan."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A scan, vectors to the side from which each point was seen, (n, 3), and the places asked for, (m,)."""

    points: Array
    sides: Array
    places: NDArray[np.int64]


@dataclass(frozen=True, eq=False)
class ScanPairs:
    """Scans, pairs of their names with T_second_first, and what counts as the same place."""

    title: str
    scans: dict[str, Scan]
    motions: dict[tuple[str, str], Array]
    radius: float
    tolerance: float


def read_pairs(data: Path) -> list[ScanPairs]:
    """Read all that the folder has."""
    found = []
    kitchen, bunny = data / "registration/redkitchen", data / "registration/bunny"
    if kitchen.is_dir():
        found += [_redkitchen(kitchen, guessed) for guessed in (False, True)]
    if bunny.is_dir():
        found.append(_bunny(bunny))
    return found


def _scan(path: Path, number: int, viewpoint: Array | None) -> Scan:
    """Read one; without a viewpoint, its normals are taken to point away from its centroid."""
    points = surfsig.read(path).points.astype(np.float64)
    sides = points - points.mean(axis=0) if viewpoint is None else viewpoint - points
    places = np.random.default_rng(number).choice(len(points), PLACES, replace=False)
    return Scan(points, sides, np.sort(places))


def _redkitchen(folder: Path, guessed: bool) -> ScanPairs:
    """Six pairs of fragments of a room, each in the axes of its first camera."""
    lines = [line.split() for line in (folder / "gt.log").read_text().splitlines() if line.strip()]
    motions = {}
    for start in range(0, len(lines), 5):
        target, source = lines[start][:2]
        motions[source, target] = np.array(lines[start + 1 : start + 5], dtype=np.float64)
    names = sorted({name for pair in motions for name in pair})
    viewpoint = None if guessed else np.zeros(3)
    scans = {name: _scan(folder / f"cloud_bin_{name}.ply", int(name), viewpoint) for name in names}
    known = "normals away from the centroid" if guessed else "viewpoints known"
    return ScanPairs(f"redkitchen, {known}", scans, motions, radius=0.5, tolerance=0.1)


def _bunny(folder: Path) -> ScanPairs:
    """Neighbouring views of the bunny, 45 degrees apart."""
    poses = {}
    for line in (folder / "bun.conf").read_text().splitlines():
        kind, *values = line.split() or [""]
        if kind == "bmesh":
            # The file's quaternions turn the world into the scan.
            pose = np.eye(4)
            pose[:3, :3] = Rotation.from_quat([float(v) for v in values[4:8]]).as_matrix().T
            pose[:3, 3] = [float(v) for v in values[1:4]]
            poses[values[0].removesuffix(".ply")] = pose
    pairs = (("bun000", "bun045"), ("bun045", "bun090"), ("bun315", "bun000"))
    motions = {(a, b): np.linalg.inv(poses[b]) @ poses[a] for a, b in pairs}
    names = sorted({name for pair in pairs for name in pair})
    scans = {name: _scan(folder / f"{name}.ply", number, None) for number, name in enumerate(names)}
    title = "bunny, neighbouring views, normals away from the centroid"
    return ScanPairs(title, scans, motions, radius=0.02, tolerance=0.002)
