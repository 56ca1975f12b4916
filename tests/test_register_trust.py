"""Poses that must not be trusted: what deceives, and why it is said not to be trusted."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from register_scenes import error

import surfsig
from surfsig import PointCloud, simulate

LIDAR = simulate.Lidar(lines=32, steps=360)


def seen(scene: simulate.Scene, x: float, y: float, yaw: float, seed: int) -> PointCloud:
    return simulate.scan(scene, LIDAR, simulate.upright_pose(x, y, 1.3, yaw), seed=seed)


def between(one: tuple[float, float, float], other: tuple[float, float, float]) -> np.ndarray:
    """T_other_one of two places, x, y and yaw."""
    poses = [simulate.upright_pose(x, y, 1.3, yaw) for x, y, yaw in (one, other)]
    return np.linalg.inv(poses[1]) @ poses[0]


ONE, OTHER = (0.3, 0.2, 0.4), (-0.3, -0.1, 2.0)


@pytest.fixture(scope="module")
def furnished() -> tuple[PointCloud, PointCloud]:
    scene = simulate.room(11)
    return seen(scene, *ONE, seed=1), seen(scene, *OTHER, seed=2)


def test_a_right_pose_survives_all_tests(furnished: tuple[PointCloud, PointCloud]) -> None:
    found = surfsig.register(*furnished)
    off = error(found.T_target_source, between(ONE, OTHER), np.zeros(3))
    assert np.abs(off).max() < 0.01
    assert found.trusted
    assert not found.reasons
    assert not found.alternatives
    assert found.free_space < 0.02
    assert abs(found.scale - 1.0) < 4.0 * found.scale_standard_error + 0.002


def test_a_source_of_another_size_is_not_trusted(furnished: tuple[PointCloud, PointCloud]) -> None:
    found = surfsig.register(simulate.distorted(furnished[0], scale=1.02), furnished[1])
    assert not found.trusted
    assert abs(found.scale - 1.02) < 0.004
    assert any("times as large" in reason for reason in found.reasons)
    assert not surfsig.register(simulate.distorted(furnished[0], scale=1.1), furnished[1]).trusted


def test_a_mirrored_source_is_not_trusted(furnished: tuple[PointCloud, PointCloud]) -> None:
    found = surfsig.register(simulate.distorted(furnished[0], mirrored=True), furnished[1])
    assert not found.trusted
    assert found.reasons


def test_another_room_is_not_trusted(furnished: tuple[PointCloud, PointCloud]) -> None:
    other = seen(simulate.room(12), *ONE, seed=3)
    assert not surfsig.register(other, furnished[1]).trusted


def test_an_empty_room_has_a_second_pose() -> None:
    scene = simulate.room(5, size=(7.0, 5.0, 2.8), furniture=0)
    found = surfsig.register(seen(scene, *ONE, seed=4), seen(scene, *OTHER, seed=5))
    assert not found.trusted
    half = np.diag([-1.0, -1.0, 1.0, 1.0])
    T_target_scene = np.linalg.inv(simulate.upright_pose(OTHER[0], OTHER[1], 1.3, OTHER[2]))
    T_scene_source = simulate.upright_pose(ONE[0], ONE[1], 1.3, ONE[2])
    poses = [found.T_target_source, *(other.T_target_source for other in found.alternatives)]
    for truth in (T_target_scene @ T_scene_source, T_target_scene @ half @ T_scene_source):
        assert min(np.abs(error(pose, truth, np.zeros(3))).max() for pose in poses) < 0.03
    assert any("other transform" in reason for reason in found.reasons)
    values = found.values()
    assert len(values["alternatives"]) == len(found.alternatives)
    assert values["reasons"] == found.reasons


def test_a_smooth_corridor_is_free_along_itself() -> None:
    scene = simulate.corridor()
    sensor = simulate.Lidar(lines=16, elevation=(-15.0, 15.0), steps=480, max_range=12.0)
    source, target = (
        simulate.scan(scene, sensor, simulate.upright_pose(x, 0.1, 1.2, 0.0), seed=seed)
        for x, seed in ((1.0, 6), (0.0, 7))
    )
    found = surfsig.register(source, target)
    assert not found.trusted
    axes = [free.axis for free in found.free_directions if free.motion == "translation"]
    assert any(abs(axis[0]) > 0.97 for axis in axes)


def test_hard_scenes_are_not_trusted(shared_data: Path) -> None:
    folder = shared_data / "hard_scenes"
    pairs = [
        ("register_corridor/scan_2.ply", "register_corridor/scan_0.ply"),
        ("register_corridor/scan_1.ply", "register_corridor/scan_0.ply"),
        ("register_different_rooms/25_source.ply", "register_different_rooms/25_target.ply"),
        ("register_scale_mirror/source_times_1.1.ply", "register_scale_mirror/target.ply"),
        ("register_symmetric_box/source.ply", "register_symmetric_box/target.ply"),
    ]
    if not folder.is_dir():
        pytest.skip(f"{folder} is not here")
    for source, target in pairs:
        found = surfsig.register(surfsig.read(folder / source), surfsig.read(folder / target))
        assert not found.trusted, source
        assert found.reasons, source
