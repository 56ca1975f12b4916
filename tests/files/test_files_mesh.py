"""OBJ and STL by value: hand-made files, and trimesh as the reference reader."""

import contextlib
import re
import struct
import warnings
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read

CORNERS = np.array([[0, 0, 0], [2, 0, 0], [0, 1, 0], [0, 0, 4]], np.float32)
TRIANGLES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])
OBJ = "".join(f"v {x:g} {y:g} {z:g}\n" for x, y, z in CORNERS) + "".join(
    f"f {a + 1} {b + 1} {c + 1}\n" for a, b, c in TRIANGLES
)


def binary_stl(corners: NDArray[Any] = CORNERS, triangles: NDArray[Any] = TRIANGLES) -> bytes:
    facets = b"".join(struct.pack("<12fH", 0, 0, 0, *corners[t].ravel(), 0) for t in triangles)
    return b"solid, in spite of its name binary".ljust(80) + struct.pack("<I", len(triangles)) + facets


def ascii_stl(corners: NDArray[Any] = CORNERS, triangles: NDArray[Any] = TRIANGLES) -> bytes:
    lines = ["solid a vertex of endfacet"]
    for triangle in triangles:
        lines += ["facet normal 0 0 0", "  outer loop"]
        lines += [f"    vertex {x} {y} {z:e}" for x, y, z in corners[triangle]]
        lines += ["  endloop", "endfacet"]
    return "\n".join([*lines, "endsolid", ""]).encode()


CONTENTS = {"a.stl": binary_stl(), "b.stl": ascii_stl(), "a.obj": OBJ.encode()}


def save(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content.encode() if isinstance(content, str) else content)
    return path


def normals_of(fields: dict[str, NDArray[Any]]) -> NDArray[Any]:
    return np.column_stack([fields[name] for name in ("nx", "ny", "nz")])


@pytest.mark.parametrize(("name", "dtype"), [("a.stl", np.float32), ("b.stl", np.float64)])
def test_stl_gives_each_vertex_once_with_its_normal(tmp_path: Path, name: str, dtype: type) -> None:
    cloud = read(save(tmp_path, name, CONTENTS[name]))
    # In the order in which they come first: 0, 2, 1, 3.
    np.testing.assert_array_equal(cloud.points, CORNERS[[0, 2, 1, 3]])
    assert cloud.points.dtype == dtype
    # The areas of the faces at x, y, z = 0 are 4 * 1 / 2, 4 * 2 / 2, 2 * 1 / 2; the slanted face's vector
    # area is their sum, turned round.
    at_zero, slanted = -np.array([2, 4, 1]), np.array([2, 4, 1])
    # A vertex on an axis belongs to the slanted face and to the two faces at 0 along that axis.
    sums = np.array([at_zero, *(slanted - np.array([[2, 0, 1], [0, 4, 1], [2, 4, 0]]))])
    expected = sums / np.linalg.norm(sums, axis=1)[:, None]
    np.testing.assert_allclose(normals_of(cloud.fields), expected, atol=1e-7)


def test_stl_of_a_sphere_has_the_vertices_of_trimesh(tmp_path: Path) -> None:
    sphere = trimesh.creation.icosphere(subdivisions=3, radius=2.0)
    for file_type in ("stl", "stl_ascii"):
        path = tmp_path / f"{file_type}.stl"
        sphere.export(path, file_type=file_type)
        reference: Any = trimesh.load(path, file_type="stl", process=True)
        cloud = read(path)
        assert len(cloud) == len(reference.vertices) == 642
        nearest = np.argmin(np.linalg.norm(cloud.points[:, None] - reference.vertices, axis=2), axis=1)
        np.testing.assert_allclose(cloud.points, reference.vertices[nearest], atol=1e-6)
        sums = np.zeros((642, 3))
        weighted = reference.face_normals * reference.area_faces[:, None]
        np.add.at(sums, reference.faces, weighted[:, None])
        expected = (sums / np.linalg.norm(sums, axis=1)[:, None])[nearest]
        np.testing.assert_allclose(normals_of(cloud.fields), expected, atol=1e-5)


def test_stl_vertices_at_zero_of_either_sign_are_one(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, 0]], np.float32)
    cloud = read(save(tmp_path, "a.stl", binary_stl(corners, np.array([[0, 1, 2], [3, 2, 1]]))))
    assert len(cloud) == 3
    # The two faces cancel out.
    assert not normals_of(cloud.fields).any()


