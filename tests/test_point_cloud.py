import numpy as np
import pytest

from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud, coordinate_array


@pytest.mark.parametrize(
    ("given", "kept"),
    [
        (np.float32, np.float32),
        (np.float64, np.float64),
        (np.float16, np.float32),
        (np.int16, np.float32),
        (np.int32, np.float64),
        (">f4", np.float32),
        (">f8", np.float64),
    ],
)
def test_precision_is_kept(given: str, kept: type) -> None:
    array = coordinate_array(np.array([[1, 2, 3]], dtype=given))
    assert array.dtype == kept
    assert array.dtype.isnative
    assert array.tolist() == [[1, 2, 3]]


def test_arrays_that_fit_are_not_copied() -> None:
    points = np.zeros((4, 3), np.float32)
    assert PointCloud(points).offsets is points


@pytest.mark.parametrize(
    ("bad", "message"),
    [
        (np.zeros((4, 2)), r"shape \(n, 3\), not \(4, 2\)"),
        (np.zeros(3), r"shape \(n, 3\), not \(3,\)"),
        (np.zeros((2, 3, 3)), r"shape \(n, 3\)"),
        (np.zeros((2, 3), complex), "real numbers, not complex128"),
        (np.array([["a", "b", "c"]]), "real numbers, not <U1"),
        (np.array([[None, 1, 2]]), "real numbers, not object"),
        ([[1, 2, 3], [4, 5]], "rows differ in length"),
    ],
)
def test_arrays_of_wrong_shape_or_type(bad: object, message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        PointCloud(bad)  # type: ignore[arg-type]


def test_origin_is_added_in_float64() -> None:
    offsets = np.array([[0.001, 0, 0], [np.nan, 0, 0], [0, 0, np.inf]], np.float32)
    cloud = PointCloud(offsets, origin=np.array([500000.0, 4500000.0, 100.0]))
    assert cloud.points.dtype == np.float64
    assert cloud.points[0].tolist() == [500000 + float(np.float32(0.001)), 4500000.0, 100.0]
    assert cloud.finite.tolist() == [True, False, False]
    assert len(cloud) == 3
    assert PointCloud(offsets).points is offsets


@pytest.mark.parametrize(
    ("more", "message"),
    [
        ({"viewpoint": (0, 0)}, "viewpoint must be three finite"),
        ({"viewpoint": (0, 0, np.nan)}, "viewpoint must be three finite"),
        ({"viewpoint": "abc"}, "viewpoint must be three numbers"),
        ({"origin": (np.inf, 0, 0)}, "origin must be three finite"),
        ({"fields": {"t": np.zeros(3)}}, "field 't' must have one row for each of the 2 points"),
        ({"fields": {"t": np.array(["a", "b"])}}, "field 't' must hold real numbers"),
        ({"grid": (3, 1)}, "a grid of 3 x 1 does not hold 2 points"),
    ],
)
def test_parts_that_do_not_fit(more: dict[str, object], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        PointCloud(np.zeros((2, 3)), **more)  # type: ignore[arg-type]
