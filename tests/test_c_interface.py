"""The C interface's extractions: the values are Python's, bit for bit, and mistakes are said in a line."""

from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from contextlib import contextmanager
from ctypes import byref, c_size_t, c_void_p
from typing import Any, Literal

import numpy as np
import pytest
from c_interface import SIGNATURE, CInterface, Columns, Failed, Options, address
from numpy.typing import NDArray
from surface_points import UTM, rough_surface

import surfsig

RADIUS = 0.3
INVALID_INPUT, CANCELLED = 1, 5


@contextmanager
def extracted(
    c: CInterface,
    points: NDArray[Any],
    radius: float | Literal["auto"] = RADIUS,
    options: Options | None = None,
    origin: Any = None,
) -> Iterator[c_void_p]:
    """Extract from the rows of an array, whatever their distance."""
    with c.cloud_of(points, origin=origin) as cloud:
        made = c.extract(cloud, radius, options)
    try:
        yield made
    finally:
        c.functions.surfsig_extraction_free(made)


def assert_equal_columns(columns: Columns, expected: surfsig.Extraction) -> None:
    """Compare what both have, and see that nothing is there that Python has not."""
    own_radius = not isinstance(expected.radius, float)
    for name, column in columns.items():
        value: Any
        if name == "radii":
            value = expected.radius if own_radius else None
        elif name == "indices":
            # Of all points, C does not repeat the numbers.
            value = None if column is None else expected.indices
        else:
            value = getattr(expected, name)
        assert (column is None) == (value is None), name
        np.testing.assert_array_equal(column, value, err_msg=name)


@pytest.fixture(scope="module")
def points() -> NDArray[np.float32]:
    """A rough surface with a point that is none."""
    array = rough_surface(61).astype(np.float32)
    array[17, 1] = np.nan
    return array


@pytest.mark.parametrize("stride", [12, 16, 48, 13])
def test_values_at_any_stride(c: CInterface, points: NDArray[np.float32], stride: int) -> None:
    # Behind one byte that belongs to nobody, so that a stride of 13 is misaligned from the start.
    shift = 1 if stride == 13 else 0
    memory = np.full(shift + stride * len(points), 0xA5, np.uint8)
    rows = np.ndarray((len(points), 12), np.uint8, memory, shift, (stride, 1))
    rows[:] = points.view(np.uint8)
    with c.cloud(address(rows), len(points), stride) as cloud:
        made = c.extract(cloud, RADIUS)
    assert_equal_columns(c.columns("extraction", made), surfsig.extract(points, RADIUS))
    assert c.functions.surfsig_extraction_radius(made) == RADIUS
    assert c.functions.surfsig_extraction_oriented(made) == 0
    c.functions.surfsig_extraction_free(made)


