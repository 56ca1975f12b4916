"""What is wrong with a sensor is in all of its scans, and as large as it was asked for."""

from __future__ import annotations

import numpy as np

from surfsig import simulate

ROOM = simulate.room(3, furniture=0)
POSE = simulate.upright_pose(0.3, -0.2, 1.3, 0.4)
EXACT = simulate.Lidar(lines=16, steps=90, noise=0.0)


def ranges(calibration: simulate.Calibration | None) -> np.ndarray:
    cloud = simulate.scan(ROOM, EXACT, POSE, calibration=calibration)
    return np.asarray(np.linalg.norm(cloud.points.astype(np.float64), axis=1))


def test_without_errors_nothing_changes() -> None:
    assert np.array_equal(ranges(None), ranges(simulate.Calibration()))


def test_ranges_are_longer_by_a_share_and_at_grazing_incidence() -> None:
    exact = ranges(None)
    np.testing.assert_allclose(ranges(simulate.Calibration(range_scale=0.01)), 1.01 * exact, rtol=1e-6)
    longer = ranges(simulate.Calibration(incidence=0.02)) - exact
    assert longer.min() >= -1e-6
    assert longer.max() < 0.02
    # The ray that meets a wall most steeply is the shortest to it, and hardly longer.
    assert longer[np.argmin(exact)] < 0.005


def test_points_are_written_along_the_rays_that_lasers_should_have() -> None:
    bent = simulate.Calibration(line_angle=0.5, seed=2)
    cloud = simulate.scan(ROOM, EXACT, POSE, calibration=bent)
    elevations = np.degrees(np.arcsin(cloud.points[:, 2] / np.linalg.norm(cloud.points, axis=1)))
    nominal = np.repeat(np.linspace(-25.0, 25.0, 16), 90)
    np.testing.assert_allclose(elevations, nominal, atol=1e-3)
    assert not np.allclose(ranges(bent), ranges(None), rtol=1e-4)
    assert np.array_equal(bent.line_errors(16), simulate.Calibration(line_angle=0.5, seed=2).line_errors(16))
    many = simulate.Calibration(line_angle=0.05).line_errors(2000)
    assert 0.045 < np.degrees(many.std()) < 0.055


def test_mixed_returns_lie_between_those_of_both_surfaces() -> None:
    scene = simulate.Scene(
        (*ROOM.objects, simulate.Placed(simulate.Box((0.6, 0.6, 2.0)), simulate.pose((1.5, 0.5, 1.0))))
    )
    clean, mixed = (
        np.linalg.norm(
            simulate.scan(scene, EXACT, POSE, calibration=simulate.Calibration(mixed=share)).points, axis=1
        )
        for share in (0.0, 1.0)
    )
    changed = np.abs(clean - mixed) > 1e-3
    assert 0.005 < changed.mean() < 0.1
    rows = clean.reshape(16, 90)
    low, high = (of(rows, np.roll(rows, -1, axis=1)).reshape(-1) for of in (np.minimum, np.maximum))
    assert ((mixed >= low - 1e-4) & (mixed <= high + 1e-4))[changed].all()


def test_the_last_return_of_a_line_is_mixed_with_the_first_of_a_whole_turn_only() -> None:
    pose = simulate.upright_pose(1.2, 0.8, 1.3, 0.4)

    def changed(sensor: simulate.Lidar | simulate.DepthCamera) -> np.ndarray:
        """Of each ray of a line, whether any of its returns changes."""
        clean, mixed = (
            np.linalg.norm(
                simulate.scan(ROOM, sensor, pose, calibration=simulate.Calibration(mixed=share)).points,
                axis=1,
            )
            for share in (0.0, 1.0)
        )
        width = sensor.steps if isinstance(sensor, simulate.Lidar) else sensor.width
        return np.asarray((np.abs(clean - mixed) > 1e-3).reshape(-1, width).any(axis=0))

    for sensor in (
        simulate.Lidar(lines=4, steps=10, noise=0.0, view=170.0),
        simulate.DepthCamera(10, 4, view=150.0, noise=0.0, max_range=20.0),
    ):
        assert changed(sensor)[:-1].any()
        assert not changed(sensor)[-1]
    assert changed(simulate.Lidar(lines=4, steps=4, noise=0.0))[-1]


def test_a_storey_has_rooms_that_see_each_other() -> None:
    scene = simulate.storey(4, rooms=(2, 1))
    lidar = simulate.Lidar(lines=8, steps=180, elevation=(-5.0, 5.0))
    cloud = simulate.scan(scene, lidar, simulate.upright_pose(-3.0, 0.0, 1.4, 0.0))
    # In the sensor's axes, which are those of the storey: the next room begins three metres ahead.
    share = (cloud.points[:, 0] > 3.2).mean()
    assert 0.03 < share < 0.5
    again = simulate.scan(simulate.storey(4, rooms=(2, 1)), lidar, simulate.upright_pose(-3.0, 0.0, 1.4, 0.0))
    assert np.array_equal(cloud.points, again.points)
