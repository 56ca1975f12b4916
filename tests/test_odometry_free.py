"""Places that leave a motion open: it is named, its variance is infinite, and the last one goes on."""

from __future__ import annotations

import numpy as np
import pytest

import surfsig
from surfsig import Odometry, PointCloud, geometry, simulate

STEP = 0.3
COUNT = 8


def poses_along(count: int, yaw: float = 0.6) -> list[np.ndarray]:
    """Of a sensor that is carried along x and sways."""
    return [
        simulate.upright_pose(STEP * k - 1.0, 0.08 * np.sin(0.7 * k), 1.2 + 0.02 * np.sin(k), yaw + 0.02 * k)
        for k in range(count)
    ]


def scanned(scene: simulate.Scene, lines: int, poses: list[np.ndarray]) -> list[PointCloud]:
    sensor = simulate.Lidar(lines=lines, steps=360, elevation=(-25.0, 25.0), max_range=12.0)
    return [simulate.scan(scene, sensor, pose, seed=number) for number, pose in enumerate(poses)]


def errors_in_place(found: Odometry, poses: list[np.ndarray]) -> np.ndarray:
    """Along x, y and z of the place, (n, 3)."""
    true = [geometry.inverse(poses[0]) @ pose for pose in poses]
    return np.array(
        [
            poses[0][:3, :3] @ (pose[:3, 3] - truth[:3, 3])
            for pose, truth in zip(found.poses, true, strict=True)
        ]
    )


@pytest.fixture(scope="module")
def corridor() -> tuple[Odometry, list[np.ndarray]]:
    poses = poses_along(COUNT)
    return surfsig.estimate_odometry(scanned(simulate.corridor(3), 32, poses)), poses


def test_a_smooth_corridor_is_followed_across_and_open_along(
    corridor: tuple[Odometry, list[np.ndarray]],
) -> None:
    found, poses = corridor
    assert found.counts()["tracked"] == COUNT
    off = errors_in_place(found, poses)
    assert np.abs(off[:, 1:]).max() < 0.02, "across the corridor the walls say where the sensor is"
    for number in range(1, COUNT):
        along = poses[number][:3, :3].T[:, 0]
        directions = found.free_directions[number]
        named = [one.axis for one in directions if one.motion == "translation"]
        assert any(abs(axis @ along) > np.cos(np.radians(15.0)) for axis in named), number


def test_the_variance_of_an_open_motion_is_infinite_and_that_of_the_others_is_not(
    corridor: tuple[Odometry, list[np.ndarray]],
) -> None:
    found, poses = corridor
    assert (found.covariances[0] == 0.0).all()
    assert not found.free_directions[0]
    for number in range(1, COUNT):
        covariance = found.covariances[number]
        # The sensor's x and y are both at an angle to the corridor.
        assert np.isinf(covariance[[3, 4], [3, 4]]).all()
        assert np.isinf(covariance[3, 4])
        along = poses[number][:3, :3].T[:, 0]
        assert np.sign(covariance[3, 4]) == np.sign(along[0] * along[1])
        assert np.isfinite(covariance[:3, :3]).all()
        assert 0.0 < covariance[5, 5] < 0.01**2


def test_a_motion_that_was_known_before_goes_on() -> None:
    """Away from the end of a corridor, whose wall is out of reach after some steps."""
    poses = [simulate.upright_pose(STEP * k - 26.5, 0.0, 1.2, 0.5) for k in range(10)]
    sensor = simulate.Lidar(lines=32, steps=360, elevation=(-25.0, 25.0), max_range=5.0)
    scans = [
        simulate.scan(simulate.corridor(3), sensor, pose, seed=number) for number, pose in enumerate(poses)
    ]
    found = surfsig.estimate_odometry(scans)
    assert found.counts()["tracked"] == len(poses)
    assert np.abs(errors_in_place(found, poses)).max() < 0.1
    is_open = [bool(free) for free in found.free_directions]
    assert not any(is_open[:4]), "the wall is seen"
    assert all(is_open[8:]), "it is not any more"
    assert np.isinf(found.covariances[9]).any()
    assert np.isfinite(found.covariances[3]).all()


def test_a_plane_leaves_three_motions_open() -> None:
    poses = poses_along(4)
    found = surfsig.estimate_odometry(scanned(simulate.plane(), 32, poses))
    assert found.counts()["tracked"] == 4
    for number in range(1, 4):
        motions = sorted(one.motion for one in found.free_directions[number])
        assert motions == ["rotation", "translation", "translation"]
        deviations = np.sqrt(np.diag(found.covariances[number]))
        assert np.isinf(deviations[[2, 3, 4]]).all()
        assert (deviations[[0, 1, 5]] < 0.01).all()
    assert np.abs(errors_in_place(found, poses)[:, 2]).max() < 0.02


def test_a_furnished_room_leaves_nothing_open() -> None:
    poses = [simulate.upright_pose(0.1 * k, 0.05 * k, 1.3, 0.3) for k in range(4)]
    found = surfsig.estimate_odometry(scanned(simulate.room(11), 32, poses))
    assert not any(found.free_directions)
    assert np.isfinite(found.covariances).all()


def test_errors_of_normals_do_not_hold_a_scan_in_a_corridor_of_sixteen_noisy_lines() -> None:
    """It was 2.1 m off after eight scans, and said 7 mm: thousands of slightly wrong planes held it."""
    poses = [simulate.upright_pose(0.5 * k - 8.0, 0.1 * np.sin(0.4 * k), 1.2, 0.0) for k in range(COUNT)]
    sensor = simulate.Lidar(lines=16, steps=400, elevation=(-20.0, 20.0), noise=0.03, max_range=15.0)
    scans = [simulate.scan(simulate.corridor(1), sensor, pose, seed=k) for k, pose in enumerate(poses)]
    found = surfsig.estimate_odometry(scans)
    off = errors_in_place(found, poses)
    assert np.isinf(found.covariances[1:]).any(axis=(1, 2)).all()
    assert np.abs(off[:, 1:]).max() < 0.1


def test_door_frames_hold_what_the_walls_leave_open() -> None:
    """Shallow columns are a few in a hundred of the points, and were not enough to be believed."""
    poses = [simulate.upright_pose(0.5 * k - 8.0, 0.1 * np.sin(0.4 * k), 1.2, 0.0) for k in range(12)]
    sensor = simulate.Lidar(lines=64, steps=400, elevation=(-20.0, 20.0), noise=0.02, max_range=40.0)
    scene = simulate.corridor(1, niches=12)
    found = surfsig.estimate_odometry(
        [simulate.scan(scene, sensor, pose, seed=k) for k, pose in enumerate(poses)]
    )
    assert not any(found.free_directions)
    assert np.abs(errors_in_place(found, poses)).max() < 0.03
