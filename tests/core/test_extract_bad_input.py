"""What `extract` takes and what it refuses: types, shapes, layouts, options."""

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from surface_points import Array, rough_surface

from surfsig import InvalidInputError, PointCloud, extract

RADIUS = 0.3


@pytest.fixture(scope="module")
def points() -> Array:
    return rough_surface(41, count=300)


def refused(message: str, *arguments: Any, **options: Any) -> None:
    """Check that the call raises, and that what it says is one short line about the right thing."""
    with pytest.raises(InvalidInputError, match=message) as caught:
        extract(*arguments, **options)
    assert "\n" not in str(caught.value)
    assert len(str(caught.value)) < 400


@pytest.mark.parametrize(
    "length", [0, -1, -0.0, np.nan, np.inf, -np.inf, "wide", [0.1], 1j, np.zeros(2)], ids=repr
)
def test_radius_and_voxel(points: Array, length: Any) -> None:
    refused("radius must be", points, length)
    refused("voxel must be", points, RADIUS, voxel=length)


def test_a_radius_out_of_range(points: Array) -> None:
    for radius in (1e-300, 1e300, 5e-324):
        refused("radius must be", points, radius)


def test_neither_radius_nor_neighbors(points: Array) -> None:
    refused("give a radius, or neighbors, or both", points)


@pytest.mark.parametrize("neighbors", [0, -3, 2.5, "six", 2**40, [6]], ids=repr)
def test_neighbors(points: Array, neighbors: Any) -> None:
    refused("neighbors must be", points, neighbors=neighbors)
    refused("neighbors must be", points, RADIUS, neighbors=neighbors)


def test_normals_that_do_not_fit(points: Array) -> None:
    refused("normals must be", points, RADIUS, normals=points[:5])
    refused("normals must", points, RADIUS, normals=points[:, :2])
    refused("viewpoint and normals exclude", points, RADIUS, normals=points, viewpoint=[0, 0, 1])


def test_a_radius_too_large_for_a_float(points: Array) -> None:
    refused("radius must be", points, 10**400)


@pytest.mark.parametrize("voxel", [1e-300, 1e300, 1e-20])
def test_a_voxel_out_of_range_is_called_a_voxel(points: Array, voxel: float) -> None:
    refused("voxel", points, RADIUS, voxel=voxel)


@pytest.mark.parametrize("radius", [1e-300, 1e300])
def test_a_radius_out_of_range_is_told_the_range(points: Array, radius: float) -> None:
    with pytest.raises(InvalidInputError) as caught:
        extract(points, radius)
    assert "finite number above 0" not in str(caught.value)
    assert len(str(caught.value)) < 120


@pytest.mark.parametrize(
    "cloud",
    [
        [["a", "b", "c"]],
        [["1", "2", "3"]],
        np.zeros((9, 3), complex),
        np.zeros((9, 3), object),
        np.zeros((9, 2)),
        np.zeros((9, 4)),
        np.zeros(9),
        np.zeros((9, 3), bool),
        np.zeros((3, 3, 3)),
        np.zeros((9, 0)),
        [],
        None,
        5,
        "scan.ply",
        [[1, 2, 3], [1, 2]],
        np.zeros((9, 3), "M8[s]"),
        {"x": 1},
    ],
    ids=repr,
)
def test_clouds_of_the_wrong_shape_or_type(cloud: Any) -> None:
    refused("points must", cloud, RADIUS)


@pytest.mark.parametrize(
    "at",
    [
        [1.0],
        [0.5, 1],
        np.zeros(4),
        [300],
        [-301],
        [0, 10**12],
        "here",
        5,
        np.array(5),
        [None],
        [[1, 2]],
        np.zeros((2, 4)),
        np.zeros((1, 1, 3)),
        np.zeros((5, 0)),
        [True] * 5,
        np.ones((300, 1), bool),
        np.array([1], object),
        {1, 2},
        [10**30],
        np.zeros((2, 3), complex),
        [["a", "b", "c"]],
    ],
    ids=repr,
)
def test_places_of_the_wrong_shape_or_type(points: Array, at: Any) -> None:
    refused("at", points, RADIUS, at=at)


def test_places_whose_rows_differ_in_length(points: Array) -> None:
    refused("at", points, RADIUS, at=[[1, 2, 3], [4, 5]])


def test_an_unsigned_index_beyond_int64_does_not_count_from_the_end(points: Array) -> None:
    refused("at: index", points, RADIUS, at=np.array([2**64 - 1], np.uint64))


@pytest.mark.parametrize(
    "viewpoint",
    [[0, 0], [0, 0, np.nan], [np.inf, 0, 0], "up", [1, 2, [3]], 5, np.zeros((1, 3)), [0, 0, 1j]],
    ids=repr,
)
def test_viewpoint(points: Array, viewpoint: Any) -> None:
    refused("viewpoint must be three", points, RADIUS, viewpoint=viewpoint)


@pytest.mark.parametrize("threads", [0, -1, 1.5, 2.0, "2", 10**9, [1]], ids=repr)
def test_threads(points: Array, threads: Any) -> None:
    refused("threads must be", points, RADIUS, threads=threads)


@pytest.mark.parametrize("axes", ["Surface", "", None, 1])
def test_axes(points: Array, axes: Any) -> None:
    refused("axes must be 'surface' or 'sensor'", points, RADIUS, axes=axes)


