"""pandas DataFrames and Arrow tables, in and out."""

import json
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

import surfsig
from surfsig import InvalidInputError, PointCloud

POINTS = np.array([[0, 1, 2], [3, 4, 5], [6, 7, np.nan], [9, 10, 11]], np.float32)
COLUMNS = [
    *("k1", "k2", "gaussian_curvature", "mean_curvature", "nx", "ny", "nz"),
    *("direction_x", "direction_y", "direction_z", "mean_curvature_std", "k1_std", "k2_std", "noise"),
    *("residual", "condition", "count", "status"),
    *("linearity", "planarity", "scattering"),
]


@pytest.fixture
def cloud() -> PointCloud:
    fields: dict[str, NDArray[Any]] = {
        "intensity": np.array([1, 2, 3, 65535], np.uint16),
        "pair": np.arange(8.0).reshape(4, 2),
        "red": np.array([0, 1, 254, 255], np.uint8),
        "green": np.array([0, 2, 3, 4], np.uint8),
        "blue": np.array([5, 6, 7, 8], np.uint8),
        "flag": np.array([True, False, True, False]),
    }
    return PointCloud(POINTS, viewpoint=np.array([0.0, 0, 9]), fields=fields, grid=(2, 2))


@pytest.fixture(scope="module")
def extraction() -> surfsig.Extraction:
    rng = np.random.default_rng(5)
    points = rng.uniform(-1, 1, (400, 3)) * [1, 1, 0.1]
    return surfsig.extract(points, 0.6, at=[7, 3, 300], viewpoint=(0, 0, 5))


def test_pandas_and_back(cloud: PointCloud) -> None:
    pandas = pytest.importorskip("pandas")
    frame = cloud.to_pandas()
    assert isinstance(frame, pandas.DataFrame)
    names = ["x", "y", "z", "intensity", "pair_0", "pair_1", "red", "green", "blue", "flag"]
    assert list(frame.columns) == names
    np.testing.assert_array_equal(frame[["x", "y", "z"]].to_numpy(), POINTS)
    assert [frame[name].dtype for name in ("x", "intensity", "red", "flag")] == ["f4", "u2", "u1", "bool"]
    back = PointCloud.of(frame)
    np.testing.assert_array_equal(back.points, POINTS)
    assert back.offsets.dtype == np.float32
    for name in names[3:]:
        np.testing.assert_array_equal(back.fields[name], frame[name])
        assert back.fields[name].dtype == frame[name].dtype
    frame.loc[0, "x"] = 100.0
    assert POINTS[0, 0] == 0


def test_a_data_frame_of_one_block_is_shared() -> None:
    pandas = pytest.importorskip("pandas")
    points = np.arange(12.0).reshape(4, 3)
    frame = pandas.DataFrame(points, columns=["x", "y", "z"], copy=False)
    cloud = PointCloud.of(frame)
    assert np.shares_memory(cloud.offsets, points)
    assert cloud.points.tolist() == points.tolist()


def test_columns_of_a_data_frame() -> None:
    pandas = pytest.importorskip("pandas")
    frame = pandas.DataFrame(
        {
            "Z": pandas.array([7, 8, None], dtype="Int64"),
            "x": [1.0, 2.0, 3.0],
            "Y": np.array([4, 5, 6], np.int16),
            "label": ["a", "b", "c"],
            "kind": pandas.Categorical(["a", "b", "a"]),
            "sure": pandas.array([True, None, False], dtype="boolean"),
            "number": pandas.array([1, 2, 3], dtype="UInt8"),
            "mass": pandas.array([1.5, None, 2.5], dtype="Float32"),
            "when": pandas.to_datetime(["2020-01-01"] * 3),
            8: [1, 2, 3],
        }
    )
    cloud = PointCloud.of(frame)
    np.testing.assert_array_equal(cloud.points, [[1, 4, 7], [2, 5, 8], [3, 6, np.nan]])
    assert list(cloud.fields) == ["sure", "number", "mass", "8"]
    np.testing.assert_array_equal(cloud.fields["sure"], [1, np.nan, 0])
    np.testing.assert_array_equal(cloud.fields["mass"], np.array([1.5, np.nan, 2.5], np.float32))
    assert [cloud.fields[name].dtype for name in ("number", "mass")] == [np.uint8, np.float32]
    with pytest.raises(InvalidInputError, match="the DataFrame: no column 'y'"):
        PointCloud.of(frame.drop(columns="Y"))
    twice = pandas.DataFrame([[1.0, 2.0, 3.0, 9.0]], columns=["x", "y", "z", "x"])
    assert PointCloud.of(twice).points.tolist() == [[1, 2, 3]]


def test_a_field_called_like_a_coordinate_is_kept() -> None:
    pytest.importorskip("pandas")
    frame = PointCloud(POINTS, fields={"x": np.arange(4)}).to_pandas()
    assert list(frame.columns) == ["x", "y", "z", "input_x"]


def test_arrow_and_back(cloud: PointCloud) -> None:
    pa = pytest.importorskip("pyarrow")
    table = cloud.to_arrow()
    assert table.schema.field("pair").type == pa.list_(pa.float64(), 2)
    assert table.column("intensity").to_pylist() == [1, 2, 3, 65535]
    for data in (table, table.to_batches()[0]):
        back = PointCloud.of(data)
        np.testing.assert_array_equal(back.points, POINTS)
        assert back.viewpoint is not None
        assert back.viewpoint.tolist() == [0, 0, 9]
        assert back.grid == (2, 2)
        assert list(back.fields) == list(cloud.fields)
        for name, values in cloud.fields.items():
            np.testing.assert_array_equal(back.fields[name], values)
            assert back.fields[name].dtype == values.dtype


