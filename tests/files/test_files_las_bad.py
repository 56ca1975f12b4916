"""LAS, LAZ and COPC files that are cut off or broken: an error of one line, and no allocation."""

import contextlib
import struct
import subprocess
import sys
import tracemalloc
from collections.abc import Callable
from pathlib import Path
from typing import Any

import laspy
import numpy as np
import pytest

from surfsig.errors import FileFormatError
from surfsig.files import read, write
from surfsig.files.laz_chunks import one_line_errors
from surfsig.point_cloud import PointCloud

EVERYTHING = [[-np.inf] * 3, [np.inf] * 3]


def whole(folder: Path, name: str) -> bytearray:
    """Make a file of 700 points with colours and extra bytes: "6.las" (that is, ours), "6.laz", "3.laz"."""
    rng = np.random.default_rng(23)
    path = folder / name
    if name.startswith("6"):
        fields: dict[str, Any] = {"label": rng.integers(0, 99, 700).astype(np.uint16)}
        write(path, PointCloud(rng.normal(size=(700, 3)), fields=fields))
    else:
        header = laspy.LasHeader(point_format=3, version="1.2")
        header.add_extra_dim(laspy.ExtraBytesParams("raw", "5u1"))
        data = laspy.LasData(header)
        data.xyz = rng.normal(size=(700, 3))
        data.write(path)
    return bytearray(path.read_bytes())


NAMES = ["6.las", "6.laz", "3.laz"]


def assert_refused(
    path: Path, content: bytes | bytearray, message: str | None = None, **options: Any
) -> None:
    path.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=message) as error:
            read(path, **options)
        assert tracemalloc.get_traced_memory()[1] < 20e6
    finally:
        tracemalloc.stop()
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


