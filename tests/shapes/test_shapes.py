"""Fitted spheres, cylinders and planes: exact, calibrated, and robust."""

import math
from collections.abc import Callable

import numpy as np
import pytest
from drawn_shapes import cylinder, plane, sphere
from numpy.typing import NDArray
from scipy.stats import t as students_t
from surface_points import UTM, Array, rotation

import surfsig
from surfsig import InvalidInputError, PointCloud, fit_cylinder, fit_plane, fit_sphere

DRAWS = 300


@pytest.mark.parametrize("place", [np.zeros(3), UTM])
@pytest.mark.parametrize("unit", [1e-3, 1.0, 1e3])
def test_shapes_are_exact_without_noise(unit: float, place: Array) -> None:
    rng = np.random.default_rng(1)
    turned = rotation(rng)
    # Coordinates of UTM have no digits below a nanometre.
    rounding = 1e-9 if place.any() else 0.0
    on_ball = PointCloud(unit * sphere(rng, 0.7) @ turned.T, origin=place)
    ball = fit_sphere(on_ball)
    assert ball.kind == "sphere"
    assert np.isnan(ball.axis).all()
    assert ball.radius == pytest.approx(unit, rel=1e-9)
    np.testing.assert_allclose(ball.center, place, rtol=0, atol=1e-8 * unit + rounding)
    on_pipe = PointCloud(unit * cylinder(rng, 1.5) @ turned.T, origin=place)
    pipe = fit_cylinder(on_pipe)
    assert pipe.radius == pytest.approx(unit, rel=1e-8)
    axis = turned[:, 2] * np.sign(turned[2, 2])
    np.testing.assert_allclose(pipe.axis, axis, atol=1e-8)
    assert np.linalg.norm(np.cross(pipe.point - place, axis)) < 1e-8 * unit + rounding
    on_floor = PointCloud(unit * plane(rng) @ turned.T, origin=place)
    floor = fit_plane(on_floor)
    assert math.isnan(floor.radius)
    assert math.isnan(floor.radius_std)
    np.testing.assert_allclose(floor.axis, axis, atol=1e-12)
    assert abs((floor.point - place) @ axis) < 1e-9 * unit + rounding
    for shape, cloud in ((ball, on_ball), (pipe, on_pipe), (floor, on_floor)):
        assert shape.count == 400
        assert shape.rms < 1e-9 * unit + rounding
        assert np.abs(shape.distances(cloud)).max() < 1e-8 * unit + rounding


def test_it_is_the_orthogonal_distance_that_is_least() -> None:
    """The sum of squares is stationary where the fit says, and the residuals are the distances."""
    rng = np.random.default_rng(2)
    points = sphere(rng, 0.0, 0.05)
    ball = fit_sphere(points)
    residuals = np.linalg.norm(points - ball.center, axis=1) - ball.radius
    np.testing.assert_allclose(ball.distances(points), residuals, atol=1e-12)
    assert ball.rms == pytest.approx(math.sqrt((residuals**2).mean()))

    def cost(x: Array) -> float:
        return float(((np.linalg.norm(points - x[:3], axis=1) - x[3]) ** 2).sum())

    best = np.array([*ball.center, ball.radius])
    for step in 1e-4 * np.concatenate([np.eye(4), -np.eye(4)]):
        assert cost(best + step) > cost(best)


Draw = Callable[[np.random.Generator, float, float], Array]
ARCS: list[tuple[Callable[..., surfsig.Surface], Draw, float]] = [
    (fit_sphere, sphere, -1.0),
    (fit_sphere, sphere, 0.0),
    (fit_sphere, sphere, 0.8),
    (fit_cylinder, cylinder, 2 * np.pi),
    (fit_cylinder, cylinder, np.pi),
    (fit_cylinder, cylinder, np.pi / 2),
]


QUICK = {(-1.0, 0.01), (0.0, 0.03), (np.pi, 0.01)}
"""Of the arcs and noises below those whose draws are always made."""
EXTREMES = (0.001, 0.03)
"""Noises. The draws are the same but for their scale: those between tell hardly anything of their own."""


@pytest.mark.parametrize(
    ("fit", "draw", "extent", "noise"),
    [
        pytest.param(*arc, noise, marks=() if (arc[2], noise) in QUICK else pytest.mark.slow)
        for arc in ARCS
        for noise in (0.001, 0.01, 0.03)
        if noise in EXTREMES or (arc[2], noise) in QUICK
    ],
)
def test_standard_errors_of_radii_are_calibrated(
    fit: Callable[..., surfsig.Surface], draw: Draw, extent: float, noise: float
) -> None:
    rng = np.random.default_rng(4)
    shapes = [fit(draw(rng, extent, noise)) for _ in range(DRAWS)]
    radii = np.array([shape.radius for shape in shapes])
    errors = np.array([shape.radius_std for shape in shapes])
    assert abs(radii.mean() - 1) < 0.2 * radii.std()
    assert 0.9 < math.sqrt((errors**2).mean()) / radii.std() < 1.1
    # Standard errors have few degrees of freedom: a ratio is Student's, whose deviation is a little above 1.
    freedom = np.mean([shape.degrees_of_freedom for shape in shapes])
    assert 10 < freedom < 32
    assert 0.9 < ((radii - 1) / errors).std() / students_t.std(freedom) < 1.1
    inside = [shape.interval[0] <= 1 <= shape.interval[1] for shape in shapes]
    assert 0.92 < np.mean(inside) < 0.98


