"""Whether scans are registered that share little, or of which one is a tenth of the other.

python benchmarks/low_overlap.py --write

Simulated tripod scans of neighbouring rooms, simulated scans of rooms, and real pairs (redkitchen, bunny),
cut so that a fifth is in common, or to a ball with a tenth of the source; with and without viewpoints.
"""

from __future__ import annotations

import argparse
import os
import time
from collections.abc import Callable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from peers import ROOT
from registration import Pair as RealPair
from registration import known_pairs
from report import Row, markdown_table, measured_on, publish
from rich.progress import track
from scipy.spatial import cKDTree

import surfsig
from surfsig import PointCloud, geometry, simulate

COMMAND = "python benchmarks/low_overlap.py --write"
Array = NDArray[np.float64]
TRIPOD = simulate.Lidar(lines=96, elevation=(-50.0, 60.0), steps=720, noise=0.003, max_range=12.0)
LIDAR = simulate.Lidar(lines=32, elevation=(-25.0, 25.0), noise=0.01)
IN_COMMON, PART = 0.2, 0.1
"""Share of both scans that is in common after cutting them apart; share of the source's points in a ball."""
NEAR = {"simulated": 0.1, "redkitchen": 0.05, "bunny": 0.002}
"""Distance within which a point is in the other scan, too, in the scans' unit, to measure the overlap."""
DEGREES, METRES = 2.0, 0.1
"""Within which a simulated pose is right."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two scans with their true pose, in which kind of data, and how far off a right pose may be.

    The distance is that of the source's middle: where its origin lies, says nothing about the pose.
    """

    source: PointCloud
    target: PointCloud
    truth: Array
    kind: str
    degrees: float
    distance: float

    def in_common(self, step: int) -> NDArray[np.bool_]:
        """Tell which of the source's points, one in so many, the target has, too."""
        moved = geometry.transform_points(self.truth, self.source.points[::step].astype(np.float64))
        tree = cKDTree(self.target.points)
        reach = NEAR[self.kind]
        return np.asarray(tree.query(moved, distance_upper_bound=reach)[0] < reach)

    def overlap(self) -> float:
        """Give the share of the source that the target has, too."""
        return float(np.mean(self.in_common(5)))

    def is_right(self, pose: Array) -> bool:
        """Tell whether a pose is near the true one."""
        if not np.isfinite(pose).all():
            return False
        left = geometry.inverse(self.truth) @ pose
        middle = np.median(self.source.points, axis=0).astype(np.float64)
        moved = geometry.transform_points(left, middle[np.newaxis])[0]
        turn = np.degrees(geometry.rotation_angle(left))
        return bool(turn < self.degrees and np.linalg.norm(moved - middle) < self.distance)

    def blind(self) -> Pair:
        """Forget from where both were seen, and move the source, whose origin might tell it."""
        move = geometry.exp_twist(np.array([0.4, -0.7, 1.9, 3.0, -2.0, 1.0]))
        return replace(
            self,
            source=PointCloud(geometry.transform_points(move, self.source.points.astype(np.float64))),
            target=PointCloud(self.target.points),
            truth=self.truth @ geometry.inverse(move),
        )


def next_room(seed: int) -> Pair:
    """Scan a storey from two neighbouring rooms."""
    size = (6.0, 5.0, 2.8)
    scene = simulate.storey(seed, rooms=(2, 1), size=size, opening=2.4)
    rng = np.random.default_rng([61, seed])
    poses = [
        simulate.upright_pose(
            side * 0.5 * size[0] + rng.uniform(-0.8, 0.8),
            rng.uniform(-0.8, 0.8),
            rng.uniform(1.4, 1.7),
            rng.uniform(0.0, 2.0 * np.pi),
        )
        for side in (-1.0, 1.0)
    ]
    return _simulated(scene, TRIPOD, poses, seed)


def one_room(seed: int) -> Pair:
    """Scan a room twice."""
    rng = np.random.default_rng([62, seed])
    poses = []
    for _ in range(2):
        x, y = rng.uniform(-0.5, 0.5, 2)
        poses.append(simulate.upright_pose(x, y, 1.3, rng.uniform(0.0, 2.0 * np.pi)))
    return _simulated(simulate.room(seed), LIDAR, poses, seed)


def _simulated(scene: simulate.Scene, sensor: simulate.Lidar, poses: list[Array], seed: int) -> Pair:
    source, target = (
        simulate.scan(scene, sensor, pose, seed=2 * seed + number) for number, pose in enumerate(poses)
    )
    return Pair(source, target, geometry.inverse(poses[1]) @ poses[0], "simulated", DEGREES, METRES)


def a_part(pair: Pair, seed: int) -> Pair:
    """Keep of the source a ball about a point that both have, with a tenth of its points."""
    rng = np.random.default_rng([63, seed])
    points = pair.source.points
    middle = points[rng.choice(np.flatnonzero(pair.in_common(1)))]
    distances = np.linalg.norm(points - middle, axis=1)
    return replace(pair, source=_some(pair.source, distances <= np.quantile(distances, PART)))


