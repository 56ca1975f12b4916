"""OBJ and STL: vertices, colours and normals against formulas and trimesh; broken files."""

import struct
import warnings
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import format_name, read

TETRAHEDRON = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], np.float32)
# Counterclockwise from outside.
FACES = np.array([[0, 2, 1], [0, 1, 3], [0, 3, 2], [1, 2, 3]])


def sphere(radius: float = 1.0) -> tuple[NDArray[np.float64], NDArray[np.int64]]:
    """A sphere of rings, its faces counterclockwise from outside."""
    rings, around = 40, 80
    heights = np.repeat(np.cos(np.linspace(0, np.pi, rings + 2)[1:-1]), around)
    angles = np.tile(np.arange(around) * 2 * np.pi / around, rings)
    width = np.sqrt(1 - heights**2)
    vertices = radius * np.stack([width * np.cos(angles), width * np.sin(angles), heights], axis=1)
    low, place = np.meshgrid(np.arange(rings - 1), np.arange(around), indexing="ij")
    a = (low * around + place).ravel()
    b = (low * around + (place + 1) % around).ravel()
    faces = np.concatenate(
        [np.stack([a, a + around, b + around], axis=1), np.stack([a, b + around, b], axis=1)]
    )
    return vertices, faces


def binary_stl(vertices: NDArray[Any], faces: NDArray[Any], head: bytes = b"made by a test") -> bytes:
    rows = np.zeros(len(faces), [("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
    rows["corners"] = vertices[faces]
    return head.ljust(80) + struct.pack("<I", len(faces)) + rows.tobytes()


def ascii_stl(vertices: NDArray[Any], faces: NDArray[Any]) -> bytes:
    text = "solid some part\n"
    for corners in vertices[faces]:
        text += "facet normal 0 0 0\n  outer loop\n"
        text += "".join("    vertex {!r} {!r} {!r}\n".format(*map(float, corner)) for corner in corners)
        text += "  endloop\nendfacet\n"
    return (text + "endsolid some part\n").encode()


def obj(vertices: NDArray[Any], faces: NDArray[Any]) -> bytes:
    text = "# from a test\nmtllib none.mtl\no thing\n"
    text += "".join("v {!r} {!r} {!r}\n".format(*map(float, vertex)) for vertex in vertices)
    return (text + "".join("f {} {} {}\n".format(*(face + 1)) for face in faces)).encode()


def saved(folder: Path, name: str, content: bytes | str) -> Path:
    path = folder / name
    path.write_bytes(content if isinstance(content, bytes) else content.encode())
    return path


def normals_of(cloud: Any) -> NDArray[Any]:
    return np.stack([cloud.fields[name] for name in ("nx", "ny", "nz")], axis=1)


@pytest.mark.parametrize("make", [binary_stl, ascii_stl])
@pytest.mark.parametrize("name", ["a.stl", "a.dat"])
def test_stl_gives_each_vertex_once(tmp_path: Path, make: Any, name: str) -> None:
    path = saved(tmp_path, name, make(TETRAHEDRON, FACES))
    cloud = read(path)
    assert format_name(path) == "STL"
    # In the order in which the faces name them: 0, 2, 1, 3.
    np.testing.assert_array_equal(cloud.points, TETRAHEDRON[[0, 2, 1, 3]])
    assert cloud.points.dtype == (np.float32 if make is binary_stl else np.float64)
    # At the origin the normals of three faces of equal area meet: the diagonal; at (1, 0, 0) those of two
    # coordinate planes of area 1/2 and the oblique one, whose area vector is (1, 1, 1) / 2.
    found = normals_of(cloud)
    np.testing.assert_allclose(found[0], -np.ones(3) / np.sqrt(3), atol=1e-7)
    np.testing.assert_allclose(found[2], [1, 0, 0], atol=1e-7)


@pytest.mark.parametrize("make", [binary_stl, ascii_stl])
def test_stl_of_a_sphere(tmp_path: Path, make: Any) -> None:
    vertices, faces = sphere(0.5)
    cloud = read(saved(tmp_path, "a.stl", make(vertices.astype(np.float32), faces)))
    order = np.lexsort(cloud.points.T)
    expected = vertices.astype(np.float32)
    np.testing.assert_array_equal(cloud.points[order], expected[np.lexsort(expected.T)])
    inner = np.abs(cloud.points[:, 2]) < 0.49
    cosines = (normals_of(cloud) * cloud.points).sum(axis=1) / 0.5
    assert cosines[inner].min() > 0.998


def test_stl_with_zeros_of_both_signs(tmp_path: Path) -> None:
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-0.0, -0.0, -0.0], [-1, 0, 0], [0, -1, 0]])
    cloud = read(saved(tmp_path, "a.stl", binary_stl(vertices, np.arange(6).reshape(2, 3))))
    assert len(cloud) == 5


