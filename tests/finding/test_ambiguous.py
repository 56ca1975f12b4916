"""Instances whose pose is not the only one: symmetric models, and copies of another size."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

import surfsig
from surfsig import PointCloud, simulate

CAMERA = simulate.DepthCamera(width=240, height=180, noise=0.0005)
POSE = np.eye(4)
POSE[:3, :3] = Rotation.from_euler("ZYX", [0.3, 0.5, 0.7]).as_matrix()
POSE[:3, 3] = (0.05, -0.02, 1.2)
"""T_camera_object: three faces of a box are seen."""


def surface_of(surface: simulate.Surface, count: int = 8000) -> PointCloud:
    """Points all over a surface, by rays from a sphere around it."""
    rng = np.random.default_rng(1)
    directions = rng.normal(size=(count, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    inwards = 0.3 * rng.normal(size=(count, 3)) - directions
    inwards /= np.linalg.norm(inwards, axis=1)[:, None]
    hits = simulate.Scene([simulate.Placed(surface)]).cast(2.0 * directions, inwards)
    return PointCloud(hits.points[np.isfinite(hits.t)])


def seen(surface: simulate.Surface) -> PointCloud:
    """Measure it before a wall."""
    wall = simulate.Placed(simulate.Box((4.0, 4.0, 0.1)), simulate.pose((0.0, 0.0, 2.0)))
    return simulate.scan(simulate.Scene([simulate.Placed(surface, POSE), wall]), CAMERA, seed=2)


BOX = simulate.Box((0.5, 0.35, 0.22))


@pytest.fixture(scope="module")
def box() -> surfsig.Instance:
    found = surfsig.find_instances(surface_of(BOX), seen(BOX))
    assert len(found) >= 1
    return found[0]


def test_a_box_has_four_poses_of_which_three_are_alternatives(box: surfsig.Instance) -> None:
    poses = [box.T_scene_model, *box.alternatives]
    for signs in ((1, 1, 1), (1, -1, -1), (-1, 1, -1), (-1, -1, 1)):
        truth = POSE @ np.diag([*signs, 1.0])
        assert min(np.abs(pose - truth).max() for pose in poses) < 0.02, signs
    assert len(box.alternatives) == 3


def test_it_is_not_trusted_and_says_why(box: surfsig.Instance) -> None:
    assert not box.trusted
    assert box.doubts == ["ambiguous"]
    assert "3 other transforms explain as much" in box.reasons[0]
    assert box.values()["trusted"] is False
    assert len(box.values()["alternatives"]) == 3
    assert abs(box.scale - 1.0) < 0.01
    assert np.isfinite(box.covariance).all()


def test_a_cylinder_turns_about_its_axis_with_infinite_variance() -> None:
    cylinder = simulate.Cylinder(0.12, 0.5)
    found = surfsig.find_instances(surface_of(cylinder), seen(cylinder))[0]
    rotations = [one for one in found.free_directions if one.motion == "rotation"]
    assert len(rotations) == 1
    assert abs(rotations[0].axis @ POSE[:3, 2]) > 0.999
    assert "free_directions" in found.doubts
    assert np.isinf(np.diag(found.covariance)[:3]).all()


def test_a_copy_of_another_size_is_said_to_be_one() -> None:
    larger = simulate.Box((0.525, 0.3675, 0.231))
    found = surfsig.find_instances(surface_of(BOX), seen(larger))
    for instance in found:
        assert not instance.trusted
    assert any("scale" in instance.doubts and abs(instance.scale - 1.05) < 0.01 for instance in found)
