"""Simulated places and sensors: points lie on what is there, and the same seed gives the same scan."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from surfsig import InvalidInputError, simulate

PLACES: dict[str, Callable[[int], simulate.Scene]] = {
    "room": simulate.room,
    "corridor": lambda seed: simulate.corridor(seed, niches=4),
    "tunnel": simulate.tunnel,
    "hall": simulate.hall,
    "pipes": simulate.pipes,
    "forest": simulate.forest,
    "plane": lambda seed: simulate.plane(),
}
SENSORS: dict[str, simulate.Lidar | simulate.DepthCamera] = {
    "lidar": simulate.Lidar(lines=16, steps=60, noise=0.01),
    "camera": simulate.DepthCamera(24, 18, noise=0.001, max_range=30.0),
}


@pytest.mark.parametrize("sensor", SENSORS)
@pytest.mark.parametrize("place", PLACES)
def test_points_lie_on_the_scene_up_to_the_noise(place: str, sensor: str) -> None:
    scene = PLACES[place](3)
    pose = simulate.upright_pose(0.2, -0.1, 1.4, 0.7, (0.02, -0.03))
    if sensor == "camera":
        # It looks ahead and down.
        pose[:3, :3] = pose[:3, :3] @ simulate.turn((0.0, 1.0, 0.0), 2.0)
    exact, noisy = (
        simulate.scan(scene, kind, pose, seed=5)
        for kind in (_without_noise(SENSORS[sensor]), SENSORS[sensor])
    )
    assert len(exact) > 100
    world = simulate.transform_points(pose, exact.points.astype(np.float64))
    nearest = np.min([np.abs(_distance(placed, world)) for placed in scene.objects], axis=0)
    assert nearest.max() < 1e-4
    off = np.linalg.norm(noisy.points - exact.points, axis=1)
    limit = SENSORS[sensor].noise * (1.0 if sensor == "lidar" else exact.points[:, 2].max() ** 2 * 2.0)
    assert 0.0 < off.max() < 6.0 * limit
    again = simulate.scan(scene, SENSORS[sensor], pose, seed=5)
    assert np.array_equal(again.points, noisy.points)
    assert noisy.viewpoint is not None
    assert not noisy.viewpoint.any()


def _without_noise(sensor: simulate.Lidar | simulate.DepthCamera) -> simulate.Lidar | simulate.DepthCamera:
    if isinstance(sensor, simulate.Lidar):
        return simulate.Lidar(lines=sensor.lines, steps=sensor.steps, noise=0.0)
    return simulate.DepthCamera(sensor.width, sensor.height, noise=0.0, max_range=sensor.max_range)


def _distance(placed: simulate.Placed, points: np.ndarray) -> np.ndarray:
    """The implicit function over its slope: the distance, near the surface."""
    steps = 1e-4 * np.eye(3)
    slopes = [(placed.implicit(points + step) - placed.implicit(points - step)) / 2e-4 for step in steps]
    slope = np.maximum(np.linalg.norm(slopes, axis=0), 1e-9)
    value = placed.implicit(points) / slope
    # Beyond the ends of an open tube the implicit function knows nothing of them.
    return np.asarray(value)


def test_a_lidar_has_its_lines_and_a_camera_its_view() -> None:
    rays = simulate.Lidar(lines=3, elevation=(-10.0, 20.0), steps=4).rays()
    elevation = np.degrees(np.arcsin(rays[:, 2]))
    assert np.allclose(np.unique(elevation.round(6)), [-10.0, 5.0, 20.0])
    azimuth = np.degrees(np.arctan2(rays[:, 1], rays[:, 0])).reshape(3, 4)
    assert np.allclose(np.abs(azimuth), [180.0, 90.0, 0.0, 90.0])
    assert np.allclose(azimuth[:, [1, 3]], [-90.0, 90.0])
    rays = simulate.Lidar(lines=2, steps=4, view=90.0).rays()
    azimuth = np.degrees(np.arctan2(rays[:, 1], rays[:, 0])).reshape(2, 4)
    assert np.allclose(azimuth, [-45.0, -22.5, 0.0, 22.5])
    rays = simulate.DepthCamera(100, 50, view=90.0).rays()
    # From the middle of the first to the middle of the last pixel.
    assert np.allclose(rays[0] / rays[0, 2], [-0.99, -0.49, 1.0])
    assert np.allclose(np.linalg.norm(rays, axis=1), 1.0)


def test_dropouts_are_lost_and_what_is_far_is_not_measured() -> None:
    scene = simulate.plane()
    pose = simulate.upright_pose(0.0, 0.0, 1.0, 0.0)
    whole = simulate.scan(scene, simulate.Lidar(max_range=20.0), pose)
    some = simulate.scan(scene, simulate.Lidar(max_range=20.0, dropout=0.25), pose)
    assert np.linalg.norm(whole.points, axis=1).max() < 20.1
    assert 0.7 < len(some) / len(whole) < 0.8
    with pytest.raises(InvalidInputError, match="meets nothing"):
        simulate.scan(scene, simulate.Lidar(max_range=0.5), pose)


def test_a_distorted_scan_is_larger_and_left_handed() -> None:
    scan = simulate.scan(
        simulate.room(1), simulate.Lidar(lines=8, steps=30), simulate.upright_pose(0, 0, 1, 0)
    )
    found = simulate.distorted(scan, scale=2.0, mirrored=True)
    assert np.allclose(found.points, scan.points * [2.0, -2.0, 2.0], atol=1e-5)
    assert found.viewpoint is not None
    assert not found.viewpoint.any()


def test_an_empty_square_room_looks_the_same_after_a_quarter_turn() -> None:
    scene = simulate.room(2, size=(6.0, 6.0, 3.0), furniture=0)
    sensor = simulate.Lidar(lines=8, steps=40, noise=0.0)
    one, other = (
        simulate.scan(scene, sensor, simulate.upright_pose(0.0, 0.0, 1.0, yaw)) for yaw in (0.0, np.pi / 2)
    )
    assert np.allclose(one.points, other.points, atol=1e-5)
