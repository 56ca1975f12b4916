"""PCD headers as other programs write them, and what their text means where the types do not fit."""

import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import format_name, read
from surfsig.point_cloud import PointCloud

COUNT = 10


def points() -> NDArray[np.float32]:
    i = np.arange(COUNT)
    return np.column_stack([0.1 * i, 0.2 * i + 1, 0.05 * i**2]).astype(np.float32)


HEAD = {
    "VERSION": "0.7", "FIELDS": "x y z", "SIZE": "4 4 4", "TYPE": "F F F", "COUNT": "1 1 1", "WIDTH": "10",
    "HEIGHT": "1", "VIEWPOINT": "0 0 0 1 0 0 0", "POINTS": "10", "DATA": "binary",
}  # fmt: skip


def header(data: str = "binary", /, **changes: str | None) -> bytes:
    """Give a header; a line that is None is left out."""
    lines = {**HEAD, "DATA": data, **changes}
    return "".join(f"{key} {value}\n" for key, value in lines.items() if value is not None).encode()


def rows(extra: list[Any] | None = None) -> bytes:
    """Give the points as text, with one more value in each line."""
    values = [[*map(repr, map(float, row))] for row in points()]
    for i, row in enumerate(values):
        row.extend([] if extra is None else [str(extra[i % len(extra)])])
    return "".join(" ".join(row) + "\n" for row in values).encode()


def cloud_of(folder: Path, content: bytes, message: str | None = None) -> PointCloud:
    """Read a file that says nothing, or warns once with these words; its points are those above."""
    path = folder / "a.pcd"
    path.write_bytes(content)
    assert format_name(path) == "PCD"
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("always")
        cloud = read(path)
    assert [str(one.message).startswith(f"{path}: ") for one in told] == [True] * (message is not None)
    assert message is None or message in str(told[0].message)
    np.testing.assert_array_equal(cloud.points, points())
    return cloud


def refused(folder: Path, content: bytes, message: str) -> None:
    (folder / "a.pcd").write_bytes(content)
    with pytest.raises(FileFormatError, match=message) as error:
        read(folder / "a.pcd")
    assert "\n" not in str(error.value)


# The files of the shared folder.


def shared(shared_data: Path, name: str) -> PointCloud:
    cloud = read(shared_data / "odd_files" / "pcd_headers" / name)
    np.testing.assert_allclose(cloud.points, points(), atol=1e-6)
    return cloud


def test_pcd_columns_v5(shared_data: Path) -> None:
    assert shared(shared_data, "pcd_columns_v5.pcd").fields == {}


def test_pcd_dupfields(shared_data: Path) -> None:
    with pytest.warns(UserWarning, match="two fields are called 'intensity'; the second is the field"):
        fields = shared(shared_data, "pcd_dupfields.pcd").fields
    assert {name: set(values.tolist()) for name, values in fields.items()} == {
        "intensity": {1.0}, "intensity_2": {2.0},
    }  # fmt: skip


def test_pcd_o3d6925_lower(shared_data: Path) -> None:
    # PCL and Open3D take the bits of the float 4.2108e+06.
    with pytest.warns(UserWarning, match="look like rounded whole numbers; they were read as PCL reads them"):
        fields = shared(shared_data, "pcd_o3d6925_lower.pcd").fields
    bits = int(np.array(4.2108e6, np.float32).view(np.uint32))
    for name, shift in (("red", 16), ("green", 8), ("blue", 0)):
        assert (fields[name] == (bits >> shift) & 255).all()


def test_pcd_pdal3254_count0(shared_data: Path) -> None:
    fields = shared(shared_data, "pcd_pdal3254_count0.pcd").fields
    assert list(fields) == ["intensity", "t", "reflectivity", "ring", "noise", "range"]
    np.testing.assert_array_equal(fields["intensity"], 10 + np.arange(COUNT))
    np.testing.assert_array_equal(fields["t"], 1000 + np.arange(COUNT))
    np.testing.assert_array_equal(fields["range"], 5000 + np.arange(COUNT))


def test_pcd_rgb_u4_overflow_as_I(shared_data: Path) -> None:
    fields = shared(shared_data, "pcd_rgb_u4_overflow_as_I.pcd").fields
    colours = {name: set(values.tolist()) for name, values in fields.items()}
    assert colours == {"red": {10}, "green": {20}, "blue": {250}, "alpha": {255}}


# Headers.