@pytest.mark.parametrize("name", NAMES)
def test_cut_off_at_every_twentieth_and_by_a_byte(tmp_path: Path, name: str) -> None:
    content = whole(tmp_path, name)
    for length in [*range(4, len(content), len(content) // 20), len(content) - 1]:
        if name.endswith("laz") and length == len(content) - 1:
            # The coder's last byte may be one that is not needed.
            continue
        assert_refused(tmp_path / name, content[:length])


@pytest.mark.parametrize(
    ("changes", "seed"), [(30, 29), pytest.param(120, 30, marks=pytest.mark.slow)], ids=["few", "many"]
)
@pytest.mark.parametrize("name", [*NAMES, "copc"])
def test_random_changes_never_crash(
    tmp_path: Path, name: str, changes: int, seed: int, request: pytest.FixtureRequest
) -> None:
    content = request.getfixturevalue("octree")[0] if name == "copc" else whole(tmp_path, name)
    start = int.from_bytes(content[96:100], "little")
    rng = np.random.default_rng(seed)
    path = tmp_path / "broken.laz"
    for number in range(changes):
        broken = bytearray(content)
        low, high = [(4, start + 16), (start, len(content)), (len(content) - 2000, len(content))][number % 3]
        for place in rng.integers(low, high, rng.integers(1, 6)):
            broken[place] = rng.integers(256)
        if number % 5 == 0:
            place = int(rng.integers(94, len(content) - 60))
            broken[place : place + 60] = bytes(60)
        path.write_bytes(broken)
        for box in (None, EVERYTHING):
            # A change may be harmless; any other error than this one is a bug.
            with contextlib.suppress(FileFormatError):
                cloud = read(path, box=box)
                assert all(len(values) == len(cloud) for values in cloud.fields.values())


def field(content: bytearray, place: int, kind: str, value: float) -> bytearray:
    changed = bytearray(content)
    struct.pack_into("<" + kind, changed, place, value)
    return changed


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize(
    ("place", "kind", "value", "message"),
    [
        (94, "H", 60_000, "cut off or broken: its header promises . records and points from byte"),
        (94, "H", 100, "Incoherent header size"),
        (96, "I", 2**32 - 1, "points from byte 4294967295 on"),
        (100, "I", 2**32 - 1, "promises 4294967295 records"),
        (104, "B", 99, None),
        (105, "H", 2, "Incoherent point size"),
        (131, "d", np.nan, "the scale or offset in its header makes no sense"),
        (131, "d", 1e308, "the scale or offset in its header makes no sense"),
        (155, "d", -np.inf, "the scale or offset in its header makes no sense"),
    ],
)
def test_headers_that_make_no_sense(
    tmp_path: Path, name: str, place: int, kind: str, value: float, message: str | None
) -> None:
    assert_refused(tmp_path / name, field(whole(tmp_path, name), place, kind, value), message)


@pytest.mark.parametrize("name", NAMES)
def test_absurd_numbers_of_points_allocate_nothing(tmp_path: Path, name: str) -> None:
    place, kind = (247, "Q") if name.startswith("6") else (107, "I")
    for count in (701, 10**9, 2**32 - 1):
        assert_refused(tmp_path / name, field(whole(tmp_path, name), place, kind, count), "cut off")


def laszip_record(content: bytearray) -> int:
    return content.index(b"laszip encoded") + 52


@pytest.mark.parametrize("name", ["6.laz", "3.laz"])
def test_a_chunk_of_absurdly_many_points(tmp_path: Path, name: str) -> None:
    content = whole(tmp_path, name)
    place, kind = (247, "Q") if name.startswith("6") else (107, "I")
    content = field(content, laszip_record(content) + 12, "I", 2**31)
    assert len(read_of(tmp_path / name, content)) == 700
    message = "a chunk promises 2000000000 points in"
    assert_refused(tmp_path / name, field(content, place, kind, 2_000_000_000), message)
    # lazrs would have all points of such a file in one chunk of unknown size.
    content = field(content, laszip_record(content), "H", 1)
    assert_refused(tmp_path / name, field(content, place, kind, 2_000_000_000), message)


def read_of(path: Path, content: bytes | bytearray) -> PointCloud:
    path.write_bytes(content)
    return read(path)


@pytest.mark.parametrize("name", ["6.laz", "3.laz"])
def test_chunk_tables_that_make_no_sense(tmp_path: Path, name: str) -> None:
    content = whole(tmp_path, name)
    start = int.from_bytes(content[96:100], "little")
    table = int.from_bytes(content[start : start + 8], "little")
    path = tmp_path / name
    assert_refused(path, field(content, table + 4, "I", 2**32 - 1), "its table promises 4294967295 chunks")
    assert_refused(path, field(content, table + 4, "I", 0), "its chunks hold 0 in 8 bytes")
    assert_refused(path, field(content, start, "q", 2**62), "the table of its chunks is missing")
    # As a writer leaves it that could not go back: the place of the table is at the end of the file.
    assert len(read_of(path, field(content, start, "q", -1) + struct.pack("<q", table))) == 700
    assert_refused(path, field(content, start, "q", -1) + struct.pack("<q", -1), "is missing")


@pytest.mark.parametrize("name", ["6.laz", "3.laz"])
def test_a_compression_of_another_point_format(tmp_path: Path, name: str) -> None:
    content = whole(tmp_path, name)
    items = laszip_record(content) + 34
    message = f"the LAZ compression is not that of point format {name[0]}"
    assert_refused(tmp_path / name, field(content, items, "H", 8), message)
    assert_refused(tmp_path / name, field(content, items + 2, "H", 9), message)
    assert_refused(tmp_path / name, field(content, items + 4, "H", 77), "version")
    hidden = content.replace(b"laszip encoded", b"laszip_encoded")
    assert_refused(tmp_path / name, hidden, "'LasZipVlr' could not be found")


def test_layers_of_absurd_sizes(tmp_path: Path) -> None:
    content = whole(tmp_path, "6.laz")
    start = int.from_bytes(content[96:100], "little")
    size = int.from_bytes(content[105:107], "little")
    for layer in range(11):
        broken = field(content, start + 8 + size + 4 + 4 * layer, "I", 2**32 - 1)
        assert_refused(tmp_path / "6.laz", broken, "a chunk promises 700 points")


def test_extra_bytes_of_no_elements(tmp_path: Path) -> None:
    # laspy reads such a description, and divides by the number of elements afterwards.
    content = whole(tmp_path, "3.laz")
    record = content.index(b"LASF_Spec") + 52
    assert content[record + 2 : record + 4] == b"\x00\x05"
    content[record + 3] = 0
    assert_refused(tmp_path / "3.laz", content, "cut off or broken")


def test_notes_that_make_no_sense(tmp_path: Path) -> None:
    content = whole(tmp_path, "6.las")
    start = content.index(b'{"notes')
    end = int.from_bytes(content[96:100], "little")
    for text in (b"", b"[", b"[]", b'{"viewpoint": 3}', b'{"grid": [1, 2]}', b'{"dimensions": 7}'):
        broken = bytes(content[:start]) + text.ljust(end - start) + bytes(content[end:])
        assert_refused(tmp_path / "6.las", broken, "cut off or broken", box=None)


@pytest.fixture
def octree(shared_data: Path) -> tuple[bytearray, int, int]:
    """Give a COPC file, and where the root page of its octree is and how long."""
    content = bytearray((shared_data / "formats/simple.copc.laz").read_bytes())
    info = content.index(b"copc\0") + 52
    return content, *struct.unpack_from("<QQ", content, info + 40)


def broken_octrees(content: bytearray, root: int, length: int) -> dict[str, tuple[bytearray, str]]:
    info = content.index(b"copc\0") + 52
    loop = field(field(content, root + 16, "Q", root), root + 24, "i", length)
    nowhere = field(content, root + 28, "i", -1)
    return {
        "a page that names itself": (field(loop, root + 28, "i", -1), "a page of"),
        "an empty page": (field(field(nowhere, root + 16, "Q", 2**63), root + 24, "i", 32), "a page of 32"),
        "a page of negative size": (field(nowhere, root + 24, "i", -32), "a page of -32"),
        "a page of half an entry": (field(nowhere, root + 24, "i", 16), "a page of 16"),
        "a root beyond the file": (field(content, info + 40, "Q", 2**64 - 1), "a page of"),
        "a root of absurd size": (field(content, info + 48, "Q", 2**63), "a page of"),
        "a node beyond the file": (field(content, root + 16, "Q", 2**64 - 1), "its nodes hold more"),
        "a node of absurd size": (field(content, root + 24, "i", 2**31 - 1), "its nodes hold more"),
        "a node of negative size": (field(content, root + 24, "i", -5), "its nodes hold more"),
        "absurdly many points": (field(content, root + 28, "i", 2**31 - 1), "its nodes hold more"),
        "negatively many points": (field(content, root + 28, "i", -2), "its nodes hold more"),
        "a node twice": (
            content[: root + 32] + content[root : root + 32] + content[root + 64 :], "its nodes hold more",
        ),
    }  # fmt: skip


def test_octrees_that_make_no_sense(tmp_path: Path, octree: tuple[bytearray, int, int]) -> None:
    for name, (content, message) in broken_octrees(*octree).items():
        path = tmp_path / f"{name}.laz"
        # The points themselves are whole, and their chunks are in a table of their own.
        assert len(read_of(path, content)) == 1065
        assert_refused(path, content, message, box=EVERYTHING)


def test_an_octree_whose_cube_is_elsewhere_is_not_trusted(
    tmp_path: Path, octree: tuple[bytearray, int, int]
) -> None:
    content = octree[0]
    info = content.index(b"copc\0") + 52
    for value in (0.0, np.nan, 1e308, -np.inf):
        (tmp_path / "a.laz").write_bytes(field(content, info, "d", value))
        assert len(read(tmp_path / "a.laz", box=EVERYTHING)) == 1065


@pytest.mark.parametrize(
    ("raised", "expected"),
    [
        (lambda: ValueError("two\nlines"), FileFormatError),
        (lambda: type("PanicException", (BaseException,), {})("explicit panic"), FileFormatError),
        (KeyboardInterrupt, KeyboardInterrupt),
        (lambda: OSError(5, "Input/output error"), OSError),
    ],
)
def test_a_panic_of_rust_is_an_error_and_ctrl_c_is_not(
    raised: Callable[[], BaseException], expected: type[BaseException]
) -> None:
    with pytest.raises(expected) as error, one_line_errors("a.laz"):
        raise raised()
    assert "\n" not in str(error.value)


def test_broken_files_print_nothing(tmp_path: Path) -> None:
    content = whole(tmp_path, "6.laz")
    start = int.from_bytes(content[96:100], "little")
    content[start + 200 : start + 260] = bytes(60)
    (tmp_path / "a.laz").write_bytes(content)
    code = "import sys, contextlib, surfsig\nwith contextlib.suppress(ValueError): surfsig.read(sys.argv[1])"
    done = subprocess.run([sys.executable, "-c", code, tmp_path / "a.laz"], capture_output=True, check=True)
    assert (done.stdout, done.stderr) == (b"", b"")


def test_times_that_make_lazrs_call_itself_do_not_overflow_the_stack(tmp_path: Path) -> None:
    header = laspy.LasHeader(point_format=3, version="1.2")
    data = laspy.LasData(header)
    rng = np.random.default_rng(29)
    data.xyz = rng.normal(size=(60, 3))
    data.gps_time = np.cumsum(rng.random(60))
    path = tmp_path / "3.laz"
    data.write(path)
    content = bytearray(path.read_bytes())
    start = struct.unpack_from("<I", content, 96)[0]
    content[start + 100 : start + 600] = b"\xff" * 500
    path.write_bytes(content)
    code = "\n".join(
        [
            "import sys, surfsig",
            "try: surfsig.read(sys.argv[1])",
            "except surfsig.FileFormatError: print('refused')",
        ]
    )
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, text=True, check=False)
    assert (done.returncode, done.stdout) == (0, "refused\n"), done.stderr[-500:]
