"""Fits of every kind beside a slow reference, whatever the position, the rotation and the unit."""

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from drawn_shapes import revolved
from scipy.optimize import least_squares
from surface_points import Array, rotation

import surfsig
from surfsig import InvalidInputError, PointCloud, Surface

FITS: dict[str, Callable[..., Surface]] = {
    "plane": surfsig.fit_plane,
    "sphere": surfsig.fit_sphere,
    "cylinder": surfsig.fit_cylinder,
    "cone": surfsig.fit_cone,
    "torus": surfsig.fit_torus,
    "circle": surfsig.fit_circle,
    "line": surfsig.fit_line,
}
SIZES = {
    "plane": (),
    "sphere": (1.0,),
    "cylinder": (1.0,),
    "cone": (1.0, 0.4),
    "torus": (0.3, 1.0),
    "circle": (1.0,),
    "line": (),
}
"""Of the true shapes, about 0 and along z: the radius, and the half angle or the major radius."""

HAS_RADIUS = ("sphere", "cylinder", "circle")


def components(kind: str, points: Array, position: Array, axis: Array, sizes: Array) -> Array:
    """Give the components of the points' distances by their formulas."""
    axis = axis / np.linalg.norm(axis)
    offset = points - position
    height = offset @ axis
    beside = offset - np.outer(height, axis)
    away = np.linalg.norm(beside, axis=1)
    if kind == "plane":
        return height
    if kind == "sphere":
        return np.asarray(np.linalg.norm(offset, axis=1) - sizes[0])
    if kind == "cylinder":
        return np.asarray(away - sizes[0])
    if kind == "cone":
        return np.asarray((away - sizes[0]) * math.cos(sizes[1]) - height * math.sin(sizes[1]))
    if kind == "torus":
        return np.asarray(np.hypot(away - sizes[1], height) - sizes[0])
    if kind == "circle":
        return np.concatenate([away - sizes[0], height])
    return beside.ravel()


Parts = tuple[Array, Array, Array]
"""A position on the plane or axis (of a curve or sphere its center), a direction, and the sizes."""


def reference_shape(kind: str, points: Array, weights: Array | None = None, fixed: str = "") -> Parts:
    """Find the least squares from the true shape on, to the last digits, by a general solver."""
    sizes = np.array(SIZES[kind])

    def parts(x: Array) -> Parts:
        axis = np.array([0.0, 0, 1]) if fixed == "axis" else np.array([x[3], x[4], 1.0])
        return x[:3], axis, sizes if fixed == "radius" else x[5:]

    def residuals(x: Array) -> Array:
        found = components(kind, points, *parts(x))
        if weights is None:
            return found
        roots = np.sqrt(weights)
        # A line's components follow each other point by point, a circle's do not.
        return np.asarray(found * (np.repeat(roots, 3) if kind == "line" else np.resize(roots, found.shape)))

    start = np.concatenate([np.zeros(5), sizes])
    found = least_squares(residuals, start, jac="3-point", xtol=1e-15, ftol=1e-15, gtol=1e-15, max_nfev=300)
    return parts(found.x)


def reference(kind: str, points: Array, weights: Array | None = None, fixed: str = "") -> tuple[Array, float]:
    """Give distances of the least squares, and its first size."""
    position, axis, sizes = reference_shape(kind, points, weights, fixed)
    return components(kind, points, position, axis, sizes), float(sizes[0]) if len(sizes) else math.nan


def sums(values: Array) -> float:
    return float((values**2).sum())


@pytest.mark.parametrize("kind", FITS)
@pytest.mark.parametrize("count", [10, 300])
@pytest.mark.parametrize("noise", [0.0, 0.001])
def test_a_fit_is_the_least_of_squares(kind: str, count: int, noise: float) -> None:
    rng = np.random.default_rng(51)
    points = revolved(rng, kind, SIZES[kind], count, arc=4.0, noise=noise)
    expected, size = reference(kind, points)
    surface = FITS[kind](points)
    assert sums(surface.distances(points)) <= sums(expected) * (1 + 1e-9) + 1e-24
    if kind in (*HAS_RADIUS, "torus"):
        assert surface.radius == pytest.approx(size, rel=1e-7)
    assert surface.kind == kind


