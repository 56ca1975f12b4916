"""glTF and GLB: hand-made scenes by value, and trimesh as the reference."""

import base64
import json
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
from surfsig.point_cloud import PointCloud

SQUARE = np.array([[0, 0, 0], [2, 0, 0], [2, 2, 0], [0, 2, 0]], np.float32)
UP = np.array([[0, 0, 1]] * 4, np.float32)
COMPONENTS = {"i1": 5120, "u1": 5121, "i2": 5122, "u2": 5123, "u4": 5125, "f4": 5126}


def scene(
    arrays: dict[str, Any], primitives: Any = None, nodes: Any = None, **more: Any
) -> tuple[dict[str, Any], bytes]:
    """A document and its buffer: an accessor for each array, one mesh, and nodes that show it."""
    data, views, accessors = b"", [], []
    for values in arrays.values():
        values = np.asarray(values)
        data += bytes(-len(data) % 4)
        views.append({"buffer": 0, "byteOffset": len(data), "byteLength": values.nbytes})
        accessor: dict[str, Any] = {
            "bufferView": len(views) - 1,
            "componentType": COMPONENTS[values.dtype.str[1:]],
            "count": len(values),
            "type": "SCALAR" if values.ndim == 1 else f"VEC{values.shape[1]}",
        }
        if values.dtype.kind != "f" and values.ndim == 2:
            accessor["normalized"] = True
        accessors.append(accessor)
        data += values.tobytes()
    if primitives is None:
        names = list(arrays)
        primitive = {"attributes": {name: i for i, name in enumerate(names) if name != "indices"}}
        if "indices" in names:
            primitive["indices"] = names.index("indices")  # type: ignore[assignment]
        primitives = [primitive]
    document = {
        "asset": {"version": "2.0"},
        "scene": 0,
        "scenes": [{"nodes": [0]}],
        "nodes": [{"mesh": 0}] if nodes is None else nodes,
        "meshes": [{"primitives": primitives}],
        "accessors": accessors,
        "bufferViews": views,
        "buffers": [{"byteLength": len(data)}],
    }
    return document | more, data


def glb(document: dict[str, Any], data: bytes) -> bytes:
    text = json.dumps(document).encode()
    text += b" " * (-len(text) % 4)
    data += bytes(-len(data) % 4)
    chunks = struct.pack("<I4s", len(text), b"JSON") + text + struct.pack("<I4s", len(data), b"BIN\0") + data
    return struct.pack("<4sII", b"glTF", 2, 12 + len(chunks)) + chunks


def gltf(document: dict[str, Any], data: bytes) -> bytes:
    uri = "data:application/octet-stream;base64," + base64.b64encode(data).decode()
    return json.dumps(document | {"buffers": [{"byteLength": len(data), "uri": uri}]}).encode()


def save(folder: Path, content: bytes, name: str = "a.glb") -> Path:
    path = folder / name
    path.write_bytes(content)
    return path


def quiet(path: Path, **options: Any) -> PointCloud:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        return read(path, **options)


def stacked(cloud: PointCloud, names: str) -> NDArray[Any]:
    return np.column_stack([cloud.fields[name] for name in names.split()])


FACES: dict[str, Any] = {"POSITION": SQUARE, "NORMAL": UP, "indices": np.array([0, 1, 2, 0, 2, 3], "<u2")}


@pytest.mark.parametrize(("make", "kind"), [(glb, "GLB"), (gltf, "glTF")])
@pytest.mark.parametrize("name", ["a.glb", "a.gltf", "a.dat"])
def test_both_forms_are_known_by_content(tmp_path: Path, make: Any, kind: str, name: str) -> None:
    path = save(tmp_path, make(*scene(FACES)), name)
    assert format_name(path) == kind
    cloud = quiet(path)
    assert cloud.points.dtype == np.float32
    np.testing.assert_array_equal(cloud.points, SQUARE)
    np.testing.assert_array_equal(stacked(cloud, "nx ny nz"), UP)
    samples = quiet(path, samples=100)
    assert (samples.fields["nz"] == 1).all()
    assert samples.points.max() > 1.8


