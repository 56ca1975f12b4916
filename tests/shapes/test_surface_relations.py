"""Distances and angles between surfaces against geometry, and their standard errors against many draws."""

import math
from collections.abc import Callable
from typing import Any

import drawn_shapes
import numpy as np
import pytest
from made_surfaces import made, moved
from surface_points import UTM, Array, rotation

from surfsig import InvalidInputError, PointCloud, Surface, fit_circle, fit_cylinder, fit_plane, fit_sphere

FLOOR = made("plane", [0, 0, 0], [0, 0, 1])
PIPE = made("cylinder", [0, 0, 2], [1, 0, 0], 0.5)
BALL = made("sphere", [3, 0, 1], radius=0.25)

DISTANCES = [
    ("plane to plane", FLOOR, made("plane", [1, 1, 0.7], [0, 0, -1]), 0.7, 0.7, math.sqrt(2e-6 + 2 * 0.5e-6)),
    ("plane to center", FLOOR, BALL, 1.0, 0.75, math.sqrt(2e-6 + 9e-6)),
    ("plane to axis", FLOOR, PIPE, 2.0, 1.5, math.sqrt(2e-6)),
    (
        "plane to center",
        FLOOR,
        made("torus", [0, 0, 1], [1, 0, 0], 0.1, major_radius=1.0),
        1.0,
        math.nan,
        None,
    ),
    ("axis to axis", PIPE, made("cylinder", [0, 5, 2], [1, 0, 0], 1.5), 5.0, 3.0, math.sqrt(2e-6)),
    ("axis to axis", PIPE, made("cylinder", [0, 9, 5], [0, 1, 0], 0.5), 3.0, 2.0, math.sqrt(2e-6 + 81e-6)),
    ("axis to axis", PIPE, made("cone", [0, 0, 0], [1, 0, 0], 0.5, half_angle=0.3), 2.0, math.nan, None),
    ("axis to center", PIPE, BALL, 1.0, 0.25, math.sqrt(2e-6 + 9e-6)),
    ("center to center", BALL, made("sphere", [3, 4, 4], radius=1.0), 5.0, 3.75, math.sqrt(2e-6)),
]


@pytest.mark.parametrize(("between", "first", "second", "value", "gap", "std"), DISTANCES)
@pytest.mark.parametrize("offset", [np.zeros(3), UTM])
def test_distances_are_those_of_geometry(
    between: str, first: Surface, second: Surface, value: float, gap: float, std: float | None, offset: Array
) -> None:
    turn = rotation(np.random.default_rng(1))
    ours, theirs = (moved(surface, turn, offset) for surface in (first, second))
    found, back = ours.distance_to(theirs), theirs.distance_to(ours)
    assert found.between == back.between == between
    assert found.value == pytest.approx(value, abs=1e-9)
    assert found.gap == pytest.approx(gap, abs=1e-9, nan_ok=True)
    if std is not None:
        assert found.std == pytest.approx(std, rel=1e-6)
        radii = sum(surface.kind != "plane" for surface in (first, second))
        assert found.gap_std == pytest.approx(math.sqrt(std**2 + radii * 1e-6), rel=1e-6)
    assert (back.value, back.std) == pytest.approx((found.value, found.std), rel=1e-6)
    assert np.linalg.norm(np.subtract(*found.points)) == pytest.approx(value, abs=1e-8)
    np.testing.assert_allclose(back.points, found.points[::-1], atol=1e-8)
    low, high = found.interval
    assert low < found.value < high
    assert found.to_dict()["interval"] == (low, high)


def test_the_ends_of_a_distance_are_where_it_is_shortest() -> None:
    crossing = made("cylinder", [7, 9, 5], [0, 1, 0], 0.5)
    np.testing.assert_allclose(PIPE.distance_to(crossing).points, [[7, 0, 2], [7, 0, 5]], atol=1e-12)
    np.testing.assert_allclose(FLOOR.distance_to(BALL).points, [[3, 0, 0], [3, 0, 1]], atol=1e-12)