def test_stl_of_several_solids_and_capitals(tmp_path: Path) -> None:
    content = ascii_stl(TETRAHEDRON, FACES)
    cloud = read(saved(tmp_path, "a.stl", content + (content.upper().replace(b"SOME PART", b"vertex 2"))))
    assert len(cloud) == 4


def test_stl_whose_header_says_solid(tmp_path: Path) -> None:
    head = b"solid\nfacet " + bytes(20)
    path = saved(tmp_path, "a.stl", binary_stl(TETRAHEDRON, FACES, head))
    assert len(read(path)) == 4


@pytest.mark.parametrize("make", [binary_stl, ascii_stl])
def test_stl_without_triangles_is_an_empty_cloud(tmp_path: Path, make: Any) -> None:
    path = saved(tmp_path, "a.stl", make(TETRAHEDRON, FACES[:0]))
    assert read(path).points.shape == (0, 3)
    with pytest.raises(FileFormatError, match="no surface to take samples of"):
        read(path, samples=5)


def test_stl_as_trimesh_reads_it(tmp_path: Path) -> None:
    trimesh = pytest.importorskip("trimesh")
    vertices, faces = sphere()
    path = saved(tmp_path, "a.stl", binary_stl(vertices, faces))
    mesh = trimesh.load(path)
    cloud = read(path)
    assert len(cloud) == len(mesh.vertices)
    ours, theirs = np.lexsort(cloud.points.T), np.lexsort(mesh.vertices.T)
    np.testing.assert_array_equal(cloud.points[ours], mesh.vertices[theirs])


@pytest.mark.parametrize(("name", "make"), [("a.stl", binary_stl), ("b.stl", ascii_stl), ("a.obj", obj)])
def test_samples_are_spread_evenly_and_always_the_same(tmp_path: Path, name: str, make: Any) -> None:
    vertices, faces = sphere()
    path = saved(tmp_path, name, make(vertices, faces))
    cloud = read(path, samples=20_000)
    np.testing.assert_array_equal(cloud.points, read(path, samples=20_000).points)
    assert cloud.points.shape == (20_000, 3)
    # Between the spheres within and around the triangles, and by Archimedes evenly in height: the polar
    # rings end at 0.997, and the share below h is (h + 0.997) / 1.994.
    lengths = np.linalg.norm(cloud.points, axis=1)
    assert lengths.max() <= 1 + 1e-6
    assert lengths.min() > 0.997
    heights = np.sort(cloud.points[:, 2])
    shares = (np.arange(20_000) + 0.5) / 20_000
    np.testing.assert_allclose((heights + 0.997) / 1.994, shares, atol=0.003)
    cosines = (normals_of(cloud) * cloud.points).sum(axis=1)
    assert cosines.min() > 0.99


def test_samples_follow_the_area_of_faces(tmp_path: Path) -> None:
    # A square of area 1, given as one face of four corners, a needle without area, a triangle of area 3.
    text = "v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 5\nv 6 0 5\nv 0 1 5\nf 1 2 3 4\nf 1 2 2\nf 5 6 7\n"
    points = read(saved(tmp_path, "a.obj", text), samples=4000).points
    assert (points[:, 2] == 0).sum() == 1000
    np.testing.assert_allclose(points[:1000].mean(axis=0), [0.5, 0.5, 0], atol=0.02)
    np.testing.assert_allclose(points[1000:].mean(axis=0), [2, 1 / 3, 5], atol=0.02)
    assert (points[:, 0] / 6 + points[:, 1] <= 1 + 1e-9)[points[:, 2] == 5].all()


def test_obj_vertices_stay_in_their_order(tmp_path: Path) -> None:
    vertices, faces = sphere()
    path = saved(tmp_path, "a.obj", obj(vertices, faces))
    cloud = read(path)
    np.testing.assert_array_equal(cloud.points, vertices)
    assert cloud.fields == {}
    trimesh = pytest.importorskip("trimesh")
    np.testing.assert_array_equal(cloud.points, trimesh.load(path, maintain_order=True).vertices)


