"""Whether scans are registered from any start, how long that takes, and whether wrong poses are trusted.

python benchmarks/registration.py --write

Each pair in both directions, the source turned and shifted at random. Pairs that do not overlap are fragments
of one room, each cut to a side that the other does not have.
"""

from __future__ import annotations

import argparse
import os
import sys
import tempfile
import time
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from descriptor_pairs import Array, read_pairs
from machine import measured_here
from peers import HERE, ROOT, PeerUnavailable, peer_python, run_json
from report import Results, Row, markdown_table, measured_on, publish
from rich.progress import track
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import PointCloud

COMMAND = "python benchmarks/registration.py --write"
COLUMNS = (
    "pairs",
    "method",
    "viewpoints",
    "right",
    "trusted of right",
    "trusted of wrong",
    "seconds, median",
    "largest",
    "processor seconds, median",
)
SEED = 3
PEER_SECONDS = 1800
CUTS = 9
"""Ways in which each pair of fragments is cut apart."""
PEER_STARTS = 2
"""Random starts of each pair for the peers."""
PEERS = {"open3d": "Open3D: FPFH, RANSAC, ICP", "kiss": "KISS-Matcher, GICP"}
VOXELS = {"redkitchen": 0.05, "bunny": 0.003, "lidar": 0.5, "redkitchen, cut apart": 0.05}
"""What the peers are told of each kind of scan; of three that were tried the best or as good as it."""
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


def starts_of(pairs: list[Pair], count: int) -> list[list[Array]]:
    """Give random starts of each pair, (4, 4)."""
    rng = np.random.default_rng(SEED)
    return [[_start(pair, rng) for _ in range(count)] for pair in pairs]


def _start(pair: Pair, rng: np.random.Generator) -> Array:
    start = np.eye(4)
    start[:3, :3] = Rotation.random(random_state=int(rng.integers(1 << 30))).as_matrix()
    start[:3, 3] = rng.normal(size=3) * np.ptp(pair.source, axis=0).max()
    return start


def ours(title: str, pairs: list[Pair], starts: int, known: bool) -> Row:
    """Register all pairs from some starts each, and return a row of the table."""
    poses, seconds, processor, trusted = [], [], [], []
    every = starts_of(pairs, starts)
    for pair, each in track(list(zip(pairs, every, strict=True)), description=title, transient=True):
        for start in each:
            # No product of matrices: the threads of its library wait for more while others are timed.
            moved = np.einsum("ij,nj->ni", start[:3, :3], pair.source) + start[:3, 3]
            eyes = (start[:3, 3], np.zeros(3)) if known else (None, None)
            clouds = PointCloud(moved, viewpoint=eyes[0]), PointCloud(pair.target, viewpoint=eyes[1])
            begin = time.perf_counter(), time.process_time()
            found = surfsig.register(*clouds)
            seconds.append(time.perf_counter() - begin[0])
            processor.append(time.process_time() - begin[1])
            poses.append(found.T_target_source)
            trusted.append(found.trusted)
    return row(title, "surfsig", pairs, every, known, poses, (seconds, processor), trusted)


def peers(title: str, pairs: list[Pair], starts: int, known: bool, method: str) -> Row:
    """Let a peer do the same."""
    every = starts_of(pairs, starts)
    with tempfile.TemporaryDirectory() as folder:
        files = []
        for number, (pair, each) in enumerate(zip(pairs, every, strict=True)):
            files.append(Path(folder) / f"{number}.npz")
            np.savez(files[-1], source=pair.source, target=pair.target, starts=np.array(each), known=known)
        program: list[str | Path] = [peer_python(), HERE / "registration_peers.py", method, *files]
        command = [*program, "--voxel", str(VOXELS[title])]
        answer = run_json(command, threads=os.cpu_count() or 1, seconds=PEER_SECONDS)
    poses = [np.array(pose) for pose in answer["poses"]]
    times = answer["seconds"], answer["processor"]
    return row(title, PEERS[method], pairs, every, known, poses, times, answer["confident"])


def row(
    title: str,
    method: str,
    pairs: list[Pair],
    starts: list[list[Array]],
    known: bool,
    poses: list[Array],
    times: tuple[list[float], list[float]],
    trusted: list[bool],
) -> Row:
    """Compare the poses with the truth, pair by pair and start by start.

    Times are those by the clock, and those of all threads.
    """
    asked = [(pair, start) for pair, each in zip(pairs, starts, strict=True) for start in each]
    good = np.array([is_right(pose @ start, pair) for pose, (pair, start) in zip(poses, asked, strict=True)])
    sure, count, right = np.array(trusted), len(good), int(good.sum())
    return (
        title, method, "known" if known else "not known", f"{right} of {count}",
        f"{(good & sure).sum()} of {right}", f"{(~good & sure).sum()} of {count - right}",
        f"{np.median(times[0]):.2f}", f"{max(times[0]):.2f}", f"{np.median(times[1]):.2f}",
    )  # fmt: skip


def is_right(pose: Array, pair: Pair) -> bool:
    """Tell whether a pose is near the true one."""
    if pair.truth is None or not np.isfinite(pose).all():
        return False
    left = np.linalg.inv(pair.truth) @ pose
    turn = np.degrees(np.linalg.norm(Rotation.from_matrix(left[:3, :3]).as_rotvec()))
    return bool(turn < pair.degrees and np.linalg.norm(left[:3, 3]) < pair.distance)


def peer_versions() -> dict[str, str]:
    """Give those of the peers that are installed."""
    try:
        program: list[str | Path] = [peer_python(), HERE / "registration_peers.py", "versions"]
        return {name: str(text) for name, text in run_json(program, threads=1).items()}
    except PeerUnavailable:
        return {}


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__)
    default = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
    parser.add_argument("data", type=Path, nargs="?", default=default, help="folder of the real scans")
    parser.add_argument("--starts", type=int, default=20, help="random starts of each pair")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    sets = known_pairs(arguments.data)
    if not sets:
        sys.exit(f"{arguments.data} has no folder registration")
    results: Results = measured_here(peer_versions())
    table: list[Row] = []
    for title, pairs in sets.items():
        overlap = pairs[0].truth is not None
        table.append(ours(title, pairs, arguments.starts if overlap else 1, True))
        # Where nobody knows the viewpoints, nothing changes for the peers but the sign of normals.
        table.append(ours(title, pairs, PEER_STARTS if overlap else 1, False))
        for method in PEERS:
            try:
                table.append(peers(title, pairs, PEER_STARTS if overlap else 1, True, method))
            except PeerUnavailable as error:
                print(f"{PEERS[method]}, {title}: {error}", file=sys.stderr)
    notes = "\n".join(f"- {line}" for line in [*measured_on(results), f"The seed is {SEED}."])
    text = f"{markdown_table(COLUMNS, table)}\n\n{notes}"
    publish(text, COMMAND, arguments.write)


if __name__ == "__main__":
    main()
