"""Follow simulated sensors through a building: drift, errors beside covariances, speed, and ways back.

python benchmarks/odometry.py --write

No real sequence is part of this. The second table carries the sensor to places near its way, turned at
random, and to places of another building with the same walls and other furniture.
"""

from __future__ import annotations

import argparse
import datetime
import time

import moving_sensor
import numpy as np
from machine import ROOT, describe_machine, own_versions
from moving_sensor import Lidar
from numpy.typing import NDArray
from report import Row, markdown_table, measured_on, update_section
from rich.progress import track

import surfsig
from surfsig import ScanStatus, simulate

SENSORS = {
    "lidar, 32 rings": (Lidar(), 110),
    "the same, noise 30 mm": (Lidar(noise=0.03), 110),
    "the same, every 0.5 m": (Lidar(), 48),
    "lidar, 16 rings, 30° high": (Lidar(16, 900, np.radians(15.0), noise=0.02), 110),
    "lidar, 8 rings": (Lidar(8, 360, np.radians(30.0)), 110),
    "camera, 90° x 60°": (Lidar(96, 160, np.radians(30.0), np.radians(90.0), 0.005), 110),
}
WAY_COLUMNS = (
    "sensor", "scans", "points each", "tracked", "largest error of place", "of the way", "of direction",
    "error² over covariance", "scans/s",
)  # fmt: skip
BACK_COLUMNS = ("carried to", "scans", "found, right", "found, wrong", "lost")
CARRIED = 10
RIGHT = 0.1
"""Metres within which a place is right."""
BUILDINGS = range(1)


def main() -> None:
    """Print the tables, and write them into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    arguments = parser.parse_args()
    facts = {
        "machine": describe_machine(),
        "date": datetime.datetime.now(datetime.timezone.utc).date().isoformat(),
        "versions": own_versions(),
    }
    ways = [follow(name, *sensor) for name, sensor in track(SENSORS.items(), "following")]
    found = np.sum([carry_away(seed) for seed in track(BUILDINGS, "carrying away")], axis=0)
    places = ("a mapped place", "another building")
    back: list[Row] = [(place, *map(str, row)) for place, row in zip(places, found.tolist(), strict=True)]
    parts = [
        markdown_table(WAY_COLUMNS, ways),
        markdown_table(BACK_COLUMNS, back),
        "\n".join(f"- {note}" for note in measured_on(facts)),
    ]
    text = "\n\n".join(parts)
    print(text)
    if arguments.write:
        update_section(ROOT / "BENCHMARKS.md", "python benchmarks/odometry.py --write", text)


def follow(name: str, lidar: Lidar, count: int) -> Row:
    """Follow a sensor on its way, and return a row of the first table."""
    scene, true = moving_sensor.building(1), moving_sensor.way(count)
    scans = [moving_sensor.scan(scene, pose, seed, lidar) for seed, pose in enumerate(true)]
    start = time.perf_counter()
    found = surfsig.odometry(scans)
    seconds = time.perf_counter() - start
    off, turned = moving_sensor.errors(found.poses, true)
    known = np.flatnonzero(np.isfinite(found.poses).all(axis=(1, 2)))
    # The first pose is exact by definition.
    motions = moving_sensor.missing_motions(found.poses[known], true[known])[1:]
    nees = np.einsum("ni,nij,nj->n", motions, np.linalg.inv(found.covariances[known[1:]]), motions) / 6
    return (
        name,
        str(count),
        f"{np.mean([len(scan) for scan in scans]):,.0f}",
        str(found.counts()["tracked"]),
        f"{1000 * np.nanmax(off):.1f} mm",
        f"{np.nanmax(off) / found.length:.3%}",
        f"{np.degrees(np.nanmax(turned)):.3f}°",
        f"{nees.mean():.1f}",
        f"{count / seconds:.1f}",
    )


def carry_away(seed: int) -> NDArray[np.int64]:
    """Carry the sensor to places after its way, and count scans, right, wrong and lost, (2, 4)."""
    rng = np.random.default_rng([13, seed])
    true = moving_sensor.way(70)
    scenes = [moving_sensor.building(seed), moving_sensor.building(100 + seed)]
    way = [moving_sensor.scan(scenes[0], pose, number) for number, pose in enumerate(true)]
    counts = np.zeros((2, 4), np.int64)
    for place, scene in enumerate(scenes):
        carried, poses = [], []
        for number in range(CARRIED):
            pose = true[rng.integers(len(true))].copy()
            pose[:3, :3] = simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi)) @ pose[:3, :3]
            pose[:3, 3] += rng.uniform(-0.4, 0.4, 3)
            poses.append(pose)
            carried.append(moving_sensor.scan(scene, pose, 1000 + number))
        found = surfsig.odometry([*way, *carried])
        off, _ = moving_sensor.errors(found.poses, np.concatenate([true, poses]))
        lost = int((found.status[len(way) :] == ScanStatus.LOST).sum())
        right = int((off[len(way) :] < RIGHT).sum())
        counts[place] += (CARRIED, right, CARRIED - right - lost, lost)
    return counts


if __name__ == "__main__":
    main()