@pytest.mark.parametrize("kind", FITS)
@pytest.mark.parametrize("unit", [1e-6, 1e3])
def test_a_fit_moves_with_the_points(kind: str, unit: float) -> None:
    """Rotated, 1e6 times the size away, in micrometres and kilometres: the same shape to 1e-7 of its size."""
    rng = np.random.default_rng(52)
    points = revolved(rng, kind, SIZES[kind], 60, arc=2.5, noise=0.001)
    turned, away = rotation(rng), unit * np.array([1e6, -5e5, 3e5])
    here = FITS[kind](points)
    there = FITS[kind](unit * points @ turned.T + away)
    assert there.fitted_radius / unit == pytest.approx(here.fitted_radius, rel=1e-7, nan_ok=True)
    assert there.major_radius / unit == pytest.approx(here.major_radius, rel=1e-7, nan_ok=True)
    assert there.half_angle == pytest.approx(here.half_angle, rel=1e-7, nan_ok=True)
    np.testing.assert_allclose((there.center - away) / unit, turned @ here.center, atol=1e-7)
    if kind != "sphere":
        assert np.linalg.norm(np.cross(there.axis, turned @ here.axis)) < 1e-7
    assert there.deviation / unit == pytest.approx(here.deviation, rel=1e-6)
    assert there.form_error / unit == pytest.approx(here.form_error, rel=1e-6)


@pytest.mark.parametrize("kind", FITS)
@pytest.mark.parametrize("unit", [1e-6, 1.0, 1e3])
@pytest.mark.parametrize("count", [8, 40])
def test_parameters_are_those_of_the_reference(kind: str, unit: float, count: int) -> None:
    """Of few points, 1e6 times the size away, in micrometres and kilometres: to 1e-7, as metrologists ask."""
    rng = np.random.default_rng(60)
    points = revolved(rng, kind, SIZES[kind], count, arc=3.5, noise=0.001)
    position, axis, sizes = reference_shape(kind, points)
    turned, away = rotation(rng), unit * np.array([1e6, -5e5, 3e5])
    scan = unit * points @ turned.T + away
    surface = FITS[kind](scan)
    found = (
        surface.fitted_radius / unit,
        surface.half_angle if kind == "cone" else surface.major_radius / unit,
    )
    direction = turned @ axis / np.linalg.norm(axis)
    if kind == "cone":
        # The reference's radius is that at its own position.
        beside = turned @ position + away / unit - surface.point / unit
        found = (found[0] + float(beside @ direction) * math.tan(found[1]), found[1])
    for value, expected in zip(found, sizes, strict=False):
        assert value == pytest.approx(expected, rel=1e-7)
    if kind != "sphere":
        assert np.linalg.norm(np.cross(surface.axis, direction)) < 1e-7
    if kind in ("sphere", "torus", "circle"):
        np.testing.assert_allclose((surface.center - away) / unit, turned @ position, atol=1e-7)
    expected_distances = components(kind, points, position, axis, sizes)
    if kind in ("circle", "line"):
        shape = (2, count) if kind == "circle" else (count, 3)
        expected_distances = np.linalg.norm(
            expected_distances.reshape(shape), axis=0 if kind == "circle" else 1
        )
    signs = 1.0 if kind != "plane" else math.copysign(1, float(surface.axis @ direction))
    np.testing.assert_allclose(signs * surface.distances(scan) / unit, expected_distances, atol=1e-7)


@pytest.mark.parametrize("kind", FITS)
def test_many_points_have_the_least_squares_of_all(kind: str) -> None:
    """Most steps are made with a sample; the last ones are not."""
    points = revolved(np.random.default_rng(61), kind, SIZES[kind], 20_000, arc=2.5, noise=0.01)
    surface = FITS[kind](points)
    expected, _ = reference(kind, points)
    squares = surface.distances(points) ** 2
    assert squares.sum() == pytest.approx(sums(expected), rel=1e-12)
    # Half of the points are given twice, which is a weight of two.
    weights = np.where(np.arange(20_000) % 2, 2.0, 1.0)
    weighted = FITS[kind](points, weights=weights)
    repeated = FITS[kind](np.concatenate([points, points[1::2]]))
    np.testing.assert_allclose(weighted.distances(points), repeated.distances(points), atol=1e-9)


