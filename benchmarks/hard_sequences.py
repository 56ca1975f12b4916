"""Follow simulated sensors where odometry commonly fails: sight that opens, fast rotations, traffic.

python benchmarks/hard_sequences.py --write

Each sequence is told nothing. A pose is wrong where it is more than `WRONG` off, or more than `WRONG_ANGLE`,
in the motions that its covariance calls known; scans of one segment are compared with the segment's first
one.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import dataclass

import moving_sensor
import numpy as np
from machine import measured_here
from moving_sensor import Array
from report import Row, markdown_table, measured_on, publish

import surfsig
from surfsig import PointCloud, simulate

COUNT = 40
"""Scans of a sequence."""
WRONG = 0.15
"""Metres."""
WRONG_ANGLE = 2.0
"""Degrees."""
SEEDS = (1, 2)
"""Of the places: looked at while the tracker was made. 11 to 13 were looked at once, at the end."""
COLUMNS = (
    "sequence", "scans", "found", "lost", "wrong", "segments", "largest error",
    "processor time a scan: median", "95th percentile",
)  # fmt: skip
FINE = simulate.Lidar(lines=32, steps=480, elevation=(-25.0, 25.0), noise=0.01)


@dataclass(frozen=True)
class Sequence:
    """Scans and where they were taken."""

    scans: list[PointCloud]
    true: Array
    """T_scene_sensor, (n, 4, 4)."""


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS)
    parser.add_argument("--only", nargs="+", default=list(SEQUENCES), help="names of sequences")
    parser.add_argument("--verbose", action="store_true", help="a line for each scan")
    arguments = parser.parse_args()
    rows = []
    for name in arguments.only:
        for seed in arguments.seeds:
            row = follow(f"{name}, seed {seed}", SEQUENCES[name](seed), arguments.verbose)
            rows.append(row)
            print(row, flush=True)
    text = markdown_table(COLUMNS, rows)
    text += "\n\n" + "\n".join(f"- {note}" for note in measured_on(measured_here({})))
    publish(text, "python benchmarks/hard_sequences.py --write", arguments.write)


def follow(name: str, sequence: Sequence, is_verbose: bool = False) -> Row:
    """Follow one sequence, and return a row of the table."""
    started = [time.process_time()]
    found = surfsig.estimate_odometry(
        sequence.scans, threads=1, progress=lambda done, total: started.append(time.process_time())
    )
    seconds = np.diff(started)
    off, angle = known_errors(found, sequence.true)
    if is_verbose:
        for number, status in enumerate(found.status.tolist()):
            told = surfsig.ScanStatus(status).name.lower()
            free = [one.motion for one in found.free_directions[number]]
            print(
                f"{number:3d} {told:12s} overlap {found.overlaps[number]:.2f} off {off[number]:.3f} m",
                end=" ",
            )
            print(f"{angle[number]:.2f} deg {1000 * seconds[number]:6.0f} ms free {free}")
    known = np.isfinite(off)
    wrong = known & ((off > WRONG) | (angle > WRONG_ANGLE))
    segments = found.segments
    return (
        name,
        str(len(found)),
        str(int(known.sum())),
        str(int((~known).sum())),
        str(int(wrong.sum())),
        str(len(set(segments[known].tolist()))),
        f"{1000 * np.nanmax(off):.0f} mm, {np.nanmax(angle):.2f}°",
        f"{1000 * np.median(seconds):.0f} ms",
        f"{1000 * np.quantile(seconds, 0.95):.0f} ms",
    )


def known_errors(found: surfsig.Odometry, true: Array) -> tuple[Array, Array]:
    """Give by how much poses are off in the motions that are known, in metres and degrees, (n,) each."""
    off, angle = np.full(len(found), np.nan), np.full(len(found), np.nan)
    known = np.isfinite(found.poses).all(axis=(1, 2))
    segments = found.segments
    for segment in set(segments[known].tolist()):
        of_segment = np.flatnonzero(known & (segments == segment))
        first = of_segment[0]
        relative = surfsig.geometry.inverse(found.poses[first]) @ found.poses[of_segment]
        motions = moving_sensor.missing_motions(relative, true[of_segment])
        for number, motion in zip(of_segment.tolist(), motions, strict=True):
            known_motion = without_free(motion, found.free_directions[number])
            known_motion *= np.isfinite(np.diag(found.covariances[number]))
            angle[number] = np.degrees(np.linalg.norm(known_motion[:3]))
            off[number] = np.linalg.norm(known_motion[3:])
    return off, angle


def without_free(motion: Array, free: list[surfsig.FreeDirection]) -> Array:
    """Take the parts of a twist out that are along motions that the map does not determine."""
    motion = motion.copy()
    for direction in free:
        if direction.axis is not None:
            part = slice(3, 6) if direction.motion == "translation" else slice(0, 3)
            motion[part] -= (direction.axis @ motion[part]) * direction.axis
    return motion


def straight(count: int, step: float, start: tuple[float, float], height: float = 1.5) -> Array:
    """Give poses of a sensor that is driven along x and sways a little."""
    return np.array(
        [
            simulate.upright_pose(
                start[0] + step * k,
                start[1] + 0.1 * np.sin(0.4 * k),
                height + 0.02 * np.sin(0.9 * k),
                0.04 * np.sin(0.3 * k),
                (0.01 * np.sin(1.1 * k), 0.008 * np.cos(0.8 * k)),
            )
            for k in range(count)
        ]
    )


def scanned(
    scene: simulate.Scene, sensor: simulate.Lidar | simulate.DepthCamera, true: Array, seed: int
) -> list[PointCloud]:
    """Scan a scene from each pose."""
    return [simulate.scan(scene, sensor, pose, seed=1000 * seed + number) for number, pose in enumerate(true)]


def box(middle: tuple[float, float, float], size: tuple[float, float, float]) -> simulate.Placed:
    """Place a box along the axes."""
    return simulate.Placed(simulate.Box(size), simulate.pose(middle))


def street(seed: int) -> list[simulate.Placed]:
    """Put houses, trees and parked cars along a street of 140 m along x, which begins at x = 0."""
    rng = np.random.default_rng([71, seed])
    placed = [box((60.0, 0.0, -0.1), (200.0, 60.0, 0.2))]
    for side in (-1.0, 1.0):
        x = -2.0
        while x < 120.0:
            length, depth, high = rng.uniform((6.0, 5.0, 4.0), (16.0, 9.0, 12.0))
            y = side * (rng.uniform(8.0, 13.0) + 0.5 * depth)
            placed.append(box((x + 0.5 * length, y, 0.5 * high), (length, depth, high)))
            x += length + rng.uniform(0.0, 6.0)
        for at in rng.uniform(8.0, 120.0, 8):
            placed.append(
                simulate.Placed(
                    simulate.Cylinder(rng.uniform(0.1, 0.3), 8.0),
                    simulate.pose((at, side * rng.uniform(6.0, 7.0), 4.0)),
                )
            )
        for at in rng.uniform(10.0, 120.0, 6):
            placed.append(box((at, side * 5.0, 0.8), (rng.uniform(3.5, 5.0), 1.8, 1.6)))
    return placed


def out_of_a_garage(seed: int) -> Sequence:
    """Drive out of a garage, 6 m long and open at one end, into a street."""
    garage = [
        box((-3.5, 2.1, 1.5), (7.0, 0.2, 3.0)),
        box((-3.5, -2.1, 1.5), (7.0, 0.2, 3.0)),
        box((-7.0, 0.0, 1.5), (0.2, 4.4, 3.0)),
        box((-3.5, 0.0, 3.1), (7.0, 4.4, 0.2)),
        box((-3.5, 0.0, -0.1), (7.0, 4.4, 0.2)),
        box((-5.5, 1.7, 0.6), (1.0, 0.6, 1.2)),
    ]
    true = straight(COUNT, 0.5, (-5.0, 0.0))
    return Sequence(scanned(simulate.Scene(street(seed) + garage), FINE, true, seed), true)


def through_a_door(seed: int) -> Sequence:
    """Walk from a furnished room through a door into a hall."""
    room = simulate.room(seed, size=(7.0, 6.0, 2.8), furniture=8).objects[:3] + tuple(
        simulate.room(seed, size=(7.0, 6.0, 2.8), furniture=8).objects[4:]
    )
    # In place of the wall at x = 3.5 the hall's, with the door.
    outer = [
        box((3.55, 1.8, 4.0), (0.1, 2.6, 8.0)),
        box((3.55, -1.8, 4.0), (0.1, 2.6, 8.0)),
        box((3.55, 7.7, 4.0), (0.1, 9.2, 8.0)),
        box((3.55, -7.7, 4.0), (0.1, 9.2, 8.0)),
        box((3.55, 0.0, 5.1), (0.1, 1.2, 5.8)),
    ]
    hall = [one.moved(simulate.pose((23.6, 0.0, 0.0))) for one in simulate.hall(seed).objects]
    hall = [one for one in hall if abs(one.pose[0, 3] - 3.55) > 0.1]
    true = straight(COUNT, 0.3, (-1.5, 0.0))
    return Sequence(scanned(simulate.Scene([*room, *outer, *hall]), FINE, true, seed), true)


def thin_first_scan(seed: int) -> Sequence:
    """Begin with a scan of 60 points."""
    true = straight(COUNT, 0.3, (-8.0, 0.0))
    scans = scanned(simulate.hall(seed), FINE, true, seed)
    chosen = np.random.default_rng([72, seed]).choice(len(scans[0]), 60, replace=False)
    scans[0] = PointCloud(scans[0].points[chosen], viewpoint=np.zeros(3))
    return Sequence(scans, true)


def near_first_scan(seed: int) -> Sequence:
    """Begin with a scan of what is within 6 m, in a street."""
    true = straight(COUNT, 0.5, (10.0, 0.0))
    scans = scanned(simulate.Scene(street(seed)), FINE, true, seed)
    points = scans[0].points
    scans[0] = PointCloud(points[np.linalg.norm(points, axis=1) < 6.0], viewpoint=np.zeros(3))
    return Sequence(scans, true)


def near_camera(seed: int) -> Sequence:
    """Carry a depth camera that sees 1.5 m along the wall of a furnished room."""
    camera = simulate.DepthCamera(160, 120, 70.0, max_range=1.5)
    rng = np.random.default_rng([73, seed])
    placed = [box((0.0, 2.05, 1.25), (12.0, 0.1, 2.5)), box((0.0, 0.0, -0.05), (12.0, 6.0, 0.1))]
    for x in np.arange(-3.0, 4.0, 0.45):
        a, b, c = rng.uniform((0.1, 0.1, 0.1), (0.35, 0.4, 0.4))
        middle = (x + rng.uniform(-0.1, 0.1), 2.0 - 0.5 * b, rng.uniform(0.6, 1.5))
        if rng.random() < 0.3:
            placed.append(simulate.Placed(simulate.Sphere(0.5 * a), simulate.pose(middle)))
        else:
            turn = simulate.turn((0.0, 0.0, 1.0), rng.uniform(-0.5, 0.5))
            placed.append(simulate.Placed(simulate.Box((a, b, c)), simulate.pose(middle, turn)))
    looking = np.eye(4)
    # Along y, and x to the right.
    looking[:3, :3] = np.array([[1.0, 0.0, 0.0], [0.0, 0.0, 1.0], [0.0, -1.0, 0.0]])
    true = np.array(
        [
            simulate.upright_pose(-1.0 + 0.05 * k, 1.0 + 0.1 * np.sin(0.2 * k), 1.1, 0.1 * np.sin(0.3 * k))
            @ looking
            for k in range(COUNT)
        ]
    )
    return Sequence(scanned(simulate.Scene(placed), camera, true, seed), true)


def turned(seed: int, angles: Callable[[int], float]) -> Sequence:
    """Rotate the sensor between the scans while it goes through a building, but for the first four."""
    true = moving_sensor.way(2 * COUNT)[:COUNT]
    for k, pose in enumerate(true):
        pose[:3, :3] = pose[:3, :3] @ simulate.turn((0.0, 0.0, 1.0), np.radians(angles(k)))
    return Sequence(scanned(moving_sensor.building(seed), FINE, true, seed), true)


def lorries(seed: int) -> Sequence:
    """Be passed in a street by two lorries, which hide one side each for a while."""
    true = straight(COUNT, 0.5, (15.0, 0.0))
    scans = []
    for k, pose in enumerate(true):
        there = [
            box((-10.0 + 1.6 * k, 2.9, 1.9), (9.0, 2.4, 3.6)),
            box((85.0 - 2.4 * k, -2.9, 1.9), (12.0, 2.4, 3.6)),
        ]
        scene = simulate.Scene(street(seed) + there)
        scans.append(simulate.scan(scene, FINE, pose, seed=1000 * seed + k))
    return Sequence(scans, true)


def in_a_tunnel(seed: int) -> Sequence:
    """Drive along a tunnel with nothing in it."""
    sensor = simulate.Lidar(lines=32, steps=480, elevation=(-25.0, 25.0), max_range=25.0)
    true = straight(COUNT, 0.3, (-6.0, 0.0))
    return Sequence(scanned(simulate.tunnel(seed), sensor, true, seed), true)


def on_a_plane(seed: int) -> Sequence:
    """Drive over flat ground."""
    sensor = simulate.Lidar(lines=32, steps=480, elevation=(-25.0, 25.0), max_range=25.0)
    true = straight(COUNT, 0.3, (-6.0, 0.0))
    return Sequence(scanned(simulate.plane(), sensor, true, seed), true)


SEQUENCES: dict[str, Callable[[int], Sequence]] = {
    "out of a garage": out_of_a_garage,
    "through a door into a hall": through_a_door,
    "a first scan of 60 points": thin_first_scan,
    "a first scan within 6 m": near_first_scan,
    "camera that sees 1.5 m": near_camera,
    "45° a scan": lambda seed: turned(seed, lambda k: 45.0 * max(0, k - 3)),
    "90° a scan": lambda seed: turned(seed, lambda k: 90.0 * max(0, k - 3)),
    "30° to and fro": lambda seed: turned(seed, lambda k: 30.0 * (k % 2) * (k > 3)),
    "two lorries": lorries,
    "tunnel": in_a_tunnel,
    "plane": on_a_plane,
}


if __name__ == "__main__":
    main()
