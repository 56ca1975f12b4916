"""Follow a lidar around a building to where it began: the error at the end, with loops closed and without.

python benchmarks/loops.py --write

`surfsig.simulate.circuit`: a corridor around a square block, once around and then some metres again. KISS-ICP
and small_gicp have the same scans, with a voxel of 0.3 m, which suits a corridor better than their default.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np
from machine import measured_here
from moving_sensor import errors
from odometry import PEERS, by_peer, peer_versions
from report import Row, markdown_table, measured_on, publish

import surfsig
from surfsig import simulate

SIDE = 100.0
"""Metres: of the outer walls, so that a round is some 385 m long."""
LIDAR = simulate.Lidar(lines=16, steps=400, elevation=(-15.0, 15.0), noise=0.02, max_range=40.0)
PEER_VOXEL = 0.3
COLUMNS = (
    "seed", "scans", "path", "tracked", "with a free direction", "error where the loop closes, before it",
    "at the end, after it", "of the path", "largest", "loops", "processor time a scan: median",
    "95th percentile", "memory", "KISS-ICP: largest error, processor time a scan", "small_gicp",
)  # fmt: skip
SEEDS = (1, 21)
"""Both were looked at while the tracker was made."""


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--side", type=float, default=SIDE)
    parser.add_argument("--step", type=float, default=1.0, help="metres between scans")
    arguments = parser.parse_args()
    rows = []
    for seed in arguments.seeds:
        rows.append(follow(seed, arguments.side, arguments.step))
        print(rows[-1], flush=True)
    text = markdown_table(COLUMNS, rows)
    notes = measured_on(measured_here(peer_versions()))
    publish(
        text + "\n\n" + "\n".join(f"- {note}" for note in notes),
        "python benchmarks/loops.py --write",
        arguments.write,
    )


def follow(seed: int, side: float, step: float) -> Row:
    """Follow one path, and return a row of the table."""
    scene, true = simulate.circuit(seed, side=side), simulate.circuit_poses(side=side, step=step)
    scans = [simulate.scan(scene, LIDAR, pose, seed=1000 * seed + number) for number, pose in enumerate(true)]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    started = [time.process_time()]
    tracker = surfsig.Tracker(threads=1)
    for cloud in scans:
        tracker.push(cloud)
        started.append(time.process_time())
    seconds = 1000 * np.diff(started)
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    found = tracker.result()
    path = float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum())
    off, _ = errors(found.poses, true)
    first = min(found.loops, key=lambda loop: loop.scan, default=None)
    drift = "no loop"
    if first is not None:
        came = np.array([found.poses[0], first.T_world_scan_before])
        drift = f"{errors(came, true[[0, first.scan]])[0][1]:.3f} m"
    return (
        str(seed),
        str(len(scans)),
        f"{path:.0f} m",
        str(found.counts()["tracked"]),
        str(sum(bool(free) for free in found.free_directions)),
        drift,
        f"{off[-1]:.3f} m",
        f"{off[-1] / path:.4%}",
        f"{np.nanmax(off):.3f} m",
        str(len(found.loops)),
        f"{np.median(seconds):.0f} ms",
        f"{np.quantile(seconds, 0.95):.0f} ms",
        f"{grown / 1024:.0f} MB",
        *(by_peer(method, scans, true, PEER_VOXEL) for method in PEERS),
    )


if __name__ == "__main__":
    main()