def test_lower_case_and_commas(tmp_path: Path) -> None:
    lines = {**HEAD, "FIELDS": "x, y, z, label", "SIZE": "4,4,4,1", "TYPE": "f f f u", "COUNT": "1,1,1,1"}
    text = "".join(f"{key.lower()} {value}\n" for key, value in lines.items()).encode()
    data = np.zeros(COUNT, [("p", "<f4", 3), ("l", "u1")])
    data["p"], data["l"] = points(), np.arange(COUNT)
    cloud = cloud_of(tmp_path, text + data.tobytes())
    np.testing.assert_array_equal(cloud.fields["label"], np.arange(COUNT))
    cloud_of(tmp_path, header().replace(b"WIDTH 10", b"Width 10,") + points().tobytes())
    cloud_of(tmp_path, header().replace(b"VERSION ", b"VERSION, ") + points().tobytes())


@pytest.mark.parametrize("version", [".5", ".7", "0.7", "0.7.1", "v0.7", "7", "1.0", None])
@pytest.mark.parametrize(
    "before", [b"", b"\xef\xbb\xbf", b"# .PCD v.7 - Point Cloud\n", b"\n# a comment\n\n"]
)
def test_versions_and_what_stands_before(tmp_path: Path, version: str | None, before: bytes) -> None:
    cloud_of(tmp_path, before + header(VERSION=version) + points().tobytes())
    cloud_of(tmp_path, before + header("ascii", VERSION=version) + rows())


@pytest.mark.parametrize("key", ["FIELDS", "COLUMNS", "columns"])
def test_columns_for_fields(tmp_path: Path, key: str) -> None:
    cloud_of(tmp_path, header().replace(b"FIELDS", key.encode()) + points().tobytes())
    old = header(VERSION=None).replace(b"FIELDS", key.encode())
    cloud_of(tmp_path, old + points().tobytes())


@pytest.mark.parametrize(
    ("missing", "grid"),
    [
        ({"WIDTH": None, "HEIGHT": None}, None),
        ({"WIDTH": None}, None),
        ({"HEIGHT": None}, None),
        ({"POINTS": None}, None),
        ({"HEIGHT": None, "POINTS": None}, None),
        ({"WIDTH": None, "HEIGHT": "2"}, (2, 5)),
        ({"HEIGHT": None, "WIDTH": "5"}, (2, 5)),
        ({"HEIGHT": "2", "WIDTH": "5", "POINTS": None}, (2, 5)),
        ({"WIDTH": "0", "HEIGHT": "0"}, None),
        ({"WIDTH": "0"}, None),
        ({"COUNT": None, "VIEWPOINT": None}, None),
    ],
)
def test_lines_that_are_missing(
    tmp_path: Path, missing: dict[str, str | None], grid: tuple[int, int] | None
) -> None:
    assert cloud_of(tmp_path, header(**missing) + points().tobytes()).grid == grid
    assert cloud_of(tmp_path, header("ascii", **missing) + rows()).grid == grid


def test_text_needs_no_types(tmp_path: Path) -> None:
    cloud_of(tmp_path, header("ascii", SIZE=None, TYPE=None, COUNT=None) + rows())
    refused(tmp_path, header(SIZE=None) + points().tobytes(), "the PCD header has no line SIZE")
    refused(tmp_path, header(TYPE=None) + points().tobytes(), "the PCD header has no line TYPE")


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"WIDTH": None, "HEIGHT": None, "POINTS": None}, "has no line WIDTH"),
        ({"POINTS": "0"}, "POINTS 0 is not WIDTH 10 times HEIGHT 1"),
        ({"POINTS": "9"}, "POINTS 9 is not WIDTH 10 times HEIGHT 1"),
        ({"WIDTH": None, "HEIGHT": "3"}, "POINTS 10 is not WIDTH 3 times HEIGHT 3"),
        ({"HEIGHT": None, "WIDTH": "4"}, "POINTS 10 is not WIDTH 4 times HEIGHT 2"),
        ({"WIDTH": "-10", "HEIGHT": "-1"}, "a negative WIDTH"),
        ({"COUNT": "1 1 -1"}, "a negative COUNT"),
        ({"COUNT": "1 1 0"}, "no column 'z'"),
        ({"COUNT": "1 2 1", "WIDTH": "7", "POINTS": "7"}, "column 'y' holds 2 numbers per point, not one"),
        ({"POINTS": "ten"}, "makes no sense"),
        ({"VIEWPOINT": "a b c"}, "makes no sense"),
    ],
)
def test_headers_without_a_meaning(tmp_path: Path, changes: dict[str, str | None], message: str) -> None:
    refused(tmp_path, header(**changes) + points().tobytes(), message)


@pytest.mark.parametrize(
    ("words", "expected", "message"),
    [
        ("1 2 3 1 0 0 0", [1, 2, 3], None),
        ("1 2 3", [1, 2, 3], "VIEWPOINT has 3 numbers, not seven; its first three were taken for the"),
        ("1 2 3 1", [1, 2, 3], "VIEWPOINT has 4 numbers, not seven; its first three"),
        ("1 2", None, "VIEWPOINT has 2 numbers, not seven; it is left out"),
        ("", None, "VIEWPOINT has 0 numbers, not seven; it is left out"),
        ("nan nan nan 1 0 0 0", None, None),
    ],
)
def test_viewpoints_of_other_lengths(
    tmp_path: Path, words: str, expected: list[float] | None, message: str | None
) -> None:
    cloud = cloud_of(tmp_path, header(VIEWPOINT=words) + points().tobytes(), message)
    assert (None if cloud.viewpoint is None else cloud.viewpoint.tolist()) == expected


