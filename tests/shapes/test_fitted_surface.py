"""One type for every fitted surface: its values, its errors in one convention, its free directions."""

import math
import warnings
from collections.abc import Callable
from typing import Any, get_args

import numpy as np
import pytest
from drawn_shapes import cylinder, plane, sphere
from surface_points import Array

import surfsig
from surfsig import Surface, _surfsig, fit_cylinder, fit_plane, fit_sphere
from surfsig.geometry import about, transform_points
from surfsig.shapes.measured import measured_surface
from surfsig.shapes.surface import CURVE_KINDS, KINDS, PARAMETERS, Kind, ShapeKind

DRAWN: dict[str, Array] = {
    "sphere": sphere(np.random.default_rng(41), 0.2, 0.01),
    "cylinder": cylinder(np.random.default_rng(42), 2.0, 0.01),
    "plane": plane(np.random.default_rng(43), 0.01),
}
FITS: dict[str, Callable[..., Surface]] = {
    "sphere": fit_sphere,
    "cylinder": fit_cylinder,
    "plane": fit_plane,
}

# Computed before the two types of fitted surfaces became one; lengths in the points' unit.
FITTED: dict[str, dict[str, Any]] = {
    "sphere": {
        "point": [0.001086861885219, 0.00057068670231394, -0.00025507355655141],
        "point_std": [7.676075700841995e-4, 8.90792072113998e-4, 1.9926431071234977e-3],
        "radius": 0.9999688555448881,
        "radius_std": 0.001159098699913214,
        "interval": [0.9975195410496044, 1.002418170040172],
        "degrees_of_freedom": 16.65801834454908,
        "rms": 0.009915924708415454,
    },
    "cylinder": {
        "point": [0.0010916051539408, 0.00142578836097585, 0.02456153903129661],
        "point_std": [4.396555165377674e-3, 1.3172803000051486e-3, 7.453136179774391e-6],
        "axis": [1.697571518133081e-03, -8.098461824870960e-04, 9.999982311984864e-01],
        "axis_std": [1.0071626857834264e-3, 1.9716771598390415e-3, 1.89612702394327e-6],
        "radius": 0.9985723988824993,
        "radius_std": 0.004026657853433803,
        "interval": [0.9901333892066946, 1.007011408558304],
        "degrees_of_freedom": 18.637198334406502,
        "rms": 0.010087206917283825,
    },
    "plane": {
        "point": [0.03871686771738238, -0.04296090857731899, -0.00048753732886911],
        "point_std": [2.9890293493970906e-7, 2.67460069828776e-7, 4.997686662150673e-4],
        "axis": [5.980823906802267e-04, 5.351675720646921e-04, 9.999996779465099e-01],
        "axis_std": [8.291818935610543e-4, 9.450417833216279e-4, 5.676799820474825e-7],
        "degrees_of_freedom": 29.056469789722264,
        "rms": 0.009562210389313732,
    },
}
FOUND: dict[str, dict[str, Any]] = {
    "sphere": {
        "center": [0.0012750836692526496, 0.00023350038715546414, -6.743295433453422e-05],
        "radius": 1.0000920106646747,
        "radius_std": 0.0012388050084972623,
        "arc": 2.7542753566473994,
        "area": 5.0406670992508795,
        "degrees_of_freedom": 17.79813209099525,
        "covariance": [5.984615255571704e-07, 8.145412270229869e-07, 3.9558705078787725e-06],
    },
    "cylinder": {
        "center": [0.0010517291064806513, 0.001444811691324538, 0.0010715270527491341],
        "radius": 0.998572398883881,
        "radius_std": 0.004238587214070121,
        "arc": 1.971296346166934,
        "area": 3.8452060337473357,
        "length": 1.9992833513191155,
        "degrees_of_freedom": 18.63719833441278,
        "covariance": [2.1418007460272228e-05, 1.9226908883724597e-06, 1.1239642341672687e-06],
    },
    "plane": {
        "center": [0.03871686771738244, -0.042960908577318956, -0.0004875373288691131],
        "length": 1.9879786976174412,
        "width": 1.9854089302164137,
        "area": 3.7913072750502317,
        "degrees_of_freedom": 29.056469789722257,
        "covariance": [2.7675222228059957e-07, 7.618201430261938e-07, 9.895891723131779e-07],
    },
}


