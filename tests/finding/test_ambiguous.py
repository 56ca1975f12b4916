"""Instances whose pose is not the only one: symmetric models."""

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


def surface_of(surface: simulate.Surface, half: tuple[float, float, float], count: int = 12000) -> PointCloud:
    """Points all over a surface, by rays from a sphere around it to random points within."""
    rng = np.random.default_rng(1)
    origins = rng.normal(size=(count, 3))
    origins *= 2.0 / np.linalg.norm(origins, axis=1)[:, None]
    rays = rng.uniform(-1.0, 1.0, (count, 3)) * half - origins
    rays /= np.linalg.norm(rays, axis=1)[:, None]
    hits = simulate.Scene([simulate.Placed(surface)]).cast(origins, rays)
    return PointCloud(hits.points[np.isfinite(hits.t)])


def seen(surface: simulate.Surface) -> PointCloud:
    """Measure it before a wall."""
    wall = simulate.Placed(simulate.Box((4.0, 4.0, 0.1)), simulate.pose((0.0, 0.0, 2.0)))
    return simulate.scan(simulate.Scene([simulate.Placed(surface, POSE), wall]), CAMERA, seed=2)


BOX = simulate.Box((0.5, 0.35, 0.22))


@pytest.fixture(scope="module")
def box() -> surfsig.Instance:
    found = surfsig.find_instances(surface_of(BOX, (0.25, 0.175, 0.11)), seen(BOX))
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
    assert np.isfinite(box.covariance).all()


def test_a_cylinder_turns_about_its_axis_with_infinite_variance() -> None:
    cylinder = simulate.Cylinder(0.12, 0.5)
    found = surfsig.find_instances(surface_of(cylinder, (0.08, 0.08, 0.25)), seen(cylinder))[0]
    rotations = [one for one in found.free_directions if one.motion == "rotation"]
    assert len(rotations) == 1
    assert abs(rotations[0].axis @ POSE[:3, 2]) > 0.999
    assert "free_directions" in found.doubts
    assert np.isinf(np.diag(found.covariance)[:3]).all()
