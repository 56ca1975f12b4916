"""A spinning lidar that moves through a furnished room while it scans."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig import PointCloud, geometry, simulate

Array = NDArray[np.float64]

PERIOD = 0.1
LIDAR = simulate.Lidar(lines=24, steps=240, elevation=(-30.0, 30.0), noise=0.003)
TWIST = np.array([0.05, -0.02, 1.2, 1.5, 0.3, 0.0])
"""A second: 70 degrees and 1.5 m."""


def pose_at(time: float) -> Array:
    """Give T_room_sensor at a time, of a motion with a constant twist."""
    return simulate.upright_pose(-1.0, -0.5, 1.3, 0.2) @ geometry.exp_twist(time * TWIST)


def moving_scans(count: int, seed: int = 4) -> tuple[list[PointCloud], Array]:
    """Scan a room, and give the true poses at the middles of the scans."""
    room = simulate.room(seed)
    within = PERIOD * (np.arange(LIDAR.steps) / LIDAR.steps - 0.5)
    scans = [
        simulate.scan_moving(
            room, LIDAR, [pose_at(PERIOD * k + time) for time in within], seed=k, period=PERIOD
        )
        for k in range(count)
    ]
    return scans, np.array([pose_at(PERIOD * k) for k in range(count)])