@pytest.mark.parametrize("kind", FITS)
def test_a_fit_has_the_values_that_it_always_had(kind: str) -> None:
    surface = FITS[kind](DRAWN[kind])
    for name, value in FITTED[kind].items():
        np.testing.assert_allclose(getattr(surface, name), value, rtol=1e-6, atol=1e-12, err_msg=name)
    np.testing.assert_array_equal(surface.members, np.arange(400))


@pytest.mark.parametrize("kind", FITS)
def test_a_surface_that_was_found_has_the_values_that_it_always_had(kind: Kind) -> None:
    (surface,) = surfsig.find_surfaces(DRAWN[kind], kinds=[kind], min_points=200)
    for name, value in FOUND[kind].items():
        ours = surface.covariance.diagonal()[:3] if name == "covariance" else getattr(surface, name)
        np.testing.assert_allclose(ours, value, rtol=1e-6, atol=1e-12, err_msg=name)


@pytest.mark.parametrize("kind", FITS)
def test_both_describe_the_same_points_alike(kind: Kind) -> None:
    """But for the axis's sign."""
    (found,) = surfsig.find_surfaces(DRAWN[kind], kinds=[kind], min_points=200)
    fitted = FITS[kind](DRAWN[kind][found.members])
    assert type(fitted) is type(found) is Surface
    names = ["center", "radius", "length", "width", "arc", "rms", "deviation"]
    for name in (*names, "degrees_of_freedom"):
        ours, theirs = getattr(fitted, name), getattr(found, name)
        np.testing.assert_allclose(ours, theirs, rtol=1e-5, atol=1e-7, err_msg=name)
    for name in ("center_std", "axis_std", "radius_std"):
        # A surface that was found left out the points far from it, which makes its errors a little larger.
        ours, theirs = np.atleast_1d(getattr(fitted, name)), np.atleast_1d(getattr(found, name))
        known = ours > 0
        assert (theirs[known] >= ours[known] * (1 - 1e-9)).all(), name
        assert (theirs[known] < 1.2 * ours[known]).all(), name
    np.testing.assert_allclose(abs(fitted.axis), abs(found.axis), atol=1e-7)
    # Cells of which the area is made begin at another end.
    assert fitted.area == pytest.approx(found.area, rel=0.03)
    assert fitted.to_dict().keys() == found.to_dict().keys()


def test_the_parameters_are_the_cores() -> None:
    assert {kind: len(names) for kind, names in PARAMETERS.items()} == _surfsig.KIND_PARAMETERS
    assert get_args(Kind) == KINDS == tuple(PARAMETERS)[:5]
    assert (*KINDS, *CURVE_KINDS) == get_args(ShapeKind) == tuple(PARAMETERS)


def example(kind: Kind, covariance: Array | None = None) -> Surface:
    """Give a surface with axis z at (1, 2, 3), its sizes 0.2 (tube), 0.5 (major) and 0.4 (half angle)."""
    nan = math.nan
    point = np.array([1.0, 2.0, 3.0])
    fitted: dict[str, Any] = {
        "kind": kind,
        "point": point,
        "axis": np.full(3, nan) if kind == "sphere" else np.array([0.0, 0.0, 1.0]),
        "radius": nan if kind == "plane" else 0.2,
        "major_radius": 0.5 if kind == "torus" else nan,
        "half_angle": 0.4 if kind == "cone" else nan,
        "deviation": 0.1,
        "across": np.array([[0.6, 0.8, 0.0], [0.8, -0.6, 0.0]]),
        "freedom": 9.0,
    }
    if covariance is not None:
        fitted["covariance"] = covariance
    points = np.random.default_rng(44).normal(size=(60, 3)) + point
    return measured_surface(fitted, points, np.zeros(3), np.arange(60))


@pytest.mark.parametrize("kind", KINDS)
def test_each_size_has_the_error_that_stands_in_its_row(kind: Kind) -> None:
    count = len(PARAMETERS[kind])
    surface = example(kind, np.diag(np.arange(1.0, count + 1) ** 2))
    assert len(surface.parameters) == count
    for name in ("radius", "major_radius", "half_angle"):
        error = getattr(surface, f"{name}_std")
        if name in surface.parameters:
            assert error == surface.parameters.index(name) + 1
            assert not math.isnan(getattr(surface, name))
        else:
            assert math.isnan(error)
    assert math.isnan(example(kind).radius_std)
    assert np.isnan(example(kind).covariance).all()


