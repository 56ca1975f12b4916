"""Clouds that determine little or nothing: a status and NaN, never a number that means nothing."""

from typing import Any

import numpy as np
import pytest
from surface_points import Array, rotation

from surfsig import Extraction, InvalidInputError, Status, _surfsig, extract

TILT = rotation(np.random.default_rng(31))
NORMAL: Array = TILT[:, 2] * np.sign(TILT[2, 2])
AXES = ["surface", "sensor"]
CURVATURE = ("k1", "k2", "residual", "condition", "directions")


def flat(plane_points: Any) -> Array:
    """Return points (x, y) in the tilted plane."""
    xy = np.asarray(plane_points, np.float64)
    return xy @ TILT[:, :2].T


def circle(count: int) -> Array:
    angle = np.arange(count) * 2 * np.pi / count
    return flat(np.column_stack([np.cos(angle), np.sin(angle)]))


def cross() -> Array:
    along = np.linspace(-1, 1, 11)
    return flat(np.vstack([np.column_stack([along, 0 * along]), np.column_stack([0.2 * along, 0.9 * along])]))


def has_no_curvature(found: Extraction, rows: Any = slice(None)) -> None:
    for column in CURVATURE:
        assert np.isnan(getattr(found, column)[rows]).all(), column
    assert np.isnan(found.signatures()[rows]).all()
    assert np.isnan(found.gaussian_curvature[rows]).all()


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_points_that_are_not_finite_belong_to_no_ball(axes: Any, bad: float, dtype: Any) -> None:
    rng = np.random.default_rng(32)
    points = np.column_stack([rng.uniform(-1, 1, (300, 2)), np.zeros(300)]).astype(dtype)
    clean = extract(points, 0.5, axes=axes)
    numbers = np.array([0, 150, 301, 302])
    with_bad = np.insert(points, [0, 149, 299, 299], 0, axis=0)
    for axis, number in enumerate(numbers):
        with_bad[number, axis % 3] = bad
    found = extract(with_bad, 0.5, axes=axes)
    assert (found.status[numbers] == Status.NOT_FINITE).all()
    assert (found.count[numbers] == 0).all()
    assert np.isnan(found.normals[numbers]).all()
    assert np.isnan(found.linearity[numbers]).all()
    has_no_curvature(found, numbers)
    kept = np.delete(np.arange(len(with_bad)), numbers)
    for column in ("k1", "k2", "normals", "residual", "count", "status"):
        assert getattr(found, column)[kept].tobytes() == getattr(clean, column).tobytes(), column
    asked = extract(with_bad, 0.5, axes=axes, at=numbers)
    assert (asked.status == Status.NOT_FINITE).all()
    assert found.ok.sum() == 300
    assert "not_finite: 4" in repr(found)


def test_a_cloud_without_a_finite_point() -> None:
    found = extract(np.full((5, 3), np.nan), 1.0)
    assert (found.status == Status.NOT_FINITE).all()
    assert len(extract(np.full((5, 3), np.nan), 1.0, voxel=1.0)) == 0
    found = extract(np.full((5, 3), np.nan), 1.0, at=[[0.0, 0, 0], [np.nan, 0, 0]])
    assert found.status.tolist() == [Status.TOO_FEW_POINTS, Status.NOT_FINITE]


@pytest.mark.parametrize("axes", AXES)
def test_an_empty_cloud(axes: Any) -> None:
    empty = np.zeros((0, 3))
    every: list[dict[str, Any]] = [{}, {"voxel": 0.1}, {"at": []}, {"at": np.zeros((0, 3))}]
    for options in every:
        found = extract(empty, 1.0, axes=axes, **options)
        assert len(found) == 0
        assert found.normals.shape == found.directions.shape == found.points.shape == (0, 3)
        assert found.signatures().shape == (0, 242)
        assert found.signatures(flat_atom=0.1).shape == (0, 243)
        assert list(found.iter_signatures()) == []
        assert found.status_counts() == {}
    found = extract(empty, 1.0, axes=axes, at=[[1, 2, 3]])
    assert found.status.tolist() == [Status.TOO_FEW_POINTS]
    assert found.count.tolist() == [0]


@pytest.mark.parametrize("axes", AXES)
def test_one_point(axes: Any) -> None:
    found = extract([[1.0, 2.0, 3.0]], 1.0, axes=axes)
    assert found.status.tolist() == [Status.TOO_FEW_POINTS]
    assert found.count.tolist() == [1]
    assert np.isnan(found.normals).all()
    has_no_curvature(found)


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("at", [None, [[1.3, 2.0, 2.8]]], ids=["at the points", "beside them"])
def test_all_points_equal(axes: Any, at: Any) -> None:
    for count in (3, 6, 5000):
        found = extract(np.full((count, 3), [1.0, 2.0, 3.0]), 1.0, axes=axes, at=at)
        assert (found.count == count).all()
        assert (found.status == (Status.TOO_FEW_POINTS if count < 6 else Status.DEGENERATE)).all()
        assert np.isnan(found.normals).all()
        has_no_curvature(found)


