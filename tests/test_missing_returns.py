"""A lidar's missing returns, which are written as points at (0, 0, 0)."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray
from register_scenes import terrain

import surfsig
from surfsig import PointCloud
from surfsig.missing_returns import missing_returns


def with_zeros(points: NDArray[np.floating], count: int) -> NDArray[np.floating]:
    """Put missing returns among points, evenly."""
    return np.insert(points, np.linspace(0, len(points), count).astype(int), 0.0, axis=0)


def scan(count: int = 4000) -> NDArray[np.float64]:
    rng = np.random.default_rng(2)
    flat = rng.uniform(-5, 5, (count, 2))
    return np.column_stack([flat, 0.2 * np.sin(flat).sum(axis=1) - 1.5])


def test_points_at_zero_are_missing_returns_where_there_are_several() -> None:
    points = with_zeros(scan(), 100)
    cloud = PointCloud(points, fields={"number": np.arange(len(points))})
    missing = missing_returns(cloud)
    assert int(missing.sum()) == 100
    np.testing.assert_array_equal(missing, (points == 0.0).all(axis=1))
    kept = surfsig.remove_missing_returns(cloud)
    np.testing.assert_array_equal(kept.points, scan())
    np.testing.assert_array_equal(kept.fields["number"], np.flatnonzero(~missing))
    # A surface may pass through the origin once.
    once = np.concatenate([scan(), np.zeros((1, 3))])
    assert surfsig.remove_missing_returns(once).points.shape == once.shape


def test_zeros_in_true_coordinates_count_not_offsets() -> None:
    offsets = with_zeros(scan(), 100)
    assert not missing_returns(PointCloud(offsets, np.array([5e5, 5e6, 0.0]))).any()
    shifted = PointCloud(offsets + np.array([1.0, 0, 0]), np.array([-1.0, 0, 0]))
    assert int(missing_returns(shifted).sum()) == 100


def test_outliers_are_judged_without_missing_returns() -> None:
    points = np.concatenate([scan(), [[0.0, 0.0, 6.0], [1.0, 2.0, -9.0]]])
    whole = surfsig.remove_outliers(with_zeros(points, 1500))
    np.testing.assert_array_equal(whole.points, surfsig.remove_outliers(points).points)
    assert len(whole) < len(points)


def test_registration_leaves_them_out_and_says_so() -> None:
    rng = np.random.default_rng(3)
    points, other = terrain(rng, 3000, -1, 1), terrain(rng, 3000, -1, 1)
    plain = surfsig.register(points, other)
    with pytest.warns(UserWarning, match="source: 900 of 3900 points are at"):
        found = surfsig.register(with_zeros(points, 900), other)
    np.testing.assert_array_equal(found.T_target_source, plain.T_target_source)


def test_odometry_leaves_them_out_and_says_so() -> None:
    scans = [scan() + np.array([0.05 * number, 0.0, 0.0]) for number in range(3)]
    plain = surfsig.estimate_odometry(scans)
    with pytest.warns(UserWarning, match="1800 points of 3 scans are at"):
        found = surfsig.estimate_odometry([with_zeros(points, 600) for points in scans])
    np.testing.assert_array_equal(found.poses, plain.poses)


def test_finding_leaves_them_out_and_keeps_the_numbers_of_points() -> None:
    scene = with_zeros(scan(), 50)
    with pytest.warns(UserWarning, match="the scene: 50 of 4050"):
        found = surfsig.find_instances(scan(500), scene)
    for instance in found:
        assert not (scene[instance.indices] == 0.0).all(axis=1).any()


def test_commands_tell_and_drop_them(shell: Callable[..., Any], tmp_path: Path) -> None:
    file, cleaned = tmp_path / "zeros.ply", tmp_path / "out.ply"
    surfsig.write(file, with_zeros(scan(), 300))
    assert json.loads(shell("info", file, "--json").out)["missing_returns"] == 300
    assert "300 at (0, 0, 0)" in shell("info", file).out
    finished = shell("extract", file, "--radius", 0.5, "-o", tmp_path / "curved.ply")
    assert "300 of 4300 points are at (0, 0, 0)" in finished.err
    assert shell("clean", file, cleaned, "--no-returns").code == 0
    np.testing.assert_array_equal(surfsig.read(cleaned).points, scan())


def test_odd_file_zeros_pcd(shared_data: Path, shell: Callable[..., Any], tmp_path: Path) -> None:
    file = shared_data / "odd_files" / "pcd_zero_points" / "zeros.pcd"
    zeros = int((surfsig.read(file).points == 0).all(axis=1).sum())
    assert f"{zeros:,} at (0, 0, 0)" in shell("info", file).out
    assert shell("clean", file, tmp_path / "out.ply", "--outliers").code == 0
    cleaned = surfsig.read(tmp_path / "out.ply").points
    assert not (cleaned == 0).all(axis=1).any()
