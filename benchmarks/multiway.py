"""Whether many scans of one place get one consistent set of poses, and scans of another place are named.

python benchmarks/multiway.py --write

Eight simulated tripod scans of a storey, one in each room, of which neighbours share about 30 %; the same
with two scans of another building among them; and the Stanford bunny's views. Each scan is turned and moved
at random.
"""

from __future__ import annotations

import argparse
import os
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from descriptor_pairs import read_pairs
from machine import measured_here
from numpy.typing import NDArray
from peers import ROOT
from report import Row, markdown_table, measured_on, publish
from rich.progress import track
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import PointCloud, geometry, simulate

COMMAND = "python benchmarks/multiway.py --write"
Array = NDArray[np.float64]
TRIPOD = simulate.Lidar(lines=96, elevation=(-50.0, 60.0), steps=720, noise=0.003, max_range=12.0)
ROOMS, SIZE, OPENING = (4, 2), (6.0, 5.0, 2.8), 2.4
ANOTHER = 2
"""Scans of another building."""
DEGREES, METRES = 1.0, 0.05
"""Within which a pose in a building is right, beside the reference."""
NEAR = 0.1
"""Metres within which a point of one scan is also in another, to measure the overlap."""


@dataclass(frozen=True)
class Views:
    """Scans with their true poses; those that belong to the place."""

    scans: list[PointCloud]
    poses: list[Array]
    """T_place_scan."""
    belongs: NDArray[np.bool_]
    degrees: float
    distance: float


def storey(seed: int, others: int) -> Views:
    """Scan a storey from the middle of each room, and another building from some of its own."""
    scans, poses = _tripods(seed, ROOMS[0] * ROOMS[1], 0)
    if others:
        more, more_poses = _tripods(seed + 5000, others, 100)
        scans, poses = scans + more, poses + more_poses
    belongs = np.arange(len(scans)) < len(scans) - others
    rng = np.random.default_rng([52, seed])
    order = rng.permutation(len(scans))
    return Views([scans[k] for k in order], [poses[k] for k in order], belongs[order], DEGREES, METRES)


def _tripods(seed: int, count: int, first: int) -> tuple[list[PointCloud], list[Array]]:
    scene = simulate.storey(seed, rooms=ROOMS, size=SIZE, opening=OPENING)
    rng = np.random.default_rng([51, seed])
    scans, poses = [], []
    for number in range(count):
        i, j = number % ROOMS[0], number // ROOMS[0]
        x = (i - 0.5 * (ROOMS[0] - 1)) * SIZE[0] + rng.uniform(-0.8, 0.8)
        y = (j - 0.5 * (ROOMS[1] - 1)) * SIZE[1] + rng.uniform(-0.8, 0.8)
        pose = simulate.upright_pose(x, y, rng.uniform(1.4, 1.7), rng.uniform(0.0, 2.0 * np.pi))
        scans.append(simulate.scan(scene, TRIPOD, pose, seed=1000 * seed + first + number))
        poses.append(pose)
    return scans, poses


def bunny(data: Path, seed: int) -> Views | None:
    """Read the bunny's views, each turned and moved."""
    pairs = [pairs for pairs in read_pairs(data) if pairs.title.startswith("bunny")]
    if not pairs:
        return None
    found = pairs[0]
    known = {next(iter(found.scans)): np.eye(4)}
    while len(known) < len(found.scans):
        for (a, b), motion in found.motions.items():
            # The motion takes scan a to scan b.
            if b in known and a not in known:
                known[a] = known[b] @ motion
            elif a in known and b not in known:
                known[b] = known[a] @ geometry.inverse(motion)
    rng = np.random.default_rng([53, seed])
    scans, poses = [], []
    for name, scan in found.scans.items():
        turned = np.eye(4)
        turned[:3, :3] = Rotation.random(rng=rng).as_matrix()
        turned[:3, 3] = rng.uniform(-0.1, 0.1, 3)
        points = geometry.transform_points(turned, scan.points.astype(np.float64))
        scans.append(PointCloud(points))
        poses.append(known[name] @ geometry.inverse(turned))
    return Views(scans, poses, np.ones(len(scans), bool), 2.0, 0.002)


