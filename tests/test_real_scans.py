"""Real scans: the same curvature after a rigid motion, and the radii of objects that are known."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array, rotation

from surfsig import PointCloud, extract, read

SCANS = {
    "surfaces/table_scene_mug.pcd": 0.015,
    "surfaces/gym_ball.xyz": 0.15,
    "registration/redkitchen/cloud_bin_0.ply": 0.05,
    "registration/bunny/bun000.ply": 0.003,
}

pytestmark = pytest.mark.filterwarnings("ignore:.*the last line .* is cut off:UserWarning")


Reader = Callable[[str], PointCloud]


@pytest.fixture(scope="session")
def scan(shared_data: Path) -> Reader:
    """Read a scan, or skip the test where this copy of the data lacks it."""

    def load(name: str) -> PointCloud:
        path = shared_data / name
        if not path.is_file():
            pytest.skip(f"no {path}")
        return read(path)

    return load


@pytest.mark.parametrize("name", SCANS)
def test_a_scan_that_is_turned_and_moved_keeps_its_curvature(scan: Reader, name: str) -> None:
    check_turned_and_moved(scan(name), SCANS[name])


def check_turned_and_moved(cloud: PointCloud, radius: float) -> None:
    """Compare k1 and k2 of 2,000 points before and after a rigid motion."""
    rng = np.random.default_rng(91)
    at = rng.choice(np.flatnonzero(cloud.finite), 2000, replace=False)
    points = cloud.points.astype(np.float64)
    turned, moved = rotation(rng), rng.uniform(-5, 5, 3)
    still = extract(points, radius, at=at, viewpoint=np.zeros(3))
    found = extract(points @ turned.T + moved, radius, at=at, viewpoint=moved)
    ok = still.ok
    assert ok.mean() > 0.9
    error = np.maximum(abs(found.k1 - still.k1), abs(found.k2 - still.k2))
    limit = 1e-3 * np.maximum(np.maximum(abs(still.k1), abs(still.k2)), 1 / radius)
    assert (error <= limit)[ok].mean() >= 0.99
    same = ok & found.ok
    assert np.median(np.einsum("ij,ij->i", found.normals[same], still.normals[same] @ turned.T)) > 0.999999


def test_a_sparse_lidar_scan_that_is_turned_and_moved_keeps_its_curvature(scan: Reader) -> None:
    check_turned_and_moved(scan("surfaces/lidar_sphere_1.xyz"), 0.5)


def sphere_through(points: Array) -> tuple[Array, float]:
    """Return centre and radius of the algebraic least-squares sphere."""
    terms = np.column_stack([2 * points, np.ones(len(points))])
    x, y, z, rest = np.linalg.lstsq(terms, (points**2).sum(axis=1), rcond=None)[0]
    centre = np.array([x, y, z])
    return centre, float(np.sqrt(rest + centre @ centre))


def points_of_sphere(points: Array, centre: Array, radius: float) -> tuple[NDArray[np.intp], Array, float]:
    """Return the numbers of a sphere's points, from a rough idea where it is, and what fits them."""
    for _ in range(6):
        near = abs(np.linalg.norm(points - centre, axis=1) - radius) < 0.03
        centre, radius = sphere_through(points[near])
    return np.flatnonzero(abs(np.linalg.norm(points - centre, axis=1) - radius) < 0.02), centre, radius


@pytest.mark.parametrize(
    ("number", "centre"), [(1, [1.72, 2.47, 0.01]), (2, [1.46, 2.24, -0.03]), (3, [2.09, 1.34, -0.01])]
)
def test_the_lidars_calibration_sphere(scan: Reader, number: int, centre: list[float]) -> None:
    points = scan(f"surfaces/lidar_sphere_{number}.xyz").points.astype(np.float64)
    at, _, fitted = points_of_sphere(points, np.array(centre), 0.295)
    assert len(at) > 250
    assert fitted == pytest.approx(0.295, abs=0.01)
    found = extract(points, 0.15, at=at, viewpoint=[0, 0, 0])
    assert found.ok.mean() > 0.95
    assert np.median(found.mean_curvature[found.ok]) == pytest.approx(1 / 0.295, rel=0.06)


def test_the_gym_ball(scan: Reader) -> None:
    """A tablet's scan, 3 cm thick: points on both sides of the surface flatten what is fitted to them."""
    points = scan("surfaces/gym_ball.xyz").points.astype(np.float64)
    at, centre, fitted = points_of_sphere(points, np.array([0.1, -0.91, 0.74]), 0.341)
    assert len(at) > 8000
    assert fitted == pytest.approx(0.341, abs=0.002)
    # Seen from its middle a ball is hollow: that tells its sides apart.
    upper = at[points[at, 2] > centre[2]]
    found = extract(points, 0.2, at=upper, viewpoint=centre)
    assert found.ok.mean() > 0.98
    assert np.median(found.k2[found.ok]) == pytest.approx(-1 / 0.341, rel=0.1)
    assert np.median(found.mean_curvature[found.ok]) == pytest.approx(-1 / 0.341, rel=0.25)


def test_the_mugs_wall(scan: Reader) -> None:
    cloud = scan("surfaces/table_scene_mug.pcd")
    points = cloud.points.astype(np.float64)
    # The cylinder that PCL's documentation fits; of its wall the part that faces the sensor.
    middle, axis = np.array([0.055, 0.071, 0.769]), np.array([0, 0.834, 0.552])
    offsets = points - middle
    along = offsets @ axis
    outward = offsets - along[:, None] * axis
    distance = np.linalg.norm(outward, axis=1)
    facing = -(outward * points).sum(axis=1) > 0.5 * distance * np.linalg.norm(points, axis=1)
    wall = np.flatnonzero((abs(distance - 0.0394) < 0.003) & (abs(along) < 0.02) & facing)
    assert len(wall) > 2000
    found = extract(cloud, 0.02, at=wall)
    assert found.oriented
    assert found.ok.mean() > 0.99
    assert np.median(found.k1[found.ok]) == pytest.approx(1 / 0.0396, rel=0.08)
    assert np.median(found.k2[found.ok]) == pytest.approx(0, abs=2)
    # x of the surface's axes runs around the mug.
    assert np.median(abs(found.directions[found.ok] @ axis)) < 0.15
