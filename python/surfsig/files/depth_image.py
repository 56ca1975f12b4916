"""Depth images: PNG of 16 bits, through Pillow, which is an optional dependency (``surfsig[image]``)."""

from __future__ import annotations

import os
import struct
import warnings
import zlib
from numbers import Real
from typing import BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.defaults import DEPTH_SCALE
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

MAGIC = b"\x89PNG\r\n\x1a\n"

_KINDS = {0: "grey", 2: "colour", 3: "palette", 4: "grey and alpha", 6: "colour and alpha"}
_PIECE_BYTES = 1 << 16
_BLOCK_ROWS = 64


def check_available() -> None:
    """Make sure that Pillow is installed.

    Raises
    ------
    InvalidInputError
        With the command that installs it.
    """
    try:
        import PIL.PngImagePlugin  # noqa: F401
    except ImportError:
        raise InvalidInputError("depth images need Pillow: pip install 'surfsig[image]'") from None


def read(
    file: BinaryIO,
    source: str,
    progress: Progress,
    intrinsics: ArrayLike | None = None,
    depth_scale: float = DEPTH_SCALE,
) -> PointCloud:
    """Read an open depth image, as a camera at (0, 0, 0) that looks along z sees it.

    A depth d at column u and row v is the point z = d / depth_scale, x = (u - cx) z / fx,
    y = (v - cy) z / fy, computed in float64 and kept as float32; depth 0 is no point (NaN). The cloud is
    organised like the image.

    Parameters
    ----------
    file, source, progress
        The open file, its name, and whom to tell.
    intrinsics
        (fx, fy, cx, cy) in pixels.
    depth_scale
        Units of depth per unit of length.

    Raises
    ------
    FileFormatError
        If it is cut off, broken, or no image of 16 bits of grey.
    InvalidInputError
        If Pillow or the intrinsics are missing, or no such numbers.
    """
    size = os.fstat(file.fileno()).st_size
    _check_image(file, source)
    fx, fy, cx, cy = _checked(intrinsics, depth_scale)
    check_available()
    file.seek(0)
    depths = _decoded(file, source)
    height, width = depths.shape
    offsets = np.empty((height, width, 3), np.float32)
    # A tiny scale or focal length makes infinite coordinates, which are no points.
    with np.errstate(over="ignore", invalid="ignore"):
        for start in range(0, height, _BLOCK_ROWS):
            rows = depths[start : start + _BLOCK_ROWS]
            z = np.where(rows == 0, np.nan, rows / np.float64(depth_scale))
            block = offsets[start : start + len(rows)]
            block[..., 0] = (np.arange(width) - cx) * z / fx
            block[..., 1] = (np.arange(start, start + len(rows))[:, None] - cy) * z / fy
            block[..., 2] = z
            progress.advance(size * len(rows) // height)
    progress.advance(size)
    return PointCloud(offsets.reshape(-1, 3), viewpoint=np.zeros(3), grid=(height, width))


def _check_image(file: BinaryIO, source: str) -> None:
    head = file.read(33)
    if len(head) < 33 or head[12:16] != b"IHDR":
        raise FileFormatError(f"{source}: the PNG image is cut off or broken (no header)")
    width, height, bits, colour = struct.unpack_from(">IIBB", head, 16)
    if (bits, colour) != (16, 0):
        kind = _KINDS.get(colour, "unknown")
        raise FileFormatError(
            f"{source}: holds a PNG image of {bits} bits ({kind}), not a depth image (16 bits, grey)"
        )
    # Each row has a byte more, for its filter.
    _check_data(file, height * (1 + 2 * width), source)


def _check_data(file: BinaryIO, needed: int, source: str) -> None:
    """Make sure that the pixels are all there: Pillow leaves those that are missing 0, and says nothing."""
    inflater = zlib.decompressobj()
    size = os.fstat(file.fileno()).st_size
    file.seek(len(MAGIC))
    while len(head := file.read(8)) == 8:
        length, name = struct.unpack(">I4s", head)
        end = file.tell() + length + 4
        # Pillow asks for as many bytes as a chunk says that it has.
        if end > size:
            raise FileFormatError(f"{source}: the PNG image is cut off or broken (a chunk is too long)")
        if name == b"IDAT":
            for start in range(0, length, _PIECE_BYTES):
                data = file.read(min(_PIECE_BYTES, length - start))
                if not data or needed <= 0:
                    break
                needed -= _inflated_bytes(inflater, data, needed, source)
        file.seek(end)
    if needed > 0:
        raise FileFormatError(f"{source}: the PNG image is cut off or broken (pixels are missing)")


def _inflated_bytes(inflater: zlib._Decompress, data: bytes, needed: int, source: str) -> int:
    """Count the bytes in a piece of a stream, holding few of them at a time, until there are enough."""
    count = 0
    while count < needed:
        try:
            piece = inflater.decompress(data, _PIECE_BYTES)
        except zlib.error as error:
            raise FileFormatError(f"{source}: the PNG image is cut off or broken ({error})") from None
        count += len(piece)
        data = inflater.unconsumed_tail
        if not data and len(piece) < _PIECE_BYTES:
            break
    return count


def _checked(
    intrinsics: ArrayLike | None, depth_scale: float
) -> tuple[np.float64, np.float64, np.float64, np.float64]:
    if intrinsics is None:
        raise InvalidInputError("a depth image needs the camera's intrinsics (--intrinsics fx,fy,cx,cy)")
    try:
        numbers = np.array(intrinsics, dtype=np.float64)
    except (TypeError, ValueError):
        numbers = np.empty(0)
    if numbers.shape != (4,) or not np.isfinite(numbers).all() or not (numbers[:2] > 0).all():
        raise InvalidInputError(
            "intrinsics must be four finite numbers fx, fy, cx, cy with fx and fy above 0"
        )
    if not isinstance(depth_scale, Real) or not 0 < depth_scale < np.inf:
        raise InvalidInputError(f"depth_scale must be a finite number above 0, not {depth_scale!r:.40}")
    fx, fy, cx, cy = numbers
    return fx, fy, cx, cy


def _decoded(file: BinaryIO, source: str) -> NDArray[np.uint16]:
    from PIL import Image

    try:
        with warnings.catch_warnings():
            # Of sizes that the data have justified, and of extras that do not touch the depths.
            warnings.simplefilter("ignore")
            with Image.open(file, formats=["PNG"]) as image:
                return np.asarray(image).astype(np.uint16)
    except MemoryError:
        raise
    # Pillow's chunks and zlib raise whatever they like: SyntaxError, struct.error, OSError, ValueError.
    except Exception as error:
        text = " ".join(str(error).split())[:100]
        raise FileFormatError(f"{source}: the PNG image is cut off or broken ({text})") from None