def some_normals(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Normals of either side and any length, some of which say nothing."""
    normals = np.random.default_rng(3).normal(0, 100, (len(points), 3)).astype(np.float32)
    normals[::7], normals[3::7] = 0, np.nan
    return normals


@pytest.mark.parametrize(
    ("radius", "how"),
    [
        (RADIUS, {"neighbors": 30, "robust": True}),
        (RADIUS, {"neighbors": 30, "robust": True, "axes": "sensor"}),
        (25, {}),
        (25, {"axes": "sensor", "voxel": 0.2}),
        ("auto", {"fit": "auto"}),
        ("auto", {"voxel": 0.1, "viewpoint": [0.0, 0.0, 9.0]}),
        (RADIUS, {"fit": "quadric", "voxel": 0.1}),
        (RADIUS, {"fit": "auto", "robust": True, "threads": 2}),
        (RADIUS, {"normals": some_normals}),
        (RADIUS, {"normals": some_normals, "at": np.array([5, 17, 900, 5], np.uint32)}),
        (25, {"normals": some_normals, "voxel": 0.1}),
        (RADIUS, {"at": np.array([[0.1, 0.2, 0.0], [9.0, 9.0, 9.0], [np.nan, 0.0, 0.0]])}),
        ("auto", {"at": np.array([[0.1, 0.2, 0.0]]), "viewpoint": [0.0, 0.0, -9.0]}),
    ],
    ids=lambda value: " ".join(value) if isinstance(value, dict) else str(value),
)
def test_values_of_each_way_to_extract(
    c: CInterface, points: NDArray[np.float32], radius: float | Literal["auto"], how: dict[str, Any]
) -> None:
    how = {name: value(points) if callable(value) else value for name, value in how.items()}
    size: dict[str, Any] = {"neighbors": radius} if isinstance(radius, int) else {"radius": radius}
    expected = surfsig.extract(points, **size, **how)
    given = {name: value for name, value in how.items() if name not in ("axes", "fit", "at")}
    at = how.get("at")
    if at is not None:
        given["indices" if at.ndim == 1 else "positions"] = at
    axes, fit = how.get("axes", "surface"), how.get("fit", "paraboloid")
    options = Options(
        axes=("surface", "sensor").index(axes), fit=("paraboloid", "quadric", "auto").index(fit), **given
    )
    with extracted(c, points, radius, options) as made:
        assert_equal_columns(c.columns("extraction", made), expected)
        assert c.functions.surfsig_extraction_oriented(made) == expected.oriented
        rows, statuses = c.signatures(made, None, len(expected))
    expected_rows, expected_statuses = expected.signatures(return_status=True)
    np.testing.assert_array_equal(rows, expected_rows)
    np.testing.assert_array_equal(statuses, expected_statuses)


def test_values_of_several_radii(c: CInterface, points: NDArray[np.float32]) -> None:
    radii = [0.2, 0.02, 0.4]
    with c.cloud_of(points) as cloud:
        several = c.extract_radii(cloud, radii, Options(voxel=0.1))
        assert c.extract_radii(cloud, []) == []
    for made, expected in zip(several, surfsig.extract_radii(points, radii, voxel=0.1), strict=True):
        assert_equal_columns(c.columns("extraction", made), expected)
        assert c.functions.surfsig_extraction_radius(made) == expected.radius
        c.functions.surfsig_extraction_free(made)


def test_normals_of_positions(c: CInterface, points: NDArray[np.float32]) -> None:
    positions = points[:3].astype(np.float64)
    up = surfsig.extract(points, RADIUS, at=positions).normals
    known = np.array([[0, 0, -5], [0, 0, 5], [0, 0, -1e-9]], np.float32)
    with extracted(c, points, options=Options(positions=positions, normals=known)) as made:
        normals = c.columns("extraction", made)["normals"]
    np.testing.assert_array_equal(normals, up * [[-1], [1], [-1]])


@pytest.mark.parametrize("dtype", [np.float32, np.float64])
def test_values_with_an_origin(c: CInterface, points: NDArray[np.float32], dtype: Any) -> None:
    offsets = points.astype(dtype)
    expected = surfsig.extract(surfsig.PointCloud(offsets, origin=UTM), RADIUS)
    with extracted(c, offsets, origin=UTM) as made:
        assert_equal_columns(c.columns("extraction", made), expected)


def test_signatures_of_chosen_queries(c: CInterface, points: NDArray[np.float32]) -> None:
    # A tip of radius 1/24, which is outside the vocabulary.
    x, y = np.meshgrid(*[np.linspace(-0.1, 0.1, 15)] * 2)
    tip = np.column_stack([x.ravel() + 5, y.ravel(), -12 * (x**2 + y**2).ravel()])
    cloud = np.vstack([points, tip]).astype(np.float32)
    chosen = np.array([len(points) + 112, 17, 3, 3], np.uint32)
    expected, expected_statuses = surfsig.extract(cloud, RADIUS).signatures(chosen, return_status=True)
    with extracted(c, cloud) as made:
        rows, statuses = c.signatures(made, chosen, 4)
        # Statuses need not be asked for.
        again = np.zeros((4, SIGNATURE), np.float32)
        f = c.functions
        c.check(f.surfsig_signatures(made, address(chosen), c_size_t(4), address(again), c_void_p()))
    np.testing.assert_array_equal(rows, expected)
    np.testing.assert_array_equal(again, expected)
    np.testing.assert_array_equal(statuses, expected_statuses)
    assert [surfsig.Status(s).name for s in statuses] == ["OUTSIDE_VOCABULARY", "NOT_FINITE", "OK", "OK"]
    zeta = f.surfsig_similarity(address(rows[2]), address(rows[3]))
    assert zeta == 1.0
    assert np.isnan(f.surfsig_similarity(address(rows[1]), address(rows[2])))


def test_no_point_and_no_query(c: CInterface, points: NDArray[np.float32]) -> None:
    with c.cloud(c_void_p(), 0, 0) as cloud:
        empty = c.extract(cloud, RADIUS)
    assert all(column is None for column in c.columns("extraction", empty).values())
    assert len(c.signatures(empty, None, 0)[0]) == 0
    c.functions.surfsig_extraction_free(empty)
    with extracted(c, points, options=Options(indices=np.zeros(0, np.uint32))) as made:
        assert c.functions.surfsig_extraction_size(made) == 0


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"radius": 0.0}, "radius"),
        ({"radius": -1.0}, "radius"),
        ({"radius": float("nan")}, "radius"),
        ({"radius": 0}, "at least one neighbour must be asked for"),
        ({"first": c_void_p()}, "points must not be null"),
        ({"stride": 11}, "stride must be at least 12 bytes, not 11"),
        ({"stride": 0}, "stride must be at least 12 bytes, not 0"),
        ({"stride": 2**62}, "more than memory can hold"),
        ({"count": 2**63}, "more than memory can hold"),
        ({"count": 2**32}, "4294967296 entries are too many"),
        ({"precision": "f64"}, "stride must be at least 24 bytes, not 12"),
        ({"origin": [0.0, np.inf, 0.0]}, "origin must be finite"),
        ({"options": Options(viewpoint=[np.nan, 0.0, 0.0])}, "viewpoint must be finite"),
        ({"options": Options(axes=2)}, "axes must be a surfsig_axes, not 2"),
        ({"options": Options(axes=-1)}, "axes must be a surfsig_axes, not -1"),
        ({"options": Options(fit=3)}, "fit must be a surfsig_fit, not 3"),
        ({"options": Options(fit=1, axes=1)}, "only a paraboloid is fitted in the sensor's axes"),
        ({"options": Options(axes=1), "radius": "auto"}, "surface's axes only"),
        ({"options": Options(neighbors=5), "radius": "auto"}, "for surfsig_extract\\(\\) only"),
        ({"options": Options(voxel=0.0)}, "voxel"),
        ({"options": Options(threads=1025)}, "threads must be 0 to 1024, not 1025"),
        ({"options": Options(indices=np.array([1200], np.uint32))}, "index 1200 is outside a cloud of 1200"),
        (
            {"options": Options(normals=np.zeros((9, 3), np.float32))},
            "normals must be one of each of the 1200 points, not 9",
        ),
        (
            {"options": Options(normals=np.zeros((1200, 3), np.float32), viewpoint=[0.0, 0.0, 0.0])},
            "viewpoint and normals exclude each other",
        ),
    ],
    ids=str,
)
def test_bad_arguments(
    c: CInterface, points: NDArray[np.float32], change: dict[str, Any], message: str
) -> None:
    change = {"first": address(points), "count": len(points), "stride": 12, "radius": RADIUS, **change}
    radius, options = change.pop("radius"), change.pop("options", None)
    with pytest.raises(Failed, match=message) as caught, c.cloud(**change) as cloud:
        c.extract(cloud, radius, options)
    assert str(caught.value).startswith(f"{INVALID_INPUT}: ")
    assert "\n" not in str(caught.value)


def test_queries_outside(c: CInterface, points: NDArray[np.float32]) -> None:
    with extracted(c, points) as made:
        with pytest.raises(Failed, match="query 1200 is outside an extraction of 1200 queries"):
            c.signatures(made, np.array([0, 1200], np.uint32), 2)
        with pytest.raises(Failed, match="query 1200 is outside an extraction of 1200 queries"):
            c.signatures(made, None, 1201)
        far = c.functions.surfsig_signatures(made, c_void_p(), c_size_t(2**63), byref(made), c_void_p())
        assert far == INVALID_INPUT


def test_progress_ends_with_all_and_stops_where_it_is_told(
    c: CInterface, points: NDArray[np.float32]
) -> None:
    calls: list[tuple[int, int]] = []

    def count(done: int, total: int) -> int:
        calls.append((done, total))
        return 0

    # The point that is not finite counts for nothing.
    with extracted(c, points, options=Options(progress=count)) as made:
        assert_equal_columns(c.columns("extraction", made), surfsig.extract(points, RADIUS))
    assert calls[-1] == (len(points) - 1, len(points))
    # Enough points for more than one call.
    many = np.ascontiguousarray(rough_surface(5, 100_000))
    with pytest.raises(Failed, match=f"{CANCELLED}: stopped by the caller"), c.cloud_of(many) as cloud:
        c.extract(cloud, RADIUS, Options(progress=lambda *_: 1, robust=True))


def test_many_threads_at_once(c: CInterface, points: NDArray[np.float32]) -> None:
    expected = surfsig.extract(points, RADIUS).signatures()

    def one(number: int) -> None:
        # Each thread reads its own error, whatever the others do.
        for stride in range(number + 1):
            with (
                pytest.raises(Failed, match=f"not {stride}$"),
                c.cloud(address(points), len(points), stride),
            ):
                pass
        with extracted(c, points) as made:
            np.testing.assert_array_equal(c.signatures(made, None, len(points))[0], expected)

    with ThreadPoolExecutor(8) as pool:
        list(pool.map(one, range(8)))


def test_names(c: CInterface) -> None:
    names = [c.functions.surfsig_status_name(status) for status in surfsig.Status]
    assert names == [status.name.lower().encode() for status in surfsig.Status]
    assert c.functions.surfsig_status_name(len(surfsig.Status)) is None
