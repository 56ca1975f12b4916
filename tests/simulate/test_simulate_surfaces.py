"""Rays against a slow, independent reference; normals and curvatures against formulas and differences."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from surfsig import simulate as sim
from surfsig.errors import InvalidInputError

WAVY = sim.HeightField.random(7, size=(0.08, 0.06), rms=0.003, wavelengths=(0.02, 0.06))
REACH = 0.4  # metres from a ray's origin that the reference looks at
SOLIDS: list[Any] = [
    sim.Plane(),
    sim.Rectangle((0.08, 0.05)),
    sim.Sphere(0.03),
    sim.Cylinder(0.02, 0.07),
    sim.Cone(0.03, 0.05),
    sim.Cone(0.03, 0.04, 0.01),
    sim.Cone(0.01, 0.04, 0.03),
    sim.Box((0.05, 0.03, 0.07)),
    sim.Ellipsoid((0.03, 0.02, 0.015)),
    WAVY,
]


def rays(seed: int, n: int, spread: float = 0.03) -> tuple[np.ndarray, np.ndarray]:
    """Rays from a sphere of 0.2 m, aimed near the origin."""
    rng = np.random.default_rng(seed)
    start = rng.normal(size=(n, 3))
    start *= 0.2 / np.linalg.norm(start, axis=1, keepdims=True)
    aim = rng.normal(0.0, spread, (n, 3))
    return start, (aim - start) * rng.uniform(0.5, 3.0, (n, 1))


def in_domain(surface: Any, points: np.ndarray) -> np.ndarray:
    size = getattr(surface, "size", None)
    if isinstance(surface, sim.Rectangle | sim.HeightField) and size is not None:
        return np.asarray((np.abs(points[:, :2]) <= np.array(size) / 2).all(axis=1))
    return np.ones(len(points), dtype=bool)


def first_by_bisection(surface: Any, origin: np.ndarray, direction: np.ndarray) -> float:
    """First sign change of the implicit function among 4,000 samples of the ray, bisected."""
    t = np.linspace(0.0, REACH / np.linalg.norm(direction), 4001)
    value = surface.implicit(origin + t[:, None] * direction)
    for i in np.flatnonzero(np.sign(value[:-1]) != np.sign(value[1:])):
        low, high, sign = t[i], t[i + 1], np.sign(value[i])
        for _ in range(60):
            middle = (low + high) / 2
            if np.sign(surface.implicit((origin + middle * direction)[None])[0]) == sign:
                low = middle
            else:
                high = middle
        if in_domain(surface, (origin + low * direction)[None])[0]:
            return float(low)
    return np.inf


@pytest.mark.parametrize("surface", SOLIDS, ids=lambda s: type(s).__name__)
def test_first_hit_agrees_with_bisection(surface: Any) -> None:
    origins, directions = rays(3, 400)
    # A pose of no symmetry, and rays given in the scene.
    placed = sim.Placed(surface, sim.pose((0.01, -0.02, 0.005), sim.turn((1.0, -2.0, 0.5), 1.1)))
    to_scene = placed.pose[:3, :3].T
    hits = sim.Scene([placed]).cast(sim.transform_points(placed.pose, origins), directions @ to_scene)
    expected = np.array([first_by_bisection(surface, o, d) for o, d in zip(origins, directions, strict=True)])
    reach = REACH / np.linalg.norm(directions, axis=1)
    hit = np.where(hits.t < reach, hits.t, np.inf)
    # The reference steps over chords shorter than 0.1 mm: of 400 rays, two at the most.
    disagree = np.isfinite(expected) != np.isfinite(hit)
    assert disagree.sum() <= 2
    both = np.isfinite(expected) & np.isfinite(hit)
    assert both.sum() > 80
    np.testing.assert_allclose(hits.t[both], expected[both], rtol=0, atol=1e-12)
    assert np.abs(placed.implicit(hits.points[both])).max() < 1e-12
    assert (np.einsum("ij,ij->i", hits.normals[both], (directions @ to_scene)[both]) < 0.0).all()


@pytest.mark.parametrize("surface", SOLIDS, ids=lambda s: type(s).__name__)
def test_normals_are_the_implicit_functions_gradient(surface: Any) -> None:
    origins, directions = rays(4, 500)
    hits = sim.Scene([sim.Placed(surface)]).cast(origins, directions)
    points = hits.points[np.isfinite(hits.t)]
    step = 1e-6
    gradient = np.stack(
        [
            (surface.implicit(points + d) - surface.implicit(points - d)) / (2 * step)
            for d in step * np.eye(3)
        ],
        axis=1,
    )
    gradient /= np.linalg.norm(gradient, axis=1, keepdims=True)
    error = np.linalg.norm(surface.normals(points) - gradient, axis=1)
    # Within a step of an edge the difference quotient mixes two faces.
    assert np.mean(error < 1e-6) > 0.995


@pytest.mark.parametrize(
    ("surface", "k1", "k2"),
    [
        (sim.Plane(), 0.0, 0.0),
        (sim.Sphere(0.025), 40.0, 40.0),
        (sim.Cylinder(0.02, 1.0, capped=False), 50.0, 0.0),
        (sim.Box((0.05, 0.03, 0.07)), 0.0, 0.0),
    ],
)
def test_constant_curvatures_from_outside(surface: Any, k1: float, k2: float) -> None:
    origins, directions = rays(5, 300)
    outside = surface.implicit(origins) > 0.0
    hits = sim.Scene([sim.Placed(surface)]).cast(origins[outside], directions[outside])
    seen = hits.curvatures[np.isfinite(hits.t)]
    assert len(seen) > 50
    np.testing.assert_allclose(seen, np.tile((k1, k2), (len(seen), 1)), rtol=1e-15)


def test_cone_curvature_is_that_of_its_normal_section() -> None:
    cone = sim.Cone(0.03, 0.04, 0.01)
    height = 0.016
    radius = 0.03 - 0.5 * height
    k1, k2 = cone.curvatures(np.array([[0.6 * radius, 0.8 * radius, height]]))[0]
    # Meusnier: curvature of the parallel circle times the cosine between its plane and the normal.
    assert k1 == pytest.approx(np.cos(np.arctan(0.5)) / radius, rel=1e-12)
    assert k2 == 0.0


def test_height_field_curvatures_from_finite_differences() -> None:
    xy = np.random.default_rng(1).uniform(-0.03, 0.03, (50, 2))
    e, ex, ey = 1e-4, np.array([1e-4, 0.0]), np.array([0.0, 1e-4])
    h = WAVY.heights
    hx, hy = (h(xy + ex) - h(xy - ex)) / (2 * e), (h(xy + ey) - h(xy - ey)) / (2 * e)
    hxx = (h(xy + ex) - 2 * h(xy) + h(xy - ex)) / e**2
    hyy = (h(xy + ey) - 2 * h(xy) + h(xy - ey)) / e**2
    hxy = (h(xy + ex + ey) - h(xy + ex - ey) - h(xy - ex + ey) + h(xy - ex - ey)) / (4 * e**2)
    first = np.stack([1 + hx**2, hx * hy, hx * hy, 1 + hy**2], axis=1).reshape(-1, 2, 2)
    second = (
        np.stack([hxx, hxy, hxy, hyy], axis=1).reshape(-1, 2, 2) / np.sqrt(1 + hx**2 + hy**2)[:, None, None]
    )
    expected = -np.sort(np.linalg.eigvals(np.linalg.solve(first, second)).real, axis=1)
    points = np.column_stack([xy, h(xy)])
    np.testing.assert_allclose(WAVY.curvatures(points), expected, atol=0.02)
    assert np.abs(expected).max() > 50.0


def test_random_height_field_has_the_stated_rms_and_repeats() -> None:
    field = sim.HeightField.random(3, size=(1.0, 1.0), rms=0.002, wavelengths=(0.01, 0.02), count=16)
    xy = np.random.default_rng(0).uniform(-0.5, 0.5, (40_000, 2))
    assert np.sqrt(np.mean(field.heights(xy) ** 2)) == pytest.approx(0.002, rel=0.03)
    again = sim.HeightField.random(3, size=(1.0, 1.0), rms=0.002, wavelengths=(0.01, 0.02), count=16)
    other = sim.HeightField.random(4, size=(1.0, 1.0), rms=0.002, wavelengths=(0.01, 0.02), count=16)
    assert field == again
    assert field != other


def test_seen_from_inside_curvatures_change_sign() -> None:
    tube = sim.Scene([sim.Placed(sim.Cylinder(0.02, 0.1, capped=False))])
    hits = tube.cast(np.array([[0.0, 0.0, 0.01]]), np.array([[1.0, 0.0, 0.0]]))
    np.testing.assert_allclose(hits.curvatures, [[0.0, -50.0]])
    np.testing.assert_allclose(hits.normals, [[-1.0, 0.0, 0.0]])
    # Along the axis the open tube lets the ray through, the capped one does not.
    down = (np.array([[0.001, 0.0, 0.2]]), np.array([[0.0, 0.0, -1.0]]))
    assert tube.cast(*down).surface[0] == -1
    capped = sim.Scene([sim.Placed(sim.Cylinder(0.02, 0.1))]).cast(*down)
    assert capped.points[0, 2] == pytest.approx(0.05, abs=1e-15)


def test_a_hole_cut_by_a_ball_leaves_no_gap() -> None:
    plate = sim.Placed(sim.Box((0.1, 0.1, 0.02)), sim.pose((0.0, 0.0, -0.01)))
    ball = sim.Placed(sim.Sphere(0.02), sim.pose((0.0, 0.0, 0.012)))
    scene = sim.Scene(
        [
            sim.Placed(plate.surface, plate.pose, outside=(ball,)),
            sim.Placed(ball.surface, ball.pose, inside=(plate,)),
        ]
    )
    x = np.linspace(-0.04, 0.04, 2000)  # none on the rim itself
    origins = np.column_stack([x, np.zeros_like(x), np.full_like(x, 0.3)])
    hits = scene.cast(origins, np.tile((0.0, 0.0, -1.0), (len(x), 1)))
    rim = np.sqrt(0.02**2 - 0.012**2)
    in_hole = np.abs(x) < rim
    np.testing.assert_array_equal(hits.surface, np.where(in_hole, 1, 0))
    np.testing.assert_allclose(
        hits.points[in_hole, 2], 0.012 - np.sqrt(0.02**2 - x[in_hole] ** 2), atol=1e-15
    )
    np.testing.assert_allclose(hits.curvatures[in_hole], -50.0)
    # The cuts move with the scene.
    motion = sim.pose((0.1, 0.2, -0.3), sim.turn((0.3, 1.0, -0.2), 2.0))
    moved = scene.moved(motion).cast(
        sim.transform_points(motion, origins), np.tile((0.0, 0.0, -1.0), (len(x), 1)) @ motion[:3, :3].T
    )
    np.testing.assert_array_equal(moved.surface, hits.surface)
    np.testing.assert_allclose(moved.points, sim.transform_points(motion, hits.points), atol=1e-12)


def test_poses() -> None:
    for direction in ((0.0, 0.0, 1.0), sim.UP, (0.781, -0.499, -0.375), (1.0, 0.0, 0.0)):
        rotation = sim.facing(direction)
        expected = np.array(direction) / np.linalg.norm(direction)
        np.testing.assert_allclose(rotation @ (0.0, 0.0, 1.0), expected, atol=1e-12)
        np.testing.assert_allclose(rotation.T @ rotation, np.eye(3), atol=1e-12)
        assert np.linalg.det(rotation) == pytest.approx(1.0)
    np.testing.assert_allclose(
        sim.turn((0.0, 0.0, 2.0), np.pi / 2) @ (1.0, 0.0, 0.0), (0.0, 1.0, 0.0), atol=1e-15
    )
    placed = sim.pose((1.0, 2.0, 3.0), sim.turn((1.0, 1.0, 0.0), 0.4))
    np.testing.assert_allclose(sim.inverse(placed) @ placed, np.eye(4), atol=1e-15)


@pytest.mark.parametrize(
    "make",
    [
        lambda: sim.Sphere(0.0),
        lambda: sim.Sphere(np.nan),
        lambda: sim.Cylinder(0.1, -1.0),
        lambda: sim.Cone(0.1, 0.1, -0.1),
        lambda: sim.Box((1.0, 0.0, 1.0)),
        lambda: sim.HeightField((1.0, 1.0), ()),
        lambda: sim.HeightField.random(0, size=(1.0, 1.0), rms=1.0, wavelengths=(2.0, 1.0)),
        lambda: sim.Placed(sim.Sphere(1.0), np.diag([2.0, 1.0, 1.0, 1.0])),
        lambda: sim.Placed(sim.Sphere(1.0), np.diag([1.0, 1.0, -1.0, 1.0])),
        lambda: sim.Placed(WAVY, inside=(sim.Placed(sim.Sphere(1.0)),)),
        lambda: sim.Scene([]),
        lambda: sim.facing((0.0, 0.0, 0.0)),
        lambda: sim.Scene([sim.Placed(sim.Sphere(1.0))]).cast(np.zeros((3, 2)), np.zeros((3, 2))),
    ],
)
def test_bad_input_is_one_line(make: Any) -> None:
    with pytest.raises(InvalidInputError) as caught:
        make()
    assert "\n" not in str(caught.value)


def test_curvatures_of_an_ellipsoid_at_the_ends_of_its_axes() -> None:
    a, b, c = 0.03, 0.02, 0.015
    found = sim.Ellipsoid((a, b, c)).curvatures(np.diag([a, b, c]))
    expected = [[a / c**2, a / b**2], [b / c**2, b / a**2], [c / b**2, c / a**2]]
    np.testing.assert_allclose(found, expected, rtol=1e-9)
