"""Follow a lidar around a building again and again: memory and processor time after thousands of scans.

python benchmarks/long_run.py --write

The way of `benchmarks/loops.py`, around a smaller block and with small scans: 10,000 take minutes.
"""

from __future__ import annotations

import argparse
import time
from pathlib import Path

import numpy as np
from machine import measured_here
from moving_sensor import errors
from report import Row, markdown_table, measured_on, publish

import surfsig
from surfsig import simulate

SIDE = 40.0
"""Metres: of the outer walls, so that a round is some 145 m long."""
LIDAR = simulate.Lidar(lines=16, steps=120, elevation=(-15.0, 15.0), noise=0.01, max_range=25.0)
SCANS = (1000, 2000, 5000, 10000)
COLUMNS = (
    "scans",
    "rounds",
    "with a pose",
    "loops",
    "error of the last pose",
    "memory",
    "processor time a scan",
)
SEED = 41


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--scans", type=int, nargs="+", default=SCANS, help="when memory is looked at")
    arguments = parser.parse_args()
    text = markdown_table(COLUMNS, follow(arguments.scans))
    notes = measured_on(measured_here({}))
    publish(
        text + "\n\n" + "\n".join(f"- {note}" for note in notes),
        "python benchmarks/long_run.py --write",
        arguments.write,
    )


def follow(counts: list[int]) -> list[Row]:
    """Go round, and return a row for each number of scans."""
    scene = simulate.circuit(SEED, side=SIDE)
    round_trip = simulate.circuit_poses(side=SIDE, beyond=0.0)
    # Scans are made once for each place; the sensor's noise is the same in each round.
    scans = [simulate.scan(scene, LIDAR, pose, seed=number) for number, pose in enumerate(round_trip)]
    tracker = surfsig.Tracker(threads=1)
    before, started = resident_memory(), time.process_time()
    rows: list[Row] = []
    poses, last = [], 0
    for number in range(max(counts)):
        poses.append(tracker.push(scans[number % len(scans)]).T_world_scan)
        if number + 1 in counts:
            seconds = time.process_time() - started
            true = round_trip[np.array([0, number]) % len(scans)]
            off, _ = errors(np.array([poses[0], poses[-1]]), true)
            found = tracker.result(close_loops=False)
            rows.append(
                (
                    str(number + 1),
                    f"{(number + 1) / len(scans):.0f}",
                    str(int((found.segments >= 0).sum())),
                    str(len(found.loops)),
                    f"{off[-1]:.3f} m",
                    f"{(resident_memory() - before) / 2**20:.0f} MB",
                    f"{1000 * seconds / (number + 1 - last):.0f} ms",
                )
            )
            print(rows[-1], flush=True)
            last, started = number + 1, time.process_time()
    return rows


def resident_memory() -> int:
    """Give the resident memory of this process, in bytes."""
    status = Path("/proc/self/status").read_text()
    return 1024 * int(status.split("VmRSS:")[1].split()[0])


if __name__ == "__main__":
    main()