@pytest.mark.parametrize("axes", AXES)
@pytest.mark.parametrize("direction", [[1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 1, 0], [1, -2, 3]], ids=str)
@pytest.mark.parametrize("origin", [0.0, 1e7])
def test_all_points_on_a_line(axes: Any, direction: Any, origin: float) -> None:
    step = np.asarray(direction) / np.linalg.norm(direction)
    points = np.linspace(-1, 1, 41)[:, None] * step + origin
    kinds = [np.float64] if origin else [np.float32, np.float64]
    for dtype in kinds:
        found = extract(points.astype(dtype), 0.5, axes=axes)
        assert (found.status == Status.DEGENERATE).all()
        assert np.isnan(found.normals).all()
        np.testing.assert_allclose(found.linearity, 1, atol=1e-5)
        np.testing.assert_allclose(found.planarity, 0, atol=1e-5)
        has_no_curvature(found)


def test_float32_at_1e7_is_a_staircase_of_whole_metres() -> None:
    points = (np.random.default_rng(33).uniform(-3, 3, (200, 3)) + 1e7).astype(np.float32)
    found = extract(points, 2.5)
    steps = (points.astype(np.float64) - 1e7)[:, None, :] - (points.astype(np.float64) - 1e7)[None, :, :]
    np.testing.assert_array_equal(found.count, ((steps**2).sum(axis=2) <= 2.5**2).sum(axis=1))


@pytest.mark.parametrize("count", [3, 4, 5])
def test_three_to_five_points_have_a_normal_and_no_curvature(count: int) -> None:
    for axes in AXES:
        for side in (1.0, -1.0):
            found = extract(circle(5)[:count], 3.0, axes=axes, viewpoint=side * 50 * NORMAL)  # type: ignore[arg-type]
            assert (found.status == Status.TOO_FEW_POINTS).all()
            assert (found.count == count).all()
            has_no_curvature(found)
            if axes == "surface":
                np.testing.assert_allclose(found.normals @ NORMAL, side, atol=1e-5)
            else:
                np.testing.assert_allclose(abs(found.normals @ NORMAL), 1, atol=1e-5)


CONICS = {
    "six on a circle": circle(6),
    "a circle": circle(40),
    "two lines": cross(),
    "three points, each nine times": np.repeat(circle(3), 9, axis=0),
    "a parabola": flat([[t, 0.5 * t * t] for t in np.linspace(-1, 1, 21)]),
}
conics = pytest.mark.parametrize("points", CONICS.values(), ids=CONICS)


@conics
def test_points_on_a_conic_determine_no_paraboloid_in_the_sensors_axes(points: Array) -> None:
    found = extract(points, 3.0, axes="sensor")
    assert (found.status == Status.DEGENERATE).all()
    np.testing.assert_allclose(abs(found.normals @ NORMAL), 1, atol=1e-5)
    has_no_curvature(found)


@conics
def test_points_on_a_conic_determine_no_paraboloid_but_a_normal_in_the_surfaces_axes(points: Array) -> None:
    for side in (1.0, -1.0):
        found = extract(points, 3.0, viewpoint=side * 50 * NORMAL)
        assert (found.status == Status.DEGENERATE).all()
        has_no_curvature(found)
        np.testing.assert_allclose(found.normals @ NORMAL, side, atol=1e-5)


@pytest.mark.parametrize("points", [circle(5), circle(6)], ids=["too few", "degenerate"])
def test_normals_without_curvature_point_to_the_sensor_in_the_sensors_axes(points: Array) -> None:
    for side in (1.0, -1.0):
        found = extract(points, 9.0, axes="sensor", viewpoint=side * 50 * NORMAL)
        np.testing.assert_allclose(found.normals @ NORMAL, side, atol=1e-5)
    # Where nobody says, z runs away from the sensor.
    np.testing.assert_allclose(extract(points, 9.0, axes="sensor").normals @ NORMAL, -1, atol=1e-5)


@pytest.mark.parametrize(
    "viewpoint",
    [None, [0.0, 0.0, 5.0], [5.0, 0.0, 0.0]],
    ids=str,
)
def test_normals_point_to_the_sensor_whatever_the_points_are_in_the_surfaces_axes(viewpoint: Any) -> None:
    points = np.random.default_rng(34).uniform(-1, 1, (5000, 3))
    found = extract(points, 0.4, viewpoint=viewpoint)
    ok = found.ok
    assert ok.sum() > 1000
    to_sensor = np.array([0.0, 0.0, 1.0]) if viewpoint is None else np.asarray(viewpoint) - points
    assert ((found.normals * to_sensor).sum(axis=1)[ok] >= 0).all()


