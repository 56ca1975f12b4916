"""From where a scan was measured, told by the density of its points."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import PointCloud, geometry, simulate

Array = NDArray[np.float64]
MOTION = geometry.from_rotation_vector(np.array([0.4, -0.9, 1.9]), np.array([30.0, -20.0, 10.0]))


def scanned(sensor: simulate.Lidar | simulate.DepthCamera, seed: int) -> PointCloud:
    """Scan a room, and take the viewpoint away."""
    pose = simulate.upright_pose(0.3, -0.4, 1.3, 0.8)
    if isinstance(sensor, simulate.DepthCamera):
        pose[:3, :3] = pose[:3, :3] @ np.array([[0.0, 0.0, 1.0], [-1.0, 0.0, 0.0], [0.0, -1.0, 0.0]])
    scan = simulate.scan(simulate.room(seed), sensor, pose, seed=seed)
    return PointCloud(geometry.transform_points(MOTION, scan.points.astype(np.float64)))


def error(cloud: PointCloud) -> float:
    found = surfsig.estimate_viewpoint(cloud)
    assert found is not None
    return float(np.linalg.norm(found - MOTION[:3, 3]))


@pytest.mark.parametrize("seed", [61, 62])
@pytest.mark.parametrize(
    ("sensor", "largest"),
    [
        (simulate.Lidar(lines=32, elevation=(-25.0, 25.0), noise=0.01), 0.06),
        (simulate.Lidar(lines=16, elevation=(-15.0, 15.0), noise=0.02), 0.15),
        (simulate.Lidar(lines=96, elevation=(-50.0, 60.0), steps=720, noise=0.003), 0.15),
        (simulate.DepthCamera(), 0.2),
    ],
)
def test_of_simulated_sensors(
    sensor: simulate.Lidar | simulate.DepthCamera, largest: float, seed: int
) -> None:
    assert error(scanned(sensor, seed)) < largest


def test_of_some_of_the_points_in_any_order() -> None:
    scan = scanned(simulate.Lidar(lines=32, elevation=(-25.0, 25.0), noise=0.01), 63)
    some = np.random.default_rng(5).permutation(len(scan))[: len(scan) // 4]
    assert error(PointCloud(scan.points[some])) < 0.25


def test_at_large_coordinates() -> None:
    scan = scanned(simulate.Lidar(lines=32, elevation=(-25.0, 25.0), noise=0.01), 64)
    far = PointCloud(scan.points - MOTION[:3, 3].astype(np.float32), origin=np.array([4.5e6, 5.5e6, 300.0]))
    found = surfsig.estimate_viewpoint(far)
    assert found is not None
    assert np.linalg.norm(found - [4.5e6, 5.5e6, 300.0]) < 0.06


def test_surfaces_that_are_sampled_evenly_do_not_tell() -> None:
    rng = np.random.default_rng(6)
    ball = rng.normal(size=(20_000, 3))
    assert surfsig.estimate_viewpoint(ball / np.linalg.norm(ball, axis=1, keepdims=True)) is None


@pytest.mark.parametrize(
    "points", [np.zeros((0, 3)), np.ones((500, 3)), np.full((500, 3), np.nan), np.full((500, 3), 1e30)]
)
def test_nothing_to_tell_from(points: Array) -> None:
    assert surfsig.estimate_viewpoint(points) is None


@pytest.mark.parametrize("name", ["source", "target"])
def test_of_a_real_lidar(shared_data: Path, name: str) -> None:
    """Its scans are in its own frame: it stood at the origin."""
    found = surfsig.estimate_viewpoint(
        surfsig.read(shared_data / "registration" / "lidar_pair" / f"{name}.ply")
    )
    assert found is not None
    assert np.linalg.norm(found) < 0.1


def test_fused_maps_do_not_tell(shared_data: Path) -> None:
    for path in sorted((shared_data / "registration" / "redkitchen").glob("*.ply")):
        assert surfsig.estimate_viewpoint(surfsig.read(path)) is None
