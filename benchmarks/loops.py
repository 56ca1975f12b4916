"""Go once round a corridor of 400 m, and correct the trajectory where it comes back.

python benchmarks/loops.py --write

The sensor is ideal, or its calibration is bent: range bias of 0.1 %, and by incidence, 0.05 degrees per line.
"""

from __future__ import annotations

import argparse
import time

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from report import Row, markdown_table, measured_on, publish
from rich.progress import track

import surfsig
from surfsig import geometry, simulate

Array = NDArray[np.float64]

SENSORS = {
    "lidar, 16 lines, 30° high, noise 20 mm": simulate.Lidar(16, (-15.0, 15.0), 480, 0.02),
    "lidar, 32 lines, 50° high, noise 10 mm": simulate.Lidar(),
}
CALIBRATIONS = ("ideal", "bent")
SIDE, WIDTH = 104.0, 4.0
STEP, BEYOND = 1.0, 8.0
"""Metres between two scans, and by which the path goes on after the round."""
REACH = 30.0
"""Metres about the sensor within which things are simulated; walls are, everywhere."""
RIGHT = 0.1
"""Metres within which a loop's pose is right."""
COLUMNS = (
    "sensor", "calibration", "scans", "path", "tracked", "error at the end", "of the path", "with loops",
    "of the path", "largest error, before and after", "loops used / tried", "used but wrong",
    "processor time a scan", "of closing",
)  # fmt: skip


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument(
        "--seed", type=int, default=400, help="of the things in the corridor, and of the noise"
    )
    parser.add_argument("--side", type=float, default=SIDE, help="of the outer walls, in metres")
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    rows = [
        go_round(name, calibration, arguments.seed, arguments.side)
        for name in SENSORS
        for calibration in CALIBRATIONS
    ]
    notes = [
        *measured_on(measured_here()),
        f"Seed {arguments.seed}. A corridor {WIDTH:g} m wide around a square block of {arguments.side:g} m, "
        f"with things along its walls; a scan each {STEP:g} m, and {BEYOND:g} m beyond the round.",
        f"A loop is wrong where its pose is off by more than {RIGHT:g} m.",
    ]
    text = markdown_table(COLUMNS, rows) + "\n\n" + "\n".join(f"- {note}" for note in notes)
    publish(text, "make bench-loops", arguments.write)


def go_round(name: str, calibration: str, seed: int, side: float) -> Row:
    """Scan along the path, follow the sensor, and close loops."""
    true = simulate.circuit_poses(side=side, width=WIDTH, step=STEP, beyond=BEYOND)
    scans = scan_all(name, calibration, seed, side, true)
    start = time.process_time()
    odometry = surfsig.estimate_odometry(scans)
    followed = time.process_time()
    closed = surfsig.close_loops(scans, odometry)
    done = time.process_time()
    path = float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum())
    before, after = (errors(found.poses, true) for found in (odometry, closed.odometry))
    wrong = sum(loop.used and is_wrong(loop, true) for loop in closed.loops)
    return (
        name,
        calibration,
        f"{len(scans)}",
        f"{path:.0f} m",
        f"{odometry.counts()['tracked']}",
        f"{1000 * before[-1]:.0f} mm",
        f"{before[-1] / path:.3%}",
        f"{1000 * after[-1]:.0f} mm",
        f"{after[-1] / path:.4%}",
        f"{1000 * np.nanmax(before):.0f}, {1000 * np.nanmax(after):.0f} mm",
        f"{closed.used} / {len(closed.loops)}",
        f"{wrong}",
        f"{1000 * (followed - start) / len(scans):.0f} ms",
        f"{done - followed:.1f} s",
    )


def scan_all(name: str, calibration: str, seed: int, side: float, true: Array) -> list[surfsig.PointCloud]:
    """Scan from all poses; only what is near the sensor is looked at."""
    objects = simulate.circuit(seed, side=side, width=WIDTH).objects
    middles = np.array([placed.pose[:3, 3] for placed in objects])
    sizes = np.array([np.linalg.norm(placed.surface.size) for placed in objects])  # type: ignore[attr-defined]
    wrong = simulate.bent_calibration(seed) if calibration == "bent" else None
    scans = []
    for number, pose in enumerate(track(true, description=f"{name}, {calibration}")):
        near = np.linalg.norm(middles - pose[:3, 3], axis=1) < REACH + sizes
        scene = simulate.Scene([placed for placed, is_near in zip(objects, near, strict=True) if is_near])
        scan_seed = 1000 * seed + number
        scans.append(simulate.scan(scene, SENSORS[name], pose, seed=scan_seed, calibration=wrong))
    return scans


def errors(found: Array, true: Array) -> Array:
    """Give how far off positions are, both seen from the first pose, in metres."""
    seen = geometry.inverse(true[0]) @ true
    return np.asarray(np.linalg.norm(found[:, :3, 3] - seen[:, :3, 3], axis=1))


def is_wrong(loop: surfsig.Loop, true: Array) -> bool:
    """Say whether a loop's pose is off."""
    relative = geometry.inverse(true[loop.earlier]) @ true[loop.later]
    off = geometry.inverse(relative) @ loop.T_earlier_later
    return bool(np.linalg.norm(off[:3, 3]) > RIGHT)


if __name__ == "__main__":
    main()
