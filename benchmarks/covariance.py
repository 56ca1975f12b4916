"""Whether errors of poses are as large as their covariances say, with ideal and with bent sensors.

python benchmarks/covariance.py --write

Of each pose a sixth of error^T covariance^-1 error is taken, which is 1 in the mean where the covariance is
right. Simulated pairs and sequences are scanned by an ideal lidar and by one whose calibration is bent
(`surfsig.simulate.bent_calibration`), with objects that move from scan to scan; of real pairs the poses that
came with them are taken as true.
"""

from __future__ import annotations

import argparse
import itertools
import os
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from machine import measured_here
from numpy.typing import NDArray
from peers import ROOT
from registration import known_pairs
from report import Row, markdown_table, measured_on, publish
from rich.progress import track

import surfsig
from surfsig import PointCloud, geometry, simulate

COMMAND = "python benchmarks/covariance.py --write"
Array = NDArray[np.float64]
LIDAR = simulate.Lidar(lines=32, noise=0.01)
MOVING = 3
"""Objects that move."""
PAUSE = 0.3
"""Time between two scans of a pair, in which an object moves so many metres."""
NEAREST = 0.8
"""Metres from the sensor within which there are none."""
PLACES: dict[str, tuple[Callable[[int], simulate.Scene], float]] = {
    "room": (simulate.room, 1.0),
    "hall": (simulate.hall, 3.0),
    "pipes": (simulate.pipes, 1.0),
}
"""Scenes, and metres between two scans of a pair at most."""
WRONG = 0.25
"""Radii of a patch from which on a pose is wrong and not only inaccurate."""
WRONG_TURN = np.radians(5.0)
"""The same of its rotation: halls are nearly the same after half a turn about their middles."""
SCANS = 12
"""Of a sequence."""


@dataclass(frozen=True)
class Sensor:
    """A lidar with what is wrong with it, and whether objects move about it."""

    calibration: simulate.Calibration | None
    traffic: bool


def _sensor(name: str, seed: int) -> Sensor:
    return Sensor(None, False) if name == "ideal" else Sensor(simulate.bent_calibration(seed), True)


def with_traffic(scene: simulate.Scene, sensor: Array, seed: int, time: float) -> simulate.Scene:
    """Add people-sized boxes that walk along straight lines, a metre in a unit of time, round the sensor."""
    rng = np.random.default_rng([43, seed])
    placed = []
    for _ in range(MOVING):
        x, y = rng.uniform(-3.0, 3.0, 2)
        about = rng.uniform(0.0, 2.0 * np.pi)
        x, y = x + time * np.cos(about), y + time * np.sin(about)
        if np.hypot(x - sensor[0, 3], y - sensor[1, 3]) > NEAREST:
            placed.append(simulate.Placed(simulate.Box((0.5, 0.35, 1.7)), simulate.pose((x, y, 0.85))))
    return simulate.Scene((*scene.objects, *placed))


def scan(scene: simulate.Scene, pose: Array, sensor: Sensor, seed: int, time: float) -> PointCloud:
    """Scan a place at a time."""
    there = with_traffic(scene, pose, seed, time) if sensor.traffic else scene
    return simulate.scan(
        there, LIDAR, pose, seed=1000 * seed + int(10 * time), calibration=sensor.calibration
    )


def share_of_covariance(twist: Array, covariance: Array) -> float:
    """Give a sixth of error^T covariance^-1 error; NaN where the covariance is not that of six unknowns."""
    if not (np.isfinite(twist).all() and np.isfinite(covariance).all()):
        return float("nan")
    scale = np.sqrt(np.diag(covariance))
    return float(twist / scale @ np.linalg.solve(covariance / np.outer(scale, scale), twist / scale) / 6.0)


def of_registration(found: surfsig.Registration, truth: Array | None) -> tuple[float, float, float]:
    """Give the share, and the errors of the place of the overlap's middle: true, and as the covariance says.

    NaN where the pose is wrong, not inaccurate.
    """
    if truth is None:
        return (float("nan"), float("nan"), float("nan"))
    to_center = geometry.from_translation(found.center)
    off = geometry.inverse(to_center) @ truth @ geometry.inverse(found.T_target_source) @ to_center
    said = float(np.sqrt(np.diag(found.covariance)[3:].sum()))
    if (
        not np.isfinite(off).all()
        or np.linalg.norm(off[:3, 3]) > WRONG * found.radius
        or geometry.rotation_angle(off) > WRONG_TURN
    ):
        return (float("nan"), float("nan"), float("nan"))
    twist = geometry.log_pose(off)
    return share_of_covariance(twist, found.covariance), float(np.linalg.norm(twist[3:])), said