def test_errors_of_points_and_axes_are_those_of_shifts_and_tilts() -> None:
    """Shifts by 1 along (0.6, 0.8, 0), by 2 along (0.8, -0.6, 0), by 5 along the axis; tilts by 3 and 4."""
    along_x, along_y = math.hypot(0.6, 2 * 0.8), math.hypot(0.8, 2 * 0.6)
    tilt_x, tilt_y = math.hypot(3 * 0.6, 4 * 0.8), math.hypot(3 * 0.8, 4 * 0.6)
    torus = example("torus", np.diag([1.0, 4, 9, 16, 25, 1, 1]))
    np.testing.assert_allclose(torus.point_std, [along_x, along_y, 5])
    np.testing.assert_allclose(torus.axis_std, [tilt_x, tilt_y, 0])
    np.testing.assert_array_equal(torus.center_std, torus.point_std)
    pipe = example("cylinder", np.diag([1.0, 4, 9, 16, 1]))
    np.testing.assert_allclose(pipe.point_std, [along_x, along_y, 0])
    np.testing.assert_allclose(pipe.axis_std, [tilt_x, tilt_y, 0])
    floor = example("plane", np.diag([25.0, 9, 16]))
    np.testing.assert_allclose(floor.point_std, [0, 0, 5])
    np.testing.assert_allclose(floor.axis_std, [tilt_x, tilt_y, 0])
    ball = example("sphere", np.diag([1.0, 4, 9, 16]))
    np.testing.assert_allclose(ball.point_std, [1, 2, 3])
    np.testing.assert_array_equal(ball.center_std, ball.point_std)
    assert np.isnan(ball.axis_std).all()
    assert np.isnan(ball.across).all()


@pytest.mark.parametrize("kind", KINDS)
def test_free_directions_leave_all_distances_as_they_are(kind: Kind) -> None:
    surface = example(kind)
    points = np.random.default_rng(45).normal(size=(50, 3)) + surface.point
    before = surface.distances(points)
    assert len(surface.free_directions) == {"plane": 3, "cylinder": 2}.get(kind, 1)
    for direction in surface.free_directions:
        axis = np.array([0.6, 0.0, 0.8]) if np.isnan(direction.axis).any() else direction.axis
        if np.isnan(direction.point).any():
            moved = points + 0.7 * axis
        else:
            moved = transform_points(about(direction.point, 0.7 * axis, np.zeros(3)), points)
        np.testing.assert_allclose(surface.distances(moved), before, atol=1e-12)


def test_distances_take_clouds_with_an_origin_and_points_that_are_none() -> None:
    surface = example("sphere")
    far = np.array([3e5, 5e6, 0.0])
    cloud = surfsig.PointCloud(np.array([[1.0, 2, 3.5], [math.nan, 0, 0]]) - far, origin=far)
    np.testing.assert_allclose(surface.distances(cloud), [0.3, math.nan], atol=1e-8)
    assert surface.distances(np.zeros((0, 3))).shape == (0,)
    with pytest.raises(surfsig.InvalidInputError):
        surface.distances([1.0, 2.0])


def test_a_plane_of_points_that_are_nearly_on_a_line_has_a_length() -> None:
    along = np.linspace(0, 1, 50)
    points = np.column_stack([along, 1e-17 * np.sin(9 * along), 0 * along])
    fitted = {"kind": "plane", "point": np.zeros(3), "axis": np.array([0.0, 0.0, 1.0]), "deviation": 0.0}
    fitted |= dict.fromkeys(("radius", "major_radius", "half_angle"), math.nan)
    surface = measured_surface(fitted, points, np.zeros(3), np.arange(50))
    assert surface.length == pytest.approx(1)
    assert surface.width == pytest.approx(0, abs=1e-12)


def test_a_point_at_the_center_of_a_sphere_is_no_warning() -> None:
    points = np.concatenate([DRAWN["sphere"], fit_sphere(DRAWN["sphere"]).center[None]])
    fitted = {"kind": "sphere", "point": points[-1], "axis": np.full(3, math.nan), "radius": 1.0}
    fitted |= {"major_radius": math.nan, "half_angle": math.nan, "deviation": 0.01}
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        surface = measured_surface(fitted, points, np.zeros(3), np.arange(len(points)))
    assert surface.area > 0
