"""Files that cannot be read: an error of one line, never a crash, a wrong cloud or a huge allocation."""

import contextlib
import io
import struct
import tracemalloc
import warnings
import zipfile
from collections.abc import Callable
from pathlib import Path
from typing import Any

import lzf
import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import read, write
from surfsig.point_cloud import PointCloud

POINTS = np.random.default_rng(5).normal(size=(200, 3)).astype(np.float32)
PCD_HEAD = (
    "# .PCD v0.7\nVERSION 0.7\nFIELDS x y z\nSIZE 4 4 4\nTYPE F F F\nCOUNT 1 1 1\nWIDTH {n}\nHEIGHT 1\n"
    "VIEWPOINT 0 0 0 1 0 0 0\nPOINTS {n}\nDATA {data}\n"
)
AXES = "".join(f"property float {axis}\n" for axis in "xyz")
PLY_HEAD = "ply\nformat {data} 1.0\nelement vertex {n}\n" + AXES + "{more}end_header\n"
FACES = "element face 2\nproperty list uchar int vertex_indices\n"


def table(delimiter: str = " ") -> bytes:
    text = io.StringIO()
    np.savetxt(text, POINTS, fmt="%.9g", delimiter=delimiter)
    return text.getvalue().encode()


def archive() -> bytes:
    file = io.BytesIO()
    np.savez(file, points=POINTS, label=np.arange(200))
    return file.getvalue()


def array() -> bytes:
    file = io.BytesIO()
    np.save(file, POINTS)
    return file.getvalue()


def parquet() -> bytes:
    pa = pytest.importorskip("pyarrow")
    pq = pytest.importorskip("pyarrow.parquet")
    file: io.BytesIO = io.BytesIO()
    pq.write_table(pa.table(dict(zip("xyz", POINTS.T, strict=True))), file)
    return file.getvalue()


def compressed_pcd() -> bytes:
    planes = np.ascontiguousarray(np.round(POINTS.T)).tobytes()
    short: bytes | None = lzf.compress(planes)
    assert short is not None
    sizes = struct.pack("<II", len(short), len(planes))
    return PCD_HEAD.format(n=200, data="binary_compressed").encode() + sizes + short


def mesh(data: str) -> bytes:
    head = PLY_HEAD.format(data=data, n=200, more=FACES).encode()
    if data == "ascii":
        return head + table() + b"3 0 1 2\n4 0 1 2 3\n"
    order = "<" if "little" in data else ">"
    faces = struct.pack(order + "B3iB4i", 3, 0, 1, 2, 4, 0, 1, 2, 3)
    return head + POINTS.astype(order + "f4").tobytes() + faces


WHOLE: dict[str, Callable[[], bytes]] = {
    "ascii.ply": lambda: mesh("ascii"),
    "little.ply": lambda: mesh("binary_little_endian"),
    "big.ply": lambda: mesh("binary_big_endian"),
    "ascii.pcd": lambda: PCD_HEAD.format(n=200, data="ascii").encode() + table(),
    "binary.pcd": lambda: PCD_HEAD.format(n=200, data="binary").encode() + POINTS.tobytes(),
    "compressed.pcd": compressed_pcd,
    "space.xyz": table,
    "comma.csv": lambda: table(","),
    "a.npy": array,
    "a.npz": archive,
    "a.parquet": parquet,
}


