"""A viewpoint at (0, 0, 0) that a program wrote who knew none."""

import warnings
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import PointCloud
from surfsig.visibility import without_false_viewpoint


def ball(count: int = 6000, radius: float = 0.5) -> NDArray[np.float64]:
    directions = np.random.default_rng(3).normal(size=(count, 3))
    return np.asarray(radius * directions / np.linalg.norm(directions, axis=1, keepdims=True))


def street(count: int = 20_000) -> NDArray[np.float64]:
    """What a lidar sees from (0, 0, 0) of a ground 1.8 below, and of posts and walls on it."""
    rng = np.random.default_rng(4)
    azimuth = rng.uniform(-np.pi, np.pi, count)
    elevation = np.radians(rng.integers(-24, 5, count))
    rays = np.column_stack(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    with np.errstate(divide="ignore"):
        ground = np.where(rays[:, 2] < 0, -1.8 / rays[:, 2], np.inf)
        wall = 12.0 / np.maximum(np.abs(rays[:, 1]), 1e-9)
    posts = np.where(np.abs((azimuth + np.pi) % 0.5 - 0.25) < 0.03, 6.0, np.inf)
    distance = np.minimum(np.minimum(ground, wall), np.minimum(posts, 60.0))
    return np.asarray(rays * distance[:, None])


def read_pcd(path: Path, points: NDArray[np.floating], viewpoint: str = "0 0 0 1 0 0 0") -> PointCloud:
    rows = points.astype(np.float32)
    head = "VERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\n"
    head += f"WIDTH {len(rows)}\nHEIGHT 1\nVIEWPOINT {viewpoint}\nPOINTS {len(rows)}\nDATA binary\n"
    path.write_bytes(head.encode() + rows.tobytes())
    return surfsig.read(path)


def test_a_ball_about_the_origin_was_not_seen_from_its_middle(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"ball\.pcd: its viewpoint is \(0, 0, 0\)"):
        cloud = read_pcd(tmp_path / "ball.pcd", ball())
    assert cloud.viewpoint is None
    assert not surfsig.extract(cloud, 0.1).oriented


@pytest.mark.parametrize("shape", ["box", "cylinder", "dumbbell"])
def test_models_about_the_origin_or_beside_it(tmp_path: Path, shape: str) -> None:
    rng = np.random.default_rng(1)
    if shape == "box":
        points = rng.uniform(-1, 1, (9000, 3))
        points[np.arange(9000), rng.integers(0, 3, 9000)] = rng.choice([-1.0, 1.0], 9000)
    elif shape == "cylinder":
        angle = rng.uniform(0, 2 * np.pi, 9000)
        points = np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(-1, 1, 9000)])
    else:
        points = np.concatenate([ball(4500) + shift for shift in ((0.7, 0, 0), (-0.7, 0, 0))])
    for shift in ([0.0, 0.0, 0.0], [0.5, 5.0, 0.0], [389_000.0, 5_819_000.0, 40.0]):
        with pytest.warns(UserWarning, match="viewpoint"):
            assert read_pcd(tmp_path / "model.pcd", points + shift).viewpoint is None


def room(rays: NDArray[np.float64], noise: float) -> NDArray[np.float64]:
    """What a sensor at (0, 0, 0) measures in an empty room of 9 x 6.5 x 2.8 m."""
    with np.errstate(divide="ignore"):
        walls = np.maximum(np.array([-4.0, -3.0, -1.5]) / rays, np.array([5.0, 3.5, 1.3]) / rays)
    distance = walls.min(axis=1) + np.random.default_rng(6).normal(0.0, noise, len(rays))
    return np.asarray(rays * distance[:, None])


def lines(elevations: NDArray[np.float64], azimuths: int) -> NDArray[np.float64]:
    """Directions of a spinning lidar or a tripod scanner."""
    turn = np.linspace(0, 2 * np.pi, azimuths, endpoint=False)
    up, around = (part.ravel() for part in np.meshgrid(np.radians(elevations), turn))
    return np.column_stack([np.cos(up) * np.cos(around), np.cos(up) * np.sin(around), np.sin(up)])