def test_data_in_a_file_beside(tmp_path: Path) -> None:
    document, data = scene(FACES)
    (tmp_path / "parts").mkdir()
    for name, uri in (("square one.bin", "square%20one.bin"), ("parts/a.bin", "parts/a.bin")):
        (tmp_path / name).write_bytes(data)
        document["buffers"] = [{"byteLength": len(data), "uri": uri}]
        path = save(tmp_path, json.dumps(document).encode(), "a.gltf")
        np.testing.assert_array_equal(quiet(path).points, SQUARE)


@pytest.mark.parametrize(
    "uri", ["../a.bin", "/etc/passwd", "https://a.b/c.bin", "%2e%2e/a.bin", "", "c:\\a", "a\0"]
)
def test_no_other_file_is_opened(tmp_path: Path, uri: str) -> None:
    document, _ = scene(FACES)
    document["buffers"] = [{"byteLength": 9, "uri": uri}]
    with pytest.raises(FileFormatError, match="its data are not beside it"):
        read(save(tmp_path, json.dumps(document).encode(), "a.gltf"))
    document["buffers"] = [{"byteLength": 9, "uri": "missing.bin"}]
    with pytest.raises(FileFormatError, match=r"its data 'missing\.bin': No such file"):
        read(save(tmp_path, json.dumps(document).encode(), "a.gltf"))


def test_nodes_move_what_they_show(tmp_path: Path) -> None:
    half = 0.5**0.5
    nodes = [
        {"children": [1, 2], "translation": [10, 0, 0]},
        # A quarter turn about z, then twice as large along x.
        {"mesh": 0, "rotation": [0, 0, half, half], "scale": [2, 1, 1]},
        # Column by column: mirrored in x, and 5 up.
        {"mesh": 0, "matrix": [-1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 5, 1]},
        {"mesh": 0},
    ]
    path = save(tmp_path, glb(*scene(FACES, nodes=nodes)))
    cloud = quiet(path)
    assert cloud.points.dtype == np.float64
    turned = [[10, 0, 0], [10, 4, 0], [8, 4, 0], [8, 0, 0]]
    mirrored = [[10, 0, 5], [8, 0, 5], [8, 2, 5], [10, 2, 5]]
    np.testing.assert_allclose(cloud.points, turned + mirrored, atol=1e-12)
    np.testing.assert_allclose(stacked(cloud, "nx ny nz"), [[0, 0, 1]] * 8, atol=1e-7)
    # A mirrored mesh has its triangles the other way round.
    assert (quiet(path, samples=200).fields["nz"] == 1).all()


def test_normals_turn_with_scaled_surfaces(tmp_path: Path) -> None:
    corners = np.array([[0, 0, 0], [1, 1, 0], [0, 0, 1]], np.float32)
    normal = np.array([[0.5**0.5, -(0.5**0.5), 0]] * 3, np.float32)
    nodes = [{"mesh": 0, "scale": [1, 3, 1]}]
    cloud = quiet(save(tmp_path, glb(*scene({"POSITION": corners, "NORMAL": normal}, nodes=nodes))))
    np.testing.assert_allclose(stacked(cloud, "nx ny nz")[0], np.array([3, -1, 0]) / 10**0.5, atol=1e-6)


@pytest.mark.parametrize(
    ("values", "expected", "dtype"),
    [
        (np.array([[0, 1, 255]], np.uint8), [0, 1, 255], np.uint8),
        (np.array([[0, 1, 65535]], np.uint16), [0, 1, 65535], np.uint16),
        (np.array([[0, 0.2, 1]], np.float32), [0, 51, 255], np.uint8),
        (np.array([[0, 0.2, 1, 0.6]], np.float32), [0, 51, 255, 153], np.uint8),
    ],
)
def test_colours(tmp_path: Path, values: NDArray[Any], expected: list[int], dtype: type) -> None:
    arrays = {"POSITION": SQUARE, "COLOR_0": np.repeat(values, 4, axis=0)}
    cloud = quiet(save(tmp_path, glb(*scene(arrays))))
    names = "red green blue alpha" if len(expected) == 4 else "red green blue"
    assert stacked(cloud, names)[0].tolist() == expected
    assert {part.dtype for part in cloud.fields.values()} == {np.dtype(dtype)}


def test_quantised_positions(tmp_path: Path) -> None:
    quantised = np.array([[0, 32767, -32768], [16384, -1, 1]], np.int16)
    document, data = scene({"POSITION": quantised}, extensionsRequired=["KHR_mesh_quantization"])
    expected = np.maximum(quantised / 32767, -1).astype(np.float32)
    np.testing.assert_array_equal(quiet(save(tmp_path, glb(document, data))).points, expected)
    document["accessors"][0]["normalized"] = False
    np.testing.assert_array_equal(quiet(save(tmp_path, glb(document, data))).points, quantised)