@pytest.mark.parametrize(
    ("first", "second", "degrees", "between"),
    [
        (FLOOR, made("plane", [1, 0, 0], [1, 0, 1]), 45.0, "plane to plane"),
        (FLOOR, made("plane", [1, 0, 0], [0, 1, 0]), 90.0, "plane to plane"),
        (FLOOR, made("plane", [1, 0, 1], [0, 0, -1]), 0.0, "plane to plane"),
        (FLOOR, PIPE, 0.0, "plane to axis"),
        (FLOOR, made("cylinder", [1, 1, 1], [0, 0, 1], 0.5), 90.0, "plane to axis"),
        (FLOOR, made("cylinder", [1, 1, 1], [0, -1, math.sqrt(3)], 0.5), 60.0, "plane to axis"),
        (PIPE, made("cone", [1, 1, 1], [-1, 1, 0], 0.5, half_angle=0.2), 45.0, "axis to axis"),
    ],
)
def test_angles_are_those_of_geometry(first: Surface, second: Surface, degrees: float, between: str) -> None:
    for found in (first.angle_to(second), second.angle_to(first)):
        assert found.between == between
        assert math.degrees(found.value) == pytest.approx(degrees, abs=1e-9)
        # Each direction has an error of 0.001 towards the other one.
        assert found.std == pytest.approx(math.sqrt(2e-6), rel=1e-6)
        assert 0.0 <= found.interval[0] <= found.value <= found.interval[1] <= 0.5 * math.pi


def test_where_surfaces_meet() -> None:
    wall = FLOOR.angle_to(made("plane", [2, 6, 1], [1, 0, 0]))
    np.testing.assert_allclose(abs(wall.direction), [0, 1, 0], atol=1e-12)
    np.testing.assert_allclose(wall.point, [2, 3, 0], atol=1e-12)
    # The wall's shift and tilts move the line along x, the floor's along z; that they turn it moves the place
    # that is nearest to (1, 3, 0.5), from where it is 1 and 0.5 away.
    np.testing.assert_allclose(wall.point_std**2, [11e-6, 1.25e-6, 14e-6], rtol=1e-6)
    post = FLOOR.angle_to(made("cylinder", [1, 2, 3], [0, 0, 1], 0.5))
    np.testing.assert_allclose(post.point, [1, 2, 0], atol=1e-12)
    np.testing.assert_allclose(post.point_std[:2] ** 2, 1e-6 * (1 + 9), rtol=1e-6)
    axes = PIPE.angle_to(made("cylinder", [4, 5, 2], [0, 1, 0], 0.5))
    np.testing.assert_allclose(axes.point, [4, 0, 2], atol=1e-12)
    parallel = FLOOR.angle_to(made("plane", [0, 0, 1], [0, 0, 1]))
    assert np.isnan([*parallel.point, *parallel.point_std, *parallel.direction]).all()
    assert "point" not in parallel.to_dict()


ROUND = np.column_stack([np.cos(np.arange(9.0)), np.sin(np.arange(9.0)), np.zeros(9)])
RNG = np.random.default_rng(0)
ARC, ALONG = RNG.uniform(-0.1, 0.1, 300), RNG.uniform(0, 1, 300)
HIDDEN = np.column_stack([np.cos(ARC), np.sin(ARC), ALONG]) + RNG.normal(0, 0.05, (300, 3))
"""Part of a cylinder, whose noise hides that it is bent."""


