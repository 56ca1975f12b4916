"""PTS, and what begins with the number of its points; PTX with its poses."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read
from surfsig.point_cloud import PointCloud


def save(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def quietly(path: Path, **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(path, **options)


@pytest.mark.parametrize(
    ("more", "fields"),
    [
        ("", {}),
        (" -2048", {"intensity": -2048}),
        (" 255 0 7", {"red": 255, "green": 0, "blue": 7}),
        (" 2047 255 0 7", {"intensity": 2047, "red": 255, "green": 0, "blue": 7}),
        (" 0 -0.6 0.8", {"column_4": 0, "column_5": -0.6, "column_6": 0.8}),
        (" 1 0 -0.6 0.8", {"intensity": 1, "column_5": 0, "column_6": -0.6, "column_7": 0.8}),
        (" 5 6", {"column_4": 5, "column_5": 6}),
    ],
)
def test_pts(tmp_path: Path, more: str, fields: dict[str, float]) -> None:
    path = save(tmp_path, "a.pts", f"2\n0 1 2.5{more}\n3 4 5{more}\n")
    cloud = quietly(path)
    assert cloud.points.tolist() == [[0, 1, 2.5], [3, 4, 5]]
    assert {name: values[1] for name, values in cloud.fields.items()} == fields
    if "red" in fields:
        assert cloud.fields["red"].dtype == np.uint8
    assert format_name(path) == "PTS"


def test_several_scans_of_pts(tmp_path: Path) -> None:
    content = "2\r\n0 1 2 7\r\n3 4 5 8\r\n1\r\n6 7 8 9\r\n0\r\n3\r\n1 1 1 1\r\n2 2 2 2\r\n3 3 3 3\r\n"
    path = save(tmp_path, "a.pts", content)
    cloud = quietly(path)
    assert cloud.points[:, 0].tolist() == [0, 3, 6, 1, 2, 3]
    assert cloud.fields["scan"].tolist() == [0, 0, 1, 3, 3, 3]
    assert cloud.fields["intensity"].tolist() == [7, 8, 9, 1, 2, 3]
    assert quietly(path, scan=1).points.tolist() == [[6, 7, 8]]
    assert "scan" not in quietly(path, scan=3).fields
    with pytest.raises(InvalidInputError, match="there is no scan 4: the file holds 4, numbered from 0"):
        read(path, scan=4)
    assert list(quietly(path, columns="x,y,z,_").fields) == ["scan"]
    with pytest.raises(InvalidInputError, match="'scan' means nothing"):
        read(save(tmp_path, "b.xyz", "1 2 3\n"), scan=0)


def test_a_long_pts_of_two_scans(tmp_path: Path) -> None:
    points = np.random.default_rng(3).normal(size=(150_000, 3))
    lines = [f"{x!r} {y!r} {z!r}" for x, y, z in points.tolist()]
    path = save(tmp_path, "a.pts", "\n".join(["140000", *lines[:140_000], "10000", *lines[140_000:], ""]))
    cloud = quietly(path)
    np.testing.assert_array_equal(cloud.points, points)
    assert np.bincount(cloud.fields["scan"]).tolist() == [140_000, 10_000]


def test_a_wrong_count_is_told(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="the count promises 3 points, 2 are there"):
        assert len(read(save(tmp_path, "a.pts", "3\n0 1 2\n3 4 5\n"))) == 2
    with pytest.warns(UserWarning, match="the count of scan 1 promises 9999999999 points, 1 are there"):
        assert len(read(save(tmp_path, "a.pts", "2\n0 1 2\n3 4 5\n9999999999\n1 2 3\n"))) == 3


def test_names_above_the_count(tmp_path: Path) -> None:
    cloud = quietly(save(tmp_path, "a.txt", "//X;Y;Z;R;G;B\n2\n0;1;2;3;4;5\n3;4;5;6;7;255\n"))
    assert cloud.points.tolist() == [[0, 1, 2], [3, 4, 5]]
    assert cloud.fields["blue"].tolist() == [5, 255]


POSE = "1 2 3\n1 0 0\n0 1 0\n0 0 1\n"
MOVED = "1 0 0 0\n0 1 0 0\n0 0 1 0\n1 2 3 1\n"
# A quarter turn about z: x becomes y.
TURNED = "0 1 0 0\n-1 0 0 0\n0 0 1 0\n10 20 30 1\n"


def ptx(size: str, matrix: str, rows: list[str], pose: str = POSE) -> str:
    return size + pose + matrix + "".join(row + "\n" for row in rows)


ROWS = [f"{i + 1} {i / 2} {i} {i / 10} {i} 0 255" for i in range(6)]


def test_ptx_is_moved_and_keeps_its_grid(tmp_path: Path) -> None:
    rows = [*ROWS[:3], "0 0 0 0.5 0 0 0", *ROWS[4:]]
    path = save(tmp_path, "a.ptx", ptx("3\n2\n", MOVED, rows))
    cloud = quietly(path)
    expected = np.array([[i + 2, i / 2 + 2, i + 3] for i in range(6)], float)
    expected[3] = np.nan
    np.testing.assert_array_equal(cloud.points, expected)
    assert cloud.grid == (3, 2)
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [1, 2, 3]
    assert list(cloud.fields) == ["intensity", "red", "green", "blue"]
    assert cloud.fields["intensity"][3] == 0.5
    assert cloud.fields["blue"].dtype == np.uint8
    assert format_name(path) == "PTX"


def test_ptx_turns_points(tmp_path: Path) -> None:
    cloud = quietly(
        save(
            tmp_path,
            "a.ptx",
            ptx("1\n2\n", TURNED, ["1 0 0 0.1", "0 1 0.5 0.2"], "0 0 0\n1 0 0\n0 1 0\n0 0 1\n"),
        )
    )
    np.testing.assert_allclose(cloud.points, np.array([[10, 21, 30], [9, 20, 30.5]]))
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [10, 20, 30]
    assert cloud.grid is None


def test_several_scans_of_ptx(tmp_path: Path) -> None:
    second = ptx("1\n2\n", TURNED, ["1 0 0 0.1", "0 1 0.5 0.2"], "10 20 30\n1 0 0\n0 1 0\n0 0 1\n")
    path = save(tmp_path, "a.ptx", ptx("3\n2\n", MOVED, ROWS) + "\n" + second)
    cloud = quietly(path)
    assert len(cloud) == 8
    assert cloud.fields["scan"].tolist() == [0] * 6 + [1] * 2
    assert cloud.fields["intensity"][-1] == 0.2
    assert cloud.fields["red"].tolist() == [0, 1, 2, 3, 4, 5, 0, 0]
    assert cloud.viewpoints is not None
    assert cloud.viewpoints.tolist() == [[1, 2, 3], [10, 20, 30]]
    assert cloud.viewpoint is None
    assert cloud.grid is None
    single = quietly(path, scan=1)
    np.testing.assert_allclose(single.points, np.array([[10, 21, 30], [9, 20, 30.5]]))
    assert single.viewpoint is not None
    assert quietly(path, scan=0).grid == (3, 2)
    with pytest.raises(InvalidInputError, match="there is no scan 2"):
        read(path, scan=2)
    with pytest.raises(InvalidInputError, match="'columns' means nothing"):
        read(path, columns="x,y,z,i")


def test_a_ptx_longer_than_a_block(tmp_path: Path) -> None:
    points = np.random.default_rng(3).normal(size=(120_000, 3))
    rows = [f"{x!r} {y!r} {z!r} 0.25" for x, y, z in points.tolist()]
    path = save(
        tmp_path, "a.ptx", ptx("300\n200\n", MOVED, rows[:60_000]) + ptx("200\n300\n", MOVED, rows[60_000:])
    )
    cloud = quietly(path)
    np.testing.assert_array_equal(cloud.points, points + np.array([1, 2, 3]))
    assert cloud.viewpoint is not None


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (ptx("3\n3\n", MOVED, ROWS), "cut off"),
        (ptx("99999999\n99999999\n", MOVED, ROWS), "cut off"),
        (ptx("3\n2\n", MOVED, ROWS) + "1\n1\n0 0 0\n", "cut off"),
        (
            ptx("3\n2\n", MOVED, ["1 2 3 4 5", *ROWS[1:]]),
            "line 11: 5 values where a point of PTX has 3, 4, 6, 7",
        ),
        (ptx("3\n2\n", MOVED, [*ROWS[:4], "1 2 x 4 5 6 7", ROWS[5]]), "line 15: 'x' is not a number"),
        (ptx("3\n2\n", MOVED, [*ROWS, "1 2 3 4 5 6 7"]), "7 values where 1 are expected"),
        (ptx("3\n2\n", "1 0 0 5\n0 1 0 0\n0 0 1 0\n0 0 0 1\n", ROWS), "the matrix of the scan is no pose"),
    ],
)
def test_a_broken_ptx(tmp_path: Path, content: str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        read(save(tmp_path, "a.ptx", content))
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("name", "count", "fields"),
    [
        ("cc_txt_count.txt", 10, ["red", "green", "blue"]),
        (
            "pts_pdal1508_cc.pts",
            10,
            ["Rf", "Gf", "Bf", "Intensity", "Illuminance (PCV)", "Volume density (r=0.01)", "nx", "ny", "nz"],
        ),
        ("pts_pyntcloud241.pts", 9, ["intensity", "red", "green", "blue"]),
        ("ptx_pdal3718.ptx", 10, ["intensity"]),
    ],
)
def test_odd_files_with_counts(shared_data: Path, name: str, count: int, fields: list[str]) -> None:
    cloud = quietly(shared_data / "odd_files" / "text_pts_ptx" / name)
    assert len(cloud) == count
    assert list(cloud.fields) == fields
    begin = np.array([0.1, 1.2, 0.05])
    if name.endswith(".ptx"):
        begin += np.array([1, 2, 3])
        assert cloud.viewpoint is not None
        assert cloud.viewpoint.tolist() == [1, 2, 3]
    np.testing.assert_allclose(cloud.points[1], begin)
