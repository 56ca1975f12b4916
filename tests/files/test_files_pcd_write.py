"""PCD as it is written: what comes back, and what PCL and Open3D make of it."""

import warnings
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

RNG = np.random.default_rng(23)


def coloured(*, alpha: bool = False) -> PointCloud:
    names = ("red", "green", "blue", "alpha") if alpha else ("red", "green", "blue")
    fields: dict[str, NDArray[Any]] = {name: RNG.integers(0, 256, 6, np.uint8) for name in names}
    fields |= {"intensity": RNG.normal(size=6).astype(np.float32)}
    points = RNG.normal(size=(6, 3)).astype(np.float32)
    return PointCloud(points, viewpoint=np.array([0.1, -2, 1e-9]), fields=fields, grid=(2, 3))


def split(path: Path) -> tuple[str, bytes]:
    head, mark, body = path.read_bytes().partition(b"DATA binary\n")
    return (head + mark).decode(), body


def test_the_file_byte_by_byte(tmp_path: Path) -> None:
    cloud = coloured()
    write(tmp_path / "a.pcd", cloud, {"wide": np.arange(12).reshape(6, 2)}, notes={"radius": "0.02"})
    head, body = split(tmp_path / "a.pcd")
    assert head == (
        "# .PCD v0.7 - Point Cloud Data file format\nVERSION 0.7\n# surfsig radius 0.02\n"
        "FIELDS x y z rgb intensity wide\nSIZE 4 4 4 4 4 8\nTYPE F F F F F I\nCOUNT 1 1 1 1 1 2\n"
        "WIDTH 3\nHEIGHT 2\nVIEWPOINT 0.1 -2.0 1e-09 1 0 0 0\nPOINTS 6\nDATA binary\n"
    )
    row = [("xyz", "<f4", 3), ("rgb", "<u4"), ("intensity", "<f4"), ("wide", "<i8", 2)]
    rows = np.frombuffer(body, row)
    red, green, blue = (cloud.fields[name].astype(np.uint32) for name in ("red", "green", "blue"))
    np.testing.assert_array_equal(rows["xyz"], cloud.points)
    np.testing.assert_array_equal(rows["rgb"], (red << 16) | (green << 8) | blue)
    np.testing.assert_array_equal(rows["intensity"], cloud.fields["intensity"])
    np.testing.assert_array_equal(rows["wide"], np.arange(12).reshape(6, 2))


@pytest.mark.parametrize("alpha", [False, True])
def test_colours_come_back(tmp_path: Path, alpha: bool) -> None:
    cloud = coloured(alpha=alpha)
    write(tmp_path / "a.pcd", cloud)
    assert ("rgba" in split(tmp_path / "a.pcd")[0]) == alpha
    again = read(tmp_path / "a.pcd")
    assert list(again.fields) == list(cloud.fields)
    for name, values in cloud.fields.items():
        assert again.fields[name].dtype == values.dtype
        np.testing.assert_array_equal(again.fields[name], values)
    assert again.grid == (2, 3)
    np.testing.assert_array_equal(again.viewpoint, [0.1, -2, 1e-9])


def test_every_type_comes_back(tmp_path: Path) -> None:
    fields: dict[str, NDArray[Any]] = {}
    for kind in ("i1", "u1", "i2", "u2", "i4", "u4", "i8", "u8"):
        limits = np.iinfo(kind)
        fields[kind] = np.array([limits.min, limits.max, 1], kind)
    fields |= {"f4": np.array([np.nan, np.inf, 0.1], np.float32), "f8": np.array([0.1, -np.inf, 1e300])}
    fields |= {"many": RNG.normal(size=(3, 5)), "one": np.array([[1], [2], [3]])}
    write(tmp_path / "a.pcd", PointCloud(np.eye(3), fields=fields), {"good": np.array([True, False, True])})
    again = read(tmp_path / "a.pcd").fields
    assert list(again) == [*fields, "good"]
    for name, values in fields.items():
        assert again[name].dtype == values.dtype
        np.testing.assert_array_equal(again[name], values[:, 0] if name == "one" else values)
    assert again["good"].dtype == np.uint8
    assert again["good"].tolist() == [1, 0, 1]


def test_half_floats_and_empty_columns(tmp_path: Path) -> None:
    fields: dict[str, NDArray[Any]] = {"half": np.array([0.5, -2], np.float16), "none": np.zeros((2, 0))}
    write(tmp_path / "a.pcd", PointCloud(np.zeros((2, 3)), fields=fields))
    again = read(tmp_path / "a.pcd").fields
    assert list(again) == ["half"]
    np.testing.assert_array_equal(again["half"], np.array([0.5, -2], np.float32))


