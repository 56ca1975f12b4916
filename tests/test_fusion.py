"""Maps of many scans whose poses are known."""

from collections import defaultdict
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud, geometry, simulate

Array = NDArray[np.float64]

SIDE, WIDTH = 20.0, 3.0
LIDAR = simulate.Lidar(lines=24, steps=300, noise=0.01)


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


def test_files_are_fused_as_clouds_are(tmp_path: Path, scans: list[PointCloud], true: Array) -> None:
    files = [tmp_path / f"{number}.ply" for number in range(2)]
    for file, scan in zip(files, scans, strict=False):
        surfsig.write(file, scan)
    expected = surfsig.fuse_scans(scans[:2], true[:2], voxel=0.3)
    for given in (files, tmp_path, surfsig.open_scan_sequence(tmp_path)):
        np.testing.assert_array_equal(surfsig.fuse_scans(given, true[:2], voxel=0.3).points, expected.points)


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