def test_points_without_weight_are_not_looked_at() -> None:
    """Far away, and a thousand times as many as the others."""
    rng = np.random.default_rng(62)
    points = revolved(rng, "sphere", (1.0,), 30, arc=6.0, noise=0.001)
    far = rng.normal(scale=100, size=(30_000, 3))
    weights = np.repeat([1.0, 0.0], [len(points), len(far)])
    alone, among = (
        surfsig.fit_sphere(points),
        surfsig.fit_sphere(np.concatenate([points, far]), weights=weights),
    )
    assert among.radius == alone.radius
    np.testing.assert_allclose(among.covariance, alone.covariance, rtol=1e-12)


@pytest.mark.parametrize("kind", FITS)
def test_weights_count_like_repeated_points(kind: str) -> None:
    rng = np.random.default_rng(53)
    points = revolved(rng, kind, SIZES[kind], 40, arc=5.0, noise=0.01)
    weights = rng.integers(0, 4, 40)
    repeated = FITS[kind](np.repeat(points, weights, axis=0))
    weighted = FITS[kind](points, weights=7.0 * weights)
    np.testing.assert_allclose(weighted.distances(points), repeated.distances(points), atol=1e-9)
    expected, _ = reference(kind, points, weights.astype(float))
    squares = (expected.reshape((-1, 40) if kind == "circle" else (40, -1)) ** 2).sum(
        axis=0 if kind == "circle" else 1
    )
    assert weights @ weighted.distances(points) ** 2 <= weights @ squares * (1 + 1e-9)


@pytest.mark.parametrize("kind", HAS_RADIUS)
def test_a_radius_that_is_known_is_kept(kind: str) -> None:
    points = revolved(np.random.default_rng(54), kind, (1.0,), 80, arc=1.2, noise=0.01)
    expected, _ = reference(kind, points, fixed="radius")
    surface = FITS[kind](points, radius=1.0)
    assert surface.radius == 1.0
    assert surface.radius_std == 0.0
    assert surface.interval == (1.0, 1.0)
    assert sums(surface.distances(points)) <= sums(expected) * (1 + 1e-9)
    free = FITS[kind](points)
    # What is known makes the rest surer.
    assert np.trace(surface.covariance) < np.trace(free.covariance)


@pytest.mark.parametrize("kind", [kind for kind in FITS if kind != "sphere"])
def test_an_axis_that_is_known_is_kept(kind: str) -> None:
    points = revolved(np.random.default_rng(55), kind, SIZES[kind], 80, arc=3.0, noise=0.01)
    expected, _ = reference(kind, points, fixed="axis")
    surface = FITS[kind](points, axis=[0, 0, 5])
    np.testing.assert_array_equal(surface.axis, [0, 0, 1])
    assert (surface.axis_std == 0).all()
    assert sums(surface.distances(points)) <= sums(expected) * (1 + 1e-9)


@pytest.mark.parametrize("kind", ["circle", "line", "cone", "torus"])
def test_errors_are_calibrated(kind: str) -> None:
    rng = np.random.default_rng(56)
    # Of 100 draws the spread has an error of 7 %: the limits below are more than three of it away.
    found = [FITS[kind](revolved(rng, kind, SIZES[kind], 400, arc=4.0, noise=0.01)) for _ in range(100)]
    if kind == "line":
        values, errors = [[s.axis[0] for s in found], [s.axis_std[0] for s in found]]
    elif kind == "cone":
        values, errors = [[s.half_angle for s in found], [s.half_angle_std for s in found]]
    else:
        values, errors = [[s.radius for s in found], [s.radius_std for s in found]]
    assert 0.75 < np.std(values) / math.sqrt(np.mean(np.square(errors))) < 1.3
    assert np.mean([s.deviation for s in found]) == pytest.approx(0.01, rel=0.03)


def test_form_errors_are_peak_to_valley() -> None:
    turn = 2 * math.pi * np.arange(12) / 12
    radii = 1 + 0.01 * np.cos(3 * turn)
    ring = np.column_stack([radii * np.cos(turn), radii * np.sin(turn), 0.003 * np.cos(turn * 4)])
    circle = surfsig.fit_circle(ring)
    assert circle.form_error == pytest.approx(0.02, rel=1e-3)
    points = np.array([[0, 0, 0], [1, 0.1, 0], [2, -0.1, 0], [3, 0.1, 0], [4, -0.1, 0], [5, 0, 0]])
    line = surfsig.fit_line(points)
    assert line.form_error == pytest.approx(2 * line.distances(points).max())


