"""Many scans of one place: one consistent set of poses, and those that do not belong are named."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from register_scenes import error

import surfsig
from surfsig import InvalidInputError, PointCloud, simulate

LIDAR = simulate.Lidar(lines=32, steps=300)
PLACES = ((0.4, 0.3, 0.4), (-0.5, -0.2, 2.0), (0.2, -0.6, 4.0))


@pytest.fixture(scope="module")
def scans() -> list[PointCloud]:
    """Three scans of one room, and a fourth of another one."""
    room, other = simulate.room(11), simulate.room(12)
    poses = [simulate.upright_pose(x, y, 1.3, yaw) for x, y, yaw in PLACES]
    found = [simulate.scan(room, LIDAR, pose, seed=seed) for seed, pose in enumerate(poses)]
    return [found[0], simulate.scan(other, LIDAR, poses[1], seed=9), *found[1:]]


@pytest.fixture(scope="module")
def result(scans: list[PointCloud]) -> surfsig.MultiwayRegistration:
    return surfsig.register_multiway(scans, names=["a", "stranger", "b", "c"])


def test_scans_of_one_room_are_registered_and_the_stranger_is_named(
    result: surfsig.MultiwayRegistration,
) -> None:
    assert result.belongs.tolist() == [True, False, True, True]
    poses = [simulate.upright_pose(x, y, 1.3, yaw) for x, y, yaw in PLACES]
    to_reference = np.linalg.inv(poses[[0, None, 1, 2].index(result.reference)])
    for number, pose in zip((0, 2, 3), poses, strict=True):
        off = error(result.T_reference_scan[number], to_reference @ pose, np.zeros(3))
        assert np.abs(off).max() < 0.01
    assert np.isnan(result.T_reference_scan[1]).all()
    assert (result.covariance[result.reference] == 0.0).all()
    used = {(pair.source, pair.target) for pair in result.pairs if pair.used}
    assert used <= {(2, 0), (3, 0), (3, 2)}
    assert len(used) >= 2
    assert "3 of 4" in repr(result)
    rows = result.rows()
    assert rows[1] == ("stranger", "does not belong", "", "0")


def test_values_are_plain_and_the_merged_cloud_knows_its_scans(
    result: surfsig.MultiwayRegistration, scans: list[PointCloud]
) -> None:
    values = json.loads(json.dumps(result.values()))
    assert values["scans"][1]["T_reference_scan"] is None
    assert len(values["pairs"]) == 6
    merged = result.merged(scans)
    assert len(merged) == sum(len(scans[number]) for number in (0, 2, 3))
    assert np.unique(merged.fields["file"]).tolist() == [0, 2, 3]
    first = merged.points[merged.fields["file"] == result.reference]
    assert np.allclose(first, scans[result.reference].points, atol=1e-6)
    with pytest.raises(InvalidInputError, match="4 scans, but 1 cloud"):
        result.merged(scans[:1])


def test_arguments_without_a_meaning(scans: list[PointCloud]) -> None:
    with pytest.raises(InvalidInputError, match="at least two scans"):
        surfsig.register_multiway(scans[:1])
    with pytest.raises(InvalidInputError, match="2 scans, but 1 names"):
        surfsig.register_multiway(scans[:2], names=["a"])


def test_scans_that_do_not_belong_together_have_one_pose(scans: list[PointCloud]) -> None:
    found = surfsig.register_multiway(scans[:2])
    assert found.belongs.sum() == 1
    assert found.reference == 0
    assert len(found.merged(scans[:2])) == len(scans[0])


def test_the_shell_registers_several_files(
    shell: Callable[..., Any], scans: list[PointCloud], tmp_path: Path
) -> None:
    # One of the stranger, and two that belong together.
    files = [tmp_path / f"{number}.ply" for number in range(3)]
    for file, cloud in zip(files, scans[:3], strict=True):
        surfsig.write(file, cloud)
    poses, merged = tmp_path / "poses.json", tmp_path / "merged.ply"
    run = shell("register", *files, "-o", poses, "--merged", merged)
    assert (run.code, run.err) == (0, "")
    assert "2 of 3 scans belong together" in run.out
    assert "does not belong" in run.out
    assert len(json.loads(poses.read_text())["scans"]) == 3
    assert len(surfsig.read(merged)) == sum(len(scans[number]) for number in (0, 2))
    for arguments, words in (
        ([files[0]], "at least two scans"),
        ([*files, "-o", tmp_path / "poses.ply"], ".json"),
        ([*files, "--init", files[0]], "for two scans"),
        ([*files[:2], "--merged", merged], "three scans and more"),
    ):
        refused = shell("register", *arguments)
        assert refused.code == 2
        assert words in refused.err
