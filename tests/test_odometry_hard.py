"""Sequences that odometry commonly loses: sight that opens, fast rotations, a first scan that misleads."""

from __future__ import annotations

import moving_sensor
import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import Odometry, PointCloud, simulate

Array = NDArray[np.float64]

LIDAR = simulate.Lidar(lines=24, steps=360, elevation=(-25.0, 25.0), noise=0.01)


def along(count: int, step: float, start: float, yaws: Array | None = None) -> Array:
    return np.array(
        [
            simulate.upright_pose(
                start + step * k, 0.05 * np.sin(0.5 * k), 1.4, 0.0 if yaws is None else yaws[k]
            )
            for k in range(count)
        ]
    )


def scanned(scene: simulate.Scene, true: Array) -> list[PointCloud]:
    return [simulate.scan(scene, LIDAR, pose, seed=number) for number, pose in enumerate(true)]


def largest_error(found: Odometry, true: Array) -> float:
    """Of the scans of the longest segment, as seen from its first."""
    known = found.segments == found.longest_segment
    first = int(np.flatnonzero(known)[0])
    poses = surfsig.geometry.inverse(found.poses[first]) @ found.poses[known]
    off, _ = moving_sensor.errors(poses, true[known])
    return float(off.max())


@pytest.mark.parametrize("step", [40.0, 90.0])
def test_a_sensor_that_rotates_fast_is_followed(step: float) -> None:
    """From the fourth scan on: nothing has told before that it would."""
    count = 9
    true = along(count, 0.1, -0.5, np.radians(step * np.maximum(0, np.arange(count) - 3)))
    found = surfsig.estimate_odometry(scanned(simulate.room(3, size=(8.0, 6.0, 2.8)), true))
    assert (found.status < surfsig.ScanStatus.LOST).all()
    assert largest_error(found, true) < 0.03


def test_a_sensor_that_is_shaken_is_followed() -> None:
    count = 10
    yaws = np.radians(30.0) * (np.arange(count) % 2) * (np.arange(count) > 3)
    true = along(count, 0.1, -0.5, yaws)
    found = surfsig.estimate_odometry(scanned(simulate.room(3, size=(8.0, 6.0, 2.8)), true))
    assert found.counts()["lost"] == 0
    assert largest_error(found, true) < 0.03


def test_a_first_scan_of_sixty_points_does_not_make_the_voxel() -> None:
    """Another map is begun, with lengths of its own, and all other scans are in it."""
    true = along(8, 0.25, -4.0)
    scans = scanned(simulate.hall(2, size=(24.0, 15.0, 5.0)), true)
    expected = surfsig.estimate_odometry(scans[1:])
    chosen = np.random.default_rng(1).choice(len(scans[0]), 60, replace=False)
    scans[0] = PointCloud(scans[0].points[chosen], viewpoint=np.zeros(3))
    found = surfsig.estimate_odometry(scans)
    assert found.voxel == pytest.approx(expected.voxel, rel=0.1)
    assert (found.segments == found.longest_segment).sum() >= 7
    assert largest_error(found, true) < 0.03


def test_sight_that_opens_is_no_reason_to_be_lost() -> None:
    """Out of a box of 4 m that is open at one end, into a hall."""
    walls = [
        ((-9.0, 1.6, 1.3), (4.0, 0.1, 2.6)),
        ((-9.0, -1.6, 1.3), (4.0, 0.1, 2.6)),
        ((-11.0, 0.0, 1.3), (0.1, 3.2, 2.6)),
        ((-9.0, 0.0, 2.6), (4.0, 3.2, 0.1)),
        ((-10.3, 1.2, 0.5), (0.6, 0.5, 1.0)),
    ]
    placed = [simulate.Placed(simulate.Box(size), simulate.pose(middle)) for middle, size in walls]
    hall = simulate.hall(5, size=(26.0, 16.0, 6.0)).objects
    # The shell has six parts, whose middles are on the way; nothing else may stand there.
    free = [*hall[:6], *(one for one in hall[6:] if abs(one.pose[1, 3]) > 3.5)]
    true = along(12, 0.4, -10.0)
    found = surfsig.estimate_odometry(scanned(simulate.Scene([*free, *placed]), true))
    assert found.counts()["tracked"] == 12
    assert (found.segments == 0).all()
    assert largest_error(found, true) < 0.05


@pytest.mark.slow
def test_a_sensor_that_was_brought_to_another_place_begins_another_map() -> None:
    """And finds the first one again, where it is brought back."""
    here, there = simulate.room(6, size=(8.0, 6.0, 2.8)), simulate.room(7, size=(6.0, 5.0, 2.5))
    first, away, back = along(6, 0.1, -0.6), along(7, 0.1, -0.4), along(5, 0.1, -0.3)
    scans = [*scanned(here, first), *scanned(there, away), *scanned(here, back)]
    found = surfsig.estimate_odometry(scans)
    assert found.segments[:6].tolist() == [0] * 6
    assert set(found.segments[6:13].tolist()) == {1}
    assert found.segments[-1] == 0
    assert set(found.segments[13:].tolist()) <= {0, -1}
    off, _ = moving_sensor.errors(
        found.poses[found.segments == 0],
        np.concatenate([first, away, back])[found.segments == 0],
    )
    assert off.max() < 0.03
    assert found.length == pytest.approx(0.5 + 0.6 + 0.3 + 0.1, abs=0.35)
    assert np.isnan(found.poses_of(1)[:6]).all()
    assert np.isfinite(found.poses_of(1)[6:13]).all()