@pytest.mark.parametrize(
    ("fit", "options", "message"),
    [
        (surfsig.fit_circle, {"weights": [1.0]}, "weights must be one for each of the 9 points"),
        (surfsig.fit_circle, {"weights": [-1.0] * 9}, "weights must be finite and not below 0"),
        (surfsig.fit_circle, {"weights": [0.0] * 9}, "one weight at least"),
        (surfsig.fit_circle, {"weights": "many"}, "weights must be numbers"),
        (surfsig.fit_circle, {"weights": [1.0] * 3 + [0.0] * 6}, "at least 4 points, not 3"),
        (surfsig.fit_circle, {"radius": 0}, "radius must be a finite number above 0"),
        (surfsig.fit_cone, {"radius": 1}, "a cone keeps none"),
        (surfsig.fit_line, {"axis": [0, 0]}, "axis must be three numbers"),
        (surfsig.fit_line, {"axis": [0, 0, 0]}, "longer than 0"),
        (surfsig.fit_line, {"axis": "up"}, "axis must be three numbers"),
        (surfsig.fit_plane, {"criterion": "largest"}, "criterion must be"),
        (surfsig.fit_plane, {"criterion": "minimum_zone", "robust": True}, "a minimum zone takes neither"),
    ],
)
def test_what_has_no_meaning_is_refused(
    fit: Callable[..., Surface], options: dict[str, Any], message: str
) -> None:
    points = [[math.cos(t), math.sin(t), 0.1 * t] for t in range(9)]
    with pytest.raises(InvalidInputError, match=message):
        fit(points, **options)


@pytest.mark.parametrize(
    ("kind", "points"),
    [
        ("circle", [[i, 2 * i, 3 * i] for i in range(9)]),
        ("line", [[1, 2, 3]] * 9),
        ("line", [[1, 2, 3], [2, 2, 2]]),
        ("cone", [[1, 2, 3]] * 9),
        ("torus", [[i, 2 * i, 3 * i] for i in range(9)]),
    ],
)
def test_points_that_determine_no_shape_are_refused(kind: str, points: list[list[float]]) -> None:
    with pytest.raises(InvalidInputError, match=f"determine no {kind}|a {kind} takes at least"):
        FITS[kind](points)


@pytest.mark.parametrize("fit", [surfsig.fit_cylinder, surfsig.fit_circle])
def test_where_noise_hides_the_sagitta_no_radius_is_told(fit: Callable[..., Surface]) -> None:
    """Noise of a tenth of the radius, an arc of 30 degrees: never an interval that leaves the radius out."""
    rng = np.random.default_rng(57)
    kind = "circle" if fit is surfsig.fit_circle else "cylinder"
    told, refused = [], 0
    for _ in range(40):
        points = revolved(rng, kind, (1.0,), 200, arc=math.radians(30), noise=0.1, thickness=True)
        try:
            surface = fit(points)
        except InvalidInputError:
            refused += 1
            continue
        low, high = surface.interval
        if surface.radius_determined:
            told.append(low <= 1 <= high)
        else:
            assert math.isnan(surface.radius)
            assert surface.fitted_radius > 0
            assert high == math.inf
            assert "radius not determined" in repr(surface)
    assert len(told) - sum(told) <= 2
    assert len(told) + refused < 10


def test_a_large_error_gives_an_interval_of_the_curvature() -> None:
    points = revolved(np.random.default_rng(58), "cylinder", (1.0,), 200, arc=0.5, noise=0.01)
    surface = surfsig.fit_cylinder(points)
    low, high = surface.interval
    assert surface.radius_determined
    assert low < 1 < high < math.inf
    assert 1 / low - 1 / surface.radius == pytest.approx(1 / surface.radius - 1 / high)


@pytest.mark.parametrize("kind", ["circle", "cone", "torus"])
def test_a_shape_grows_from_a_place(kind: str) -> None:
    rng = np.random.default_rng(59)
    points = revolved(rng, kind, SIZES[kind], 3000, arc=2 * math.pi, noise=0.002)
    floor = np.column_stack([rng.uniform(-3, 3, (3000, 2)), np.full(3000, -2.0)])
    cloud = PointCloud(np.concatenate([points, floor]))
    surface = FITS[kind](cloud, near=points[0])
    assert (surface.members < 3000).all()
    assert surface.count > 2500