def test_interleaved_and_sparse_accessors(tmp_path: Path) -> None:
    rows = np.zeros(4, [("POSITION", "<f4", 3), ("NORMAL", "<f4", 3)])
    rows["POSITION"], rows["NORMAL"] = SQUARE, UP
    places, others = np.array([1, 3], "<u2"), np.array([[9, 8, 7], [6, 5, 4]], np.float32)
    data = rows.tobytes() + places.tobytes() + others.tobytes()
    document, _ = scene(FACES)
    document["bufferViews"] = [
        {"buffer": 0, "byteLength": 96, "byteStride": 24},
        {"buffer": 0, "byteOffset": 96, "byteLength": 4},
        {"buffer": 0, "byteOffset": 100, "byteLength": 24},
    ]
    vector = {"componentType": 5126, "count": 4, "type": "VEC3"}
    sparse = {
        "count": 2,
        "indices": {"bufferView": 1, "componentType": 5123},
        "values": {"bufferView": 2},
    }
    document["accessors"] = [
        vector | {"bufferView": 0},
        vector | {"bufferView": 0, "byteOffset": 12},
        vector | {"bufferView": 0, "sparse": sparse},
        vector | {"sparse": sparse},
    ]
    document["meshes"] = [
        {"primitives": [{"attributes": {"POSITION": i, "NORMAL": 1}} for i in (0, 2, 3)]},
    ]
    cloud = quiet(save(tmp_path, glb(document, data)))
    replaced, alone = SQUARE.copy(), np.zeros((4, 3))
    replaced[[1, 3]] = alone[[1, 3]] = others
    np.testing.assert_array_equal(cloud.points, np.concatenate([SQUARE, replaced, alone]))
    np.testing.assert_array_equal(stacked(cloud, "nx ny nz"), np.tile(UP, (3, 1)))


@pytest.mark.parametrize(("mode", "indices"), [(4, [0, 1, 2, 2, 3, 0]), (5, [0, 1, 3, 2]), (6, [0, 1, 2, 3])])
def test_triangles_strips_and_fans(tmp_path: Path, mode: int, indices: list[int]) -> None:
    arrays = {"POSITION": SQUARE, "indices": np.array(indices, "<u4")}
    primitive = {"attributes": {"POSITION": 0}, "indices": 1, "mode": mode}
    for primitives in ([primitive], [{"attributes": {"POSITION": 0}, "mode": mode}]):
        if primitives[0] is not primitive and mode != 6:
            continue
        cloud = quiet(save(tmp_path, glb(*scene(arrays, primitives))), samples=400)
        assert (cloud.fields["nz"] == 1).all()
        assert np.unique(cloud.points[:, :2] > 1, axis=0, return_counts=True)[1].min() > 70


def test_parts_that_share_vertices_have_them_once(tmp_path: Path) -> None:
    arrays = {"POSITION": SQUARE, "a": np.array([0, 1, 2], "<u1"), "b": np.array([0, 2, 3], "<u1")}
    primitives = [{"attributes": {"POSITION": 0}, "indices": i} for i in (1, 2)]
    path = save(tmp_path, glb(*scene(arrays, primitives)))
    np.testing.assert_array_equal(quiet(path).points, SQUARE)
    samples = quiet(path, samples=100).points
    assert (samples[:, 0] > samples[:, 1]).sum() == 50


def test_normals_of_some_parts_are_left_out(tmp_path: Path) -> None:
    primitives = [{"attributes": {"POSITION": 0, "NORMAL": 1}}, {"attributes": {"POSITION": 0}}]
    with pytest.warns(UserWarning, match="normals are left out: 1 of 2 parts have them"):
        cloud = read(save(tmp_path, glb(*scene(FACES, primitives))))
    assert (len(cloud), cloud.fields) == (8, {})


