"""Depth images by value, from PNG files made by hand, and what is none."""

import contextlib
import struct
import sys
import tracemalloc
import warnings
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files import read

INTRINSICS = (525.5, 520.25, 3.5, 1.25)


def chunk(name: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + name + data + struct.pack(">I", zlib.crc32(name + data))


def png(values: NDArray[Any], colour: int = 0, size: tuple[int, int] | None = None) -> bytes:
    """Make a PNG image, of 16 or 8 bits; `size` (width, height) says something else in its header."""
    lines = b"".join(b"\0" + row.astype(row.dtype.newbyteorder(">")).tobytes() for row in values)
    width, height = size or (values.shape[1], values.shape[0])
    header = struct.pack(">IIBBBBB", width, height, 8 * values.dtype.itemsize, colour, 0, 0, 0)
    chunks = chunk(b"IHDR", header) + chunk(b"IDAT", zlib.compress(lines)) + chunk(b"IEND", b"")
    return b"\x89PNG\r\n\x1a\n" + chunks


def depths(height: int, width: int) -> NDArray[np.uint16]:
    values = np.random.default_rng(7).integers(1, 65536, (height, width)).astype(np.uint16)
    values[::3, ::2] = 0
    values[0, 1] = 65535
    return values


@pytest.mark.parametrize("shape", [(2, 3), (200, 31)])
@pytest.mark.parametrize("scale", [None, 5000.0])
def test_values(tmp_path: Path, shape: tuple[int, int], scale: float | None) -> None:
    values = depths(*shape)
    path = tmp_path / "depth.png"
    path.write_bytes(png(values))
    told: list[int] = []
    cloud = read(path, intrinsics=INTRINSICS, depth_scale=scale, progress=lambda done, _: told.append(done))
    assert cloud.grid == shape
    assert cloud.viewpoint is not None
    assert cloud.viewpoint.tolist() == [0, 0, 0]
    assert cloud.points.dtype == np.float32
    fx, fy, cx, cy = INTRINSICS
    for v in range(shape[0]):
        for u in range(shape[1]):
            z = int(values[v, u]) / (scale or 1000.0)
            expected = np.array([(u - cx) * z / fx, (v - cy) * z / fy, z], np.float32)
            point = cloud.points[v * shape[1] + u]
            np.testing.assert_array_equal(point, expected if z else np.full(3, np.nan))
    assert told[-1] == path.stat().st_size
    assert told == sorted(told)


def test_the_intrinsics_are_asked_for_and_the_path_named_once(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png(depths(3, 4)))
    with pytest.raises(FileFormatError) as error:
        read(path)
    message = "a depth image needs the camera's intrinsics (--intrinsics fx,fy,cx,cy)"
    assert str(error.value) == f"{path}: {message}"
    with pytest.raises(InvalidInputError, match="a depth image needs the camera's intrinsics"):
        read(path, depth_scale=5000.0)


def test_without_pillow_the_message_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "a.png").write_bytes(png(depths(3, 4)))
    monkeypatch.setitem(sys.modules, "PIL.PngImagePlugin", None)
    with pytest.raises(InvalidInputError, match=r"pip install 'surfsig\[image\]'"):
        read(tmp_path / "a.png", intrinsics=INTRINSICS)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"intrinsics": (1, 2, 3)}, "intrinsics must be four finite numbers"),
        ({"intrinsics": (0, 1, 2, 3)}, "fx and fy above 0"),
        ({"intrinsics": (1, 1, np.nan, 3)}, "intrinsics must be four finite numbers"),
        ({"intrinsics": "many"}, "intrinsics must be four finite numbers"),
        ({"intrinsics": INTRINSICS, "depth_scale": 0.0}, "depth_scale must be a finite number above 0"),
        ({"intrinsics": INTRINSICS, "depth_scale": np.nan}, "depth_scale must be a finite number above 0"),
        ({"intrinsics": INTRINSICS, "depth_scale": "big"}, "depth_scale must be a finite number above 0"),
    ],
)
def test_options_that_make_no_sense(tmp_path: Path, options: dict[str, Any], message: str) -> None:
    (tmp_path / "a.png").write_bytes(png(depths(3, 4)))
    with pytest.raises(InvalidInputError, match=message):
        read(tmp_path / "a.png", **options)


