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
        (OBJ + "f 1 2 5\n", "line 9: a face refers to vertex 5, there are 4"),
        ("v 1 2 3\nf -1 -2 -1\n", "line 2: a face refers to vertex -2, 1 are before it"),
        (OBJ + "f 0 1 2\n", "line 9: a face refers to vertex 0"),
        (OBJ + "f 1 2\n", "line 9: a face with 2 corners"),
        (OBJ + "f 1 2 x\n", "line 9: 'x' is no number of a vertex"),
        (OBJ + "f 1 2 " + "9" * 5000 + "\n", "is no number of a vertex"),
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
