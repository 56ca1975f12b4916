"""A way that comes back: its drift is distributed, and what all scans saw is fused."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import geometry, simulate
from surfsig.odometry import LoopClosure
from surfsig.odometry.loop_closing import closed

Array = NDArray[np.float64]


def ring(count: int, radius: float) -> Array:
    """Poses along a circle and back to its start."""
    return np.array(
        [
            simulate.upright_pose(radius * np.cos(a), radius * np.sin(a), 1.0, a + 0.5 * np.pi)
            for a in np.linspace(0.0, 2.0 * np.pi, count)
        ]
    )


def drifted(true: Array, twist: Array) -> Array:
    """The same way with an error in each step."""
    poses = [true[0]]
    for before, after in itertools.pairwise(true):
        poses.append(poses[-1] @ geometry.inverse(before) @ after @ geometry.exp_twist(twist))
    return np.array(poses)


def test_a_loop_takes_the_drift_of_its_way() -> None:
    true = ring(80, 12.0)
    wrong = drifted(true, np.array([0.0, 0.0, 1e-3, 3e-3, 0.0, 1e-3]))
    loop = LoopClosure(79, 0, geometry.inverse(true[0]) @ true[79], wrong[79])
    # Where a loop is closed, the scan's pose is that by the earlier one.
    given = wrong.copy()
    given[79] = true[79]
    walk = np.arange(80.0)[:, None, None] * np.diag([1e-6] * 3 + [1e-4] * 3)
    # The last one is known as well as the first.
    walk[79] = walk[1]
    found, covariances = closed(given, walk, np.zeros(80, np.int64), [loop], 8.0)
    before = np.linalg.norm(wrong[:, :3, 3] - true[:, :3, 3], axis=1)
    after = np.linalg.norm(found[:, :3, 3] - true[:, :3, 3], axis=1)
    assert after[-1] < 0.05 * before[-1]
    assert after.max() < 0.35 * before.max()
    # The middle is known from both ends: half of the variance of one, and less as directions are known, too.
    assert 0.25 < covariances[40, 3:, 3:].trace() / walk[40, 3:, 3:].trace() < 0.55
    assert 0.2 < covariances[40, :3, :3].trace() / walk[40, :3, :3].trace() < 0.55
    np.testing.assert_allclose(covariances[79], walk[79], rtol=0.1)
    assert (np.diagonal(covariances, axis1=1, axis2=2) <= np.diagonal(walk, axis1=1, axis2=2)).all()
    np.testing.assert_allclose(found[0], true[0], atol=1e-12)
    for pose in found:
        np.testing.assert_allclose(pose[:3, :3] @ pose[:3, :3].T, np.eye(3), atol=1e-9)
    # The world's axes do not matter.
    frame = simulate.upright_pose(300.0, -20.0, 5.0, 1.1, (0.2, 0.1))
    moved = LoopClosure(79, 0, loop.T_earlier_scan, frame @ wrong[79])
    np.testing.assert_allclose(
        closed(frame @ given, walk, np.zeros(80, np.int64), [moved], 8.0)[0], frame @ found, atol=1e-6
    )


def test_covariances_after_a_loop_with_an_earlier_map_were_those_of_the_way_around() -> None:
    """Where the map is another one, scans after the loop come with covariances that know nothing of it."""
    true, reach = ring(80, 12.0), 8.0
    steps = geometry.inverse(true[:-1]) @ true[1:]
    deviation = np.array([1e-4] * 3 + [1e-3] * 3)
    of_step = np.diag(deviation**2)
    walk = np.zeros((80, 6, 6))
    for scan, step in enumerate(steps):
        to_next = geometry.adjoint(geometry.inverse(step))
        walk[scan + 1] = to_next @ walk[scan] @ to_next.T + of_step
    rng = np.random.default_rng(3)
    after = []
    for _ in range(20):
        poses = [true[0]]
        for number, step in enumerate(steps):
            poses.append(poses[-1] @ step @ geometry.exp_twist(deviation * rng.normal(size=6)))
            if number == 74:
                before = poses[-1]
                by_earlier = geometry.inverse(true[0]) @ true[75]
                by_earlier = by_earlier @ geometry.exp_twist(deviation * rng.normal(size=6))
                poses[-1] = true[0] @ by_earlier
        loop = LoopClosure(75, 0, by_earlier, before)
        found, covariances = closed(np.array(poses), walk, np.zeros(80, np.int64), [loop], reach)
        off = geometry.log_pose(geometry.inverse(found[75:]) @ true[75:])
        after.append(np.einsum("ni,nij,nj->n", off, np.linalg.inv(covariances[75:]), off) / 6)
        np.testing.assert_array_less(np.trace(covariances[75:], axis1=1, axis2=2), 0.3 * walk[75].trace())
    assert 0.1 < np.mean(after) < 10.0


def test_what_a_way_around_left_open_is_known_after_a_loop_with_an_earlier_map() -> None:
    true = ring(80, 12.0)
    walk = np.arange(80.0)[:, None, None] * np.diag([1e-8] * 3 + [1e-6] * 3)
    walk[30:, 3, 3] = np.inf
    slides = np.isin(np.arange(80), [30, 31, 78])
    loop = LoopClosure(75, 0, geometry.inverse(true[0]) @ true[75], true[75])
    _, covariances = closed(true, walk, np.zeros(80, np.int64), [loop], 8.0, slides)
    is_known = np.isfinite(covariances).all(axis=(1, 2))
    # From 78 on another motion is open.
    np.testing.assert_array_equal(np.flatnonzero(~is_known), [*range(30, 75), 78, 79])
    # As well as that of a few steps.
    assert 0.0 < covariances[76, 3:, 3:].trace() < 30.0 * walk[1, 3:, 3:].trace()


def test_segments_without_a_loop_and_scans_without_a_pose_stay() -> None:
    true = ring(40, 5.0)
    given = drifted(true, np.array([0.0, 0.0, 2e-3, 0.0, 0.0, 0.0]))
    given[5] = np.nan
    segments = np.repeat([0, 1], [20, 20])
    segments[5] = -1
    loop = LoopClosure(19, 0, geometry.inverse(given[0]) @ true[19], given[19])
    none = np.tile(np.diag([np.inf] + [1.0] * 5), (40, 1, 1))
    found, covariances = closed(given, none, segments, [loop], 5.0)
    np.testing.assert_array_equal(covariances[20:], none[20:])
    assert np.isinf(covariances[:20, 0, 0][covariances[:20, 1, 1] > 0.0]).all()
    np.testing.assert_array_equal(found[20:], given[20:])
    assert np.isnan(found[5]).all()
    assert np.abs(found[19] - given[19]).max() > 1e-3
    np.testing.assert_array_equal(closed(given, none, segments, [], 5.0)[0], given)


@pytest.mark.slow
def test_a_map_is_fused_from_what_was_followed() -> None:
    room = simulate.room(6)
    poses = [simulate.upright_pose(0.15 * k - 0.4, 0.0, 1.2, 0.1 * k) for k in range(5)]
    scans = [
        simulate.scan(room, simulate.Lidar(lines=24, steps=300), pose, seed=k) for k, pose in enumerate(poses)
    ]
    found = surfsig.estimate_odometry(scans)
    cloud = found.map(scans)
    at = geometry.transform_points(poses[0], cloud.points.astype(np.float64))
    nearest = np.min([np.abs(placed.implicit(at)) for placed in room.objects], axis=0)
    assert np.quantile(nearest, 0.9) < found.voxel
    with pytest.raises(surfsig.InvalidInputError, match="voxel must be"):
        found.map(scans, voxel=0.0)
    with pytest.raises(surfsig.InvalidInputError, match="there are 5 poses, but 4 scans"):
        found.map(scans[:4])


@pytest.mark.slow
def test_a_loop_closes_around_a_block() -> None:
    """Corridors that lead around a block, seen by 16 lines; the path goes on for 5 m where it began."""
    true = simulate.circuit_poses(side=40.0)
    sensor = simulate.Lidar(lines=16, steps=300, elevation=(-15.0, 15.0), noise=0.01, max_range=25.0)
    scene = simulate.circuit(3, side=40.0)
    scans = [simulate.scan(scene, sensor, pose, seed=3000 + k) for k, pose in enumerate(true)]
    found = surfsig.estimate_odometry(scans)
    assert (found.segments == 0).all()
    assert found.loops
    assert all(loop.scan > 140 and loop.earlier < 10 for loop in found.loops)
    relative = geometry.inverse(found.poses[0]) @ found.poses[-1]
    expected = geometry.inverse(true[0]) @ true[-1]
    assert np.linalg.norm(relative[:3, 3] - expected[:3, 3]) < 0.001 * found.length