def _some(cloud: PointCloud, chosen: NDArray[np.bool_]) -> PointCloud:
    return PointCloud(cloud.points[chosen], viewpoint=cloud.viewpoint)


def cut_apart(pair: Pair, seed: int) -> Pair:
    """Keep of both scans a side of a plane at random, so that a fifth of what is left is in common."""
    rng = np.random.default_rng([64, seed])
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    moved = geometry.transform_points(pair.truth, pair.source.points.astype(np.float64))
    ours, theirs = moved @ normal, pair.target.points @ normal
    # A band with a share b of all: each scan keeps (1 + b) / 2, of which b is c where b = c / (2 - c).
    band = IN_COMMON / (2.0 - IN_COMMON)
    low, high = np.quantile(np.concatenate([ours, theirs]), (0.5 - 0.5 * band, 0.5 + 0.5 * band))
    return replace(pair, source=_some(pair.source, ours > low), target=_some(pair.target, theirs < high))


def changed(draw: Callable[[int], Pair], change: Callable[[Pair, int], Pair]) -> Callable[[int], Pair]:
    """Change each pair that is drawn."""
    return lambda seed: change(draw(seed), seed)


def real(pairs: list[RealPair], kind: str) -> Callable[[int], Pair]:
    """Give real pairs by number, all in turn."""

    def pair(seed: int) -> Pair:
        one = pairs[seed % len(pairs)]
        assert one.truth is not None
        return Pair(
            PointCloud(one.source, viewpoint=np.zeros(3)),
            PointCloud(one.target, viewpoint=np.zeros(3)),
            one.truth,
            kind,
            one.degrees,
            one.distance,
        )

    return pair


def cases(data: Path) -> Iterator[tuple[str, Callable[[int], Pair]]]:
    """Give all kinds of pairs, each drawn by a seed."""
    yield "neighbouring rooms", next_room
    yield "a tenth of a scan of a room", changed(one_room, a_part)
    found = known_pairs(data)
    for kind in ("redkitchen", "bunny"):
        if kind in found:
            draw = real(found[kind], kind)
            yield f"{kind}, a fifth in common", changed(draw, cut_apart)
            yield f"{kind}, a tenth of the source", changed(draw, a_part)


def measured(name: str, draw: Callable[[int], Pair], seeds: range, known: bool, detail: bool) -> Row:
    """Register all pairs of a kind; give its row."""
    right = trusted = both = 0
    shares, ratios, seconds = [], [], []
    for seed in track(seeds, description=name, transient=True):
        pair = draw(seed) if known else draw(seed).blind()
        start = time.process_time()
        found = surfsig.register(pair.source, pair.target)
        seconds.append(time.process_time() - start)
        shares.append(pair.overlap())
        is_right = pair.is_right(found.T_target_source)
        ratios.append(found.inliers / max(found.matches, 1) if is_right else np.nan)
        right, trusted, both = right + is_right, trusted + found.trusted, both + (is_right and found.trusted)
        if detail:
            words = f"overlap {shares[-1]:.2f}, right {is_right:d}, trusted {found.trusted:d}, {found.doubts}"
            print(f"{name} {seed}: {words}, {found.inliers} of {found.matches}, {found!r}", flush=True)
    return (
        name,
        "known" if known else "not known",
        f"{np.median(shares):.2f}",
        f"{right} of {len(seeds)}",
        f"{both} of {right}",
        str(trusted - both),
        f"{np.nanmedian(ratios):.2f}" if right else "-",
        f"{np.median(seconds):.1f}",
    )


COLUMNS = (
    "pairs",
    "viewpoints",
    "overlap, median",
    "right",
    "trusted of right",
    "trusted of wrong",
    "inliers over matches of right ones, median",
    "processor seconds, median",
)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--seeds", type=int, nargs=2, default=(100, 112), help="first, and one after the last"
    )
    parser.add_argument("--only", help="kinds of pairs whose names begin so")
    parser.add_argument("--detail", action="store_true", help="a line for each pair")
    parser.add_argument("--write", action="store_true", help="into BENCHMARKS.md")
    arguments = parser.parse_args()
    seeds = range(*arguments.seeds)
    data = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    rows = [
        measured(name, draw, seeds, known, arguments.detail)
        for name, draw in cases(data)
        if name.startswith(arguments.only or "")
        for known in (True, False)
    ]
    notes = [*measured_on(measured_here({})), f"The seeds are {seeds[0]} to {seeds[-1]}."]
    table = markdown_table(COLUMNS, rows)
    publish("\n\n".join([table, "\n".join(f"- {line}" for line in notes)]), COMMAND, arguments.write)


if __name__ == "__main__":
    main()
