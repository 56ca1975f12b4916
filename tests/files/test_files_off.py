"""OFF by value: its variants, and trimesh as the reference."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read
from surfsig.point_cloud import PointCloud

SQUARE = "0 0 0\n2 0 0\n2 2 0\n0 2 0\n"
POINTS = [[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]]


def save(folder: Path, content: str | bytes, name: str = "a.off") -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def quiet(folder: Path, content: str | bytes, name: str = "a.off", **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(save(folder, content, name), **options)


@pytest.mark.parametrize(
    "head",
    [
        "OFF\n4 1 0\n",
        "OFF 4 1 0\n",
        "OFF4 1 0\n",
        "OFF\n4 1\n",
        "# made by hand\n\nOFF # a square\n# counts\n4 1 0 # edges are not counted\n\n",
        "\ufeffOFF\r\n4 1 0\r\n",
        "4 1 0\n",
    ],
)
def test_heads(tmp_path: Path, head: str) -> None:
    text = head + SQUARE + "\n# faces\n4 0 1 2 3 255 0 0\n"
    assert quiet(tmp_path, text).points.tolist() == POINTS
    cloud = quiet(tmp_path, text, samples=400)
    assert (cloud.fields["nz"] == 1).all()
    assert np.unique(cloud.points[:, :2] > 1, axis=0, return_counts=True)[1].min() > 70


@pytest.mark.parametrize("name", ["a.off", "a.dat"])
@pytest.mark.parametrize("encoding", ["utf-8", "utf-16"])
def test_off_is_known_by_its_first_word(tmp_path: Path, name: str, encoding: str) -> None:
    content = ("OFF\n4 0 0\n" + SQUARE).encode(encoding)
    assert quiet(tmp_path, content, name).points.tolist() == POINTS
    assert format_name(tmp_path / name) == "OFF"


@pytest.mark.parametrize(
    ("word", "row", "fields"),
    [
        ("COFF", "255 0 7", {"red": 255, "green": 0, "blue": 7}),
        ("COFF", "255 0 7 128", {"red": 255, "green": 0, "blue": 7, "alpha": 128}),
        ("COFF", "1.0 0.0 0.2 0.6", {"red": 255, "green": 0, "blue": 51, "alpha": 153}),
        ("NOFF", "0 0.6 0.8", {"nx": 0, "ny": 0.6, "nz": 0.8}),
        ("CNOFF", "0 0.6 0.8 9 8 7", {"nx": 0, "ny": 0.6, "nz": 0.8, "red": 9, "green": 8, "blue": 7}),
        ("STOFF", "0.25 0.5", {}),
        ("STCNOFF", "0 0 1 9 8 7 1 0.25 0.5", {"nx": 0, "nz": 1, "red": 9, "blue": 7, "alpha": 1}),
        ("STCNOFF", "0 0 1 9 8 7 0.25 0.5", {"nx": 0, "nz": 1, "red": 9, "blue": 7}),
    ],
)
def test_prefixes(tmp_path: Path, word: str, row: str, fields: dict[str, float]) -> None:
    cloud = quiet(tmp_path, f"{word}\n2 0 0\n1 2 3 {row}\n4 5 6 {row}\n")
    assert cloud.points.tolist() == [[1, 2, 3], [4, 5, 6]]
    for name, value in fields.items():
        assert cloud.fields[name].tolist() == pytest.approx([value] * 2), name
    assert ("alpha" in cloud.fields, "nx" in cloud.fields) == ("alpha" in fields, "nx" in fields)
    if "red" in fields:
        assert cloud.fields["red"].dtype == np.uint8


def test_numbers_that_no_prefix_announces(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="3 numbers behind the coordinates of each vertex are left out"):
        cloud = read(save(tmp_path, "OFF\n1 0 0\n1 2 3 4 5 6\n"))
    assert cloud.points.tolist() == [[1, 2, 3]]
    assert cloud.fields == {}


def test_a_sphere_of_trimesh(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3)
    path = save(tmp_path, trimesh.exchange.off.export_off(sphere))
    np.testing.assert_allclose(read(path).points, sphere.vertices, atol=1e-9)
    reference: Any = trimesh.load(path, process=False)
    np.testing.assert_array_equal(read(path).points, reference.vertices)
    samples = read(path, samples=5000)
    assert (samples.points * np.column_stack([samples.fields[n] for n in ("nx", "ny", "nz")])).sum(
        axis=1
    ).min() > 0.98


def test_faces_that_are_none_are_left_out(tmp_path: Path) -> None:
    faces = "2 0 1\n4 0 1 2 3\n3 0 1 4\n3 0 1\n3 0 1 -1\nx 0 1 2\n3 0 1 1.5\n"
    path = save(tmp_path, "OFF\n4 7 0\n" + SQUARE + faces)
    with pytest.warns(UserWarning, match="6 of 7 faces are left out, the first of which is number 1"):
        assert (read(path, samples=10).fields["nz"] == 1).all()
    assert quiet(tmp_path, path.read_bytes()).points.tolist() == POINTS
    with pytest.raises(InvalidInputError, match="has no faces with an area"):
        read(save(tmp_path, "OFF\n4 0 0\n" + SQUARE), samples=10)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"OFF BINARY\n\0\0\0\4\0\0\0\1\0\0\0\0", "a binary OFF file, which cannot be read"),
        ("4OFF\n1 0 0\n1 2 3 4\n", "of other than three dimensions"),
        ("nOFF\n5\n1 0 0\n1 2 3 4 5\n", "of other than three dimensions"),
        ("OFF\n", "does not say how many vertices"),
        ("OFF\n1 2 3 4\n", "line 2: '1 2 3 4' is not how many vertices"),
        ("OFF\n-1 0 0\n", "line 2: '-1 0 0' is not how many"),
        ("OFF\n9999999999 0 0\n" + SQUARE, "9999999999 vertices and 0 faces are promised, 4 and 0 are there"),
        ("OFF\n4 2 0\n" + SQUARE + "3 0 1 2\n", "4 vertices and 2 faces are promised, 4 and 1 are there"),
        ("OFF\n2 0 0\n1 2 3\n4 5\n", "line 4: 2 values where 3 are expected"),
        ("OFF\n2 0 0\n1 2\n4 5\n", "line 3: 2 values where 3 are expected"),
        ("OFF\n2 0 0\n1 2 3\n4 5 x\n", "line 4: 'x' is not a number"),
        ("OFF\n1 0 0\n1 2 nan\n", "a vertex is no number"),
        ("NOFF\n1 0 0\n1 2 3\n", "line 3: 3 numbers of a vertex do not fit the file's NOFF"),
        ("STNOFF\n1 0 0\n1 2 3 0 0 1\n", "STNOFF"),
    ],
)
def test_broken_files(tmp_path: Path, content: str | bytes, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        read(save(tmp_path, content))
    assert "\n" not in str(error.value)


def test_a_last_vertex_without_line_end_gives_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"the last line \(3\) has no line end"):
        read(save(tmp_path, "OFF\n1 0 0\n1 2 3"))
    quiet(tmp_path, "OFF\n3 1 0\n1 2 3\n4 5 6\n7 8 8\n3 0 1 2")