@pytest.mark.parametrize("name", WHOLE)
def test_cut_off_at_every_tenth(tmp_path: Path, name: str) -> None:
    content = WHOLE[name]()
    path = tmp_path / name
    path.write_bytes(content)
    assert len(read(path)) == 200
    text = path.suffix in (".xyz", ".csv")
    for tenth in range(10):
        path.write_bytes(content[: len(content) * tenth // 10])
        if text and tenth:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                cloud = read(path)
            assert len(caught) == 1
            assert "the last line" in str(caught[0].message)
            np.testing.assert_array_equal(cloud.points[:-1].astype(np.float32), POINTS[: len(cloud) - 1])
            assert len(cloud) < 200
        else:
            with pytest.raises(FileFormatError) as error:
                read(path)
            assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", ["little.ply", "binary.pcd", "compressed.pcd", "a.npy", "a.npz"])
def test_cut_off_by_a_single_byte(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(WHOLE[name]()[:-1])
    with pytest.raises(FileFormatError):
        read(path)


@pytest.mark.parametrize("name", [name for name in WHOLE if not name.endswith((".xyz", ".csv"))])
def test_a_wrong_extension_does_not_matter(tmp_path: Path, name: str) -> None:
    path = tmp_path / (name + ".xyz")
    path.write_bytes(WHOLE[name]())
    assert len(read(path)) == 200


def test_missing_file_and_folder(tmp_path: Path) -> None:
    with pytest.raises(FileNotFoundError):
        read(tmp_path / "none.ply")
    with pytest.raises(FileFormatError, match="holds no files"):
        read(tmp_path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (b"", "the file is empty"),
        (b"\x89PNG\r\n\x1a\n" + bytes(100), "the PNG image is cut off or broken \\(no header\\)"),
        (b"<!DOCTYPE html>\n<html><body>404</body></html>\n", "holds web page or XML data"),
        (np.random.default_rng(3).bytes(5000), "is not a PLY file, nor any other that can be read"),
        (bytes(100), "is not a PLY file"),
        (b"\xff\xfe\x00", "not a table of points|holds no points"),
    ],
)
def test_what_is_no_point_cloud(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "scan.ply"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match=message):
        read(path)


def test_random_bytes_never_crash(tmp_path: Path) -> None:
    rng = np.random.default_rng(11)
    path = tmp_path / "a.bin"
    for name, make in WHOLE.items():
        whole = make()
        for _ in range(40):
            broken = bytearray(whole)
            for place in rng.integers(0, min(len(whole), 400), 3):
                broken[place] = rng.integers(0, 256)
            path.write_bytes(bytes(broken))
            with warnings.catch_warnings():
                warnings.simplefilter("ignore")
                # A change may be harmless (a digit, a comment); any other error than this one is a bug.
                with contextlib.suppress(FileFormatError):
                    cloud = read(path)
                    assert cloud.offsets.shape == (len(cloud), 3), name


def npy_header(shape: str) -> bytes:
    head = f"{{'descr': '<f4', 'fortran_order': False, 'shape': {shape}}}".ljust(117) + "\n"
    return b"\x93NUMPY\x01\x00" + struct.pack("<H", len(head)) + head.encode()


def zipped(content: bytes) -> bytes:
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w") as whole:
        whole.writestr("points.npy", content)
    return file.getvalue()


ABSURD = {
    "binary ply": PLY_HEAD.format(data="binary_little_endian", n=99999999999, more="").encode() + bytes(120),
    "ascii ply": PLY_HEAD.format(data="ascii", n=99999999999, more="").encode() + b"0 0 0\n",
    "faces": PLY_HEAD.format(
        data="binary_little_endian", n=1, more=FACES.replace("2", "99999999999")
    ).encode()
    + bytes(99),
    "binary pcd": PCD_HEAD.format(n=99999999999, data="binary").encode() + bytes(120),
    "ascii pcd": PCD_HEAD.format(n=99999999999, data="ascii").encode() + b"0 0 0\n",
    "compressed pcd": PCD_HEAD.format(n=99999999, data="binary_compressed").encode()
    + struct.pack("<II", 20, 12 * 99999999)
    + bytes(20),
    "pcd count": PCD_HEAD.format(n=1, data="ascii")
    .encode()
    .replace(b"COUNT 1 1 1", b"COUNT 1 1 99999999999"),
    "npy": npy_header("(99999999999, 3)") + bytes(120),
    "npz": zipped(npy_header("(99999999999, 3)") + bytes(120)),
    "npy of a gigabyte": npy_header("(100000000, 3)") + bytes(120),
    "negative npy": npy_header("(-1, 3)") + bytes(120),
}


@pytest.mark.parametrize("name", ABSURD)
def test_absurd_counts_allocate_nothing(tmp_path: Path, name: str) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(ABSURD[name])
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError):
            read(path)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (
            b"ply\nformat ascii 1.0\nelement face 0\nproperty list uchar int i\nend_header\n",
            "without vertices",
        ),
        (
            b"ply\nformat ascii 1.0\nelement vertex 1\nproperty float x\nproperty float y\nend_header\n0 0\n",
            "no column 'z'",
        ),
        (b"ply\nformat middle_endian 1.0\nelement vertex 0\nend_header\n", "line 2 of the PLY header"),
        (b"ply\nelement vertex 0\nend_header\n", "does not name a format"),
        (b"ply\nformat ascii 1.0\nelement vertex many\nend_header\n", "line 3 of the PLY header"),
        (b"ply\nformat ascii 1.0\nproperty float x\nend_header\n", "line 3 of the PLY header"),
        (
            PLY_HEAD.format(data="ascii", n=2, more="").encode() + b"0 0 0\n0 nought 0\n",
            "line 9: 'nought' is not a number",
        ),
        (
            PCD_HEAD.format(n=2, data="ascii").encode() + b"0.5 0 0\n0 0\n",
            "line 13: 2 values where 3 are expected",
        ),
        (PCD_HEAD.format(n=1, data="zipped").encode() + b"0 0 0\n", "'zipped' is none of ascii, binary"),
        (
            PCD_HEAD.format(n=1, data="ascii").replace("HEIGHT 1", "HEIGHT 3").encode(),
            "POINTS 1 is not WIDTH 1 times",
        ),
        (PCD_HEAD.format(n=1, data="ascii").replace("SIZE 4 4 4", "SIZE 4 4").encode(), "differ in length"),
        (
            PCD_HEAD.format(n=1, data="ascii").replace("SIZE 4 4 4", "SIZE 4 4 3").encode(),
            "no type F of 3 bytes",
        ),
        (PCD_HEAD.format(n=1, data="ascii").replace("WIDTH 1\n", "").encode(), "has no line WIDTH"),
        (PCD_HEAD.format(n=1, data="ascii").replace("COUNT", "KOUNT").encode(), "line 6 of the PCD header"),
    ],
)
def test_headers_that_make_no_sense(tmp_path: Path, content: bytes, message: str) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    with pytest.raises(FileFormatError, match=message):
        read(path)