@pytest.mark.parametrize(("name", "kind"), [("a.stl", "STL"), ("b.stl", "ASCII STL"), ("a.obj", "OBJ")])
def test_meshes_are_known_by_content(tmp_path: Path, name: str, kind: str) -> None:
    assert format_name(save(tmp_path, "mesh.dat", CONTENTS[name])) == kind


def test_84_zero_bytes_are_an_empty_stl_file_by_name_only(tmp_path: Path) -> None:
    assert len(read(save(tmp_path, "a.stl", bytes(84)))) == 0
    with pytest.raises(FileFormatError, match="is not a PLY file"):
        read(save(tmp_path, "a.ply", bytes(84)))


@pytest.mark.parametrize(
    "begin", ["# made by hand\r\n\r\n", "mtllib a.mtl\no thing\n", "vn 0 0 1\n", "\ufeff", "\n" * 3000]
)
def test_obj_is_known_by_its_first_words(tmp_path: Path, begin: str) -> None:
    cloud = read(save(tmp_path, "mesh.txt", begin + OBJ))
    np.testing.assert_array_equal(cloud.points, CORNERS)
    assert cloud.points.dtype == np.float64
    assert cloud.fields == {}


@pytest.mark.parametrize("first", ["v x y z\n1 2 3 4\n", "x,y,z\n1,2,3\n", "1 2 3\n"])
def test_text_stays_text(tmp_path: Path, first: str) -> None:
    assert format_name(save(tmp_path, "a.txt", first)) == "text"


def test_obj_keeps_order_repeated_and_unused_vertices(tmp_path: Path) -> None:
    # trimesh drops, splits or reorders such vertices.
    text = "v 5 5 5\nv 0 0 0\nv 1 0 0\nv 1 0 0\nvt 0 0\nvt 1 1\nusemtl m\nf 2/1 3/2 4/1 # c\nf 2/2 3/1 4/2\n"
    cloud = read(save(tmp_path, "a.obj", text))
    np.testing.assert_array_equal(cloud.points, [[5, 5, 5], [0, 0, 0], [1, 0, 0], [1, 0, 0]])


@pytest.mark.parametrize(
    ("colours", "expected"),
    [
        (["0 0.2 1", "1 0 0.6"], [[0, 51, 255], [255, 0, 153]]),
        (["7 8 255", "0 1 2"], [[7, 8, 255], [0, 1, 2]]),
    ],
)
def test_obj_colours(tmp_path: Path, colours: list[str], expected: list[list[int]]) -> None:
    cloud = read(save(tmp_path, "a.obj", "".join(f"v 1 2 3 {colour}\n" for colour in colours)))
    values = np.column_stack([cloud.fields[name] for name in ("red", "green", "blue")])
    np.testing.assert_array_equal(values, expected)
    assert values.dtype == np.uint8


def test_obj_normals_only_if_each_vertex_has_its_own(tmp_path: Path) -> None:
    vertices = "v 0 0 0\nv 1 0 0\nv 0 1 0\n"
    normals = "vn 0 0 1\nvn 0 1 0\nvn 1 0 0\n"
    for faces in ("", "f 1//1 2//2 3//3\n", "f 1/9/1 2/9/2 3/9/3\n", "f -3//-3 -2//-2 -1//-1\n"):
        cloud = read(save(tmp_path, "a.obj", vertices + normals + faces))
        np.testing.assert_array_equal(normals_of(cloud.fields), np.eye(3)[::-1])
    for rest in (normals + "f 1//2 2//1 3//3\n", "vn 0 0 1\nf 1//1 2//1 3//1\n"):
        assert read(save(tmp_path, "a.obj", vertices + rest)).fields == {}


def test_obj_faces_count_back_and_have_any_number_of_corners(tmp_path: Path) -> None:
    # A square as one face, then a second far away by numbers that count back, continued on a next line.
    square = "v 0 0 {z}\nv 1 0 {z}\nv 1 1 {z}\nv 0 1 {z}\n"
    text = square.format(z=0) + "f 1 2 3 4\n" + square.format(z=9) + "f -4 -3 \\\n-2 -1\n"
    cloud = read(save(tmp_path, "a.obj", text), samples=1000)
    assert [int((cloud.points[:, 2] == z).sum()) for z in (0, 9)] == [500, 500]
    np.testing.assert_array_equal(normals_of(cloud.fields), np.tile([0, 0, 1], (1000, 1)))


