"""PLY as other programs write it: headers, types, names, lists, colours and faces, by value."""

import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

POINTS = [[1.5, -2.25, 3.0], [4.125, 5.0, -6.5]]
TEXT = "1.5 -2.25 3\n4.125 5 -6.5\n"
AXES = "property float x\nproperty float y\nproperty float z\n"


def header(properties: str = AXES, data: str = "ascii", rest: str = "", count: int = 2) -> str:
    return f"ply\nformat {data} 1.0\nelement vertex {count}\n{properties}{rest}end_header\n"


def save(folder: Path, content: bytes | str) -> Path:
    path = folder / "a.ply"
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def quiet(folder: Path, content: bytes | str, **options: Any) -> PointCloud:
    """Read a file that gives no warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(save(folder, content), **options)


@pytest.mark.parametrize("name", ["ply_bom", "ply_float_count_list", "ply_plyfile34_int64"])
def test_odd_ply_headers(shared_data: Path, name: str) -> None:
    cloud = read(shared_data / "odd_files" / "ply_headers" / f"{name}.ply")
    t = np.arange(10) / 10
    np.testing.assert_allclose(cloud.points, np.column_stack([t, 1 + 2 * t, 5 * t**2]), atol=1e-6)
    if name == "ply_plyfile34_int64":
        stamps = cloud.fields["timestamp"]
        assert stamps.dtype == np.int64
        assert stamps.tolist() == list(range(5176470752137, 5176470752147))


def test_odd_ply_float_colours(shared_data: Path) -> None:
    cloud = read(shared_data / "odd_files" / "ply_float_colours" / "ply_floatcol01.ply")
    assert [cloud.fields[name].tolist() for name in ("red", "green", "blue")] == [
        [0, 255] * 5,
        [0] * 10,
        [255] * 10,
    ]
    assert cloud.fields["red"].dtype == np.uint8


@pytest.mark.parametrize("end", ["\n", "\r\n", "\r"])
@pytest.mark.parametrize("mark", ["", "\ufeff"])
def test_line_ends_and_byte_order_marks(tmp_path: Path, end: str, mark: str) -> None:
    assert quiet(tmp_path, mark + (header() + TEXT).replace("\n", end)).points.tolist() == POINTS
    # The first number's first byte is a line feed.
    rows = np.array([[1.1754944e-37, 0, 0], *POINTS], "<f4")
    rows.view(np.uint8)[0, 0] = 10
    binary = (mark + header(data="binary_little_endian", count=3)).replace("\n", end).encode()
    cloud = quiet(tmp_path, binary + rows.tobytes())
    assert cloud.points.tobytes() == rows.tobytes()


@pytest.mark.parametrize(
    ("name", "kind"),
    [
        ("int64", "q"), ("int64_t", "q"), ("longlong", "q"), ("long", "q"), ("uint64", "Q"),
        ("uint64_t", "Q"), ("ulonglong", "Q"), ("ulong", "Q"), ("INT64", "q"),
    ],
)  # fmt: skip
def test_whole_numbers_of_64_bits(tmp_path: Path, name: str, kind: str) -> None:
    values = [2**63 - 1, 3] if kind == "q" else [2**64 - 1, 3]
    properties = f"{AXES}property {name} stamp\n"
    for order, data in (("<", "binary_little_endian"), (">", "binary_big_endian")):
        body = b"".join(
            struct.pack(order + "3f" + kind, *point, value)
            for point, value in zip(POINTS, values, strict=True)
        )
        cloud = quiet(tmp_path, header(properties, data).encode() + body)
        assert cloud.points.tolist() == POINTS
        assert cloud.fields["stamp"].tolist() == values
    rows = "".join(f"{line} {value}\n" for line, value in zip(TEXT.splitlines(), values, strict=True))
    assert quiet(tmp_path, header(properties) + rows).fields["stamp"].tolist() == values


def test_long_has_4_bytes_where_the_file_says_so(tmp_path: Path) -> None:
    properties = f"property long id\n{AXES}property ulong more\n"
    body = b"".join(struct.pack("<i3fI", -7, *point, 2**32 - 1) for point in POINTS)
    cloud = quiet(tmp_path, header(properties, "binary_little_endian").encode() + body)
    assert cloud.points.tolist() == POINTS
    assert cloud.fields["id"].tolist() == [-7, -7]
    assert cloud.fields["more"].tolist() == [2**32 - 1] * 2


def test_a_property_twice_is_left_out_if_it_is_the_same(tmp_path: Path) -> None:
    properties = AXES + "property float q\nproperty double q\nproperty float x\n"
    rows = "1.5 -2.25 3 nan nan 1.5\n4.125 5 -6.5 7 7 4.125\n"
    cloud = quiet(tmp_path, header(properties) + rows)
    assert cloud.points.tolist() == POINTS
    assert list(cloud.fields) == ["q"]
    np.testing.assert_array_equal(cloud.fields["q"], np.array([np.nan, 7], np.float32))


def test_a_property_twice_with_other_values_is_numbered(tmp_path: Path) -> None:
    properties = AXES + "property int q_2\nproperty int q\nproperty int q\nproperty int q\n"
    with pytest.warns(UserWarning, match=r"several properties of the vertices are called 'q'.*'q_3'"):
        cloud = read(save(tmp_path, header(properties) + "1.5 -2.25 3 1 2 3 2\n4.125 5 -6.5 4 5 6 5\n"))
    assert {name: values.tolist() for name, values in cloud.fields.items()} == {
        "q_2": [1, 4],
        "q": [2, 5],
        "q_3": [3, 6],
    }


def test_many_properties_of_one_name_take_no_time(tmp_path: Path) -> None:
    properties = AXES + "property uchar a\n" * 20_000
    content = header(properties, "binary_little_endian", count=1).encode() + struct.pack("<3f", 1, 2, 3)
    assert list(quiet(tmp_path, content + bytes(20_000)).fields) == ["a"]


@pytest.mark.parametrize("count", ["float", "double"])
def test_lists_whose_length_is_no_whole_type(tmp_path: Path, count: str) -> None:
    kind = count[0]
    rest = f"property list {count} int more\nelement face 1\nproperty list {count} int vertex_indices\n"
    body = b"".join(
        struct.pack(f"<3f{kind}{length}i", *point, length, *[9] * length)
        for point, length in zip(POINTS, (1, 2), strict=True)
    ) + struct.pack(f"<{kind}3i", 3, 0, 1, 1)
    cloud = quiet(tmp_path, header(rest=rest, data="binary_little_endian").encode() + body)
    assert cloud.points.tolist() == POINTS
    for length in ("{}", "{}.0", "{}.000000e+00"):
        rows = [
            f"{line} {length.format(i + 1)}{' 9' * (i + 1)}\n" for i, line in enumerate(TEXT.split("\n")[:2])
        ]
        text = "".join(rows) + length.format(3) + " 0 1 1\n"
        assert quiet(tmp_path, header(rest=rest) + text).points.tolist() == POINTS


@pytest.mark.parametrize("length", [np.nan, np.inf, -1.0, 2.5, 1e300])
def test_list_lengths_that_are_none(tmp_path: Path, length: float) -> None:
    rest = "element face 1\nproperty list double int vertex_indices\n"
    body = np.array(POINTS, np.float32).tobytes() + struct.pack("<d3i", length, 0, 1, 1)
    with pytest.raises(FileFormatError, match=r"has the length|cut off"):
        read(save(tmp_path, header(rest=rest, data="binary_little_endian").encode() + body))


def test_a_list_length_of_64_bits_is_no_promise(tmp_path: Path) -> None:
    rest = "element face 2\nproperty list uint64 int vertex_indices\n"
    for length in (2**64 - 1, 2**62, 2**40):
        body = np.array(POINTS, np.float32).tobytes() + struct.pack("<QiQ3i", 1, 0, length, 0, 1, 1)
        with pytest.raises(FileFormatError, match="cut off"):
            read(save(tmp_path, header(rest=rest, data="binary_little_endian").encode() + body))


@pytest.mark.parametrize(
    "head",
    [
        "PLY\nFORMAT ASCII 1.0\nELEMENT VERTEX 2\nPROPERTY FLOAT X\nproperty Float Y\n"
        "Property float Z\nEND_HEADER\n",
        "ply  \nformat   ascii\t1.0 \nelement  vertex   2\nproperty  float\tx\n property float y\n"
        "property float z \n  end_header\n",
        "ply\nobj_info first\ncomment\ncomment vertex 7\nformat ascii 1.0\nobj_info a b\nelement vertex 2\n"
        + AXES
        + "comment property float q\nobj_info end_header\nend_header\n",
        "ply\nelement vertex 2\n" + AXES + "format ascii 1.0\nend_header\n",
        "ply\nformat ascii\n\nelement vertex 2\n" + AXES + "\nend_header\n",
    ],
)  # fmt: skip
def test_headers_of_other_programs(tmp_path: Path, head: str) -> None:
    assert quiet(tmp_path, head + TEXT).points.tolist() == POINTS


def test_the_format_may_come_after_the_properties(tmp_path: Path) -> None:
    head = "ply\nelement vertex 2\n" + AXES + "format binary_big_endian 1.0\nend_header\n"
    assert quiet(tmp_path, head.encode() + np.array(POINTS, ">f4").tobytes()).points.tolist() == POINTS


def test_a_name_of_several_words_is_joined(tmp_path: Path) -> None:
    cloud = quiet(tmp_path, header(AXES + "property int my own label\n") + "1 2 3 4\n5 6 7 8\n")
    assert cloud.fields["my_own_label"].tolist() == [4, 8]


@pytest.mark.parametrize("name", ["vertices", "point", "Points"])
def test_points_by_another_name(tmp_path: Path, name: str) -> None:
    rest = "element face 1\nproperty list uchar int vertex_indices\n"
    text = header(rest=rest).replace("element vertex", f"element {name}") + TEXT + "3 0 1 1\n"
    with pytest.warns(UserWarning, match=f"points are called '{name}', not 'vertex'"):
        assert read(save(tmp_path, text)).points.tolist() == POINTS


def test_two_elements_with_coordinates_and_none_called_vertex(tmp_path: Path) -> None:
    rest = "element b 1\n" + AXES
    text = header(rest=rest).replace("element vertex", "element a") + TEXT + "1 2 3\n"
    with pytest.raises(FileFormatError, match=r"without vertices \(a, b\)"):
        read(save(tmp_path, text))


def test_vertices_twice_give_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="2 elements are called 'vertex'; only the first is read"):
        assert len(read(save(tmp_path, header(rest="element vertex 1\n" + AXES) + TEXT + "1 2 3\n"))) == 2


@pytest.mark.parametrize(
    ("kind", "values", "expected", "dtype"),
    [
        ("float", "0 0.5 1", [0, 128, 255], np.uint8),
        ("double", "0 1 1", [0, 255, 255], np.uint8),
        ("float", "0 1 255", [0, 1, 255], np.float32),
        ("float", "0.25 nan 1", [0.25, np.nan, 1], np.float32),
        ("uchar", "0 1 1", [0, 1, 1], np.uint8),
        ("ushort", "0 1 255", [0, 1, 255], np.uint16),
        ("int", "0 1 255", [0, 1, 255], np.uint8),
        ("int", "0 1 256", [0, 1, 256], np.uint16),
        ("int", "0 1 -1", [0, 1, -1], np.int32),
    ],
)
def test_colours_mean_what_their_type_says(
    tmp_path: Path, kind: str, values: str, expected: list[float], dtype: type
) -> None:
    properties = AXES + "".join(f"property {kind} diffuse_{name}\n" for name in ("red", "green", "blue"))
    fields = quiet(tmp_path, header(properties, count=1) + f"1 2 3 {values}\n").fields
    np.testing.assert_array_equal([float(part[0]) for part in fields.values()], np.array(expected, dtype))
    assert {part.dtype for part in fields.values()} == {np.dtype(dtype)}


def test_64_bits_that_double_would_round_are_told_when_written(tmp_path: Path) -> None:
    cloud = PointCloud(np.array(POINTS, np.float32), fields={"stamp": np.array([2**53 + 1, 0])})
    with pytest.warns(UserWarning, match="some are rounded to double"):
        write(tmp_path / "a.ply", cloud)
    cloud.fields["stamp"] = np.array([2**53, -(2**53)])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        write(tmp_path / "a.ply", cloud)


SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0], [0, 0, 6]], np.float32)
FACES = (
    "element face {}\nproperty uchar flags\nproperty list uchar int vertex_{}\nproperty list uchar int more\n"
)


def mesh(data: str, faces: list[list[int]], name: str = "indices") -> bytes:
    head = header(data=data, rest=FACES.format(len(faces), name), count=5).encode()
    if data == "ascii":
        lines = [" ".join(map(str, point)) for point in SQUARE]
        lines += [f"7 {len(face)} {' '.join(map(str, face))} 1 3" for face in faces]
        return head + ("\n".join(lines) + "\n").encode()
    order = "<" if "little" in data else ">"
    rows = b"".join(struct.pack(f"{order}BB{len(face)}iBi", 7, len(face), *face, 1, 3) for face in faces)
    vertices: bytes = SQUARE.astype(order + "f4").tobytes()
    return head + vertices + rows


@pytest.mark.parametrize("data", ["ascii", "binary_little_endian", "binary_big_endian"])
@pytest.mark.parametrize("faces", [[[0, 1, 2, 3], [0, 1, 4]], [[0, 1, 2], [0, 2, 3], [0, 1, 4]]])
def test_samples_spread_over_the_faces(tmp_path: Path, data: str, faces: list[list[int]]) -> None:
    cloud = quiet(tmp_path, mesh(data, faces, "index"), samples=1000)
    # The square has the area 4, the triangle 6.
    upright = cloud.fields["ny"] != 0
    assert upright.sum() == 600
    assert (cloud.points[~upright, 2] == 0).all()
    assert (cloud.points[upright, 1] == 0).all()
    assert set(cloud.fields["nz"][~upright].tolist()) == {1.0}
    assert cloud.points[~upright].max(axis=0)[:2].min() > 1.9
    assert len(quiet(tmp_path, mesh(data, faces))) == 5


@pytest.mark.parametrize("data", ["ascii", "binary_little_endian"])
def test_bad_faces_are_left_out(tmp_path: Path, data: str) -> None:
    path = save(tmp_path, mesh(data, [[0, 1], [0, 1, 2, 3], [0, 1, 5], [-1, 1, 2], []]))
    with pytest.warns(UserWarning, match="4 of 5 faces are left out, the first of which is number 1"):
        cloud = read(path, samples=100)
    assert (cloud.points[:, 2] == 0).all()
    assert len(quiet(tmp_path, path.read_bytes())) == 5


def test_samples_need_faces(tmp_path: Path) -> None:
    with pytest.raises(InvalidInputError, match="has no faces, over which samples could be spread"):
        read(save(tmp_path, header() + TEXT), samples=3)
    strips = "element tristrips 1\nproperty list int int vertex_indices\n"
    with pytest.raises(InvalidInputError, match="has strips of triangles, but no faces"):
        read(save(tmp_path, header(rest=strips) + TEXT + "3 0 1 1\n"), samples=3)


def test_samples_of_a_large_mesh_of_triangles_and_squares(tmp_path: Path) -> None:
    # Several blocks, the first of which has triangles only.
    side = 200
    grid = np.stack(np.meshgrid(np.arange(side), np.arange(side), indexing="ij"), axis=-1).reshape(-1, 2)
    points = np.column_stack([grid, np.zeros(len(grid))]).astype("<f4")
    corner = (np.arange(side - 1)[:, None] * side + np.arange(side - 1)).ravel()
    half = len(corner) // 2
    rows = b""
    for a in corner[:half]:
        rows += struct.pack("<B3iB3i", 3, a, a + side, a + side + 1, 3, a, a + side + 1, a + 1)
    for a in corner[half:]:
        rows += struct.pack("<B4i", 4, a, a + side, a + side + 1, a + 1)
    rest = f"element face {2 * half + len(corner) - half}\nproperty list uchar int vertex_indices\n"
    head = header(data="binary_little_endian", rest=rest, count=len(points)).encode()
    cloud = quiet(tmp_path, head + points.tobytes() + rows, samples=4 * len(corner))
    assert (cloud.fields["nz"] == 1).all()
    cells = np.floor(cloud.points[:, :2]).astype(int) @ [side, 1]
    counts = np.unique(cells, return_counts=True)[1]
    assert len(counts) == len(corner)
    # Four samples a cell, but for the pieces at the ends of triangles.
    assert counts.min() >= 2
    assert counts.max() <= 6