@pytest.mark.parametrize("noise", [0.0, 0.01])
@pytest.mark.parametrize("count", [16, 32, 64, 128, 200])
def test_a_scan_of_an_empty_room_keeps_its_viewpoint(tmp_path: Path, count: int, noise: float) -> None:
    elevations = np.linspace(-60, 90, count) if count == 200 else np.linspace(-25, 15, count)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read_pcd(tmp_path / "room.pcd", room(lines(elevations, 720), noise))
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 0])


def test_a_floor_at_a_grazing_angle_keeps_its_viewpoint(tmp_path: Path) -> None:
    across, down = (part.ravel() for part in np.meshgrid(np.arange(-160, 160), np.arange(-120, 120)))
    rays = np.column_stack([across / 386.0, down / 386.0, np.ones(across.size)])
    depth = 1.0 / (rays @ [0.0, 0.995, 0.1])
    seen = (depth > 0) & (depth < 20)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read_pcd(tmp_path / "floor.pcd", rays[seen] * depth[seen, None])
    np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 0])


@pytest.mark.parametrize("shape", ["ring", "spheres of rows", "corner", "base"])
def test_models_that_hide_little_of_themselves(tmp_path: Path, shape: str) -> None:
    rng = np.random.default_rng(1)
    around, along = rng.uniform(0, 2 * np.pi, (2, 9000))
    if shape == "ring":
        wide = 1 + 0.3 * np.cos(along)
        points = np.column_stack([wide * np.cos(around), wide * np.sin(around), 0.3 * np.sin(along)])
    elif shape == "spheres of rows":
        # In rows like a scan, but each row at one distance.
        points = lines(np.linspace(-80, 80, 60), 90)
    elif shape == "corner":
        points = rng.uniform(0, 1, (9000, 3))
        points[np.arange(9000), rng.integers(0, 3, 9000)] = rng.choice([0.0, 1.0], 9000)
    else:
        points = ball(9000) + np.array([0, 0, 0.5])
    with pytest.warns(UserWarning, match="viewpoint"):
        assert read_pcd(tmp_path / "model.pcd", points).viewpoint is None


def test_scans_from_the_origin_keep_it(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        lidar = read_pcd(tmp_path / "lidar.pcd", street())
        front = ball()[ball()[:, 2] < -0.1] + [0, 0, 2.0]
        camera = read_pcd(tmp_path / "camera.pcd", front)
    for cloud in (lidar, camera):
        assert cloud.viewpoint is not None
        np.testing.assert_array_equal(cloud.viewpoint, [0, 0, 0])
    assert np.nanmedian(surfsig.extract(camera, 0.1).mean_curvature) == pytest.approx(2.0, rel=0.05)


def test_a_viewpoint_that_somebody_set_or_gives_counts(tmp_path: Path) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        elsewhere = read_pcd(tmp_path / "set.pcd", ball(), "0 0 9 1 0 0 0")
    assert elsewhere.viewpoint is not None
    inside = surfsig.extract(ball(), 0.1, viewpoint=[0, 0, 0])
    assert np.nanmedian(inside.mean_curvature) == pytest.approx(-2.0, rel=0.05)
    assert PointCloud(ball(), viewpoint=np.zeros(3)).viewpoint is not None


def test_empty_clouds_and_those_of_one_place_keep_what_they_say() -> None:
    for points in (np.zeros((0, 3)), np.zeros((9, 3)), np.full((9, 3), np.nan), np.ones((9, 3))):
        cloud = PointCloud(points, viewpoint=np.zeros(3))
        assert without_false_viewpoint(cloud, "a") is cloud


def test_odd_file_ball_at_origin(shared_data: Path) -> None:
    file = shared_data / "odd_files" / "viewpoint_default_pcd" / "ball_at_origin.pcd"
    with pytest.warns(UserWarning, match="no sensor can have seen"):
        cloud = surfsig.read(file)
    assert cloud.viewpoint is None


def test_real_scans_from_the_origin_keep_it(shared_data: Path) -> None:
    for name in ("labelled_tables/learn5.pcd", "surfaces/table_scene_mug.pcd", "objects/milk/scene.pcd"):
        assert surfsig.read(shared_data / name).viewpoint is not None
