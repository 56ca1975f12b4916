"""Follow a lidar that spins at 10 Hz on a fast vehicle: its scans are bent by its motion, and deskewed.

python benchmarks/spinning_lidar.py --write

A street of 260 m with houses, trees and parked cars, driven along at up to 20 m/s, with rotations of up to 90
degrees a second. The error is that of the last pose as seen from the first, over the way; KISS-ICP deskews by
the same times, and its pose is that at the end of a scan or at its middle, whichever is nearer to the truth.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

import hard_sequences
import moving_sensor
import numpy as np
from machine import measured_here
from moving_sensor import Array
from peers import HERE, PeerUnavailable, peer_python, run_json
from report import Row, markdown_table, measured_on, publish
from scipy.interpolate import CubicSpline

import surfsig
from surfsig import PointCloud, simulate

PERIOD = 0.1
"""Seconds of a scan."""
LIDAR = simulate.Lidar(lines=32, steps=600, elevation=(-22.0, 12.0), noise=0.01, max_range=80.0)
COLUMNS = (
    "motion", "scans", "path", "error at the end, of the path", "largest", "the same without times",
    "KISS-ICP with times, at the end", "small_gicp without, at the end", "processor time a scan: surfsig",
    "KISS-ICP", "small_gicp",
)  # fmt: skip
MOTIONS = {
    "5 m/s, 20°/s": (5.0, 20.0),
    "10 m/s, 45°/s": (10.0, 45.0),
    "20 m/s, 90°/s": (20.0, 90.0),
}
SECONDS = 6.0


def main() -> None:
    """Print the table, and write it into BENCHMARKS.md where asked."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--write", action="store_true", help="update BENCHMARKS.md")
    parser.add_argument("--seed", type=int, default=1)
    parser.add_argument("--seconds", type=float, default=SECONDS)
    parser.add_argument("--only", nargs="+", default=list(MOTIONS))
    arguments = parser.parse_args()
    rows = []
    for name in arguments.only:
        rows.append(follow(name, *MOTIONS[name], arguments.seed, arguments.seconds))
        print(rows[-1], flush=True)
    text = markdown_table(COLUMNS, rows)
    text += "\n\n" + "\n".join(f"- {note}" for note in measured_on(measured_here({})))
    publish(text, "python benchmarks/spinning_lidar.py --write", arguments.write)


def trajectory(speed: float, rate: float, seed: int) -> tuple[CubicSpline, CubicSpline]:
    """Give position and angles (yaw, pitch, roll) over the seconds: from rest, rates up to `rate`."""
    rng = np.random.default_rng([81, seed])
    knots = np.arange(0.0, 60.0, 1.0)
    # The vehicle keeps to its street, and the sensor looks to and fro with a period of four seconds.
    speeds = speed * np.minimum(1.0, knots / 2.0) * rng.uniform(0.7, 1.0, len(knots))
    x = np.concatenate([[0.0], np.cumsum(0.5 * (speeds[1:] + speeds[:-1]))])
    y = 1.5 * np.sin(0.3 * knots)
    position = CubicSpline(knots, np.column_stack([x, y, 1.8 + 0.03 * np.sin(2.0 * knots)]))
    fine = np.arange(0.0, 60.0, 0.05)
    swing = np.radians(rate) / (0.5 * np.pi)
    yaw = swing * (1.0 - np.cos(0.5 * np.pi * fine))
    angles = CubicSpline(fine, np.column_stack([yaw, 0.02 * np.sin(3.0 * fine), 0.02 * np.cos(2.3 * fine)]))
    return position, angles


def poses_at(times: Array, position: CubicSpline, angles: CubicSpline) -> Array:
    """Give T_scene_sensor at times, (n, 4, 4)."""
    from scipy.spatial.transform import Rotation

    poses = np.tile(np.eye(4), (len(times), 1, 1))
    poses[:, :3, :3] = Rotation.from_euler("ZYX", angles(times)).as_matrix()
    poses[:, :3, 3] = position(times)
    return poses


def sequence(speed: float, rate: float, seed: int, seconds: float) -> tuple[list[PointCloud], Array]:
    """Scan a street, and give the true poses at the middles of the scans."""
    position, angles = trajectory(speed, rate, seed)
    scene = simulate.Scene(hard_sequences.street(seed))
    count = int(seconds / PERIOD)
    middles = np.asarray(PERIOD * (np.arange(count) + 0.5), np.float64)
    within = PERIOD * (np.arange(LIDAR.steps) / LIDAR.steps - 0.5)
    scans = [
        simulate.scan_moving(
            scene, LIDAR, poses_at(middle + within, position, angles), seed=1000 * seed + k, period=PERIOD
        )
        for k, middle in enumerate(middles)
    ]
    return scans, poses_at(middles, position, angles)


def follow(name: str, speed: float, rate: float, seed: int, seconds: float) -> Row:
    """Follow one motion, and return a row of the table."""
    scans, true = sequence(speed, rate, seed, seconds)
    way = float(np.linalg.norm(np.diff(true[:, :3, 3], axis=0), axis=1).sum())
    start = time.process_time()
    found = surfsig.estimate_odometry(scans, threads=1)
    taken = time.process_time() - start
    off, _ = moving_sensor.errors(found.poses, true)
    bent = surfsig.estimate_odometry([PointCloud(cloud.points, viewpoint=np.zeros(3)) for cloud in scans])
    without, _ = moving_sensor.errors(bent.poses, true)
    kiss, kiss_taken = by_peer("kiss-icp", scans, seed, speed, rate, seconds, way)
    small, small_taken = by_peer("small_gicp", scans, seed, speed, rate, seconds, way)
    return (
        name,
        f"{len(scans)}, {found.counts()['tracked']} tracked",
        f"{way:.0f} m",
        f"{off[-1] / way:.3%}",
        f"{np.nanmax(off):.3f} m",
        f"{without[-1] / way:.2%}",
        kiss,
        small,
        f"{1000 * taken / len(scans):.0f} ms",
        kiss_taken,
        small_taken,
    )


def by_peer(
    method: str, scans: list[PointCloud], seed: int, speed: float, rate: float, seconds: float, way: float
) -> tuple[str, str]:
    """Let a peer follow the same scans with their times, which small_gicp has no use for."""
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "scans.npz"
        arrays = {f"scan{number}": scan.points for number, scan in enumerate(scans)}
        arrays |= {f"times{number}": scan.fields["time"] / PERIOD + 0.5 for number, scan in enumerate(scans)}
        np.savez(file, allow_pickle=True, **arrays)
        try:
            program: list[str | Path] = [peer_python(), HERE / "odometry_peers.py", file]
            answer = run_json([*program, "--method", method, "--voxel", "1.0"], threads=1)
        except PeerUnavailable as error:
            return f"not run: {error}", ""
    position, angles = trajectory(speed, rate, seed)
    count = int(seconds / PERIOD)
    ends = [np.asarray(PERIOD * (np.arange(count) + part), np.float64) for part in (0.5, 1.0)]
    off = [
        moving_sensor.errors(np.array(answer["poses"]), poses_at(at, position, angles))[0][-1] for at in ends
    ]
    return f"{min(off) / way:.3%}", f"{1000 * answer['seconds'] / len(scans):.0f} ms"


if __name__ == "__main__":
    main()