@pytest.mark.parametrize(
    ("colours", "expected"),
    [
        ([[1, 0, 0.5], [0.2, 1, 0]], [[255, 0, 128], [51, 255, 0]]),
        ([[255, 0, 128], [51, 255, 0]], [[255, 0, 128], [51, 255, 0]]),
        ([[1, 0, 0.5, 1], [0.2, 1, 0, 0]], [[255, 0, 128, 255], [51, 255, 0, 0]]),
    ],
)
def test_obj_colours(tmp_path: Path, colours: list[list[float]], expected: list[list[int]]) -> None:
    lines = ["v 1 2 3 " + " ".join(map(str, row)) for row in colours]
    cloud = read(saved(tmp_path, "a.obj", "\n".join(lines) + "\n"))
    assert all(values.dtype == np.uint8 for values in cloud.fields.values())
    names = ["red", "green", "blue", "alpha"][: len(expected[0])]
    assert [cloud.fields[name].tolist() for name in names] == np.transpose(expected).tolist()


def test_obj_normals_where_each_vertex_has_its_own(tmp_path: Path) -> None:
    head = "v 0 0 0\nv 1 0 0\nv 0 1 0\nvn 0 0 1\nvn 1 0 0\nvn 0 1 0\n"
    for faces, kept in (
        ("", True),
        ("f 1//1 2//2 3//3\n", True),
        ("f 1/7/1 2/8/2 3/9/3\n", True),
        ("f -3//-3 -2//-2 -1//-1\n", True),
        ("f 1//2 2//2 3//2\n", False),
        ("f 1//1 2//2 3//3\nvn 0 0 1\n", False),
    ):
        cloud = read(saved(tmp_path, "a.obj", head + faces))
        assert (list(cloud.fields) == ["nx", "ny", "nz"]) is kept, faces
        if kept:
            assert normals_of(cloud).tolist() == [[0, 0, 1], [1, 0, 0], [0, 1, 0]]


def test_obj_of_points_and_lines_only(tmp_path: Path) -> None:
    path = saved(tmp_path, "a.xyz", "# points\r\no a\r\nv 1 2 3\r\n  v\t4 5 6 # here\r\nl 1 2\r\np 1\r\n")
    assert format_name(path) == "OBJ"
    assert read(path).points.tolist() == [[1, 2, 3], [4, 5, 6]]
    with pytest.raises(FileFormatError, match="no surface to take samples of"):
        read(path, samples=5)


def test_obj_negative_numbers_count_back_from_the_face(tmp_path: Path) -> None:
    text = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf -3 -2 -1\nv 0 0 9\nv 1 0 9\nv 0 1 9\nf -3 -2 -1\n"
    heights = read(saved(tmp_path, "a.obj", text), samples=100).points[:, 2]
    assert heights.tolist() == [0] * 50 + [9] * 50


def test_a_table_called_obj_or_stl_is_text(tmp_path: Path) -> None:
    for name in ("a.obj", "a.stl"):
        path = saved(tmp_path, name, "1 2 3\n4 5 6\n")
        assert format_name(path) == "text"
        assert read(path).points.tolist() == [[1, 2, 3], [4, 5, 6]]


