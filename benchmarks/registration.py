"""Whether scans are registered from any start, how long that takes, and whether wrong poses are trusted.

python benchmarks/registration.py --starts 3 --write

Each pair in both directions, the source turned and shifted at random. Pairs that do not overlap are fragments
of one room, each cut to a side that the other does not have.
"""

from __future__ import annotations

import argparse
import datetime
import os
import sys
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from descriptor_pairs import Array, read_pairs
from machine import describe_machine, own_versions
from peers import ROOT
from report import Results, Row, markdown_table, measured_on, update_section
from rich.progress import track
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import PointCloud

COMMAND = "python benchmarks/registration.py --write"
COLUMNS = (
    "pairs",
    "viewpoints",
    "right",
    "trusted of right",
    "trusted of wrong",
    "seconds, median",
    "largest",
)
SEED = 3
CUTS = 3
"""Ways in which each pair of fragments is cut apart."""
GAP = 0.3
"""Between the parts, in standard deviations of the points along the cut."""


@dataclass(frozen=True, eq=False)
class Pair:
    """Two scans, T_target_source (None where they do not overlap), and how far off a right pose may be."""

    source: Array
    target: Array
    truth: Array | None
    degrees: float
    distance: float


def known_pairs(data: Path) -> dict[str, list[Pair]]:
    """Read all that the folder has, in both directions."""
    found: dict[str, list[Pair]] = {}
    limits = {"redkitchen": (5.0, 0.1), "bunny": (2.0, 0.002)}
    for pairs in read_pairs(data):
        name = pairs.title.split(",")[0]
        if name not in found:
            found[name] = [
                Pair(pairs.scans[a].points, pairs.scans[b].points, motion, *limits[name])
                for (a, b), motion in pairs.motions.items()
            ]
    folder = data / "registration/lidar_pair"
    if folder.is_dir():
        source, target = (
            surfsig.read(folder / f"{name}.ply").points.astype(np.float64) for name in ("source", "target")
        )
        found["lidar"] = [Pair(source, target, np.loadtxt(folder / "T_target_source.txt"), 2.0, 0.3)]
    for every in found.values():
        every += [
            Pair(
                pair.target,
                pair.source,
                np.asarray(np.linalg.inv(pair.truth), np.float64),
                pair.degrees,
                pair.distance,
            )
            for pair in list(every)
            if pair.truth is not None
        ]
    if "redkitchen" in found:
        rng = np.random.default_rng(SEED)
        found["redkitchen, cut apart"] = [
            cut_apart(pair, rng) for pair in found["redkitchen"] for _ in range(CUTS)
        ]
    return found


def cut_apart(pair: Pair, rng: np.random.Generator) -> Pair:
    """Keep of both scans what the other does not have: two sides of a plane at random."""
    assert pair.truth is not None
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    moved = pair.source @ pair.truth[:3, :3].T + pair.truth[:3, 3]
    ours, theirs = moved @ normal, pair.target @ normal
    middle, gap = np.median(theirs), GAP * theirs.std()
    return Pair(pair.source[ours > middle + gap / 2], pair.target[theirs < middle - gap / 2], None, 0.0, 0.0)


def row(title: str, pairs: list[Pair], starts: int, known: bool) -> Row:
    """Register all pairs from some starts each, and return a row of the table."""
    rng = np.random.default_rng(SEED)
    right, trusted_right, trusted_wrong, seconds = 0, 0, 0, []
    for pair in track(pairs, description=title, transient=True):
        for _ in range(starts):
            start = np.eye(4)
            start[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
            start[:3, 3] = rng.normal(size=3) * np.ptp(pair.source, axis=0).max()
            moved = pair.source @ start[:3, :3].T + start[:3, 3]
            eyes = (start[:3, 3], np.zeros(3)) if known else (None, None)
            clouds = PointCloud(moved, viewpoint=eyes[0]), PointCloud(pair.target, viewpoint=eyes[1])
            begin = time.perf_counter()
            found = surfsig.register(*clouds)
            seconds.append(time.perf_counter() - begin)
            good = is_right(found.T_target_source @ start, pair)
            right += good
            trusted_right += good and found.trusted
            trusted_wrong += not good and found.trusted
    count = len(seconds)
    return (
        title, "known" if known else "not known", f"{right} of {count}", f"{trusted_right} of {right}",
        f"{trusted_wrong} of {count - right}", f"{np.median(seconds):.2f}", f"{max(seconds):.2f}",
    )  # fmt: skip


def is_right(pose: Array, pair: Pair) -> bool:
    """Tell whether a pose is near the true one."""
    if pair.truth is None or not np.isfinite(pose).all():
        return False
    left = np.linalg.inv(pair.truth) @ pose
    turn = np.degrees(np.linalg.norm(Rotation.from_matrix(left[:3, :3]).as_rotvec()))
    return bool(turn < pair.degrees and np.linalg.norm(left[:3, 3]) < pair.distance)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    parser.add_argument("data", type=Path, nargs="?", default=default, help="folder of the real scans")
    parser.add_argument("--starts", type=int, default=3, help="random starts of each pair")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    sets = known_pairs(arguments.data)
    if not sets:
        sys.exit(f"{arguments.data} has no folder registration")
    results: Results = {
        "machine": describe_machine(),
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "versions": own_versions(),
    }
    table = [
        row(title, pairs, arguments.starts if pairs[0].truth is not None else 1, known)
        for title, pairs in sets.items()
        for known in (True, False)
    ]
    notes = "\n".join(f"- {line}" for line in [*measured_on(results), f"The seed is {SEED}."])
    text = f"{markdown_table(COLUMNS, table)}\n\n{notes}"
    print(text)
    if arguments.write:
        try:
            update_section(ROOT / "BENCHMARKS.md", COMMAND, text)
        except (OSError, ValueError) as error:
            sys.exit(f"BENCHMARKS.md is not updated: {error}")


if __name__ == "__main__":
    main()