def test_lists_of_three_numbers_are_shared() -> None:
    pa = pytest.importorskip("pyarrow")
    points = np.arange(12, dtype=np.float32).reshape(4, 3)
    column = pa.FixedSizeListArray.from_arrays(pa.array(points.ravel()), 3)
    batch = pa.record_batch({"points": column, "id": pa.array([4, 3, 2, 1])})
    for data in (batch, pa.table(batch)):
        cloud = PointCloud.of(data)
        memory = np.asarray(column.values)
        assert np.shares_memory(cloud.offsets, memory)
        assert cloud.points.tolist() == points.tolist()
        assert cloud.fields["id"].tolist() == [4, 3, 2, 1]
    part = PointCloud.of(pa.table(batch).slice(1, 2))
    assert part.points.tolist() == points[1:3].tolist()
    joined = PointCloud.of(pa.concat_tables([pa.table(batch)] * 2))
    assert joined.points.tolist() == [*points.tolist(), *points.tolist()]
    # What is shared with Arrow cannot be written to; the core reads it all the same.
    assert not cloud.offsets.flags.writeable
    assert surfsig.extract(batch, 100.0).count.tolist() == [4, 4, 4, 4]


def test_missing_numbers_of_arrow_are_nan() -> None:
    pa = pytest.importorskip("pyarrow")
    inner = pa.array([1.0, None, 3.0, 4.0, 5.0, 6.0])
    table = pa.table({"points": pa.FixedSizeListArray.from_arrays(inner, 3), "t": ["a", "b"]})
    cloud = PointCloud.of(table)
    np.testing.assert_array_equal(cloud.points, [[1, np.nan, 3], [4, 5, 6]])
    assert cloud.fields == {}
    columns = {"x": [1, None], "y": [2, 3], "Z": [4.0, 5.0]}
    np.testing.assert_array_equal(PointCloud.of(pa.table(columns)).points, [[1, 2, 4], [np.nan, 3, 5]])


def test_rows_taken_from_an_organised_table_have_no_grid(cloud: PointCloud) -> None:
    pytest.importorskip("pyarrow")
    part = PointCloud.of(cloud.to_arrow().slice(0, 3))
    assert (len(part), part.grid) == (3, None)


def test_tables_that_are_no_cloud() -> None:
    pa = pytest.importorskip("pyarrow")
    with pytest.raises(InvalidInputError, match="the Arrow table: no column 'x'"):
        PointCloud.of(pa.table({"a": [1]}))
    with pytest.raises(InvalidInputError, match="the Arrow table: not a table"):
        PointCloud.of(pa.chunked_array([[1.0, 2.0, 3.0]]))
    for broken in (b"{", b"[]", b'{"grid": 5}', b'{"grid": ["a", "b"]}', b'{"viewpoint": [1]}'):
        table = pa.table({"x": [1], "y": [1], "z": [1]}).replace_schema_metadata({b"surfsig": broken})
        with pytest.raises(InvalidInputError, match="metadata 'surfsig' are broken"):
            PointCloud.of(table)


def test_a_column_without_numbers_has_no_type_in_arrow(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    cloud = PointCloud(POINTS, fields={"none": np.zeros((4, 0))})
    for give in (cloud.to_arrow, lambda: surfsig.write(tmp_path / "a.parquet", cloud)):
        with pytest.raises(InvalidInputError, match=r"cannot hold a column \(n, 0\)"):
            give()


def test_columns_of_an_extraction(extraction: surfsig.Extraction) -> None:
    columns = extraction.columns()
    assert list(columns) == COLUMNS
    assert np.isfinite(extraction.k1).all()
    np.testing.assert_array_equal(columns["gaussian_curvature"], extraction.k1 * extraction.k2)
    for i, axis in enumerate("xyz"):
        np.testing.assert_array_equal(columns["n" + axis], extraction.normals[:, i])
        np.testing.assert_array_equal(columns["direction_" + axis], extraction.directions[:, i])


def test_an_extraction_in_pandas(extraction: surfsig.Extraction) -> None:
    pytest.importorskip("pandas")
    frame = extraction.to_pandas()
    assert list(frame.columns) == ["x", "y", "z", *COLUMNS]
    assert frame.index.tolist() == [7, 3, 300]
    np.testing.assert_array_equal(frame[["x", "y", "z"]].to_numpy(), extraction.points)
    for name, values in extraction.columns().items():
        np.testing.assert_array_equal(frame[name], values)
    placed = surfsig.extract(np.zeros((9, 3)), 1.0, at=[[0.0, 0.0, 0.0]])
    assert placed.to_pandas().index.tolist() == [0]


def test_an_extraction_in_arrow(extraction: surfsig.Extraction, tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    table = extraction.to_arrow()
    assert table.column_names == ["x", "y", "z", *COLUMNS]
    for name, values in extraction.columns().items():
        np.testing.assert_array_equal(table.column(name), values)
    assert json.loads(table.schema.metadata[b"surfsig"]) == {"radius": "0.6", "axes": "surface"}
    surfsig.write(tmp_path / "a.parquet", table)
    np.testing.assert_array_equal(surfsig.read(tmp_path / "a.parquet").fields["k1"], extraction.k1)


@pytest.mark.parametrize(
    ("module", "method", "command"),
    [
        ("pandas", "to_pandas", "pip install pandas"),
        ("pyarrow", "to_arrow", r"pip install 'surfsig\[parquet\]'"),
        ("open3d", "to_open3d", "pip install open3d"),
    ],
)
def test_without_the_library(module: str, method: str, command: str, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(InvalidInputError, match=f"is not installed: {command}$"):
        getattr(PointCloud(POINTS), method)()