def test_fields_of_no_numbers_are_left_out(tmp_path: Path) -> None:
    fields = {"FIELDS": "x none y _ z label _", "SIZE": "4 8 4 1 4 2 1", "TYPE": "F F F U F U U"}
    data = np.zeros(COUNT, [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("label", "<u2"), ("pad", "u1", 3)])
    for axis, values in zip("xyz", points().T, strict=True):
        data[axis] = values
    data["label"] = np.arange(COUNT) + 500
    cloud = cloud_of(tmp_path, header(COUNT="1 0 1 0 1 1 3", **fields) + data.tobytes())
    assert list(cloud.fields) == ["label"]
    np.testing.assert_array_equal(cloud.fields["label"], np.arange(COUNT) + 500)
    fields = {"FIELDS": "x y none z", "SIZE": "4 4 4 4", "TYPE": "F F F F", "COUNT": "1 1 0 1"}
    assert cloud_of(tmp_path, header("ascii", **fields) + rows()).fields == {}


@pytest.mark.parametrize("name", ["label", "x", "rgb"])
def test_a_name_twice(tmp_path: Path, name: str) -> None:
    fields = {
        "FIELDS": f"x y z {name} {name} {name}_2",
        "SIZE": "4 " * 6,
        "TYPE": "F " * 6,
        "COUNT": "1 " * 6,
    }
    data = np.column_stack([points(), points() + 7]).astype("<f4")
    message = f"two fields are called '{name}'; the second is the field '{name}_3'"
    if name == "x":
        fields["FIELDS"] = "x y z a x x_2"
        message = "two fields are called 'x'; the second is the field 'x_3'"
    cloud = cloud_of(tmp_path, header(**fields) + data.tobytes(), message)
    np.testing.assert_array_equal(cloud.fields[f"{name}_3"], points()[:, 1] + 7)
    np.testing.assert_array_equal(cloud.fields[f"{name}_2"], points()[:, 2] + 7)


def test_a_packed_colour_beside_a_field_of_the_same_name(tmp_path: Path) -> None:
    fields = {"FIELDS": "x y z rgb red", "SIZE": "4 4 4 4 1", "TYPE": "F F F U U", "COUNT": "1 1 1 1 1"}
    data = np.zeros(COUNT, [("p", "<f4", 3), ("rgb", "<u4"), ("red", "u1")])
    data["p"], data["rgb"], data["red"] = points(), 0x010203, 77
    cloud = cloud_of(tmp_path, header(**fields) + data.tobytes())
    assert {name: int(values[0]) for name, values in cloud.fields.items()} == {
        "red_2": 1, "green": 2, "blue": 3, "red": 77,
    }  # fmt: skip


# Text that does not fit its type.


def with_field(name: str, kind: str, size: int = 4) -> bytes:
    lines = {"FIELDS": f"x y z {name}", "SIZE": f"4 4 4 {size}", "TYPE": f"F F F {kind}", "COUNT": "1 1 1 1"}
    return header("ascii", **lines)


def colour(cloud: PointCloud) -> set[tuple[int, ...]]:
    names = [name for name in ("red", "green", "blue", "alpha") if name in cloud.fields]
    return set(zip(*(cloud.fields[name].tolist() for name in names), strict=True))


@pytest.mark.parametrize("kind", ["I", "U", "i"])
@pytest.mark.parametrize("text", ["4278850810", "-16116486"])
def test_packed_colours_of_either_sign(tmp_path: Path, kind: str, text: str) -> None:
    cloud = cloud_of(tmp_path, with_field("rgba", kind) + rows([text]))
    assert colour(cloud) == {(10, 20, 250, 255)}
    assert colour(cloud_of(tmp_path, with_field("rgb", kind) + rows([text]))) == {(10, 20, 250)}


def test_colours_as_the_bits_of_a_float(tmp_path: Path) -> None:
    packed = np.array([0x000A14FA, 0xFF0A14FA], np.uint32).view(np.float32)
    cloud = cloud_of(tmp_path, with_field("rgb", "F") + rows([repr(float(value)) for value in packed]))
    assert colour(cloud) == {(10, 20, 250)}
    cloud = cloud_of(tmp_path, with_field("rgba", "f") + rows([f"{value:.9g}" for value in packed]))
    assert colour(cloud) == {(10, 20, 250, 0), (10, 20, 250, 255)}
    # Black is 0 in every way of writing it.
    assert colour(cloud_of(tmp_path, with_field("rgb", "F") + rows(["0"]))) == {(0, 0, 0)}


