"""Binary files that are longer than a block: values, memory and progress."""

import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import read, write
from surfsig.files.rows import BLOCK_BYTES
from surfsig.point_cloud import PointCloud

RNG = np.random.default_rng(31)
COUNT = 400_000
FACE = np.dtype([("n", "u1"), ("corners", "<i4", 3)])
MESH = "ply\nformat binary_little_endian 1.0\n{elements}end_header\n"
VERTEX = "element vertex {n}\nproperty float x\nproperty float y\nproperty float z\n"
FACES = "element face {n}\nproperty list uchar int vertex_indices\n"


def points_of(count: int) -> NDArray[np.float32]:
    return RNG.random((count, 3), np.float32)


def triangles(count: int) -> bytes:
    rows = np.zeros(count, FACE)
    rows["n"] = 3
    return rows.tobytes()


def save_mesh(path: Path, points: NDArray[np.float32]) -> None:
    head = MESH.format(elements=VERTEX.format(n=len(points)) + FACES.format(n=2 * len(points)))
    path.write_bytes(head.encode() + points.tobytes() + triangles(2 * len(points)))


@pytest.fixture(scope="module")
def cloud() -> PointCloud:
    fields: dict[str, NDArray[Any]] = {
        name: RNG.integers(0, 256, COUNT, np.uint8) for name in ("red", "green", "blue")
    }
    fields["intensity"] = RNG.random(COUNT, np.float32)
    return PointCloud(points_of(COUNT), fields=fields)


@pytest.fixture(params=["a.ply", "a.pcd", "a.npz", "a.npy", "mesh.ply"])
def path(request: pytest.FixtureRequest, tmp_path: Path, cloud: PointCloud) -> Path:
    path = tmp_path / str(request.param)
    if path.name == "mesh.ply":
        save_mesh(path, cloud.points)
    elif path.suffix == ".npy":
        np.save(path, cloud.points)
    else:
        write(path, cloud)
    return path


def test_values(path: Path, cloud: PointCloud) -> None:
    again = read(path)
    assert again.offsets.dtype == np.float32
    assert again.offsets.flags.writeable
    np.testing.assert_array_equal(again.points, cloud.points)
    if path.suffix in (".pcd", ".npz") or path.name == "a.ply":
        assert list(again.fields) == list(cloud.fields)
    for name, values in again.fields.items():
        np.testing.assert_array_equal(values, cloud.fields[name])


def test_reading_needs_no_memory_beside_the_cloud(path: Path) -> None:
    tracemalloc.start()
    try:
        cloud = read(path)
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    size = cloud.offsets.nbytes + sum(values.nbytes for values in cloud.fields.values())
    assert peak < size + 4 * BLOCK_BYTES


def test_progress_is_told_for_every_block(path: Path) -> None:
    told: list[tuple[int, int]] = []
    read(path, progress=lambda done, total: told.append((done, total)))
    size = path.stat().st_size
    done = np.array([0, *(done for done, _ in told)])
    assert {total for _, total in told} == {size}
    assert (np.diff(done) >= 0).all()
    assert np.diff(done).max() <= BLOCK_BYTES
    # The headers are not counted.
    assert size - 3000 < done[-1] <= size


def test_a_callback_may_stop_the_reading(path: Path) -> None:
    def stop(done: int, total: int) -> None:
        if done > total / 3:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        read(path, progress=stop)


@pytest.mark.parametrize("missing", [1, 100, 2 * BLOCK_BYTES])
def test_cut_off(path: Path, missing: int) -> None:
    content = path.read_bytes()
    path.write_bytes(content[:-missing])
    with pytest.raises(FileFormatError, match=r"cut off|broken"):
        read(path)


QUAD = b"\4" + bytes(16)


@pytest.mark.parametrize("after", [0, 5, 100_000])
def test_faces_of_other_lengths_after_many_blocks_of_triangles(tmp_path: Path, after: int) -> None:
    points = points_of(10)
    faces = triangles(100_000) + QUAD + triangles(after)
    elements = FACES.format(n=100_001 + after) + VERTEX.format(n=10) + "element last 1\nproperty uchar a\n"
    content = MESH.format(elements=elements).encode() + faces + points.tobytes() + b"\7"
    (tmp_path / "a.ply").write_bytes(content)
    np.testing.assert_array_equal(read(tmp_path / "a.ply").points, points)
    (tmp_path / "a.ply").write_bytes(content[:-1])
    with pytest.raises(FileFormatError, match="cut off: its header promises 1 of 'last'"):
        read(tmp_path / "a.ply")


@pytest.mark.parametrize("shorter", [9, 60_000])
def test_vertices_whose_lists_change_their_length_late(tmp_path: Path, shorter: int) -> None:
    points = points_of(100_000)
    uniform = np.zeros(100_000 - shorter, [("xyz", "<f4", 3), ("n", "u1"), ("list", "<u2", 2), ("q", "<u4")])
    uniform["xyz"], uniform["n"], uniform["q"] = points[:-shorter], 2, np.arange(len(uniform))
    short = np.zeros(shorter, [("xyz", "<f4", 3), ("n", "u1"), ("q", "<u4")])
    short["xyz"], short["q"] = points[-shorter:], np.arange(len(uniform), 100_000)
    elements = VERTEX.format(n=100_000) + "property list uchar ushort seen\nproperty uint q\n"
    content = MESH.format(elements=elements).encode() + uniform.tobytes() + short.tobytes()
    (tmp_path / "a.ply").write_bytes(content)
    cloud = read(tmp_path / "a.ply")
    np.testing.assert_array_equal(cloud.points, points)
    np.testing.assert_array_equal(cloud.fields["q"], np.arange(100_000))
    (tmp_path / "a.ply").write_bytes(content[:-1])
    with pytest.raises(FileFormatError, match="cut off"):
        read(tmp_path / "a.ply")


ORDERS: list[Callable[[NDArray[Any]], NDArray[Any]]] = [
    lambda points: points.astype(">f4"),
    lambda points: np.asfortranarray(points),
    lambda points: points.astype("f8"),
    lambda points: np.column_stack([points, points]),
]


@pytest.mark.parametrize("turned", ORDERS)
def test_npy_in_other_orders(tmp_path: Path, turned: Callable[[NDArray[Any]], NDArray[Any]]) -> None:
    points = points_of(50_000)
    np.save(tmp_path / "a.npy", turned(points))
    cloud = read(tmp_path / "a.npy")
    np.testing.assert_array_equal(cloud.points, points)
    assert cloud.offsets.flags.c_contiguous


def test_pcd_with_padding_and_nothing_else(tmp_path: Path) -> None:
    head = "VERSION 0.7\nFIELDS _\nSIZE 1\nTYPE U\nCOUNT 4\nWIDTH 2\nHEIGHT 1\nPOINTS 2\nDATA binary\n"
    (tmp_path / "a.pcd").write_bytes(head.encode() + bytes(8))
    with pytest.raises(FileFormatError, match="no column 'x'"):
        read(tmp_path / "a.pcd")