def overlap(views: Views) -> float:
    """Give the mean over scans that belong of the largest share that another scan of the place has, too."""
    moved = [
        geometry.transform_points(pose, scan.points[::7].astype(np.float64))
        for pose, scan in zip(views.poses, views.scans, strict=True)
    ]
    numbers = np.flatnonzero(views.belongs)
    trees = [cKDTree(points) for points in moved]
    reach = NEAR if views.distance == METRES else views.distance
    shares = [
        max(
            np.mean(trees[b].query(moved[a], distance_upper_bound=reach)[0] < reach)
            for b in numbers
            if b != a
        )
        for a in numbers
    ]
    return float(np.mean(shares))


def scores(views: Views, found: surfsig.MultiwayRegistration) -> tuple[int, int, int]:
    """Count scans with a right pose, those with a wrong one, and strangers that are named."""
    right = wrong = 0
    reference = found.reference
    to_reference = geometry.inverse(views.poses[reference])
    for number in np.flatnonzero(found.belongs):
        off = geometry.inverse(to_reference @ views.poses[number]) @ found.T_reference_scan[number]
        near = np.degrees(geometry.rotation_angle(off)) < views.degrees
        is_right = bool(
            near
            and np.linalg.norm(off[:3, 3]) < views.distance
            and views.belongs[number] == views.belongs[reference]
        )
        right, wrong = right + is_right, wrong + (not is_right)
    named = int((~found.belongs & ~views.belongs).sum())
    return right, wrong, named


def measured(name: str, every: list[Views]) -> Row:
    """Register all scans of each; give the row."""
    right = wrong = named = belong = others = whole = 0
    seconds, shares, residuals = [], [], []
    for views in track(every, description=name, transient=True):
        start = time.process_time()
        found = surfsig.register_multiway(views.scans)
        seconds.append(time.process_time() - start)
        result = scores(views, found)
        shares.append(overlap(views))
        count, apart = int(views.belongs.sum()), int((~views.belongs).sum())
        belong, others = belong + count, others + apart
        right, wrong, named = right + result[0], wrong + result[1], named + result[2]
        whole += result == (count, 0, apart)
        residuals += [pair.residual for pair in found.pairs if pair.used]
    return (
        name,
        str(len(every)),
        f"{np.mean(shares):.2f}",
        f"{right} of {belong}",
        str(wrong),
        f"{named} of {others}" if others else "-",
        f"{whole} of {len(every)}",
        f"{np.median(residuals):.2f}" if residuals else "-",
        f"{np.median(seconds):.0f}",
    )


COLUMNS = (
    "scans",
    "sets",
    "overlap with the next one",
    "poses right",
    "wrong",
    "scans of another place that are named",
    "sets all right",
    "residual over covariance, median",
    "processor seconds, median",
)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--seeds", type=int, nargs=2, default=(300, 304), help="first seed, and the one after the last"
    )
    parser.add_argument("--write", action="store_true", help="into BENCHMARKS.md")
    arguments = parser.parse_args()
    seeds = range(*arguments.seeds)
    data = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    views = [bunny(data, seed) for seed in seeds]
    rows = [measured("bunny", known)] if (known := [one for one in views if one is not None]) else []
    for name, others in (("a storey of eight rooms", 0), ("the same, and two of another", ANOTHER)):
        rows.append(measured(name, [storey(seed, others) for seed in seeds]))
    notes = [*measured_on(measured_here({})), f"The seeds are {seeds[0]} to {seeds[-1]}."]
    table = markdown_table(COLUMNS, rows)
    publish("\n\n".join([table, "\n".join(f"- {line}" for line in notes)]), COMMAND, arguments.write)


if __name__ == "__main__":
    main()