@pytest.mark.parametrize(
    ("content", "message"),
    [
        (np.zeros((4, 2)), r"shape \(n, 3\) or wider, not \(4, 2\)"),
        (np.zeros(4), r"not \(4,\)"),
        (np.zeros((4, 3), complex), "real numbers, not complex128"),
        (np.array([["a", "b", "c"]]), "real numbers, not <U1"),
        (np.array([[None, 1, 2]], object), "Python objects"),
        (np.zeros(4, [("x", "f4"), ("y", "f4")]), "no column 'z'"),
        (np.zeros((4, 2), [("x", "f4"), ("y", "f4"), ("z", "f4")]), "must have one axis"),
    ],
)
def test_arrays_that_are_no_points(tmp_path: Path, content: NDArray[Any], message: str) -> None:
    np.save(tmp_path / "a.npy", content, allow_pickle=True)
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path / "a.npy")
    np.savez(tmp_path / "a.npz", points=content)
    with pytest.raises(FileFormatError, match=message):
        read(tmp_path / "a.npz")


def test_archives_that_are_no_points(tmp_path: Path) -> None:
    np.savez(tmp_path / "a.npz", x=[1.0], y=[1.0, 2.0], z=[1.0])
    with pytest.raises(FileFormatError, match="differ in length"):
        read(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", a=[1.0], b=[2.0])
    with pytest.raises(FileFormatError, match="no array 'points'"):
        read(tmp_path / "a.npz")
    np.savez(tmp_path / "a.npz", points=np.zeros((2, 3)), grid=[5, 5])
    with pytest.raises(FileFormatError, match="a grid of 5 x 5"):
        read(tmp_path / "a.npz")
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as whole:
        whole.writestr("letter.txt", "hello")
    with pytest.raises(FileFormatError, match="not of NumPy's arrays"):
        read(tmp_path / "a.npz")


@pytest.mark.parametrize(
    "content",
    [
        PLY_HEAD.format(data="ascii", n=0, more="").encode(),
        PLY_HEAD.format(data="binary_big_endian", n=0, more="").encode(),
        PCD_HEAD.format(n=0, data="ascii").encode(),
        PCD_HEAD.format(n=0, data="binary").encode(),
        PCD_HEAD.format(n=0, data="binary_compressed").encode() + bytes(8),
        npy_header("(0, 3)"),
        zipped(npy_header("(0, 3)")),
    ],
)
def test_a_header_with_no_points_is_an_empty_cloud(tmp_path: Path, content: bytes) -> None:
    path = tmp_path / "a.bin"
    path.write_bytes(content)
    cloud = read(path)
    assert len(cloud) == 0
    assert cloud.points.shape == (0, 3)
    for extension in ("ply", "npz"):
        write(tmp_path / f"out.{extension}", cloud, {"k1": np.zeros(0, np.float32)})
        again = read(tmp_path / f"out.{extension}")
        assert isinstance(again, PointCloud)
        assert list(again.fields) == ["k1"]
        assert len(again) == 0


def test_an_archive_that_promises_more_than_it_can_hold_allocates_nothing(tmp_path: Path) -> None:
    content = bytearray(zipped(npy_header("(40_000_000, 3)")))
    # The sizes in the archive's own entry say that everything is there.
    entry = content.rindex(b"PK\x01\x02")
    content[entry + 20 : entry + 28] = struct.pack("<II", 960_000_128, 960_000_128)
    (tmp_path / "a.npz").write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match="cut off"):
            read(tmp_path / "a.npz")
        assert tracemalloc.get_traced_memory()[1] < 10_000_000
    finally:
        tracemalloc.stop()


def test_messages_stay_one_line_whatever_a_library_or_a_file_says(tmp_path: Path) -> None:
    # Arrow ends its own message in a line feed; escape codes in a name would reach the terminal.
    content = bytearray(parquet())
    content[4:30] = b"\x0f" * 26
    path = tmp_path / "a\x1b[31m\n.parquet"
    path.write_bytes(content)
    with pytest.raises(FileFormatError) as error:
        read(path)
    assert str(error.value).isprintable()


def test_parquet_column_name_that_is_no_utf8(tmp_path: Path) -> None:
    pytest.importorskip("pyarrow")
    path = tmp_path / "a.parquet"
    write(path, PointCloud(POINTS), {"label": np.arange(200)})
    path.write_bytes(path.read_bytes().replace(b"label", b"\x80abel"))
    with pytest.raises(FileFormatError, match="a column's name is not in UTF-8"):
        read(path)
