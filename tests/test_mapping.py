"""Maps of many scans, and trajectories that are corrected where the sensor comes back."""

from collections import defaultdict
from collections.abc import Callable
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from conftest import Finished
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, Odometry, PointCloud, ScanStatus, geometry, simulate

Array = NDArray[np.float64]

SIDE, WIDTH = 20.0, 3.0
LIDAR = simulate.Lidar(lines=24, steps=300, noise=0.01)


def drifted(true: Array, seed: int) -> Odometry:
    """Give poses that drift, and covariances that say so: per metre, 1 mrad about z and 6 mm."""
    rng = np.random.default_rng(seed)
    deviations = np.array([0.0002, 0.0002, 0.001, 0.006, 0.006, 0.002])
    # Half of the drift is the same all along, as a badly calibrated sensor's is.
    bias = deviations * rng.normal(size=6)
    poses, covariances = [np.eye(4)], [np.zeros((6, 6))]
    for before, after in pairwise(true):
        relative = geometry.inverse(before) @ after
        step = float(np.linalg.norm(relative[:3, 3]))
        poses.append(
            poses[-1]
            @ relative
            @ geometry.exp_twist(step * bias + np.sqrt(step) * deviations * rng.normal(size=6))
        )
        moved = geometry.adjoint(geometry.inverse(relative))
        covariances.append(moved @ covariances[-1] @ moved.T + step * np.diag(deviations**2))
    count = len(true)
    status = np.full(count, ScanStatus.TRACKED, np.uint8)
    free: list[list[surfsig.FreeDirection]] = [[] for _ in range(count)]
    times = np.arange(count, dtype=np.float64)
    return Odometry(np.array(poses), np.array(covariances), status, np.ones(count), free, times, 0.2)


def errors(found: Array, true: Array) -> Array:
    """Give how far off poses are, both seen from the first, in metres."""
    seen = geometry.inverse(true[0]) @ true
    return np.asarray(np.linalg.norm(found[:, :3, 3] - seen[:, :3, 3], axis=1))


@pytest.fixture(scope="module")
def true() -> Array:
    return simulate.circuit_poses(side=SIDE, width=WIDTH, step=1.0, beyond=6.0)


@pytest.fixture(scope="module")
def scans(true: Array) -> list[PointCloud]:
    scene = simulate.circuit(4, side=SIDE, width=WIDTH)
    return [simulate.scan(scene, LIDAR, pose, seed=number) for number, pose in enumerate(true)]


def test_a_map_has_the_mean_of_each_voxel(scans: list[PointCloud], true: Array) -> None:
    poses, voxel = true[:5].copy(), 0.3
    poses[3] = np.nan
    found = surfsig.fuse_scans(scans[:5], poses, voxel=voxel)
    inside = defaultdict(list)
    for number in (0, 1, 2, 4):
        for point in geometry.transform_points(poses[number], scans[number].points.astype(np.float64)):
            inside[tuple(np.floor(point / voxel).astype(int))].append((number, point))
    assert len(found) == len(inside)
    for point, seen in zip(found.points, found.fields["scans"], strict=True):
        members = inside[tuple(np.floor(point / voxel).astype(int))]
        np.testing.assert_allclose(point, np.mean([p for _, p in members], axis=0), atol=1e-9)
        assert seen == len({number for number, _ in members})


def test_normals_of_a_map_are_those_of_the_floor_and_look_to_the_sensor(
    scans: list[PointCloud], true: Array
) -> None:
    found = surfsig.fuse_scans(scans[:5], true[:5], voxel=0.3)
    normals = np.column_stack([found.fields[name] for name in ("nx", "ny", "nz")])
    known = np.isfinite(normals).all(axis=1)
    assert known.mean() > 0.9
    floor = known & (found.points[:, 2] < 0.05)
    ceiling = known & (found.points[:, 2] > 2.95)
    assert np.median(normals[floor, 2]) > 0.999
    assert np.median(normals[ceiling, 2]) < -0.999
    np.testing.assert_allclose(np.linalg.norm(normals[known], axis=1), 1.0, atol=1e-5)


def test_what_cannot_be_fused_is_refused(scans: list[PointCloud], true: Array) -> None:
    with pytest.raises(InvalidInputError, match="there are 2 poses, but more scans"):
        surfsig.fuse_scans(scans[:3], true[:2], voxel=0.3)
    with pytest.raises(InvalidInputError, match="there are 2 poses, but 1 scans"):
        surfsig.fuse_scans(scans[:1], true[:2], voxel=0.3)
    with pytest.raises(InvalidInputError, match=r"poses must be of shape \(n, 4, 4\)"):
        surfsig.fuse_scans(scans[:1], true[0], voxel=0.3)
    with pytest.raises(InvalidInputError, match="voxel"):
        surfsig.fuse_scans(scans[:1], true[:1], voxel=0.0)
    assert len(surfsig.fuse_scans(scans[:1], np.full((1, 4, 4), np.nan), voxel=0.3)) == 0


def test_a_closed_loop_takes_the_drift_away(scans: list[PointCloud], true: Array) -> None:
    odometry = drifted(true, 7)
    found = surfsig.close_loops(scans, odometry)
    assert found.used > 0
    for loop in found.loops:
        if loop.used:
            relative = geometry.inverse(true[loop.earlier]) @ true[loop.later]
            off = geometry.log_pose(geometry.inverse(relative) @ loop.T_earlier_later)
            assert np.linalg.norm(off[3:]) < 0.03
    before, after = errors(odometry.poses, true), errors(found.odometry.poses, true)
    assert before[-1] > 0.3
    assert after[-1] < 0.05
    assert after.max() < 0.6 * before.max()
    deviations = np.sqrt(np.diagonal(found.odometry.covariances, axis1=1, axis2=2))
    assert np.isfinite(deviations).all()
    assert deviations[-1, 3] < 0.5 * np.sqrt(odometry.covariances[-1, 3, 3])
    again = surfsig.close_loops(scans, odometry, threads=1)
    np.testing.assert_array_equal(again.odometry.poses, found.odometry.poses)


def test_without_a_loop_the_odometry_stays(scans: list[PointCloud], true: Array) -> None:
    odometry = drifted(true[:20], 7)
    found = surfsig.close_loops(scans[:20], odometry)
    assert (found.used, len(found.loops)) == (0, 0)
    assert found.odometry is odometry
    assert repr(found) == "LoopClosure(20 scans, 0 of 0 loops used)"
    with pytest.raises(InvalidInputError, match="scans must be a list"):
        surfsig.close_loops(iter(scans[:20]), odometry)
    with pytest.raises(InvalidInputError, match="there are 20 poses, but 5 scans"):
        surfsig.close_loops(scans[:5], odometry)


def test_the_shell_writes_a_map(
    tmp_path: Path, scans: list[PointCloud], shell: Callable[..., Finished]
) -> None:
    folder = tmp_path / "scans"
    folder.mkdir()
    for number, scan in enumerate(scans[:4]):
        surfsig.write(folder / f"{number}.ply", scan)
    finished = shell(
        "odometry", folder, "-o", tmp_path / "t.txt", "--loops", "--map", tmp_path / "map.ply", "--json"
    )
    assert (finished.code, finished.err) == (0, "")
    fused = surfsig.read(tmp_path / "map.ply")
    assert 0 < len(fused) < sum(len(scan) for scan in scans[:4])
    assert {"nx", "ny", "nz", "scans"} <= set(fused.fields)
    assert int(fused.fields["scans"].max()) == 4