@pytest.mark.parametrize(
    ("measure", "message"),
    [
        (lambda: FLOOR.distance_to(made("plane", [0, 0, 1], [1, 0, 1])), "the planes meet at 45 degrees"),
        (lambda: FLOOR.distance_to(made("cylinder", [0, 0, 1], [0, 0, 1], 1.0)), "meets the plane at 90"),
        (lambda: BALL.angle_to(FLOOR), "a sphere has no direction"),
        (lambda: FLOOR.angle_to(BALL), "a sphere has no direction"),
        (lambda: fit_plane(np.eye(3).repeat(9, 0)).patch(np.zeros((3, 3))), "the cloud only 3 points"),
        (lambda: fit_circle(ROUND).patch(ROUND), "a circle has no area"),
    ],
)
def test_what_has_no_meaning_is_refused(measure: Callable[[], object], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        measure()


def test_unknown_errors_stay_unknown() -> None:
    unknown = made("plane", [0, 0, 1], [0, 0, 1], covariance=np.full((3, 3), math.nan))
    found = FLOOR.distance_to(unknown)
    assert (found.value, math.isnan(found.std)) == (1.0, True)
    assert math.isnan(FLOOR.angle_to(unknown).std)
    assert np.isnan([*found.interval, *FLOOR.angle_to(unknown).interval]).all()
    assert "std" not in found.to_dict()


def test_the_gap_and_parallelism_of_planes_are_those_of_the_part_that_lies_opposite() -> None:
    rng = np.random.default_rng(4)
    lower = np.column_stack([rng.uniform(0, 2, 4000), rng.uniform(0, 1, 4000), np.zeros(4000)])
    upper = np.column_stack([rng.uniform(1, 3, 4000), rng.uniform(0, 1, 4000), np.zeros(4000)])
    # The corners themselves, so that the hulls are the rectangles.
    lower[:4, :2] = [[0, 0], [2, 0], [2, 1], [0, 1]]
    upper[:4, :2] = [[1, 0], [3, 0], [3, 1], [1, 1]]
    upper[:, 2] = 1.0 + 0.02 * upper[:, 0]
    cloud = PointCloud(np.concatenate([lower, upper]), UTM)
    number = np.arange(8000)
    planes = [fit_plane(cloud.points[part]) for part in (number < 4000, number >= 4000)]
    first, second = planes[0], Surface(**{**vars(planes[1]), "members": number[4000:]})
    found = first.distance_to(second, cloud)
    # x from 1 to 2 lies opposite: a gap of 1.03 there, along the mean normal, and 0.02 from end to end.
    assert found.value == pytest.approx(1.03, abs=1e-3)
    assert found.parallelism == pytest.approx(0.02, abs=1e-5)
    assert math.isnan(first.distance_to(second).parallelism)


def test_the_form_error_is_the_spread_of_the_members() -> None:
    points = drawn_shapes.plane(np.random.default_rng(5), 0.01)
    surface = fit_plane(points)
    assert surface.form_error == pytest.approx(np.ptp(surface.distances(points)), abs=1e-12)
    assert surface.deviation == pytest.approx(0.01, rel=0.1)


TILTED = np.array([[math.cos(0.5), 0, math.sin(0.5)], [0, 1, 0], [-math.sin(0.5), 0, math.cos(0.5)]])


def drawn_plane(rng: np.random.Generator, turn: Array, offset: Any) -> Surface:
    return fit_plane(drawn_shapes.plane(rng, 0.01) @ turn.T + offset)


def drawn_ball(rng: np.random.Generator, offset: Any) -> Surface:
    return fit_sphere(drawn_shapes.sphere(rng, 0.2, 0.01) + offset)


def drawn_pipe(rng: np.random.Generator, turn: Array, offset: Any) -> Surface:
    return fit_cylinder(drawn_shapes.cylinder(rng, 4.0, 0.01) @ turn.T + offset)


PAIRS: dict[str, Callable[[np.random.Generator], tuple[Surface, Surface]]] = {
    "planes": lambda rng: (drawn_plane(rng, np.eye(3), [0, 0, 0]), drawn_plane(rng, np.eye(3), [0.5, 0, 1])),
    "tilted planes": lambda rng: (
        drawn_plane(rng, np.eye(3), [0, 0, 0]),
        drawn_plane(rng, TILTED, [0.5, 0, 1]),
    ),
    "plane and ball": lambda rng: (drawn_plane(rng, np.eye(3), [0, 0, 0]), drawn_ball(rng, [0, 0, 3])),
    "balls": lambda rng: (drawn_ball(rng, [0, 0, 0]), drawn_ball(rng, [2, 1, 1])),
    "axes": lambda rng: (
        drawn_pipe(rng, np.eye(3), [0, 0, 0]),
        drawn_pipe(rng, TILTED, [3, 1, 0.5]),
    ),
    "parallel axes": lambda rng: (
        drawn_pipe(rng, np.eye(3), [0, 0, 0]),
        drawn_pipe(rng, np.eye(3), [3, 1, 0.5]),
    ),
    "axis and ball": lambda rng: (drawn_pipe(rng, np.eye(3), [0, 0, 0]), drawn_ball(rng, [2, 1, 0.5])),
}


@pytest.mark.slow
@pytest.mark.parametrize("pair", PAIRS)
def test_standard_errors_are_those_of_many_draws(pair: str) -> None:
    rng = np.random.default_rng(6)
    draws: dict[str, list[tuple[float, float]]] = {}
    for _ in range(100):
        first, second = PAIRS[pair](rng)
        if pair != "tilted planes":
            found = first.distance_to(second)
            draws.setdefault("distance", []).append((found.value, found.std))
            draws.setdefault("gap", []).append((found.gap, found.gap_std))
        if pair in ("tilted planes", "axes"):
            angle = first.angle_to(second)
            draws.setdefault("angle", []).append((angle.value, angle.std))
        if pair == "axes":
            for axis in range(3):
                draws.setdefault("xyz"[axis], []).append((angle.point[axis], angle.point_std[axis]))
    for name, values in draws.items():
        spread = np.std([value for value, _ in values])
        told = np.sqrt(np.mean([std**2 for _, std in values]))
        # Of 100 draws the spread itself has an error of 7 %, and blocks of neighbours add theirs.
        assert told == pytest.approx(spread, rel=0.25), name
