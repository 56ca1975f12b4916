"""Follow a lidar around a building to where it began: the error at the end, with loops closed and without.

python benchmarks/loops.py --write

Corridors with cupboards around a block of rooms, once around and then the first metres again. The
sensor sees 15 m, so that the beginning is out of its map when it comes back.
"""

from __future__ import annotations

import argparse
import resource
import time

import numpy as np
from hard_sequences import box
from machine import measured_here
from moving_sensor import Array, errors
from report import Row, markdown_table, measured_on, publish
from scipy.interpolate import CubicSpline

import surfsig
from surfsig import PointCloud, simulate

SIDE = 100.0
"""Metres: of the block, around which the corridor leads."""
LIDAR = simulate.Lidar(lines=16, steps=400, elevation=(-20.0, 20.0), noise=0.02, max_range=15.0)
COLUMNS = (
    "seed", "scans", "way", "tracked", "error at the end, loops open", "closed", "of the way", "loops",
    "processor time a scan", "memory",
)  # fmt: skip
SEEDS = (1, 2)


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--side", type=float, default=SIDE)
    parser.add_argument("--step", type=float, default=0.8, help="metres between scans")
    arguments = parser.parse_args()
    rows = []
    for seed in arguments.seeds:
        rows.append(follow(seed, arguments.side, arguments.step))
        print(rows[-1], flush=True)
    text = markdown_table(COLUMNS, rows)
    text += "\n\n" + "\n".join(f"- {note}" for note in measured_on(measured_here({})))
    publish(text, "python benchmarks/loops.py --write", arguments.write)


def block(seed: int, side: float) -> simulate.Scene:
    """Build a corridor 3 m wide around a block, with cupboards and shelves along its walls."""
    rng = np.random.default_rng([91, seed])
    outer = side + 1.5
    placed = [box((side / 2, side / 2, -0.05), (side + 6, side + 6, 0.1))]
    placed.append(box((side / 2, side / 2, 2.85), (side + 6, side + 6, 0.1)))
    placed.append(box((side / 2, side / 2, 1.4), (side - 3.0, side - 3.0, 2.8)))
    for x, y, a, b in (
        (side / 2, -1.55, side + 3.2, 0.1),
        (side / 2, outer + 0.05, side + 3.2, 0.1),
        (-1.55, side / 2, 0.1, side + 3.2),
        (outer + 0.05, side / 2, 0.1, side + 3.2),
    ):
        placed.append(box((x, y, 1.4), (a, b, 2.8)))
    for wall in range(4):
        for at in np.arange(3.0, side - 3.0, 1.3):
            along = at + rng.uniform(-0.5, 0.5)
            side_of = rng.choice((-1.0, 1.0))
            wide, depth, high = rng.uniform((0.3, 0.2, 0.8), (0.9, 0.8, 2.6))
            across = side_of * (1.5 - 0.5 * depth)
            middle, size = (along, across, 0.5 * high), (wide, depth, high)
            if wall % 2:
                middle, size = (across, along, 0.5 * high), (depth, wide, high)
            placed.append(
                box(
                    (
                        middle[0] + (side if wall == 1 else 0.0),
                        middle[1] + (side if wall == 2 else 0.0),
                        middle[2],
                    ),
                    size,
                )
            )
    return simulate.Scene(placed)


def around(side: float, step: float) -> Array:
    """Give poses once around the block, and then 12 m more."""
    round_off = 1.2
    corners = np.array([[0.0, 0.0], [side, 0.0], [side, side], [0.0, side], [0.0, 0.0], [side, 0.0]])
    knots = [np.array([[side / 2, 0.0]])]
    for before, corner, after in zip(corners[:-2], corners[1:-1], corners[2:], strict=True):
        to_corner = (before - corner) / np.linalg.norm(before - corner)
        from_corner = (after - corner) / np.linalg.norm(after - corner)
        knots.append(corner + to_corner * np.array([[20.0], [round_off], [0.0]]) * [1.0, 1.0])
        knots[-1][-1] = corner + 0.3 * round_off * (to_corner + from_corner)
        knots.append(corner + from_corner * np.array([[round_off], [20.0]]))
    knots.append(np.array([[side / 2, 0.0], [side / 2 + 12.0, 0.0]]))
    points = np.concatenate(knots)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(points, axis=0), axis=1))])
    keep = np.concatenate([[True], np.diff(length) > 1e-9])
    curve = CubicSpline(length[keep], points[keep])
    # From rest, as a sensor does: a corridor hardly says how far it went, so the last motion matters.
    speeds = step * np.minimum(1.0, 0.1 * np.arange(1, int(length[-1] / step) + 10))
    at = np.concatenate([[0.0], np.cumsum(speeds)])
    at = at[at <= length[-1]]
    x, y = curve(at).T
    ahead = curve(at, 1)
    yaw = np.unwrap(np.arctan2(ahead[:, 1], ahead[:, 0]))
    return np.array(
        [
            simulate.upright_pose(
                x[k], y[k], 1.3 + 0.02 * np.sin(0.7 * k), yaw[k], (0.02 * np.sin(0.9 * k), 0.0)
            )
            for k in range(len(at))
        ]
    )


def follow(seed: int, side: float, step: float) -> Row:
    """Follow one way, and return a row of the table."""
    scene, true = block(seed, side), around(side, step)
    scans: list[PointCloud] = [
        simulate.scan(scene, LIDAR, pose, seed=1000 * seed + number) for number, pose in enumerate(true)
    ]
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    start = time.process_time()
    tracker = surfsig.Tracker(threads=1)
    for cloud in scans:
        tracker.push(cloud)
    seconds = time.process_time() - start
    grown = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before
    closed, way = tracker.result(), float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum())
    off, _ = errors(closed.poses, true)
    # Without loops: the way around, until the first one was found.
    first = min((loop.scan for loop in closed.loops), default=len(true) - 1)
    seen = next((loop.T_world_scan_before for loop in closed.loops if loop.scan == first), None)
    last = closed.poses[-1] if seen is None else seen
    drift, _ = errors(np.array([closed.poses[0], last]), true[[0, first]])
    return (
        str(seed),
        str(len(scans)),
        f"{way:.0f} m",
        str(closed.counts()["tracked"]),
        f"{drift[1]:.3f} m",
        f"{off[-1]:.3f} m (largest {np.nanmax(off):.3f} m)",
        f"{off[-1] / way:.3%}",
        str(len(closed.loops)),
        f"{1000 * seconds / len(scans):.0f} ms",
        f"{grown / 1024:.0f} MB",
    )


if __name__ == "__main__":
    main()