@pytest.mark.parametrize(
    ("name", "content", "message"),
    [
        ("a.obj", "v 0 0 0\nv 1 two 0\n", "line 2: 'two' is not a number"),
        ("a.obj", "v 0 0 0\nv\n", "line 2: 'v' is not a number"),
        ("a.obj", "v 0 0 0\nv 1 0\n", "line 2: 2 values where 3 are expected"),
        ("a.obj", "v 0 0 0 1 1 1\nv 1 0 0\n", "line 2: 3 values where 6 are expected"),
        ("a.obj", "v 0 0 0\nvn 1 0\n", "line 2: 2 values where 3 are expected"),
        ("a.obj", "v 0 0 0\nwhat is this\n", "line 2 of the OBJ file makes no sense: 'what is this'"),
        ("a.obj", "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\nf 1 2 4\n", "line 5: a face has the corner 4, the"),
        ("a.obj", "v 0 0 0\nf 0 1 1\n", "line 2: a face has the corner 0"),
        ("a.obj", "v 0 0 0\nf -2 1 1\n", "line 2: a face has the corner 0"),
        ("a.obj", "v 0 0 0\nf 1 1\n", "line 2: a face needs three corners"),
        ("a.obj", "v 0 0 0\nf 1 1 x\n", "line 2: '1 1 x' is no face"),
        ("a.obj", "v 0 0 0\nf 1 1 99999999999999999999\n", "is no face"),
        ("a.obj", "# nothing\n", "holds no points"),
        ("a.obj", "vn 0 0 1\nf 1 2 3\n", "holds no points"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 x\n", "line 4: 'x' is not a number"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nendfacet\n", "line 3: a facet without three corners"),
        ("a.stl", "solid a\nfacet normal 0 0 1\nvortex 0 0 0\n", "line 3 of the STL file makes no sense"),
        ("a.stl", ascii_stl(TETRAHEDRON, FACES)[:-19], "cut off: its last solid does not end"),
        (
            "a.stl",
            binary_stl(TETRAHEDRON, FACES)[:-1],
            "cut off: 4 triangles need 284 bytes, the file has 283",
        ),
        ("a.stl", bytes(50), "cut off"),
        ("a.stl", bytes(80) + b"\xff\xff\xff\xff", "cut off: 4294967295 triangles"),
    ],
)
def test_broken_meshes(tmp_path: Path, name: str, content: bytes | str, message: str) -> None:
    path = saved(tmp_path, name, content)
    with pytest.raises(FileFormatError, match=message) as error:
        read(path)
    assert str(error.value).startswith(str(path))
    assert "\n" not in str(error.value)


def test_obj_that_may_be_cut_off(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match=r"the last line \(2\) has no line end"):
        assert len(read(saved(tmp_path, "a.obj", "v 0 0 0\nv 1 0 0"))) == 2


@pytest.mark.parametrize("samples", [0, -1, 1.5, "many"])
def test_samples_that_make_no_sense(tmp_path: Path, samples: Any) -> None:
    path = saved(tmp_path, "a.stl", binary_stl(TETRAHEDRON, FACES))
    with pytest.raises(InvalidInputError, match="samples must be a whole number"):
        read(path, samples=samples)


@pytest.mark.parametrize("value", [np.nan, np.inf, 3e38])
def test_coordinates_without_area(tmp_path: Path, value: float) -> None:
    vertices = TETRAHEDRON.copy()
    vertices[0, 0] = value
    path = saved(tmp_path, "a.stl", binary_stl(vertices, FACES))
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        cloud = read(path)
        assert np.isnan(normals_of(cloud)).any() == (not np.isfinite(value))
        # The face without the broken corner is still there; with 3e38 the others outweigh it.
        points = read(path, samples=10).points
    if not np.isfinite(value):
        np.testing.assert_allclose(points.sum(axis=1), 1, atol=1e-12)


def test_signalling_nans_warn_of_nothing(tmp_path: Path) -> None:
    content = bytearray(binary_stl(TETRAHEDRON, FACES))
    # The first corner's x, as a NaN whose conversion to double raises the processor's flag.
    content[96:100] = struct.pack("<I", 0x7F800001)
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert np.isnan(read(saved(tmp_path, "a.stl", bytes(content))).points).sum() == 1


def test_from_the_shell(shell: Callable[..., Any], tmp_path: Path) -> None:
    vertices, faces = sphere(20)
    path = saved(tmp_path, "part.stl", binary_stl(vertices, faces))
    out = tmp_path / "a.ply"
    assert shell("convert", path, out, "--samples", 30_000, "--unit", "mm").code == 0
    cloud = read(out)
    np.testing.assert_array_equal(cloud.points, read(path, samples=30_000, unit="mm").points)
    assert list(cloud.fields) == ["nx", "ny", "nz"]
    # In metres: a ball of 0.02, seen from outside its top, and so of curvature 50.
    words = (
        "--samples",
        30_000,
        "--unit",
        "mm",
        "--radius",
        0.004,
        "--viewpoint",
        "0,0,1",
        "--at",
        "0,0.0119,0.016",
    )
    assert shell("extract", path, *words, "-o", out).code == 0
    fields = read(out).fields
    assert fields["k1"] == pytest.approx(50, rel=0.06)
    assert fields["k2"] == pytest.approx(50, rel=0.06)
