"""Follow simulated sensors through a building: drift, errors beside covariances, speed, and relocalisation.

python benchmarks/odometry.py --write

No real sequence is part of this. The first table has KISS-ICP and small_gicp beside surfsig on the same
scans, with the voxel of their default settings (1 m, made for streets) and with one of 0.3 m. The second
table carries the sensor away: to places near its trajectory, to a building with the same walls and other
furniture, and to one with other walls.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from dataclasses import replace
from pathlib import Path
from typing import Any

import moving_sensor
import numpy as np
from machine import measured_here
from moving_sensor import LIDAR, Array
from numpy.typing import NDArray
from peers import HERE, PeerUnavailable, peer_python, run_json
from report import Row, markdown_table, measured_on, publish
from rich.progress import track

import surfsig
from surfsig import simulate

SENSORS = {
    "lidar, 32 rings": (LIDAR, 110),
    "the same, noise 30 mm": (replace(LIDAR, noise=0.03), 110),
    "the same, every 0.5 m": (LIDAR, 48),
    "lidar, 16 rings, 30° high": (simulate.Lidar(16, (-15.0, 15.0), 900, noise=0.02), 110),
    "lidar, 8 rings": (simulate.Lidar(8, (-30.0, 30.0), 360), 110),
    "camera, 90° x 60°": (simulate.Lidar(96, (-30.0, 30.0), 160, noise=0.005, view=90.0), 110),
}
WAY_COLUMNS = (
    "sensor", "scans", "points each", "tracked", "largest error of place", "of the way", "of direction",
    "error² over covariance", "processor time a scan",
    "KISS-ICP, 1 m: largest error, processor time", "KISS-ICP, 0.3 m", "small_gicp, 1 m", "small_gicp, 0.3 m",
)  # fmt: skip
PEERS = ("kiss-icp", "small_gicp")
PEER_VOXELS = (1.0, 0.3)
"""Metres: their default, and what suits rooms better. With 0.15 m KISS-ICP takes two to four times as
long."""
BACK_COLUMNS = ("sensor", "carried to", "places", "found, right", "found, wrong", "lost")
BACK_SENSORS = ("lidar, 32 rings", "camera, 90° x 60°")
PLACES = ("a mapped place", "the same walls, other furniture", "other walls")
CARRIED, STEPS = 4, 5
"""Places that the sensor is carried to, and scans on its way from there."""
RIGHT = 0.1
"""Metres within which a place is right."""
SEEDS = (503, 504, 505, 506, 507)
"""None of them was looked at while the search was made."""


def main() -> None:
    """Print the tables, and write them into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--seeds", type=int, nargs="+", default=SEEDS, help="buildings of the second table")
    arguments = parser.parse_args()
    facts = measured_here(peer_versions())
    ways = [follow(name, *sensor) for name, sensor in track(SENSORS.items(), "following")]
    back: list[Row] = []
    for sensor in BACK_SENSORS:
        lidar = SENSORS[sensor][0]
        found = np.sum([carry_away(seed, lidar) for seed in track(arguments.seeds, sensor)], axis=0)
        back += [(sensor, place, *map(str, row)) for place, row in zip(PLACES, found.tolist(), strict=True)]
    parts = [
        markdown_table(WAY_COLUMNS, ways),
        f"Seeds of the buildings: {', '.join(map(str, arguments.seeds))}.",
        markdown_table(BACK_COLUMNS, back),
        "\n".join(f"- {note}" for note in measured_on(facts)),
    ]
    text = "\n\n".join(parts)
    publish(text, "python benchmarks/odometry.py --write", arguments.write)


def follow(name: str, lidar: simulate.Lidar, count: int) -> Row:
    """Follow a sensor on its way, and return a row of the first table."""
    scene, true = moving_sensor.building(1), moving_sensor.way(count)
    scans = [moving_sensor.scan(scene, pose, seed, lidar) for seed, pose in enumerate(true)]
    start = time.process_time()
    found = surfsig.estimate_odometry(scans)
    seconds = time.process_time() - start
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
        f"{1000 * seconds / count:.0f} ms",
        *(by_peer(method, scans, true, voxel) for method in PEERS for voxel in PEER_VOXELS),
    )


def by_peer(method: str, scans: list[surfsig.PointCloud], true: Array, voxel: float) -> str:
    """Let a peer follow the same scans, and give its largest error of place and processor time a scan."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scans.npz"
        arrays: dict[str, Any] = {f"scan{number}": scan.points for number, scan in enumerate(scans)}
        np.savez(file, **arrays)
        try:
            program: list[str | Path] = [peer_python(), HERE / "odometry_peers.py", file]
            answer = run_json([*program, "--method", method, "--voxel", str(voxel)], threads=1)
        except PeerUnavailable as error:
            return f"not run: {error}"
    off, _ = moving_sensor.errors(np.array(answer["poses"]), true)
    return f"{1000 * off.max():.0f} mm, {1000 * answer['seconds'] / len(scans):.0f} ms"


def peer_versions() -> dict[str, str]:
    """Give those of KISS-ICP and small_gicp, where they are installed."""
    try:
        answer = run_json([peer_python(), HERE / "odometry_peers.py", "versions"], threads=1)
    except PeerUnavailable:
        return {}
    return {name: str(text) for name, text in answer.items()}


def carry_away(seed: int, lidar: simulate.Lidar) -> NDArray[np.int64]:
    """Carry the sensor to places after its way, and count these: all, found right, wrong, and lost, (3, 4).

    A place counts as wrong where any scan has a wrong pose, and as found where any has one.
    """
    rng = np.random.default_rng([13, seed])
    true = moving_sensor.way(70)
    size = tuple(rng.uniform(0.75, 1.3, 2))
    home = moving_sensor.building(seed)
    scenes = (home, moving_sensor.building(10_000 + seed), moving_sensor.building(20_000 + seed, size))
    way = [moving_sensor.scan(home, pose, number, lidar) for number, pose in enumerate(true)]
    counts = np.zeros((3, 4), np.int64)
    for place, scene in enumerate(scenes):
        scale = (*size, 1.0) if place == 2 else (1.0, 1.0, 1.0)
        poses = np.concatenate([walk(rng, true) for _ in range(CARRIED)])
        poses[:, :3, 3] *= scale
        scans = [moving_sensor.scan(scene, pose, 1000 + number, lidar) for number, pose in enumerate(poses)]
        found = surfsig.estimate_odometry([*way, *scans])
        off, _ = moving_sensor.errors(found.poses, np.concatenate([true, poses]))
        # A map of its own says nothing about where the sensor is in the first one.
        off[found.segments != found.segments[0]] = np.nan
        off = off[len(way) :].reshape(CARRIED, STEPS)
        known = np.isfinite(off)
        # Where other walls are, every pose is wrong; where only the furniture is new, the walls' is right.
        false = known if place == 2 else off > RIGHT
        wrong = int(false.any(axis=1).sum())
        right = int((known.any(axis=1) & ~false.any(axis=1)).sum())
        counts[place] += (CARRIED, right, wrong, CARRIED - right - wrong)
    return counts


def walk(rng: np.random.Generator, true: Array) -> Array:
    """Give poses of a few scans from a place near the way, turned as by chance, (n, 4, 4)."""
    start = rng.integers(len(true) - STEPS)
    poses = true[start : start + STEPS].copy()
    poses[:, :3, :3] = simulate.turn((0.0, 0.0, 1.0), rng.uniform(0.0, 2.0 * np.pi)) @ poses[:, :3, :3]
    poses[:, :3, 3] += rng.uniform(-0.4, 0.4, 3)
    return poses


if __name__ == "__main__":
    main()
