"""Scans of neighbouring rooms: hardly a patch looks alike in both, and the rooms are of one size."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest
from register_scenes import error

import surfsig
from surfsig import PointCloud, simulate

TRIPOD = simulate.Lidar(lines=64, elevation=(-50.0, 60.0), steps=480, noise=0.003, max_range=12.0)
COARSE_TRIPOD = replace(TRIPOD, lines=32, steps=240)
"""For many rooms: their faces are as plain from a quarter of the points."""
PLACES = ((-3.2, 0.3, 0.5), (3.1, -0.4, 2.5))


def storey(seed: int) -> tuple[list[PointCloud], list[np.ndarray]]:
    """Two rooms, with a scan of each."""
    scene = simulate.storey(seed, rooms=(2, 1))
    poses = [simulate.upright_pose(x, y, 1.5, yaw) for x, y, yaw in PLACES]
    return [simulate.scan(scene, TRIPOD, pose, seed=seed + k) for k, pose in enumerate(poses)], poses


def test_scans_of_neighbouring_rooms_are_registered_by_their_faces() -> None:
    (target, source), poses = storey(3)
    found = surfsig.register(source, target)
    truth = np.linalg.inv(poses[0]) @ poses[1]
    assert np.abs(error(found.T_target_source, truth, np.zeros(3))).max() < 0.02
    assert found.trusted, found.reasons
    assert found.free_space < 0.005
    assert found.inliers < surfsig.RegistrationSettings().trusted_inliers, "matches do not tell it"


def test_scans_of_two_storeys_with_rooms_of_one_size_are_not_trusted() -> None:
    (target, _), _ = storey(4)
    (_, source), _ = storey(5)
    found = surfsig.register(source, target)
    assert not found.trusted
    assert found.reasons


@pytest.mark.slow
def test_scans_of_four_rooms_get_one_set_of_poses() -> None:
    scene = simulate.storey(6, rooms=(2, 2))
    places = [(x, y) for y in (-2.5, 2.5) for x in (-3.0, 3.0)]
    poses = [
        simulate.upright_pose(x + 0.2, y - 0.3, 1.5, 1.3 * number) for number, (x, y) in enumerate(places)
    ]
    scans = [simulate.scan(scene, COARSE_TRIPOD, pose, seed=number) for number, pose in enumerate(poses)]
    found = surfsig.register_multiway(scans)
    assert found.belongs.all(), found
    for number, pose in enumerate(poses):
        truth = np.linalg.inv(poses[found.reference]) @ pose
        assert np.abs(error(found.T_reference_scan[number], truth, np.zeros(3))).max() < 0.03