def test_at_and_voxel_exclude_each_other(points: Array) -> None:
    refused("at and voxel exclude each other", points, RADIUS, at=[1], voxel=0.1)


def test_coordinates_beyond_the_lattice_are_an_error_that_names_them(points: Array) -> None:
    refused("too small for a coordinate of 1e20", np.vstack([points, [[1e20, 0, 0]]]), RADIUS)
    refused("too small for a coordinate", np.full((9, 3), 3.4e38, np.float32), RADIUS)


def test_nearest_points_at_coordinates_beyond_any_radius_are_an_error_and_no_panic(points: Array) -> None:
    refused("too small for a coordinate", 1e30 * points.astype(np.float64), None, neighbors=20)


LAYOUTS: dict[str, Callable[[Any], Any]] = {
    "Fortran": np.asfortranarray,
    "every other": lambda p: np.repeat(p, 2, axis=0)[::2],
    "columns of a wider table": lambda p: np.column_stack([p, p])[:, 3:],
    "backwards twice": lambda p: np.ascontiguousarray(p[::-1])[::-1],
    "big-endian": lambda p: p.astype(p.dtype.newbyteorder(">")),
    "a list": lambda p: p.tolist(),
    "a tuple of rows": lambda p: tuple(map(tuple, p)),
    "longdouble": lambda p: p.astype(np.longdouble),
    "packed records": lambda p: packed(p),
}


def packed(points: Array) -> Array:
    records = np.zeros(len(points), np.dtype([("tag", "u1"), ("p", points.dtype, 3)]))
    records["p"] = points
    view: Array = records["p"]
    return view


@pytest.mark.parametrize("layout", LAYOUTS)
@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_layouts_of_an_array_do_not_matter(points: Array, layout: str, dtype: Any) -> None:
    plain = points.astype(dtype)
    expected = extract(plain, RADIUS)
    found = extract(LAYOUTS[layout](plain), RADIUS)
    np.testing.assert_array_equal(found.k1, expected.k1)
    np.testing.assert_array_equal(found.normals, expected.normals)
    np.testing.assert_array_equal(found.points, plain)


def test_an_array_that_is_read_only_is_read_and_left_alone(points: Array) -> None:
    frozen = points.copy()
    frozen.flags.writeable = False
    at = np.arange(5)
    at.flags.writeable = False
    assert len(extract(frozen, RADIUS, at=at)) == 5
    np.testing.assert_array_equal(frozen, points)


def test_an_array_that_is_not_aligned(points: Array) -> None:
    buffer = b"\0" + points.tobytes()
    view = np.frombuffer(buffer, np.float64, offset=1).reshape(-1, 3)
    np.testing.assert_array_equal(extract(view, RADIUS).k1, extract(points, RADIUS).k1)


@pytest.mark.parametrize("dtype", ["i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8", "f2"])
def test_numbers_of_every_kind(points: Array, dtype: str) -> None:
    numbers = np.round((points - points.min(axis=0)) * 50).astype(dtype)
    expected = extract(numbers.astype(np.float64), 15)
    np.testing.assert_allclose(extract(numbers, 15).k1, expected.k1, atol=1e-6)
    assert expected.ok.mean() > 0.9


def test_indices_of_every_kind(points: Array) -> None:
    expected = extract(points, RADIUS).k1[[3, 299, 0]]
    for at in (
        [3, 299, 0],
        (3, 299, 0),
        [3, -1, -300],
        np.array([3, 299, 0], np.uint64),
        np.array([3, -1, 0], np.int16),
    ):
        np.testing.assert_array_equal(extract(points, RADIUS, at=at).k1, expected)


def test_numbers_that_look_like_numbers(points: Array) -> None:
    expected = extract(points, RADIUS, threads=2)
    found = extract(points, np.float64(RADIUS), threads=np.int8(2))  # type: ignore[arg-type]
    np.testing.assert_array_equal(found.k1, expected.k1)
    assert type(found.radius) is float


def test_a_viewpoint_of_the_call_goes_before_that_of_the_cloud(points: Array) -> None:
    cloud = PointCloud(points, viewpoint=[0, 0, -50])  # type: ignore[arg-type]
    below, above = extract(cloud, RADIUS), extract(cloud, RADIUS, viewpoint=[0, 0, 50])
    assert below.oriented
    np.testing.assert_allclose(below.k1, -above.k2, atol=1e-5)
    np.testing.assert_allclose(below.normals, -above.normals, atol=1e-5)


@pytest.mark.parametrize("points", [np.full((4, 3), np.nan), np.full((4, 3), np.inf), np.empty((0, 3))])
@pytest.mark.parametrize("size", [{"neighbors": 12}, {"radius": "auto"}])
def test_each_place_has_a_radius_where_no_point_is_finite(points: Any, size: dict[str, Any]) -> None:
    result = extract(points, **size)
    assert isinstance(result.radius, np.ndarray)
    assert result.radius.shape == (len(points),)
    assert result.columns()["radius"].shape == (len(points),)


def test_coordinates_too_large_for_any_radius_are_said() -> None:
    """They were once reported as a stop by the caller."""
    points = np.array([[1e300, 0.0, 0.0], [-1e300, 1.0, 0.0], [0.0, 1e300, 0.0], [0.0, 0.0, 1e300]])
    with pytest.raises(InvalidInputError, match="radius"):
        extract(points, radius="auto")