def of_pair(place: str, name: str, seed: int) -> tuple[float, float, float]:
    """Register two scans of a place."""
    build, apart = PLACES[place]
    rng = np.random.default_rng([44, seed])
    scene, sensor = build(seed), _sensor(name, seed)
    step, about = rng.uniform(0.3, 1.0) * apart, rng.uniform(0.0, 2.0 * np.pi)
    poses = [
        simulate.upright_pose(
            side * step * np.cos(about), side * step * np.sin(about), 1.3, rng.uniform(0.0, 2.0 * np.pi)
        )
        for side in (-0.5, 0.5)
    ]
    source, target = (scan(scene, pose, sensor, seed, PAUSE * number) for number, pose in enumerate(poses))
    found = surfsig.register(source, target)
    truth = geometry.inverse(poses[1]) @ poses[0]
    return of_registration(found, truth)


def of_sequence(place: str, name: str, seed: int) -> list[tuple[float, float, float]]:
    """Follow a sensor along a line through a place; of all scans but the first."""
    build, apart = PLACES[place]
    rng = np.random.default_rng([45, seed])
    scene, sensor = build(seed), _sensor(name, seed)
    about, turn = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(-0.05, 0.05)
    poses = []
    for number in range(SCANS):
        at = (number / (SCANS - 1) - 0.5) * 1.5 * apart
        poses.append(
            simulate.upright_pose(at * np.cos(about), at * np.sin(about), 1.3, about + number * turn)
        )
    scans = [scan(scene, pose, sensor, seed, 0.2 * number) for number, pose in enumerate(poses)]
    found = surfsig.estimate_odometry(scans)
    result = []
    for pose, estimate, covariance in zip(poses[1:], found.poses[1:], found.covariances[1:], strict=True):
        if not np.isfinite(estimate).all():
            result.append((np.nan, np.nan, np.nan))
            continue
        twist = geometry.log_pose(geometry.inverse(estimate) @ geometry.inverse(poses[0]) @ pose)
        said = float(np.sqrt(np.trace(covariance[3:, 3:])))
        result.append((share_of_covariance(twist, covariance), float(np.linalg.norm(twist[3:])), said))
    return result


def real_pairs(data: Path) -> dict[str, list[tuple[float, float, float]]]:
    """Register the real pairs of the test data, in both directions."""
    return {
        name: [of_registration(surfsig.register(pair.source, pair.target), pair.truth) for pair in pairs]
        for name, every in known_pairs(data).items()
        if (pairs := [pair for pair in every if pair.truth is not None])
    }


def row(name: str, values: list[tuple[float, float, float]]) -> Row:
    """Give the row of a table."""
    known = np.array([value for value in values if np.isfinite(value[0])]).reshape(-1, 3)
    if not len(known):
        return (name, f"0 of {len(values)}", "-", "-", "-", "-")
    share = known[:, 0]
    return (
        name,
        f"{len(known)} of {len(values)}",
        f"{np.median(share):.2f}",
        f"{np.percentile(share, 90):.2f}",
        f"{1000.0 * np.median(known[:, 1]):.2f}",
        f"{1000.0 * np.median(known[:, 2]):.2f}",
    )


COLUMNS = (
    "poses",
    "measured",
    "error² over covariance, a sixth: median",
    "of nine in ten at most",
    "error of place, median, mm",
    "as the covariance says",
)


def main() -> None:
    """Measure, print and write."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument(
        "--seeds", type=int, nargs=2, default=(300, 308), help="first seed, and the one after the last"
    )
    parser.add_argument("--places", nargs="*", choices=list(PLACES), default=list(PLACES))
    parser.add_argument("--without-real", action="store_true")
    parser.add_argument("--write", action="store_true", help="into BENCHMARKS.md")
    arguments = parser.parse_args()
    seeds = range(*arguments.seeds)
    rows = []
    for kind, name, place in itertools.product(("pairs", "sequences"), ("ideal", "bent"), arguments.places):
        label = f"{kind}, {place}, {name}"
        values = []
        for seed in track(seeds, description=label, transient=True):
            if kind == "pairs":
                values.append(of_pair(place, name, seed))
            else:
                values += of_sequence(place, name, seed)
        rows.append(row(label, values))
        if not arguments.write:
            print(rows[-1], flush=True)
    if not arguments.without_real:
        data = Path(os.environ.get("SURFSIG_TEST_DATA", ROOT / ".." / "shared" / "data"))
        rows += [row(f"real pairs, {name}", values) for name, values in real_pairs(data).items()]
    notes = [*measured_on(measured_here({})), f"The seeds are {seeds[0]} to {seeds[-1]}."]
    table = markdown_table(COLUMNS, rows)
    publish("\n\n".join([table, "\n".join(f"- {line}" for line in notes)]), COMMAND, arguments.write)


if __name__ == "__main__":
    main()