@pytest.mark.parametrize("name", CONTENTS)
def test_samples_are_even_over_the_area(tmp_path: Path, name: str) -> None:
    count = 140_000
    cloud = read(save(tmp_path, name, CONTENTS[name]), samples=count)
    normals = np.array([[0, 0, -1], [0, -1, 0], [-1, 0, 0], np.array([2, 4, 1]) / 21**0.5])
    areas = np.array([1, 4, 2, 21**0.5])
    faces = np.argmax(normals_of(cloud.fields) @ normals.T, axis=1)
    np.testing.assert_allclose(normals_of(cloud.fields), normals[faces], atol=1e-7)
    for face, corners in enumerate(CORNERS[TRIANGLES]):
        points = cloud.points[faces == face]
        # A face's share is exact but for the two pieces at its ends.
        assert abs(len(points) - count * areas[face] / areas.sum()) <= 2
        np.testing.assert_allclose((points - corners[0]) @ normals[face], 0, atol=1e-6)
        # The mean and the scatter of a triangle: sums over its corners of c - m, by 12.
        middle = corners.mean(axis=0)
        np.testing.assert_allclose(points.mean(axis=0), middle, atol=0.03)
        expected = (corners - middle).T @ (corners - middle) / 12
        np.testing.assert_allclose(np.cov(points.T), expected, atol=0.03)


def test_samples_are_the_same_each_time(tmp_path: Path) -> None:
    path = save(tmp_path, "a.stl", CONTENTS["a.stl"])
    np.testing.assert_array_equal(read(path, samples=50).points, read(path, samples=50).points)


@pytest.mark.parametrize("samples", [0, -1, 2.5, "many"])
def test_samples_must_be_a_positive_whole_number(tmp_path: Path, samples: Any) -> None:
    with pytest.raises(InvalidInputError, match="samples must be a positive whole number"):
        read(save(tmp_path, "a.obj", OBJ), samples=samples)


@pytest.mark.parametrize("text", ["v 1 2 3\n", "v 1 2 3\nv 4 5 6\nf 1 2 1\n"])
def test_samples_need_a_surface(tmp_path: Path, text: str) -> None:
    with pytest.raises(InvalidInputError, match="has no faces with an area"):
        read(save(tmp_path, "a.obj", text), samples=5)


def assert_refused(path: Path, content: bytes | str, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        read(save(path.parent, path.name, content))
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (OBJ + "v 1 2\n", "line 9: 2 values where 3 are expected"),
        ("v 1 2\n", "line 1: 2 values where 3 are expected"),
        (OBJ + "v 1 2 nan\n", "a vertex is no number"),
        (OBJ + "v 1 2 1e300\n", "a vertex is no number, or beyond"),
        (OBJ + "v\n", "some without numbers"),
        (OBJ + "vn 1 2\n", "line 9: 2 values where 3 are expected"),
        (OBJ + "w 1 2 3\n", "line 9 is none of OBJ's: 'w 1 2 3'"),
        ("# nothing\n", "has no vertices"),
    ],
)
def test_broken_obj(tmp_path: Path, content: str, message: str) -> None:
    assert_refused(tmp_path / "a.obj", content, re.escape(message))


BAD_FACES = ["f 1 2 5", "f -9 -2 -1", "f 0 1 2", "f 1 2", "f", "f 1 2 x", "f 1 2 " + "9" * 5000]


@pytest.mark.parametrize("face", BAD_FACES)
def test_obj_faces_that_are_none_are_left_out(tmp_path: Path, face: str) -> None:
    path = save(tmp_path, "a.obj", OBJ + face + "\n" + "f 1 2 3 4\n")
    told = "1 of 6 faces are left out, the first of which is number 5: they have fewer than three corners"
    with pytest.warns(UserWarning, match=told) as warned:
        cloud = read(path)
    assert len(warned) == 1
    np.testing.assert_array_equal(cloud.points, CORNERS)
    with pytest.warns(UserWarning, match=told) as warned:
        sampled = read(path, samples=100)
    assert len(warned) == 1
    whole = read(save(tmp_path, "b.obj", OBJ + "f 1 2 3 4\n"), samples=100)
    np.testing.assert_array_equal(sampled.points, whole.points)


@pytest.mark.filterwarnings("ignore:.*faces are left out")
def test_obj_normals_do_not_count_where_a_face_names_a_wrong_one(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 0 1 0\nvn 1 0 0\nf 1//1 2//2 3//{}\n"
    assert "nx" in read(save(tmp_path, "a.obj", text.format(3))).fields
    for number in ("0", "9", "x"):
        assert read(save(tmp_path, "a.obj", text.format(number))).fields == {}


def test_odd_obj_faces(shared_data: Path) -> None:
    folder = shared_data / "odd_files" / "obj_faces"
    corners = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]
    with pytest.warns(UserWarning, match="2 of 2 faces are left out"):
        assert read(folder / "obj_bad_face.obj").points.tolist() == corners
    assert read(folder / "obj_utf16.obj").points.tolist() == corners