def test_names_that_mean_something_else_in_pcd(tmp_path: Path) -> None:
    values = np.arange(2, dtype=np.float32)
    names = ["rgb", "_", "scan angle", "scan_angle", " ", "red"]
    fields = {name: values + i for i, name in enumerate(names)}
    write(tmp_path / "a.pcd", PointCloud(np.zeros((2, 3)), fields=fields))
    assert {name: float(column[0]) for name, column in read(tmp_path / "a.pcd").fields.items()} == {
        "scan_angle": 2, "scan_angle_2": 3, "field": 4, "red": 5, "input_rgb": 0, "input__": 1,
    }  # fmt: skip
    with pytest.raises(InvalidInputError, match="a column cannot be called 'rgba'"):
        write(tmp_path / "a.pcd", PointCloud(np.zeros((2, 3))), {"rgba": values})


def rows_of(path: Path) -> NDArray[Any]:
    """Give what a reader of floats finds as x, y, z, and the doubles behind them."""
    head, body = split(path)
    assert "FIELDS x y z x_double y_double z_double\nSIZE 4 4 4 8 8 8\n" in head
    return np.frombuffer(body, [("xyz", "<f4", 3), ("exact", "<f8", 3)])


def test_coordinates_stand_twice_only_where_float_would_change_them(tmp_path: Path) -> None:
    points = np.array([[0.5, 2, 2.0**100]])
    write(tmp_path / "a.pcd", PointCloud(points))
    assert "FIELDS x y z\nSIZE 4 4 4\n" in split(tmp_path / "a.pcd")[0]
    np.testing.assert_array_equal(read(tmp_path / "a.pcd").points, points)
    points = RNG.normal(size=(500, 3)) + 3
    write(tmp_path / "a.pcd", PointCloud(points))
    rows = rows_of(tmp_path / "a.pcd")
    np.testing.assert_array_equal(rows["xyz"], points.astype(np.float32))
    np.testing.assert_array_equal(rows["exact"], points)
    assert "origin" not in split(tmp_path / "a.pcd")[0]
    again = read(tmp_path / "a.pcd")
    assert again.fields == {}
    np.testing.assert_array_equal(again.points, points)


def test_utm_coordinates_are_floats_about_an_origin_that_is_told(tmp_path: Path) -> None:
    # Readers of floats (PCL, Open3D) leave every point of a file of doubles at 0.
    middle = np.array([500_123.4, 4_501_234.5, 98.7])
    points = middle + RNG.uniform(-10, 10, (500, 3))
    path = tmp_path / "a.pcd"
    with pytest.warns(UserWarning, match="about the origin 500120, 4501230, 100, because"):
        write(path, PointCloud(points, viewpoint=middle), {"h": np.arange(500)})
    head, body = split(path)
    assert "# surfsig origin 500120.0 4501230.0 100.0\n" in head
    assert "SIZE 4 4 4 8 8 8 8\n" in head
    rows = np.frombuffer(body, [("xyz", "<f4", 3), ("exact", "<f8", 3), ("h", "<i8")])
    np.testing.assert_allclose(rows["xyz"] + [500_120.0, 4_501_230.0, 100.0], points, rtol=0, atol=1e-6)
    numbers = [float(word) for word in head.partition("VIEWPOINT ")[2].split()[:3]]
    np.testing.assert_allclose(numbers, [3.4, 4.5, -1.3], atol=1e-9)
    again = read(path)
    np.testing.assert_array_equal(again.points, points)
    assert again.viewpoint is not None
    np.testing.assert_array_equal(again.viewpoint, middle)
    assert list(again.fields) == ["h"]


def test_coordinates_that_another_program_has_moved_are_believed(tmp_path: Path) -> None:
    points = np.array([500_123.4, 4_501_234.5, 98.7]) + RNG.uniform(-10, 10, (50, 3))
    path = tmp_path / "a.pcd"
    with pytest.warns(UserWarning, match="about the origin"):
        write(path, PointCloud(points))
    head, body = split(path)
    rows = np.frombuffer(body, [("xyz", "<f4", 3), ("exact", "<f8", 3)]).copy()
    rows["xyz"] += 1
    path.write_bytes(head.encode() + rows.tobytes())
    with pytest.warns(UserWarning, match="another program has changed them"):
        cloud = read(path)
    np.testing.assert_allclose(cloud.points, points + 1, rtol=0, atol=1e-5)
    assert list(cloud.fields) == ["x_double", "y_double", "z_double"]
    # Most programs drop comments: what is left is about the origin that nobody tells any more.
    path.write_bytes(head.replace("# surfsig origin", "# was").encode() + body)
    with pytest.warns(UserWarning, match="another program has changed them"):
        cloud = read(path)
    assert np.abs(cloud.points).max() < 20