@pytest.mark.parametrize("text", ["660730", "4278850810", "-16116486"])
def test_whole_numbers_of_colours_declared_float(tmp_path: Path, text: str) -> None:
    message = "the field 'rgb' is declared F, but its colours are whole numbers; they were read as packed"
    assert colour(cloud_of(tmp_path, with_field("rgb", "F") + rows([text]), message)) == {(10, 20, 250)}
    cloud = cloud_of(tmp_path, with_field("rgb", "F") + rows(["0", "nan", text]), message)
    assert colour(cloud) == {(0, 0, 0), (10, 20, 250)}


def test_colours_that_look_like_rounded_whole_numbers(tmp_path: Path) -> None:
    bits = int(np.array(4.2108e6, np.float32).view(np.uint32))
    message = "they were read as PCL reads them, as the bits of a float, and may be wrong"
    cloud = cloud_of(tmp_path, with_field("rgb", "F") + rows(["4.2108e+06", "0"]), message)
    assert colour(cloud) == {(bits >> 16 & 255, bits >> 8 & 255, bits & 255), (0, 0, 0)}


@pytest.mark.parametrize(
    ("kind", "size", "value"),
    [("U", 1, 256), ("U", 1, -1), ("I", 1, 128), ("I", 2, 40_000), ("I", 4, 4278850810), ("U", 4, -5)],
)
def test_whole_numbers_beyond_their_type(tmp_path: Path, kind: str, size: int, value: int) -> None:
    message = f"but holds numbers from {min(value, 0)} to {max(value, 0)}; they were read as they are"
    cloud = cloud_of(tmp_path, with_field("label", kind, size) + rows([value, 0]), message)
    np.testing.assert_array_equal(cloud.fields["label"], [value, 0] * (COUNT // 2))
    inside = cloud_of(tmp_path, with_field("label", kind, size) + rows([7, 0])).fields["label"]
    assert inside.dtype == np.dtype(f"{kind.lower()}{size}")


def test_the_largest_whole_numbers(tmp_path: Path) -> None:
    for kind, value in (("U", 2**64 - 1), ("I", -(2**63))):
        cloud = cloud_of(tmp_path, with_field("time", kind, 8) + rows([value]))
        assert cloud.fields["time"].tolist() == [value] * COUNT


# Comments of this library.


@pytest.mark.parametrize("words", ["", "1 2", "a b c", "1 2 nan", "1 2 3 4"])
def test_an_origin_that_makes_no_sense(tmp_path: Path, words: str) -> None:
    content = header().replace(b"FIELDS", f"# surfsig origin {words}\nFIELDS".encode())
    refused(tmp_path, content + points().tobytes(), "a comment of its header is broken")


def test_an_origin_without_doubles_is_added(tmp_path: Path) -> None:
    content = header(VIEWPOINT="1 2 3 1 0 0 0").replace(b"FIELDS", b"# surfsig origin 1e6 2e6 3\nFIELDS")
    viewpoint = b"# surfsig viewpoint 5 6 7\nFIELDS"
    expected = {b"FIELDS": [1e6 + 1, 2e6 + 2, 6], viewpoint: [5, 6, 7]}
    for line, place in expected.items():
        (tmp_path / "a.pcd").write_bytes(content.replace(b"FIELDS", line) + points().tobytes())
        cloud = read(tmp_path / "a.pcd")
        np.testing.assert_array_equal(cloud.points, points() + np.array([1e6, 2e6, 3]))
        assert cloud.viewpoint is not None
        assert cloud.viewpoint.tolist() == place


def test_pypcd_stores_what_lzf_does_not_make_smaller(tmp_path: Path) -> None:
    planes = np.random.default_rng(5).normal(size=(3, COUNT)).astype(np.float32)
    data = planes.tobytes()
    path = tmp_path / "a.pcd"
    path.write_bytes(
        header("binary_compressed", VIEWPOINT=None) + np.array([len(data)] * 2, "<u4").tobytes() + data
    )
    np.testing.assert_array_equal(read(path).points, planes.T)


@pytest.mark.parametrize("byte_order", ["utf-16-le", "utf-16-be"])
def test_a_header_in_utf_16_is_named(tmp_path: Path, byte_order: str) -> None:
    ply = "ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nend_header\n1\n"
    for name, text in (("PCD", (header("ascii") + rows()).decode()), ("PLY", ply)):
        path = tmp_path / f"a.{name.lower()}"
        path.write_bytes(("\ufeff" + text).encode(byte_order))
        with pytest.raises(FileFormatError, match=f"is a {name} file in UTF-16"):
            read(path)