def test_the_scene_counts(tmp_path: Path) -> None:
    document, data = scene(FACES, nodes=[{"mesh": 0}, {"mesh": 0, "translation": [1, 0, 0]}])
    for more, first in (
        ({"scene": 0, "scenes": [{"nodes": [1]}, {"nodes": [0]}]}, [1]),
        ({"scene": 1, "scenes": [{"nodes": [1]}, {"nodes": [0]}]}, [0]),
        ({"scene": 0, "scenes": [{"nodes": [0, 1]}]}, [0, 1]),
        ({"scenes": []}, [0, 1]),
        ({"scenes": [], "nodes": []}, [0]),
    ):
        cloud = quiet(save(tmp_path, glb(document | more, data)))
        assert cloud.points[::4, 0].tolist() == first
    with pytest.raises(FileFormatError, match="its scene shows no mesh"):
        read(save(tmp_path, glb(document | {"scenes": [{}]}, data)))


def test_skeletons_give_a_warning(tmp_path: Path) -> None:
    with pytest.warns(UserWarning, match="moves with a skeleton, which is not applied"):
        read(save(tmp_path, glb(*scene(FACES, nodes=[{"mesh": 0, "skin": 0}]))))


def test_a_scene_of_trimesh(tmp_path: Path) -> None:
    sphere, box = trimesh.creation.icosphere(subdivisions=2), trimesh.creation.box((1, 2, 3))
    sphere.visual.vertex_colors = np.random.default_rng(1).integers(0, 256, (len(sphere.vertices), 4))
    whole: Any = trimesh.Scene()
    transformations: Any = trimesh.transformations
    move = transformations.euler_matrix(0.1, 0.2, 0.3)
    move[:3, 3] = 5, 6, 7
    whole.add_geometry(sphere, "sphere", transform=move)
    whole.add_geometry(box, "box")
    path = save(tmp_path, whole.export(file_type="glb"))
    with pytest.warns(UserWarning, match="are left out"):
        cloud = read(path)
    loaded: Any = trimesh.load(path, process=False)
    reference = loaded.to_geometry()
    key = np.lexsort(np.round(cloud.points, 4).T)
    expected = reference.vertices[np.lexsort(np.round(reference.vertices, 4).T)]
    np.testing.assert_allclose(cloud.points[key], expected, atol=1e-5)
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        samples = read(path, samples=20_000)
    on_sphere = (samples.points > 3).all(axis=1)
    assert on_sphere.mean() == pytest.approx(sphere.area / (sphere.area + box.area), abs=1e-3)
    np.testing.assert_allclose(np.linalg.norm(samples.points[on_sphere] - [5, 6, 7], axis=1), 1, atol=0.06)


def test_triangles_of_missing_vertices_are_left_out(tmp_path: Path) -> None:
    arrays = {"POSITION": SQUARE, "indices": np.array([0, 1, 2, 0, 2, 4, 0], "<u1")}
    path = save(tmp_path, glb(*scene(arrays)))
    with pytest.warns(UserWarning, match="1 of 2 faces are left out, the first of which is number 2"):
        assert read(path, samples=10).points[:, 0].max() <= 2
    np.testing.assert_array_equal(quiet(path).points, SQUARE)