def test_notes_with_the_names_of_the_writer_s_own(tmp_path: Path) -> None:
    notes = {"origin": "a lidar", "viewpoint": "above", "coordinate_system": "of the robot", "radius": "1"}
    write(tmp_path / "a.pcd", PointCloud(np.eye(3)), notes=notes)
    head = split(tmp_path / "a.pcd")[0]
    assert "# surfsig note_origin a lidar\n# surfsig note_viewpoint above\n" in head
    assert "# surfsig radius 1\n" in head
    cloud = read(tmp_path / "a.pcd")
    np.testing.assert_array_equal(cloud.points, np.eye(3))
    assert cloud.viewpoint is None


def test_points_that_are_not_finite_do_not_choose_the_origin(tmp_path: Path) -> None:
    points = np.array([500_123.4, 4_501_234.5, 98.7]) + RNG.uniform(-10, 10, (50, 3))
    points[3], points[7, 1] = np.nan, np.inf
    with pytest.warns(UserWarning, match="about the origin 500120, 4501230, 100,"):
        write(tmp_path / "a.pcd", PointCloud(points))
    np.testing.assert_array_equal(read(tmp_path / "a.pcd").points, points)


def test_a_viewpoint_that_nobody_knows_stays_unknown(tmp_path: Path) -> None:
    write(tmp_path / "a.pcd", PointCloud(np.zeros((2, 3))))
    assert "VIEWPOINT" not in split(tmp_path / "a.pcd")[0]
    assert read(tmp_path / "a.pcd").viewpoint is None


def test_a_chunked_column_with_the_name_of_a_field(tmp_path: Path) -> None:
    def blocks() -> Iterator[NDArray[Any]]:
        yield np.array([[1, 2], [3, 4]], np.float32)

    cloud = PointCloud(np.zeros((2, 3)), fields={"sig nature": np.zeros(2), "sig_nature": np.ones(2)})
    write(tmp_path / "a.pcd", cloud, chunks=("sig nature", 2, np.float32, blocks()))
    fields = read(tmp_path / "a.pcd").fields
    assert list(fields) == ["sig_nature_2", "input_sig_nature", "sig_nature"]
    np.testing.assert_array_equal(fields["sig_nature"], [[1, 2], [3, 4]])
    np.testing.assert_array_equal(fields["sig_nature_2"], [1, 1])


@pytest.mark.parametrize("alpha", [False, True])
def test_as_open3d_reads_it(tmp_path: Path, alpha: bool) -> None:
    o3d = pytest.importorskip("open3d")
    cloud = coloured(alpha=alpha)
    write(tmp_path / "a.pcd", cloud, {"count": np.arange(6), "wide": np.zeros((6, 2))}, notes={"a": "b"})
    found = o3d.io.read_point_cloud(str(tmp_path / "a.pcd"))
    np.testing.assert_array_equal(np.asarray(found.points), cloud.points)
    colours = np.column_stack([cloud.fields[name] for name in ("red", "green", "blue")])
    np.testing.assert_array_equal(np.round(np.asarray(found.colors) * 255), colours)
    tensors = o3d.t.io.read_point_cloud(str(tmp_path / "a.pcd")).point
    np.testing.assert_array_equal(tensors["positions"].numpy(), cloud.points)
    np.testing.assert_array_equal(tensors["intensity"].numpy()[:, 0], cloud.fields["intensity"])


def test_real_scans_come_back(shared_data: Path, tmp_path: Path) -> None:
    paths = sorted(path for path in shared_data.rglob("*.pcd") if path.stat().st_size < 20_000_000)
    assert paths
    for path in paths:
        cloud = read(path)
        write(tmp_path / "a.pcd", cloud)
        again = read(tmp_path / "a.pcd")
        np.testing.assert_array_equal(again.points, cloud.points)
        assert (again.grid, list(again.fields)) == (cloud.grid, list(cloud.fields))
        for name, values in cloud.fields.items():
            assert again.fields[name].dtype == values.dtype
            np.testing.assert_array_equal(again.fields[name], values)


def test_one_point_is_written_where_it_is(tmp_path: Path) -> None:
    path = tmp_path / "a.pcd"
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write(path, PointCloud(np.array([[1.3, -0.7, 6.1]])))
    assert b"origin" not in path.read_bytes()
    np.testing.assert_array_equal(read(path).points, [[1.3, -0.7, 6.1]])