def cartesian_covariance(surface: surfsig.Surface) -> Array:
    """Give the covariance of point x, y, z; axis x, y, z; and the radius, where there is one."""
    derivatives = np.zeros((7, len(surface.parameters)))
    first, second = surface.across
    directions = {
        "shift": surface.axis,
        "shift_1": first,
        "shift_2": second,
        "tilt_1": first,
        "tilt_2": second,
    }
    for column, name in enumerate(surface.parameters):
        if name == "radius":
            derivatives[6, column] = 1.0
        else:
            rows = slice(0, 3) if name.startswith("shift") else slice(3, 6)
            derivatives[rows, column] = directions[name]
    return np.asarray(derivatives @ surface.covariance @ derivatives.T)


def test_the_covariance_of_all_values_is_calibrated() -> None:
    rng = np.random.default_rng(5)
    found = [fit_cylinder(cylinder(rng, np.pi, 0.01)) for _ in range(DRAWS)]
    values = np.array([[*shape.point[:2], *shape.axis[:2], shape.radius] for shape in found])
    kept = [0, 1, 3, 4, 6]
    expected = np.mean([cartesian_covariance(shape) for shape in found], axis=0)
    assert found[0].covariance.shape == (5, 5)
    # A point has no error along the axis, and an axis none along itself.
    assert abs(expected[2, 2]) + abs(expected[5, 5]) < 1e-3 * expected[4, 4]
    measured = np.cov(values.T)
    scale = np.sqrt(np.diag(measured))
    np.testing.assert_allclose(
        expected[np.ix_(kept, kept)] / np.outer(scale, scale), measured / np.outer(scale, scale), atol=0.2
    )


@pytest.mark.slow
def test_the_covariance_of_a_plane_is_calibrated() -> None:
    rng = np.random.default_rng(6)
    found = [fit_plane(plane(rng, 0.01)) for _ in range(DRAWS)]
    expected = np.mean([cartesian_covariance(shape) for shape in found], axis=0)
    assert found[0].covariance.shape == (3, 3)
    # Height: noise / sqrt(n). Slope: that over the deviation of x, 1 / sqrt(3).
    assert math.sqrt(expected[2, 2]) == pytest.approx(0.01 / 20, rel=0.05)
    assert math.sqrt(expected[3, 3]) == pytest.approx(0.01 / 20 * math.sqrt(3), rel=0.05)
    assert np.std([shape.axis[0] for shape in found]) == pytest.approx(math.sqrt(expected[3, 3]), rel=0.1)


def independent_error(points: Array, shape: surfsig.Surface) -> float:
    """Give the standard error of a sphere's radius that points without correlation would have."""
    normals = (points - shape.center) / np.linalg.norm(points - shape.center, axis=1)[:, None]
    jacobian = np.column_stack([normals, np.ones(len(points))])
    return shape.rms * math.sqrt(np.linalg.inv(jacobian.T @ jacobian)[3, 3])


def patches_of(points: Array, levels: int) -> NDArray[np.intp]:
    """Give each point the number of its patch, of 2^levels that are cut across their longest extent.

    The points of all patches are as many.
    """
    order = np.arange(len(points))[None]
    for _ in range(levels):
        parts = points[order]
        axis = np.ptp(parts, axis=1).argmax(axis=1)
        along = np.take_along_axis(parts, axis[:, None, None], axis=2)[..., 0]
        order = np.take_along_axis(order, along.argsort(axis=1), axis=1).reshape(2 * len(order), -1)
    patches = np.empty(len(points), np.intp)
    patches[order] = np.arange(len(order))[:, None]
    return patches


@pytest.mark.slow
def test_points_that_err_alike_do_not_narrow_the_interval() -> None:
    """The points of a small patch have one error in common: their number says nothing, the blocks do."""
    rng = np.random.default_rng(7)
    inside, naive = [], []
    for _ in range(DRAWS):
        points = sphere(rng, 0.0, count=3072)
        points *= 1 + 0.01 * rng.normal(size=256)[patches_of(points, 8), None]
        shape = fit_sphere(points)
        inside.append(shape.interval[0] <= 1 <= shape.interval[1])
        naive.append(abs(shape.radius - 1) < 1.96 * independent_error(points, shape))
    assert np.mean(naive) < 0.5
    assert 0.9 < np.mean(inside) < 0.99


@pytest.mark.slow
def test_noise_along_the_ray_keeps_the_interval_honest() -> None:
    """A scanner far up errs along z: much at the top of the sphere, hardly at its rim."""
    rng = np.random.default_rng(8)
    shapes = []
    for _ in range(DRAWS):
        points = sphere(rng, 0.2)
        points[:, 2] += 0.01 * rng.normal(size=len(points))
        shapes.append(fit_sphere(points))
    spread = np.std([shape.radius for shape in shapes])
    assert 0.9 < np.sqrt(np.mean([shape.radius_std**2 for shape in shapes])) / spread < 1.2
    assert np.mean([shape.interval[0] <= 1 <= shape.interval[1] for shape in shapes]) > 0.93


