"""Depth images: PNG through Pillow, which is an optional dependency (``surfsig[image]``)."""

from __future__ import annotations

import io
import os
import warnings
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import defaults
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

# Deflate makes at most 1032 bytes of one.
_MAX_RATIO = 1032
# Signature, then the chunk IHDR: its length and name, width, height, bits per channel, type of colour.
_HEADER = np.dtype(
    [
        ("signature", "V8"),
        ("name", "V8"),
        ("width", ">u4"),
        ("height", ">u4"),
        ("bits", "u1"),
        ("colour", "u1"),
    ]
)
_GREY = 0
_BLOCK = 1 << 16


def read(
    file: BinaryIO,
    source: str,
    progress: Progress,
    intrinsics: ArrayLike | None = None,
    depth_scale: float = defaults.DEPTH_SCALE,
) -> PointCloud:
    """Read an open PNG image of depths as an organised cloud, seen from (0, 0, 0).

    The pixel in column u and row v, from 0, of depth d is the point z = d / depth_scale,
    x = (u - cx) z / fx, y = (v - cy) z / fy, in float32; a depth of 0 is none, and the point NaN.

    Raises
    ------
    FileFormatError
        If the image is cut off, broken, or one of colours.
    InvalidInputError
        If `intrinsics` or Pillow are missing, or `intrinsics` or `depth_scale` make no sense.
    """
    size = os.fstat(file.fileno()).st_size
    _check_header(file.read(_HEADER.itemsize), size, source)
    fx, fy, cx, cy = _camera(intrinsics, source)
    scale = _scale(depth_scale, source)
    depths = _decoded(file, source)
    progress.advance(size)
    height, width = depths.shape
    values = depths.ravel()
    points = np.empty((values.size, 3), np.float32)
    # Pixels by blocks, as a broken image may be all height or all width.
    for start in range(0, values.size, _BLOCK):
        block = values[start : start + _BLOCK]
        v, u = np.divmod(np.arange(start, start + len(block)), width)
        rows = points[start : start + _BLOCK]
        # A tiny scale or focal length leads beyond float32.
        with np.errstate(over="ignore", invalid="ignore"):
            z = np.where(block == 0, np.nan, block / scale)
            rows[:, 0], rows[:, 1], rows[:, 2] = (u - cx) * z / fx, (v - cy) * z / fy, z
    return PointCloud(points, viewpoint=np.zeros(3), grid=(height, width))


def _check_header(head: bytes, size: int, source: str) -> None:
    if len(head) < _HEADER.itemsize:
        raise FileFormatError(f"{source}: the PNG image is cut off")
    header = np.frombuffer(head, _HEADER)[0]
    if header["colour"] != _GREY:
        raise FileFormatError(f"{source}: is a colour image, not one of depths")
    width, height, bits = (int(header[name]) for name in ("width", "height", "bits"))
    if bits not in (8, 16):
        raise FileFormatError(f"{source}: its pixels have {bits} bits, depths 8 or 16")
    if width * height * bits > 8 * _MAX_RATIO * size:
        raise FileFormatError(
            f"{source}: cut off or broken: its header promises {width} x {height} pixels, "
            f"the file has {size} bytes"
        )


def _camera(intrinsics: ArrayLike | None, source: str) -> list[float]:
    if intrinsics is None:
        raise InvalidInputError(
            f"{source}: a depth image needs the camera's intrinsics in pixels: intrinsics=(fx, fy, cx, cy), "
            "in the shell --intrinsics fx,fy,cx,cy"
        )
    try:
        values = np.array(intrinsics, np.float64)
    except (TypeError, ValueError):
        values = np.empty(0)
    if values.shape != (4,) or not np.isfinite(values).all() or not (values[:2] > 0).all():
        raise InvalidInputError(
            f"{source}: intrinsics must be four numbers (fx, fy, cx, cy), fx and fy above 0"
        )
    return [float(value) for value in values]


def _scale(depth_scale: float, source: str) -> float:
    try:
        scale = float(depth_scale)
    except (TypeError, ValueError):
        scale = np.nan
    if not 0 < scale < np.inf:
        raise InvalidInputError(f"{source}: depth_scale must be a positive number")
    return scale


def _decoded(file: BinaryIO, source: str) -> NDArray[Any]:
    """Give the image's numbers (height, width)."""
    try:
        from PIL import Image
    except ImportError:
        raise InvalidInputError(f"{source}: depth images need Pillow: pip install 'surfsig[image]'") from None
    file.seek(0)
    # From a buffer: reading from a file, Python allocates whatever length a broken chunk claims to have.
    content = io.BytesIO(file.read())
    try:
        with warnings.catch_warnings():
            # Of sizes that the file's own has justified, and of extras that do not touch the depths.
            warnings.simplefilter("ignore")
            with Image.open(content, formats=["PNG"]) as image:
                return np.asarray(image)
    # Besides OSError, a broken chunk raises whatever Pillow's parser of it may raise.
    except Exception as error:
        reason = " ".join(str(error).split())[:100]
        raise FileFormatError(f"{source}: the PNG image is cut off or broken ({reason})") from None
