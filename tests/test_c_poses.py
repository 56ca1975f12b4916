"""The C interface's registration and odometry: values are Python's, bit for bit."""

from ctypes import POINTER, byref, c_double, c_size_t, c_uint32, c_void_p
from pathlib import Path

import numpy as np
import pytest
from c_interface import PROGRESS, CInterface, Failed, Registration, Scan, ScanPose, Transform, address
from moving_lidar import moving_scans
from register_scenes import moved, pose, terrain

import surfsig
from surfsig import PointCloud

SEED = 47
ABOVE = np.array([0.2, 0.1, 4.0])
CANCELLED = 5

JUDGED = ("explained", "free_space", "scale", "scale_standard_error")
"""What the tests of a transform tell."""


@pytest.fixture(scope="module")
def scans() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Two scans of a terrain that overlap by a half, and T_second_first."""
    rng = np.random.default_rng(SEED)
    first, second, truth = terrain(rng, 8000, -1.4, 0.6), terrain(rng, 8000, -0.4, 1.6), pose(rng)
    return np.ascontiguousarray(moved(first, np.linalg.inv(truth))), np.ascontiguousarray(second), truth


def registered(
    c: CInterface,
    source: np.ndarray,
    target: np.ndarray,
    *,
    viewpoints: tuple[np.ndarray | None, np.ndarray | None] = (None, None),
    start: np.ndarray | None = None,
    radius: float = 0.0,
    keypoints: int = 0,
    stop: int = 0,
) -> Registration:
    """Register by the C interface."""
    f, found = c.functions, Registration()
    options = c_void_p(f.surfsig_registration_options_new())
    c.check(f.surfsig_registration_options_set_radius(options, c_double(radius)))
    c.check(f.surfsig_registration_options_set_keypoints(options, c_uint32(keypoints)))
    c.check(f.surfsig_registration_options_set_threads(options, c_uint32(1)))
    call = PROGRESS(lambda *_: stop)
    c.check(f.surfsig_registration_options_set_progress(options, call, c_void_p()))
    try:
        with c.cloud_of(source) as first, c.cloud_of(target) as second:
            both = [
                Scan(cloud, None if viewpoint is None else address(viewpoint).value, None)
                for cloud, viewpoint in zip((first, second), viewpoints, strict=True)
            ]
            given = None if start is None else byref(Transform.of(start))
            c.check(f.surfsig_register(byref(both[0]), byref(both[1]), given, options, byref(found)))
    finally:
        f.surfsig_registration_options_free(options)
    return found


def check(found: Registration, expected: surfsig.Registration) -> None:
    """All numbers are the same."""
    np.testing.assert_array_equal(found.T_target_source.array(), expected.T_target_source)
    np.testing.assert_array_equal(np.array(found.covariance[:]).reshape(6, 6), expected.covariance)
    np.testing.assert_array_equal(found.center[:], expected.center)
    assert found.free_direction_count == len(expected.free_directions)
    for ours, theirs in zip(found.free_directions, expected.free_directions, strict=False):
        np.testing.assert_array_equal(ours.axis[:], theirs.axis)
        np.testing.assert_array_equal(ours.point[:], theirs.point)
    for name in (*["matches", "inliers", "overlap", "rms", "radius", "trusted"], *JUDGED):
        np.testing.assert_equal(getattr(found, name), getattr(expected, name))
    assert bin(found.doubts).count("1") == len(expected.reasons)
    assert found.alternative_count == min(len(expected.alternatives), len(found.alternatives))
    for other, rival in zip(found.alternatives, expected.alternatives, strict=False):
        np.testing.assert_array_equal(other.array(), rival.T_target_source)


def test_registrations_are_those_of_python(
    c: CInterface, scans: tuple[np.ndarray, np.ndarray, np.ndarray]
) -> None:
    source, target, truth = scans
    viewpoints = np.ascontiguousarray(moved(ABOVE[None], np.linalg.inv(truth))[0]), ABOVE
    ours = PointCloud(source, viewpoint=viewpoints[0]), PointCloud(target, viewpoint=ABOVE)
    expected = surfsig.register(*ours, count=400)
    assert expected.trusted
    check(registered(c, source, target, viewpoints=viewpoints, keypoints=400), expected)
    expected = surfsig.register(*ours, init=truth, radius=0.3)
    check(registered(c, source, target, viewpoints=viewpoints, start=truth, radius=0.3), expected)


def test_free_directions_are_those_of_python(c: CInterface) -> None:
    rng = np.random.default_rng(SEED)
    flat = [np.column_stack([rng.uniform(-1, 1, (4000, 2)), 0.002 * rng.normal(size=4000)]) for _ in "ab"]
    found = registered(c, flat[0], flat[1], start=np.eye(4))
    assert found.free_direction_count == 3
    check(found, surfsig.register(flat[0], flat[1], init=np.eye(4)))


def test_nothing_to_register_is_no_failure(c: CInterface) -> None:
    found = registered(c, np.zeros((9, 3)), np.zeros((9, 3)))
    assert not found.found
    assert np.isnan(found.T_target_source.array()).all()


def test_a_registration_is_stopped(c: CInterface, scans: tuple[np.ndarray, np.ndarray, np.ndarray]) -> None:
    large = np.concatenate([scans[0] + 0.001 * k for k in range(40)])
    with pytest.raises(Failed, match=f"^{CANCELLED}: "):
        registered(c, large, large, stop=1)


def test_odometry_is_that_of_python(c: CInterface, tmp_path: Path) -> None:
    rng = np.random.default_rng(SEED)
    world = terrain(rng, 40_000, -2.0, 2.0)
    scans = []
    for step in range(5):
        seen = world[np.abs(world[:, 0] - 0.05 * step) < 1.5] + rng.normal(0.0, 0.001, 3)
        scans.append(np.ascontiguousarray(seen[::3] - np.array([0.05 * step, 0.0, 2.0])))
        surfsig.write(tmp_path / f"{step}.ply", PointCloud(scans[-1]))
    expected = surfsig.estimate_odometry(tmp_path, threads=1)
    f, made, pose = c.functions, c_void_p(), ScanPose()
    zero = c_double(0.0)
    c.check(f.surfsig_odometry_new(zero, zero, zero, c_uint32(2), byref(made)))
    try:
        for number, scan in enumerate(scans):
            with c.cloud_of(scan) as cloud:
                given = Scan(cloud, None, None)
                c.check(f.surfsig_odometry_push(made, byref(given), byref(pose)))
            assert pose.status == expected.status[number]
            assert f.surfsig_scan_status_name(pose.status) == b"tracked"
        assert f.surfsig_odometry_size(made) == len(scans)
        assert f.surfsig_odometry_voxel(made) == expected.voxel
        for number in range(len(scans)):
            c.check(f.surfsig_odometry_pose(made, c_size_t(number), byref(pose)))
            np.testing.assert_array_equal(pose.T_map_scan.array(), expected.poses[number])
            covariance = np.array(pose.covariance[:]).reshape(6, 6)
            np.testing.assert_array_equal(covariance, expected.covariances[number])
            assert pose.overlap == expected.overlaps[number]
            assert f.surfsig_odometry_segment(made, c_size_t(number)) == expected.segments[number]
        assert f.surfsig_odometry_segment(made, c_size_t(len(scans))) == -1
    finally:
        f.surfsig_odometry_free(made)


def test_points_with_times_are_deskewed_as_in_python(c: CInterface) -> None:
    scans, _ = moving_scans(3)
    expected = surfsig.estimate_odometry(scans)
    f, made, pose = c.functions, c_void_p(), ScanPose()
    zero = c_double(0.0)
    c.check(f.surfsig_odometry_new(zero, zero, zero, c_uint32(1), byref(made)))
    try:
        for number, scan in enumerate(scans):
            times = scan.fields["time"].astype(np.float64)
            # As the scans follow each other at once, an interval is as long as a scan.
            times /= np.ptp(times)
            with c.cloud_of(scan.points) as cloud:
                given = Scan(cloud, None, None)
                pointer = times.ctypes.data_as(POINTER(c_double))
                c.check(f.surfsig_odometry_push_timed(made, byref(given), pointer, byref(pose)))
            np.testing.assert_allclose(pose.T_map_scan.array(), expected.poses[number], atol=1e-9)
        twist = (c_double * 6)()
        c.check(f.surfsig_odometry_twist(made, c_size_t(2), twist))
        interval = float(np.ptp(scans[2].fields["time"].astype(np.float64)))
        np.testing.assert_allclose(np.array(twist[:]) / interval, expected.twists[2], rtol=1e-6, atol=1e-9)
    finally:
        f.surfsig_odometry_free(made)


def test_a_scan_is_deskewed_as_in_python(c: CInterface) -> None:
    scan = moving_scans(1)[0][0]
    points, seconds = scan.points.astype(np.float64), scan.fields["time"].astype(np.float64)
    twist = np.array([0.1, -0.2, 1.2, 1.5, 0.3, -0.1])
    expected = surfsig.deskew(PointCloud(points), twist, times=seconds)
    moved = np.empty_like(points)
    pointers = [values.ctypes.data_as(POINTER(c_double)) for values in (seconds, twist, moved)]
    with c.cloud_of(points) as cloud:
        c.check(c.functions.surfsig_deskew(cloud, *pointers))
    np.testing.assert_array_equal(moved, expected.points)
    assert np.abs(moved - points).max() > 0.05