def assert_refused(path: Path, content: bytes, message: str) -> None:
    path.write_bytes(content)
    tracemalloc.start()
    try:
        with pytest.raises(FileFormatError, match=message) as error:
            read(path, intrinsics=INTRINSICS)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()
    assert str(error.value).startswith(f"{path}: ")
    assert "\n" not in str(error.value)


def test_other_images_are_named(tmp_path: Path) -> None:
    byte = np.zeros((4, 6), np.uint8)
    path = tmp_path / "a.png"
    assert_refused(path, png(byte), r"a PNG image of 8 bits \(grey\), not a depth image")
    assert_refused(path, png(byte, colour=2), r"of 8 bits \(colour\)")
    assert_refused(path, png(byte, colour=3), r"of 8 bits \(palette\)")
    assert_refused(path, png(depths(4, 6), colour=6), r"of 16 bits \(colour and alpha\)")


def test_cut_off_anywhere(tmp_path: Path) -> None:
    content = png(depths(30, 40))
    for length in [*range(8, len(content) - 24, 97), len(content) - 24]:
        assert_refused(tmp_path / "a.png", content[:length], "cut off|not a depth image")


def test_sizes_that_the_file_cannot_hold_allocate_nothing(tmp_path: Path) -> None:
    content = png(depths(3, 4), size=(30_000, 30_000))
    assert_refused(tmp_path / "a.png", content, "pixels are missing")
    assert_refused(tmp_path / "a.png", png(depths(3, 4), size=(0, 5)), "cut off or broken")


def test_rows_that_are_missing_are_no_zeros(tmp_path: Path) -> None:
    # Pillow gives such an image, with zeros for the rest.
    assert_refused(tmp_path / "a.png", png(depths(3, 4), size=(4, 9)), "pixels are missing")


def test_much_more_data_than_pixels_is_not_held(tmp_path: Path) -> None:
    path = tmp_path / "a.png"
    path.write_bytes(png(np.zeros((3000, 3000), np.uint16), size=(3000, 2)))
    tracemalloc.start()
    try:
        assert read(path, intrinsics=INTRINSICS).grid == (2, 3000)
        assert tracemalloc.get_traced_memory()[1] < 5e6
    finally:
        tracemalloc.stop()


def test_what_pillow_warns_of_is_no_matter(tmp_path: Path) -> None:
    whole = png(depths(12, 15))
    # An animation without pictures.
    (tmp_path / "a.png").write_bytes(whole[:33] + chunk(b"acTL", bytes(8)) + whole[33:])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        assert read(tmp_path / "a.png", intrinsics=INTRINSICS).grid == (12, 15)


def test_random_changes_never_crash(tmp_path: Path) -> None:
    content = png(depths(12, 15))
    rng = np.random.default_rng(37)
    path = tmp_path / "a.png"
    for number in range(200):
        broken = bytearray(content)
        for place in rng.integers(8, len(broken), rng.integers(1, 4)):
            broken[place] = rng.integers(256)
        if number % 2:
            # With right check sums, so that what follows them meets the change.
            for start, length in ((8, 13), (33, int.from_bytes(content[33:37], "big"))):
                part = bytes(broken[start + 4 : start + 8 + length])
                broken[start + 8 + length : start + 12 + length] = struct.pack(">I", zlib.crc32(part))
        path.write_bytes(broken)
        with contextlib.suppress(FileFormatError):
            cloud = read(path, intrinsics=INTRINSICS)
            assert cloud.grid is not None


def test_a_chunk_that_claims_more_than_the_file_allocates_nothing(tmp_path: Path) -> None:
    content = bytearray(png(depths(3, 4)))
    place = content.index(b"IDAT") - 4
    content[place : place + 4] = b"\xf0\x00\x00\x00"
    assert_refused(tmp_path / "a.png", bytes(content), "a chunk is too long")
