"""A lidar that moves while it spins: its scans are deskewed, and its motion is found with its poses."""

from __future__ import annotations

from dataclasses import replace

import moving_lidar
import moving_sensor
import numpy as np
import pytest
from moving_lidar import LIDAR, PERIOD, TWIST, moving_scans, pose_at
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud, geometry, simulate
from surfsig.odometry.point_times import find_point_times

Array = NDArray[np.float64]
COUNT = 6


@pytest.fixture(scope="module")
def moved() -> tuple[list[PointCloud], Array]:
    return moving_scans(COUNT)


def without_times(cloud: PointCloud) -> PointCloud:
    return PointCloud(cloud.points, viewpoint=np.zeros(3))


def test_a_moving_scan_is_where_each_ray_met_the_room() -> None:
    within = PERIOD * (np.arange(LIDAR.steps) / LIDAR.steps - 0.5)
    scan = simulate.scan_moving(
        simulate.room(4), moving_lidar.LIDAR, [pose_at(time) for time in within], seed=0, period=PERIOD
    )
    straight = surfsig.deskew(scan, TWIST)
    room = simulate.room(4)
    at = geometry.transform_points(pose_at(0.0), straight.points.astype(np.float64))
    nearest = np.min([np.abs(placed.implicit(at)) for placed in room.objects], axis=0)
    assert np.median(nearest) < 0.01
    with pytest.raises(InvalidInputError, match="poses must be"):
        simulate.scan_moving(room, LIDAR, [np.eye(4)])


def test_poses_and_twists_of_a_moving_sensor_are_found(moved: tuple[list[PointCloud], Array]) -> None:
    scans, true = moved
    found = surfsig.estimate_odometry(scans)
    assert found.counts()["tracked"] == COUNT
    off, angle = moving_sensor.errors(found.poses, true)
    assert off.max() < 0.01
    assert np.degrees(angle.max()) < 0.2
    assert np.isnan(found.twists[0]).all()
    assert np.abs(found.twists[1:, :3] - TWIST[:3]).max() < 0.03
    assert np.abs(found.twists[1:, 3:] - TWIST[3:]).max() < 0.08
    # Poses alone are found without times, too, as all scans are bent alike; but their points are not.
    bent = surfsig.estimate_odometry([without_times(cloud) for cloud in scans])
    assert np.isnan(bent.twists).all()


def test_times_in_other_units_on_a_clock_or_by_the_angle_say_the_same(
    moved: tuple[list[PointCloud], Array],
) -> None:
    scans, _ = moved
    expected = surfsig.estimate_odometry(scans[:3])
    for name, unit, start in (("t", 1e-9, 0.5), ("gps_time", 1.0, 3e5), ("offset_time", 1e-6, 0.5)):
        given = []
        for number, cloud in enumerate(scans[:3]):
            seconds = cloud.fields["time"].astype(np.float64) + PERIOD * start
            if name == "gps_time":
                seconds = cloud.fields["time"].astype(np.float64) + start + PERIOD * number
            given.append(PointCloud(cloud.points, viewpoint=np.zeros(3), fields={name: seconds / unit}))
        result = surfsig.estimate_odometry(given)
        np.testing.assert_allclose(result.twists[1:], expected.twists[1:], atol=0.25, err_msg=name)
    by_angle = surfsig.estimate_odometry([without_times(cloud) for cloud in scans[:3]], spin_rate=10.0)
    np.testing.assert_allclose(by_angle.twists[1:], expected.twists[1:], atol=0.01)
    np.testing.assert_allclose(by_angle.poses, expected.poses, atol=1e-3)


def test_scans_are_pushed_one_by_one_with_times(moved: tuple[list[PointCloud], Array]) -> None:
    scans, _ = moved
    expected = surfsig.estimate_odometry(scans)
    tracker = surfsig.Tracker()
    for number, cloud in enumerate(scans):
        pushed = tracker.push(without_times(cloud), times=cloud.fields["time"], timestamp=PERIOD * number)
        assert (pushed.number, pushed.segment, pushed.is_tracked) == (number, 0, True)
        assert number in pushed.changed
        np.testing.assert_allclose(pushed.T_world_scan, expected.poses[number], atol=1e-4)
    assert len(tracker) == COUNT
    with pytest.raises(InvalidInputError, match="times must be"):
        tracker.push(scans[0], times=[0.0])
    with pytest.raises(InvalidInputError, match="spin_rate must be"):
        surfsig.Tracker(spin_rate=0.0)


def test_numbers_of_scans_were_taken_for_a_clock_that_begins_at_0(
    moved: tuple[list[PointCloud], Array],
) -> None:
    scans = [
        replace(cloud, fields={"time": cloud.fields["time"].astype(np.float64) + PERIOD * (number + 0.5)})
        for number, cloud in enumerate(moved[0])
    ]
    found = surfsig.estimate_odometry(scans)
    straight = list(found.deskewed(scans))
    assert len(straight) == COUNT
    for cloud, one, twist in zip(scans, straight, found.twists, strict=True):
        np.testing.assert_array_equal(one.points, surfsig.deskew(cloud, twist).points)
        # The sensor moves by some centimetres within a scan, and by metres within two seconds.
        assert np.linalg.norm(one.points - cloud.points, axis=1).max() < 1.0
    with pytest.raises(InvalidInputError, match="poses, but more scans"):
        list(found.deskewed([*scans, scans[0]]))
    with pytest.raises(InvalidInputError, match="scans"):
        list(found.deskewed(scans[:-1]))


def test_fields_that_are_no_times_tell_nothing() -> None:
    points = np.random.default_rng(2).normal(size=(100, 3))
    for values in (np.zeros(100), np.arange(100.0) * 1e12, np.full(100, np.nan), np.repeat([0.0, 0.1], 50)):
        assert find_point_times(PointCloud(points, fields={"time": values})) is None
    assert find_point_times(PointCloud(points)) is None
    one = find_point_times(PointCloud(points, fields={"T": np.linspace(0.0, 1e8, 100)}))
    assert one is not None
    assert one.duration == pytest.approx(0.1)
    assert one.reference is None
    on_clock = find_point_times(
        PointCloud(points, fields={"timestamp": 1e9 + np.linspace(0.0, 0.1, 100)}), 1e9
    )
    assert on_clock is not None
    assert on_clock.reference == 1e9
    assert on_clock.seconds[0] == pytest.approx(0.0, abs=1e-6)


def test_deskewing_takes_each_point_to_the_reference() -> None:
    rng = np.random.default_rng(3)
    points, times = rng.uniform(-9.0, 9.0, (500, 3)), rng.uniform(-0.05, 0.05, 500)
    times[7] = np.nan
    cloud = PointCloud(points, fields={"intensity": np.arange(500.0)})
    straight = surfsig.deskew(cloud, TWIST, times=times)
    for k in range(0, 500, 49):
        pose = geometry.exp_twist(np.nan_to_num(times[k]) * TWIST)
        expected = geometry.transform_points(pose, points[k : k + 1])[0]
        np.testing.assert_allclose(straight.points[k], expected, atol=1e-4)
    np.testing.assert_array_equal(straight.fields["intensity"], cloud.fields["intensity"])
    assert surfsig.deskew(cloud, TWIST) is cloud, "nothing tells the times"
    assert surfsig.deskew(cloud, np.full(6, np.nan), times=times) is cloud
    with pytest.raises(InvalidInputError, match="twist must be"):
        surfsig.deskew(cloud, [1.0])
    with pytest.raises(InvalidInputError, match="times must be"):
        surfsig.deskew(cloud, TWIST, times=[1.0])