@pytest.mark.parametrize("encoding", ["utf-8-sig", "utf-16", "utf-16-le", "utf-16-be"])
@pytest.mark.parametrize("name", ["a.obj", "a.dat"])
def test_obj_in_encodings_of_windows(tmp_path: Path, encoding: str, name: str) -> None:
    mark = "\ufeff" if encoding in ("utf-16-le", "utf-16-be") else ""
    path = save(tmp_path, name, (mark + "# größer\r\n" + OBJ.replace("\n", "\r\n")).encode(encoding))
    assert format_name(path) == "OBJ"
    np.testing.assert_array_equal(read(path).points, CORNERS)
    assert len(read(path, samples=10)) == 10


def test_obj_colours_of_some_vertices(tmp_path: Path) -> None:
    path = save(tmp_path, "a.obj", "v 1 2 3 1 0 0.5\nv 4 5 6\nv 7 8 9 0 1 0\n")
    with pytest.warns(UserWarning, match="2 of 3 vertices have a colour; red, green and blue of the others"):
        cloud = read(path)
    np.testing.assert_array_equal(cloud.points, [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    colours = np.column_stack([cloud.fields[name] for name in ("red", "green", "blue")])
    np.testing.assert_array_equal(colours, [[1, 0, 0.5], [np.nan] * 3, [0, 1, 0]])


def test_obj_colours_of_some_vertices_in_blocks_of_their_own(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr("surfsig.files.lines.BLOCK_BYTES", 16)
    path = save(tmp_path, "a.obj", "v 1 2 3\n" * 9 + "v 4 5 6 0 0.5 1\n" * 9 + "v 7 8 9 1\n" * 9)
    with pytest.warns(UserWarning, match="9 of 27 vertices have a colour"):
        cloud = read(path)
    assert cloud.points[:, 0].tolist() == [1] * 9 + [4] * 9 + [7] * 9
    assert np.isnan(cloud.fields["green"]).tolist() == [True] * 9 + [False] * 9 + [True] * 9
    assert sorted(cloud.fields) == ["blue", "green", "red"]


def test_obj_pure_colours_are_colours_from_0_to_1(tmp_path: Path) -> None:
    cloud = read(save(tmp_path, "a.obj", "v 1 2 3 0 0 1\nv 1 2 3 1 0 1\n"))
    assert [cloud.fields[name].tolist() for name in ("red", "green", "blue")] == [[0, 255], [0, 0], [255] * 2]


def test_obj_weights(tmp_path: Path) -> None:
    whole = read(save(tmp_path, "a.obj", "v 1 2 3 1\nv 4 5 6\nv 7 8 9 1.0\n"))
    np.testing.assert_array_equal(whole.points, [[1, 2, 3], [4, 5, 6], [7, 8, 9]])
    assert whole.fields == {}
    path = save(tmp_path, "a.obj", "v 1 2 3 1\nv 4 5 6 2\nv 7 8 9\n")
    with pytest.warns(UserWarning, match="weights of vertices are not used; they are the field 'w'"):
        cloud = read(path)
    np.testing.assert_array_equal(cloud.points, whole.points)
    assert cloud.fields["w"].tolist() == [1, 2, 1]


def test_obj_seven_numbers(tmp_path: Path) -> None:
    alpha = read(save(tmp_path, "a.obj", "v 1 2 3 0 1 0 1\nv 4 5 6 1 0 0 0.6\n"))
    assert [alpha.fields[name].tolist() for name in ("red", "green", "blue", "alpha")] == [
        [0, 255], [255, 0], [0, 0], [255, 153],
    ]  # fmt: skip
    with pytest.warns(UserWarning, match="the first is 1: taken as weights and r, g, b"):
        cloud = read(save(tmp_path, "a.obj", "v 1 2 3 1 0 0.2 0\nv 4 5 6 1 0.4 0 0.6\n"))
    assert [values.tolist() for values in cloud.fields.values()] == [[0, 102], [51, 0], [0, 153]]
    with pytest.warns(UserWarning, match="the first is 1: taken as r, g, b and alpha"):
        cloud = read(save(tmp_path, "a.obj", "v 1 2 3 1 0 0.2 1\n"))
    assert [int(values[0]) for values in cloud.fields.values()] == [255, 0, 51, 255]


def test_obj_vertices_of_every_length(tmp_path: Path) -> None:
    lengths = (3, 4, 5, 6, 7, 8, 12, 3)
    lines = [f"v {i} 2 3{' 0.2' * (length - 3)}\n" for i, length in enumerate(lengths)]
    path = save(tmp_path, "a.obj", "".join(lines) + "f 1 2 3\n")
    with pytest.warns(UserWarning, match="vertices") as warned:
        cloud = read(path)
    told = [str(warning.message).partition(": ")[2] for warning in warned]
    assert told == [
        "numbers behind the coordinates of 3 vertices are left out: they are no weight and no colour",
        "2 of 8 vertices have a colour; red, green and blue of the others are NaN",
        "weights of vertices are not used; they are the field 'w'",
    ]
    np.testing.assert_array_equal(cloud.points, [[i, 2, 3] for i in range(8)])
    assert cloud.fields["w"].tolist() == [1, 0.2, 1, 1, 1, 1, 1, 1]
    with pytest.warns(UserWarning, match="of 2 vertices are left out"):
        read(save(tmp_path, "b.obj", "v 1 2 3 4 5\n" * 2))
    assert_refused(tmp_path / "c.obj", "".join(lines) + "v 1 2\n", "line 9: 2 values where 3 are expected")
    assert_refused(tmp_path / "c.obj", "".join(lines) + "v 1 2 x 4\n", "line 9: 'x' is not a number")


def test_obj_continuation_lines(tmp_path: Path) -> None:
    text = "v 1 \\\n2 \\\n 3\nv 4 5 6\nv 7 8 \\\n9\nf 1 \\\n2 3\n"
    np.testing.assert_array_equal(
        read(save(tmp_path, "a.obj", text)).points, [[1, 2, 3], [4, 5, 6], [7, 8, 9]]
    )


@pytest.mark.filterwarnings("ignore:.*numbers behind the coordinates")
def test_obj_lines_of_any_length_need_no_more_memory(tmp_path: Path) -> None:
    import tracemalloc

    text = "v" + " 1" * 100_000 + "\n" + "v 1 2 3\n" * 20_000
    path = save(tmp_path, "a.obj", text)
    tracemalloc.start()
    assert len(read(path)) == 20_001
    assert tracemalloc.get_traced_memory()[1] < 60 * len(text)
    tracemalloc.stop()


def test_broken_stl(tmp_path: Path) -> None:
    path = tmp_path / "a.stl"
    whole = binary_stl()
    assert_refused(path, whole[:-1], "promises 4 facets of 50 bytes, the file has 283")
    assert_refused(path, whole + b"\0", "promises 4 facets of 50 bytes, the file has 285")
    assert_refused(path, b"\0" * 50, "cut off: a binary STL file has 84 bytes or more")
    assert_refused(path, b"\0" * 80 + b"\xff" * 4, "promises 4294967295 facets")
    assert_refused(path, binary_stl(CORNERS * np.float32(np.nan)), "a vertex is no number")
    text = ascii_stl()
    assert_refused(path, text.replace(b"vertex 2.0", b"vertex two", 1), "line 6: 'two' is not a number")
    assert_refused(path, text.replace(b"vertex 2.0", b"vertex nan", 1), "a vertex is no number")
    for length in range(text.index(b"vertex 0"), len(text) - 3, 7):
        assert_refused(path, text[:length], "cut off or broken|is expected|are expected|not a number")
    second = text.index(b"facet normal", text.index(b"endfacet"))
    assert_refused(path, text + text[:second], "2 solids begin, 1 end")


@pytest.mark.parametrize("name", CONTENTS)
def test_random_changes_never_crash(tmp_path: Path, name: str) -> None:
    rng = np.random.default_rng(31)
    for _ in range(150):
        broken = bytearray(CONTENTS[name])
        for place in rng.integers(0, len(broken), rng.integers(1, 6)):
            broken[place] = rng.integers(256)
        path = save(tmp_path, name, bytes(broken[: rng.integers(1, len(broken) + 200)]))
        for samples in (None, 20):
            # A last line that is cut off is worth a warning; a change may be harmless.
            with warnings.catch_warnings(), contextlib.suppress(FileFormatError, InvalidInputError):
                warnings.simplefilter("ignore", UserWarning)
                cloud = read(path, samples=samples)
                assert all(len(values) == len(cloud) for values in cloud.fields.values())
