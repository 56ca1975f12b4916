"""NumPy's masked arrays: what is hidden is NaN, wherever an array is taken."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

import surfsig
from surfsig.errors import InvalidInputError
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud, coordinate_array

MASK = np.array([[False, False, False], [False, True, False], [True, True, True]])


@pytest.mark.parametrize(
    ("kind", "kept"),
    [("f4", "f4"), ("f8", "f8"), ("u1", "f4"), ("i2", "f4"), ("u2", "f4"), ("i4", "f8"), ("i8", "f8")],
)
def test_masked_coordinates_are_nan(kind: str, kept: str) -> None:
    values = np.arange(9).reshape(3, 3).astype(kind)
    expected = np.array([[0, 1, 2], [3, np.nan, 5], [np.nan] * 3])
    masked = np.ma.array(values, mask=MASK)
    for points in (coordinate_array(masked), PointCloud.of(masked).points, PointCloud(masked).points):
        np.testing.assert_array_equal(points, expected)
        assert points.dtype == kept
    assert PointCloud.of(masked).finite.tolist() == [True, False, False]
    # The array itself stays as it is.
    np.testing.assert_array_equal(masked.data, values)


@pytest.mark.parametrize("mask", [np.ma.nomask, False, np.zeros((3, 3), bool)])
def test_an_array_of_which_nothing_is_masked_is_shared(mask: Any) -> None:
    values = np.arange(9.0).reshape(3, 3)
    assert np.shares_memory(PointCloud.of(np.ma.array(values, mask=mask)).offsets, values)
    label = np.ma.array([1, 2, 3], mask=False)
    assert PointCloud(values, fields={"label": label}).fields["label"].dtype.kind == "i"
    assert type(PointCloud(values, fields={"label": label}).fields["label"]) is np.ndarray


def test_masked_fields_are_nan(tmp_path: Path) -> None:
    hidden = [False, True, False]
    fields: dict[str, Any] = {
        "small": np.ma.array(np.array([1, 2, 3], np.uint8), mask=hidden),
        "large": np.ma.array(np.array([1, 2, 2**40 + 1]), mask=hidden),
        "flag": np.ma.array([True, True, False], mask=hidden),
        "single": np.ma.array(np.array([0.5, 1, 2], np.float32), mask=hidden),
        "pair": np.ma.array(np.ones((3, 2), np.int16), mask=[[False, True], [False, False], [True, True]]),
    }
    expected = {
        "small": ("f4", [1, np.nan, 3]),
        "large": ("f8", [1, np.nan, 2**40 + 1]),
        "flag": ("f4", [1, np.nan, 0]),
        "single": ("f4", [0.5, np.nan, 2]),
        "pair": ("f4", [[1, np.nan], [1, 1], [np.nan, np.nan]]),
    }
    points = np.arange(9.0).reshape(3, 3)
    cloud = PointCloud(points, fields=fields)
    write(tmp_path / "a.npz", points, fields)
    for found in (cloud.fields, read(tmp_path / "a.npz").fields):
        for name, (kind, values) in expected.items():
            np.testing.assert_array_equal(found[name], values, name)
            assert found[name].dtype == kind


def test_a_masked_structured_array() -> None:
    rows = np.ma.zeros(3, [("x", "f4"), ("y", "f4"), ("z", "f4"), ("label", "i2"), ("pair", "u1", 2)])
    rows["x"] = [1, 2, 3]
    rows["label"] = [7, 8, 9]
    rows["x"][1] = np.ma.masked
    rows["label"][2] = np.ma.masked
    cloud = PointCloud.of(rows)
    np.testing.assert_array_equal(cloud.points, [[1, 0, 0], [np.nan, 0, 0], [3, 0, 0]])
    np.testing.assert_array_equal(cloud.fields["label"], [7, 8, np.nan])
    assert cloud.fields["pair"].dtype == np.uint8
    table = np.genfromtxt(
        ["x,y,z,intensity", "1,2,3,4", "5,6,,8"], delimiter=",", names=True, usemask=True, dtype=None
    )
    cloud = PointCloud.of(table)
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [5, 6, np.nan]])
    assert cloud.fields["intensity"].tolist() == [4, 8]


def test_a_masked_position_is_none() -> None:
    with pytest.raises(InvalidInputError, match="viewpoint must be three finite numbers"):
        PointCloud(np.zeros((1, 3)), viewpoint=np.ma.array([1.0, 2, 3], mask=[False, True, False]))


def test_curvature_ignores_masked_points() -> None:
    points = np.random.default_rng(1).uniform(-1, 1, (400, 3))
    points[:, 2] = 0
    points[::10, 2] = 1e3
    mask = np.zeros(points.shape, bool)
    mask[::10, 2] = True
    result = surfsig.extract(np.ma.array(points, mask=mask), 0.4)
    assert (result.status[::10] != surfsig.Status.OK).all()
    good = result.status == surfsig.Status.OK
    assert good.sum() > 250
    assert np.abs(result.k1[good]).max() < 1e-5


def test_masked_places_and_numbers_of_places() -> None:
    points = np.random.default_rng(2).uniform(-1, 1, (300, 3)) * [1, 1, 0]
    at = np.ma.array(np.zeros((2, 3)), mask=[[False] * 3, [False, False, True]])
    status = surfsig.extract(points, 0.5, at=at).status
    assert (status == surfsig.Status.OK).tolist() == [True, False]
    with pytest.raises(InvalidInputError, match="at must be whole numbers"):
        surfsig.extract(points, 0.5, at=np.ma.array([1, 2], mask=[False, True]))
