"""Shapes that are grown from a place in a scan, simulated and real."""

import itertools
import math
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from surface_points import Array

import surfsig
from surfsig import InvalidInputError, PointCloud, fit_cylinder, fit_plane, fit_sphere

pytestmark = pytest.mark.filterwarnings("ignore:.*the last line .* is cut off:UserWarning")


def room(noise: float = 0.002) -> tuple[Array, dict[str, NDArray[np.bool_]]]:
    """Give a floor with half a sphere and half a standing pipe on it, and which points are whose.

    The sphere's radius is 0.3 and its center (0, 0, 0.5), the pipe's 0.1 and its axis x = 1, y = 0.
    """
    rng = np.random.default_rng(21)
    direction = rng.normal(size=(3000, 3))
    direction /= np.linalg.norm(direction, axis=1)[:, None]
    direction[:, 1] = -abs(direction[:, 1])
    ball = (0.3 + noise * rng.normal(size=(3000, 1))) * direction + [0, 0, 0.5]
    turn = rng.uniform(-np.pi, 0, 2000)
    distance = 0.1 + noise * rng.normal(size=2000)
    pipe = np.column_stack([1 + distance * np.cos(turn), distance * np.sin(turn), rng.uniform(0, 1, 2000)])
    floor = np.column_stack([rng.uniform(-2, 2, (20_000, 2)), noise * rng.normal(size=20_000)])
    parts = [ball, pipe, floor]
    owners = np.repeat([0, 1, 2], [len(part) for part in parts])
    names = ("ball", "pipe", "floor")
    return np.concatenate(parts), {name: owners == number for number, name in enumerate(names)}


def share_in(shape: surfsig.Surface, owned: NDArray[np.bool_]) -> float:
    """Give the share of a part's points that are the shape's."""
    return float(owned[shape.members].sum() / owned.sum())


@pytest.mark.parametrize("radius", [None, 0.2])
def test_a_sphere_is_found_from_a_place_on_it(radius: float | None) -> None:
    points, owners = room()
    shape = fit_sphere(points, near=[0, -0.3, 0.5], radius=radius)
    assert shape.interval[0] < 0.3 < shape.interval[1]
    np.testing.assert_allclose(shape.center, [0, 0, 0.5], atol=5e-4)
    assert share_in(shape, owners["ball"]) > 0.99
    assert owners["ball"][shape.members].all()


@pytest.mark.parametrize("radius", [None, 0.1])
def test_a_cylinder_is_found_from_a_place_on_it(radius: float | None) -> None:
    points, owners = room()
    shape = fit_cylinder(points, near=[1, -0.1, 0.5], radius=radius)
    assert shape.interval[0] < 0.1 < shape.interval[1]
    np.testing.assert_allclose(shape.axis, [0, 0, 1], atol=1e-3)
    np.testing.assert_allclose(shape.point[:2], [1, 0], atol=1e-3)
    assert share_in(shape, owners["pipe"]) > 0.98
    # Where it meets the floor, some of that is within its noise.
    assert (~owners["pipe"][shape.members]).sum() < 20


def test_a_plane_is_found_from_a_place_on_it() -> None:
    points, owners = room()
    shape = fit_plane(points, near=[-1, -1, 0])
    np.testing.assert_allclose(shape.axis, [0, 0, 1], atol=1e-4)
    assert share_in(shape, owners["floor"]) > 0.99
    assert (~owners["floor"][shape.members]).sum() < 60


def test_growing_does_not_depend_on_where_the_scan_lies() -> None:
    points, _ = room()
    here = fit_sphere(points, near=[0, -0.3, 0.5])
    place = np.array([500_000.0, 4_500_000.0, 100.0])
    there = fit_sphere(PointCloud(points, origin=place), near=place + np.array([0, -0.3, 0.5]))
    np.testing.assert_array_equal(here.members, there.members)
    assert there.radius == pytest.approx(here.radius, rel=1e-6)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"near": [9, 9, 9], "radius": 0.1}, "near is .* from the nearest|no point is within the"),
        ({"near": [0, 0]}, "near must be three"),
        ({"near": [0, 0, 0], "radius": 0}, "radius must be a finite number above 0"),
        ({"radius": -0.1}, "radius must be a finite number above 0"),
        ({"near": [-1, -1, 0], "radius": 0.3}, "determine no sphere"),
    ],
)
def test_what_has_no_meaning_is_refused(options: dict[str, object], message: str) -> None:
    points, _ = room()
    with pytest.raises(InvalidInputError, match=message):
        fit_sphere(points, **options)  # type: ignore[arg-type]


Reader = Callable[[str], PointCloud]


@pytest.fixture(scope="session")
def surface(shared_data: Path) -> Reader:
    """Read a scan of a surface, or skip the test where this copy of the data lacks it."""

    def load(name: str) -> PointCloud:
        path = shared_data / "surfaces" / name
        if not path.is_file():
            pytest.skip(f"no {path}")
        return surfsig.read(path)

    return load


# Where the sphere's center is in each scan, roughly.
SPHERES = {1: [1.72, 2.47, 0.01], 2: [1.46, 2.24, -0.03], 3: [2.09, 1.34, -0.01]}


@pytest.mark.parametrize("start", [None, 0.2, 0.3])
def test_three_lidar_scans_of_a_sphere_agree_within_their_intervals(
    surface: Reader, start: float | None
) -> None:
    shapes = []
    for number, center in SPHERES.items():
        facing = np.array(center) * (1 - 0.3 / np.linalg.norm(center))
        shapes.append(fit_sphere(surface(f"lidar_sphere_{number}.xyz"), near=facing, radius=start))
    for shape in shapes:
        assert shape.count > 250
        # Its owner says "around 0.3 m".
        assert shape.radius == pytest.approx(0.297, abs=0.007)
        assert 0.001 < shape.radius_std < 0.01
    for a, b in itertools.combinations(shapes, 2):
        assert max(a.interval[0], b.interval[0]) < min(a.interval[1], b.interval[1])
        halves = [(shape.interval[1] - shape.interval[0]) / 2 for shape in (a, b)]
        assert abs(a.radius - b.radius) < math.hypot(*halves)


@pytest.mark.parametrize("place", [[0, 1, 0], [-1, 0, 0], [0.7, 0, 0.7]])
def test_a_tablets_scan_of_a_gym_ball(surface: Reader, place: list[float]) -> None:
    on_it = np.array([0.1, -0.913, 0.739]) + 0.341 * np.array(place)
    shape = fit_sphere(surface("gym_ball.xyz"), near=on_it)
    assert shape.radius == pytest.approx(0.341, abs=0.004)
    assert shape.interval[0] < 0.341 < shape.interval[1]
    assert shape.count > 10_000


def test_a_stereo_scan_of_a_mug(surface: Reader) -> None:
    """PCL's documentation fits 0.0396 to it; it is no perfect cylinder, and has a handle."""
    middle, axis = np.array([0.055, 0.071, 0.769]), np.array([0, 0.834, 0.552])
    facing = -middle + (middle @ axis) * axis
    on_it = middle + 0.0396 * facing / np.linalg.norm(facing)
    shape = fit_cylinder(surface("table_scene_mug.pcd"), near=on_it, radius=0.02)
    assert shape.radius == pytest.approx(0.0396, abs=0.0015)
    assert abs(shape.axis @ axis) > 0.99
    assert shape.count > 10_000