@pytest.mark.parametrize("viewpoint", [[0.0, 0.0, 5.0], [5.0, 0.0, 0.0], [0.2, 0.1, 0.0], None], ids=str)
def test_normals_point_to_the_sensor_whatever_the_points_are_in_the_sensors_axes(viewpoint: Any) -> None:
    points = np.random.default_rng(34).uniform(-1, 1, (5000, 3))
    found = extract(points, 0.4, axes="sensor", viewpoint=viewpoint)
    assert found.ok.all()
    to_sensor = np.array([0.0, 0.0, -1.0]) if viewpoint is None else np.asarray(viewpoint) - points
    assert ((found.normals * to_sensor).sum(axis=1) >= 0).all()


def test_a_wall_along_the_sensors_z_has_no_height_over_x_and_y() -> None:
    rng = np.random.default_rng(35)
    along, z = rng.uniform(-1, 1, (2, 500))
    for direction in ([1, 0], [0, 1], [0.6, 0.8]):
        wall = np.column_stack([along * direction[0], along * direction[1], z])
        found = extract(wall, 0.6, axes="sensor")
        assert (found.status == Status.DEGENERATE).all()
        has_no_curvature(found)
        upright = extract(wall, 0.6, viewpoint=[9 * direction[1], -9 * direction[0], 0])
        assert upright.ok.all()
        np.testing.assert_allclose(upright.normals @ [direction[1], -direction[0], 0], 1, atol=1e-5)
        assert np.abs(upright.k1).max() < 1e-4


def test_a_radius_without_neighbours_is_a_status() -> None:
    points = np.random.default_rng(36).uniform(-1, 1, (500, 3))
    found = extract(points, 1e-6)
    assert (found.status == Status.TOO_FEW_POINTS).all()
    assert (found.count == 1).all()
    assert extract(points, 1e-6, at=[[5, 5, 5]]).count.tolist() == [0]


def test_a_radius_below_what_float64_can_tell_apart_is_an_error() -> None:
    points = np.random.default_rng(37).uniform(-1, 1, (50, 3))
    with pytest.raises(InvalidInputError, match="too small for a coordinate"):
        extract(points, 1e-18)
    with pytest.raises(InvalidInputError, match="too small for a coordinate"):
        extract(points * 1e7, 1e-9, at=[3])
    with pytest.raises(InvalidInputError, match="too small for a coordinate"):
        extract(points, 0.1, at=[[1e300, 0, 0]])


@pytest.mark.parametrize("origin", [0.0, 1e7])
def test_coordinates_of_1e7(origin: float) -> None:
    rng = np.random.default_rng(38)
    x, y = rng.uniform(-1, 1, (2, 2000))
    points = np.column_stack([x, y, -0.25 * x**2]) + origin
    found = extract(points, 0.5, at=[[origin, origin, origin]], viewpoint=[origin, origin, origin + 9])
    assert found.k1[0] == pytest.approx(0.5, abs=5e-4)
    assert found.k2[0] == pytest.approx(0, abs=5e-4)


def test_two_hundred_thousand_points_in_one_ball() -> None:
    rng = np.random.default_rng(39)
    x, y = rng.uniform(-1, 1, (2, 200_000))
    points = np.column_stack([x, y, -0.2 * x**2 + 0.1 * y**2])
    for axes in AXES:
        found = extract(points, 10.0, at=[0, 77_777, 199_999], axes=axes, viewpoint=[0, 0, 90])  # type: ignore[arg-type]
        assert (found.count == 200_000).all()
        assert found.ok.all()
        # In the sensor's axes the fit is exact, wherever on the surface it is asked for.
        if axes == "sensor":
            assert found.coefficients is not None
            np.testing.assert_allclose(found.coefficients[:, 0], 0.2, atol=1e-4)
            np.testing.assert_allclose(found.coefficients[:, 1], -0.1, atol=1e-4)
    middle = extract(points, 10.0, at=[[0, 0, 0]], viewpoint=[0, 0, 90])
    assert middle.count[0] == 200_000
    assert middle.k1[0] == pytest.approx(0.4, abs=1e-4)
    assert middle.k2[0] == pytest.approx(-0.2, abs=1e-4)


def test_the_status_numbers_are_those_of_the_core() -> None:
    from surfsig import _surfsig

    assert [status.name.lower() for status in Status] == _surfsig.STATUS_NAMES
    assert [int(status) for status in Status] == list(range(8))


def test_an_edge_does_not_settle_and_keeps_its_last_values() -> None:
    """Points in a volume have no surface: some fits turn for ever, and say so."""
    points = np.random.default_rng(40).uniform(-1, 1, (3000, 3))
    found = extract(points, 0.4)
    restless = found.status == Status.NOT_CONVERGED
    assert restless.sum() > 100
    assert np.isfinite(found.k1[restless]).all()
    np.testing.assert_allclose(np.linalg.norm(found.normals[restless], axis=1), 1, atol=1e-5)
    assert (found.k1 >= found.k2).all()


def test_the_statuses_are_those_of_the_core() -> None:
    assert [status.name.lower() for status in Status] == _surfsig.STATUS_NAMES
