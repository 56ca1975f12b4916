"""Every format that is written: what comes back, and what survives a failure."""

import errno
import os
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import hypothesis.extra.numpy as arrays
import hypothesis.strategies as st
import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.files import Chunks, check_writable, read, write
from surfsig.point_cloud import PointCloud

EXTENSIONS = ["ply", "pcd", "npz", "parquet"]
DTYPES = st.sampled_from(["f4", "f8", "i1", "u1", "i2", "u2", "i4", "u4"])
# Names that no format reserves, that are no colour, and that differ in more than case.
NAMES = st.lists(st.from_regex(r"[d-w][d-w_]{2,8}", fullmatch=True), max_size=3, unique=True).filter(
    lambda names: not {"points", "grid", "origin", "notes", "viewpoint", "red", "green", "alpha"} & set(names)
)


@pytest.fixture(params=EXTENSIONS)
def extension(request: pytest.FixtureRequest) -> str:
    if request.param == "parquet":
        pytest.importorskip("pyarrow")
    return str(request.param)


@st.composite
def clouds(draw: st.DrawFn) -> PointCloud:
    count = draw(st.integers(0, 12))
    dtype = draw(st.sampled_from([np.float32, np.float64]))
    offsets = draw(arrays.arrays(dtype, (count, 3), elements={"allow_nan": True}))
    fields = {name: draw(arrays.arrays(draw(DTYPES), count)) for name in draw(NAMES)}
    # A viewpoint of (0, 0, 0) is a default in PCD, and may be taken away when it is read.
    viewpoint = draw(st.none() | st.tuples(*[st.floats(-1e6, 1e6)] * 3).filter(any))
    grid = (3, count // 3) if count % 3 == 0 and draw(st.booleans()) else None
    return PointCloud(offsets, viewpoint=viewpoint, fields=fields, grid=grid)  # type: ignore[arg-type]


@settings(
    max_examples=60,
    deadline=None,
    derandomize=True,
    suppress_health_check=[HealthCheck.function_scoped_fixture],
)
@given(cloud=clouds())
def test_what_is_written_comes_back(tmp_path: Path, extension: str, cloud: PointCloud) -> None:
    path = tmp_path / f"a.{extension}"
    write(path, cloud)
    again = read(path)
    np.testing.assert_array_equal(again.points.astype(np.float64), cloud.points.astype(np.float64))
    assert list(again.fields) == list(cloud.fields)
    for name, values in cloud.fields.items():
        assert again.fields[name].dtype == values.dtype
        np.testing.assert_array_equal(again.fields[name], values)
    assert again.grid == cloud.grid
    np.testing.assert_array_equal(
        np.array(again.viewpoint, np.float64), np.array(cloud.viewpoint, np.float64)
    )


def test_coordinates_are_double_only_where_float_would_change_them(tmp_path: Path) -> None:
    for points, kind in (
        (np.array([[0.5, 2.0, 2.0**100]]), b"float"),
        (np.array([[500000.001, 0, 0]]), b"double"),
    ):
        write(tmp_path / "a.ply", PointCloud(points))
        assert b"property " + kind + b" x\n" in (tmp_path / "a.ply").read_bytes()
        np.testing.assert_array_equal(read(tmp_path / "a.ply").points, points)


def test_the_origin_is_added(tmp_path: Path, extension: str) -> None:
    cloud = PointCloud(np.array([[0.25, 0, 0]], np.float32), origin=np.array([500000.0, 4500000.0, 100.0]))
    write(tmp_path / f"a.{extension}", cloud)
    assert read(tmp_path / f"a.{extension}").points.tolist() == [[500000.25, 4500000.0, 100.0]]


def example() -> tuple[PointCloud, dict[str, NDArray[Any]]]:
    fields: dict[str, NDArray[Any]] = {
        "intensity": np.arange(5, dtype=np.uint16),
        "nx": np.full(5, 9.0, np.float32),
    }
    cloud = PointCloud(np.arange(15, dtype=np.float32).reshape(5, 3), fields=fields)
    columns: dict[str, NDArray[Any]] = {
        "k1": np.array([1, np.nan, -3, 0, 5], np.float32),
        "normals": np.arange(15, dtype=np.float32).reshape(5, 3) / 10,
        "direction": np.arange(15, dtype=np.float32).reshape(5, 3) + 0.5,
        "count": np.arange(5, dtype=np.int64) + 2**20,
        "good": np.arange(5) > 2,
    }
    return cloud, columns


def test_columns_beside_fields(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    write(tmp_path / f"a.{extension}", cloud, columns, notes={"radius": "0.02"})
    fields = read(tmp_path / f"a.{extension}").fields
    several = ["direction_0", "direction_1", "direction_2"] if extension == "ply" else ["direction"]
    assert list(fields) == ["intensity", "k1", "nx", "ny", "nz", *several, "count", "good", "input_nx"]
    np.testing.assert_array_equal(fields["k1"], columns["k1"])
    np.testing.assert_array_equal(fields["ny"], columns["normals"][:, 1])
    np.testing.assert_array_equal(np.column_stack([fields[name] for name in several]), columns["direction"])
    assert fields["count"].tolist() == columns["count"].tolist()
    assert fields["good"].tolist() == columns["good"].tolist()
    assert fields["input_nx"].tolist() == [9.0] * 5


def test_ply_as_other_programs_read_it(tmp_path: Path) -> None:
    cloud, columns = example()
    write(tmp_path / "a.ply", cloud, {"k1": columns["k1"]}, notes={"radius": "0.02"})
    head, body = (tmp_path / "a.ply").read_bytes().split(b"end_header\n")
    assert head.decode() == (
        "ply\nformat binary_little_endian 1.0\ncomment surfsig radius 0.02\nelement vertex 5\n"
        "property float x\nproperty float y\nproperty float z\nproperty ushort intensity\nproperty float nx\n"
        "property float k1\n"
    )
    rows = np.frombuffer(body, [("xyz", "<f4", 3), ("i", "<u2"), ("nx", "<f4"), ("k1", "<f4")])
    np.testing.assert_array_equal(rows["xyz"], cloud.points)
    np.testing.assert_array_equal(rows["k1"], columns["k1"])


def test_npz_as_numpy_reads_it(tmp_path: Path) -> None:
    cloud, columns = example()
    write(tmp_path / "a.npz", cloud, columns, notes={"radius": "0.02"})
    with np.load(tmp_path / "a.npz") as file:
        np.testing.assert_array_equal(file["points"], cloud.points)
        np.testing.assert_array_equal(file["direction"], columns["direction"])
        assert file["notes"] == '{"radius": "0.02"}'


def test_the_same_input_gives_the_same_file(tmp_path: Path, extension: str) -> None:
    cloud, columns = example()
    paths = [tmp_path / f"{name}.{extension}" for name in "ab"]
    for path in paths:
        write(path, cloud, columns)
    assert paths[0].read_bytes() == paths[1].read_bytes()


@pytest.mark.parametrize("kind", [np.float32, np.uint8])
def test_chunks(tmp_path: Path, extension: str, kind: type) -> None:
    cloud, columns = example()
    signatures: NDArray[Any] = np.arange(20).reshape(5, 4).astype(kind)
    asked = []

    def blocks() -> Iterator[NDArray[Any]]:
        for start, stop in ((0, 2), (2, 2), (2, 5)):
            asked.append(start)
            yield signatures[start:stop]

    seen: list[tuple[int, int]] = []
    path = tmp_path / f"a.{extension}"
    write(
        path,
        cloud,
        {"k1": columns["k1"]},
        chunks=("signature", 4, kind, blocks()),
        progress=lambda done, total: seen.append((done, total)),
    )
    fields = read(path).fields
    assert asked == [0, 2, 2]
    assert seen == [(2, 5), (2, 5), (5, 5)]
    names = [f"signature_{i}" for i in range(4)] if extension == "ply" else ["signature"]
    np.testing.assert_array_equal(np.column_stack([fields[name] for name in names]), signatures)
    assert fields[names[0]].dtype == kind
    np.testing.assert_array_equal(fields["k1"], columns["k1"])
    np.testing.assert_array_equal(fields["intensity"], cloud.fields["intensity"])


def test_making_a_block_may_fill_in_other_columns(tmp_path: Path, extension: str) -> None:
    status = np.zeros(5, np.uint8)

    def blocks() -> Iterator[NDArray[Any]]:
        for start, stop in ((0, 3), (3, 5)):
            status[start:stop] = np.arange(start, stop) + 1
            yield np.zeros((stop - start, 2), np.float32)

    path = tmp_path / f"a.{extension}"
    write(path, example()[0], {"status": status}, chunks=("signature", 2, np.float32, blocks()))
    assert read(path).fields["status"].tolist() == [1, 2, 3, 4, 5]


def test_chunks_never_are_in_memory_as_a_whole(tmp_path: Path, extension: str) -> None:
    tracemalloc = pytest.importorskip("tracemalloc")
    count, width, step = 20_000, 242, 1000
    cloud = PointCloud(np.zeros((count, 3), np.float32))
    blocks = (np.full((step, width), i, np.float32) for i in range(count // step))
    tracemalloc.start()
    try:
        write(tmp_path / f"a.{extension}", cloud, chunks=Chunks("signature", width, np.float32, blocks))
        peak = tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
    assert peak < count * width * 4 / 3


@pytest.mark.parametrize(("rows", "width"), [(4, 4), (6, 4), (5, 3)])
def test_chunks_that_do_not_fit(tmp_path: Path, extension: str, rows: int, width: int) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_bytes(b"old")
    with pytest.raises(InvalidInputError, match="signature"):
        write(path, example()[0], chunks=("signature", 4, np.float32, iter([np.zeros((rows, width))])))
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == [path.name]


@pytest.mark.parametrize(
    ("columns", "message"),
    [
        ({"k1": np.zeros(4)}, "column 'k1' must have one row for each of the 5 points"),
        ({"k1": np.array(["a"] * 5)}, "column 'k1' must hold real numbers"),
        ({"x": np.zeros(5)}, "a column cannot be called 'x'"),
    ],
)
def test_columns_that_do_not_fit(tmp_path: Path, columns: dict[str, NDArray[Any]], message: str) -> None:
    with pytest.raises(InvalidInputError, match=message):
        write(tmp_path / "a.ply", example()[0], columns)
    assert os.listdir(tmp_path) == []


def test_large_whole_numbers_in_ply(tmp_path: Path) -> None:
    fields = {
        "small": np.array([-5], np.int64),
        "large": np.array([3_000_000_000]),
        "huge": np.array([2**52 + 1]),
    }
    write(tmp_path / "a.ply", PointCloud(np.zeros((1, 3)), fields=fields))
    kinds = {name: values.dtype.name for name, values in read(tmp_path / "a.ply").fields.items()}
    assert kinds == {"small": "int32", "large": "uint32", "huge": "float64"}
    assert [int(v[0]) for v in read(tmp_path / "a.ply").fields.values()] == [-5, 3_000_000_000, 2**52 + 1]


def test_names_with_spaces_in_ply(tmp_path: Path) -> None:
    fields = {"scan angle": np.zeros(1), "scan_angle": np.ones(1), " ": np.full(1, 2.0)}
    write(tmp_path / "a.ply", PointCloud(np.zeros((1, 3)), fields=fields))
    assert {k: float(v[0]) for k, v in read(tmp_path / "a.ply").fields.items()} == {
        "scan_angle": 0,
        "scan_angle_2": 1,
        "field": 2,
    }


@pytest.mark.parametrize(
    ("name", "error", "message"),
    [
        ("missing/a.ply", FileNotFoundError, "No such file or directory"),
        ("folder.ply", InvalidInputError, "is a folder"),
        ("a.obj", InvalidInputError, r"must be one of \.ply, \.pcd, \.npz, \.parquet"),
        ("a", InvalidInputError, "must be one of"),
        ("pipe.ply", InvalidInputError, "is a device or a pipe"),
    ],
)
def test_outputs_that_cannot_be_written(
    tmp_path: Path, name: str, error: type[Exception], message: str
) -> None:
    (tmp_path / "folder.ply").mkdir()
    if hasattr(os, "mkfifo"):
        os.mkfifo(tmp_path / "pipe.ply")
    elif name == "pipe.ply":
        pytest.skip("no named pipes on this system")
    before = sorted(os.listdir(tmp_path))
    attempts: list[Callable[[Path], None]] = [check_writable, lambda path: write(path, example()[0])]
    for attempt in attempts:
        with pytest.raises(error, match=message) as caught:
            attempt(tmp_path / name)
        assert "\n" not in str(caught.value)
    assert sorted(os.listdir(tmp_path)) == before


def test_a_read_only_output(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "a.ply"
    path.write_bytes(b"old")
    path.chmod(0o444)
    # The superuser may write anything, so the system's answer is given here.
    monkeypatch.setattr(os, "access", lambda *_: False)
    with pytest.raises(PermissionError, match=r"read-only.*a\.ply"):
        check_writable(path)
    monkeypatch.undo()

    def refused(*_: Any) -> int:
        raise PermissionError(errno.EACCES, "Permission denied", ".a.ply.tmp")

    monkeypatch.setattr(os, "open", refused)
    with pytest.raises(PermissionError, match=r"Permission denied: .*a\.ply'$"):
        check_writable(tmp_path / "a.ply")


def test_check_leaves_nothing_behind(tmp_path: Path, extension: str) -> None:
    check_writable(tmp_path / f"new.{extension}")
    assert os.listdir(tmp_path) == []
    (tmp_path / f"old.{extension}").write_bytes(b"old")
    check_writable(tmp_path / f"old.{extension}")
    assert (tmp_path / f"old.{extension}").read_bytes() == b"old"


class FullDisk:
    """A file that takes some bytes and then says what a full disk says."""

    def __init__(self, file: Any, room: int) -> None:
        self.file, self.room = file, room

    def write(self, data: Any) -> int:
        self.room -= len(memoryview(data).cast("B"))
        if self.room < 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        return int(self.file.write(data))

    def __getattr__(self, name: str) -> Any:
        return getattr(self.file, name)

    def __enter__(self) -> "FullDisk":
        self.file.__enter__()
        return self

    def __exit__(self, *exception: object) -> object:
        return self.file.__exit__(*exception)


@pytest.mark.parametrize("room", [0, 1000, 300_000])
def test_the_old_output_survives_a_full_disk(
    tmp_path: Path, extension: str, room: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_bytes(b"old")
    cloud = PointCloud(np.random.default_rng(0).normal(size=(40_000, 3)))
    real = os.fdopen
    monkeypatch.setattr(os, "fdopen", lambda *args: FullDisk(real(*args), room))
    with pytest.raises(OSError, match=rf"No space left on device: .*a\.{extension}") as error:
        write(path, cloud)
    assert error.value.errno == errno.ENOSPC
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == [path.name]


def test_a_disk_that_is_really_full(tmp_path: Path, extension: str) -> None:
    mount = shutil.which("mount")
    disk = tmp_path / "disk"
    disk.mkdir()
    options = ["-t", "tmpfs", "-o", "size=256k", "tmpfs", str(disk)]
    if mount is None or subprocess.run([mount, *options], capture_output=True).returncode:
        pytest.skip("no right to mount a small file system here")
    try:
        path = disk / f"a.{extension}"
        path.write_bytes(b"old")
        cloud = PointCloud(np.random.default_rng(0).normal(size=(40_000, 3)))
        with pytest.raises(OSError, match="No space left on device"):
            write(path, cloud)
        assert path.read_bytes() == b"old"
        assert os.listdir(disk) == [path.name]
    finally:
        subprocess.run(["umount", str(disk)], check=True)


def test_interruption_leaves_the_old_output(tmp_path: Path, extension: str) -> None:
    path = tmp_path / f"a.{extension}"
    path.write_bytes(b"old")

    def blocks() -> Iterator[NDArray[Any]]:
        yield np.zeros((2, 4))
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        write(path, example()[0], chunks=("signature", 4, np.float32, blocks()))
    assert path.read_bytes() == b"old"
    assert os.listdir(tmp_path) == [path.name]


def test_permissions_and_links_are_kept(tmp_path: Path) -> None:
    (tmp_path / "real.ply").write_bytes(b"old")
    (tmp_path / "real.ply").chmod(0o640)
    (tmp_path / "link.ply").symlink_to("real.ply")
    write(tmp_path / "link.ply", example()[0])
    assert (tmp_path / "link.ply").is_symlink()
    assert len(read(tmp_path / "real.ply")) == 5
    assert (tmp_path / "real.ply").stat().st_mode & 0o777 == 0o640


def test_parquet_without_pyarrow(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(sys.modules, "pyarrow", None)
    monkeypatch.delitem(sys.modules, "pyarrow.parquet", raising=False)
    with pytest.raises(InvalidInputError, match=r"pip install 'surfsig\[parquet\]'"):
        check_writable(tmp_path / "a.parquet")