def lidar(rng: np.random.Generator, distance: float) -> Array:
    """Give a sphere of radius 0.3 as a lidar of 16 lines sees it, whose errors are alike along each line."""
    azimuth = np.radians(np.arange(-10, 10, 0.2))
    memory = math.exp(-1 / 20)
    lines = []
    for elevation in np.radians(np.arange(-15, 16, 2) + rng.uniform(-1, 1)):
        rays = np.column_stack(
            [
                np.cos(azimuth) * math.cos(elevation),
                np.sin(azimuth) * math.cos(elevation),
                np.full(len(azimuth), math.sin(elevation)),
            ]
        )
        along = rays[:, 0] * distance
        hit = along**2 - distance**2 + 0.3**2
        drift = [rng.normal()]
        for _ in azimuth[1:]:
            drift.append(memory * drift[-1] + math.sqrt(1 - memory**2) * rng.normal())
        error = 0.007 * rng.normal(size=len(azimuth)) + 0.006 * np.array(drift)
        ranges = along - np.sqrt(np.maximum(hit, 0)) + error
        lines.append((rays * ranges[:, None])[hit > 0])
    return np.concatenate(lines)


@pytest.mark.slow
def test_intervals_of_lidar_scans_hold_the_radius_far_more_often_than_naive_ones() -> None:
    rng = np.random.default_rng(15)
    inside, naive = [], []
    for _ in range(DRAWS):
        points = lidar(rng, rng.uniform(2.4, 3))
        shape = fit_sphere(points, robust=True)
        inside.append(shape.interval[0] <= 0.3 <= shape.interval[1])
        naive.append(abs(shape.radius - 0.3) < 1.96 * independent_error(points[shape.members], shape))
    assert np.mean(inside) > 0.8
    assert np.mean(naive) < 0.7


@pytest.mark.parametrize(
    ("fit", "points"),
    [
        (fit_sphere, sphere(np.random.default_rng(11), 0.0, 0.002)),
        (fit_cylinder, cylinder(np.random.default_rng(11), np.pi, 0.002)),
        (fit_plane, plane(np.random.default_rng(11), 0.002)),
    ],
)
def test_robust_fits_leave_out_strays(fit: Callable[..., surfsig.Surface], points: Array) -> None:
    rng = np.random.default_rng(12)
    strays = rng.uniform(-1, 1, (44, 3))
    clean, found = fit(points), fit(np.concatenate([points, strays]), robust=True)
    assert (found.members < 400).sum() > 0.98 * 400
    assert (found.members >= 400).sum() < 0.1 * 44
    np.testing.assert_allclose(found.point, clean.point, atol=0.002)
    if fit is not fit_plane:
        assert abs(found.radius - 1) < 4 * found.radius_std


def test_points_that_are_not_finite_do_not_count() -> None:
    points = sphere(np.random.default_rng(13), 0.0, 0.01)
    holes = np.insert(points, [0, 7], np.nan, axis=0)
    whole, found = fit_sphere(points), fit_sphere(holes)
    assert found.radius == whole.radius
    assert sorted({*range(len(holes))} - {*found.members.tolist()}) == [0, 8]
    assert list(np.flatnonzero(np.isnan(found.distances(holes)))) == [0, 8]


def test_a_representation_says_the_radius_and_its_error() -> None:
    shape = fit_sphere(sphere(np.random.default_rng(14), -1.0, 0.01))
    assert repr(shape).startswith("Surface(sphere, radius=0.9995")
    assert "400 points" in repr(shape)


def test_as_many_points_as_unknowns_and_one_have_no_error_that_is_known() -> None:
    """Four points of a circle and one beside it: without that one there is no sphere."""
    shape = fit_sphere([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1]])
    assert shape.radius == pytest.approx(1)
    assert math.isnan(shape.radius_std)


CIRCLE = [[math.cos(t), math.sin(t), 0.0] for t in range(9)]


@pytest.mark.parametrize(
    ("fit", "points", "message"),
    [
        (fit_sphere, [[0, 0, 0]] * 4, "a sphere takes at least 5 points, not 4"),
        (fit_cylinder, np.full((9, 3), np.nan), "a cylinder takes at least 6 points, not 0"),
        (fit_sphere, [[1, 2, 3]] * 9, "the points determine no sphere"),
        (fit_sphere, CIRCLE, "the points determine no sphere"),
        (fit_plane, [[i, 2 * i, 3 * i] for i in range(9)], "the points determine no plane"),
        (fit_plane, np.full((9, 3), 1e200), "coordinates must be within"),
        (fit_plane, np.zeros((9, 2)), "the shape"),
    ],
)
def test_what_cannot_be_fitted_is_refused(
    fit: Callable[..., surfsig.Surface], points: NDArray[np.float64], message: str
) -> None:
    for robust in (False, True):
        with pytest.raises(InvalidInputError, match=message):
            fit(points, robust=robust)