def changed(**changes: Any) -> bytes:
    document, data = scene(FACES)
    for path, value in changes.items():
        place: Any = document
        *parents, last = [int(word) if word.isdecimal() else word for word in path.split("__")]
        for word in parents:
            place = place[word]
        place[last] = value
    return glb(document, data)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (glb(*scene(FACES))[:-1], "cut off: its header promises"),
        (glb(*scene(FACES))[:11], "cut off: a GLB file has 12 bytes or more"),
        (struct.pack("<4sII", b"glTF", 1, 20) + bytes(8), "GLB version 1, which is not read"),
        (struct.pack("<4sIII4s", b"glTF", 2, 20, 99, b"JSON"), "a chunk of 99 bytes is promised"),
        (struct.pack("<4sIII4s", b"glTF", 2, 20, 0, b"BIN\0"), "has no JSON"),
        (struct.pack("<4sIII4s", b"glTF", 2, 22, 2, b"JSON") + b"[]", "is no glTF document"),
        (struct.pack("<4sIII4s", b"glTF", 2, 22, 2, b"JSON") + b"{x", "its JSON makes no sense"),
        (struct.pack("<4sIII4s", b"glTF", 2, 99_020, 99_000, b"JSON") + b"[" * 99_000, "JSON makes no sense"),
        (struct.pack("<4sIII4s", b"glTF", 2, 9020, 9000, b"JSON") + b"9" * 9000, "JSON makes no sense"),
        (changed(asset={"version": "1.0"}), "glTF version '1.0', which is not read"),
        (changed(extensionsRequired=["KHR_draco_mesh_compression"]), "compressed with Draco"),
        (changed(extensionsRequired=["EXT_mesh_gpu_instancing"]), "the extension 'EXT_mesh_gpu_instancing'"),
        (changed(bufferViews__0__extensions={"EXT_meshopt_compression": {}}), "EXT_meshopt_compression"),
        (changed(accessors__0__count=5), "cut off or broken: an accessor of 5 numbers needs 60 bytes"),
        (changed(accessors__0__count=2**40), "cut off or broken: an accessor of"),
        (changed(accessors__0__count=-1), "count is '-1', not a whole number"),
        (changed(accessors__0__count=True), "count is 'True'"),
        (changed(accessors__0__type="VEC2"), "of the type 'VEC2', where VEC3 is expected"),
        (changed(accessors__0__bufferView=7), "no number 7 among its bufferViews"),
        (changed(bufferViews__0__byteLength=10**6), "cut off or broken: an accessor of 4 numbers"),
        (changed(bufferViews__0__byteStride=4), "cut off or broken"),
        (changed(bufferViews__0__buffer="x"), "no number x among its buffers"),
        (changed(buffers__0={"uri": "data:;base64,***"}), "buffer 0 is not in base64"),
        (changed(nodes=[{"children": [0]}]), "node 0 is in two places of the scene"),
        (changed(nodes=[{"mesh": 4}]), "no number 4 among its meshes"),
        (changed(nodes=[{"mesh": 0, "scale": [1, 2]}]), "a node's scale is not 3 numbers"),
        (changed(nodes=[{"mesh": 0, "matrix": ["x"] * 16}]), "a node's matrix is not 16 numbers"),
        (changed(nodes=[{"mesh": 0, "scale": [1e60, 1, 1]}]), "a vertex is no number, or beyond"),
        (changed(meshes__0__primitives=[{}]), "a mesh's part has no positions"),
        (changed(meshes__0__primitives=[]), "its scene shows no mesh"),
        (changed(accessors__1__count=3), "4 positions have 3 normals"),
    ],
)  # fmt: skip
def test_broken_files(tmp_path: Path, content: bytes, message: str) -> None:
    with pytest.raises(FileFormatError, match=message) as error:
        read(save(tmp_path, content))
    assert "\n" not in str(error.value)


def test_meshes_that_are_compressed_are_refused_by_name(tmp_path: Path) -> None:
    document, data = scene(FACES)
    draco = {"KHR_draco_mesh_compression": {"bufferView": 0, "attributes": {"POSITION": 0}}}
    document["meshes"][0]["primitives"][0]["extensions"] = draco
    # The plain form beside it is enough.
    np.testing.assert_array_equal(quiet(save(tmp_path, glb(document, data))).points, SQUARE)
    del document["accessors"][0]["bufferView"]
    with pytest.raises(FileFormatError, match="compressed with Draco"):
        read(save(tmp_path, glb(document, data)))


@pytest.mark.parametrize("samples", [None, 10])
def test_repetition_is_bounded_by_the_files_size(tmp_path: Path, samples: int | None) -> None:
    many = np.zeros((20_000, 3), np.float32)
    arrays = {"POSITION": many, "indices": np.zeros(60_000, "<u2")}
    nodes = [{"children": list(range(1, 2001))}, *({"mesh": 0} for _ in range(2000))]
    with pytest.raises(FileFormatError, match="repeats its meshes too often"):
        read(save(tmp_path, glb(*scene(arrays, nodes=nodes))), samples=samples)
    document, data = scene({"POSITION": many, "indices": np.zeros(60_000, "<u2")})
    document["accessors"] += [document["accessors"][0]] * 2000
    parts = [{"attributes": {"POSITION": 2 + i}, "indices": 1} for i in range(2000)]
    document["meshes"][0]["primitives"] = parts
    with pytest.raises(FileFormatError, match="repeats its meshes too often"):
        read(save(tmp_path, glb(document, data)), samples=samples)


def test_samples_need_triangles(tmp_path: Path) -> None:
    primitives = [{"attributes": {"POSITION": 0}, "mode": 0}]
    with pytest.raises(InvalidInputError, match="has no faces with an area"):
        read(save(tmp_path, glb(*scene(FACES, primitives))), samples=5)
