"""KITTI's scans (.bin): x, y, z and intensity as float32, without a header."""

from __future__ import annotations

import os
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

_POINT_BYTES = 16
_BLOCK_POINTS = 1 << 16
# Metres: far beyond the reach of any scanner.
_FARTHEST = 1e6


def is_plausible(head: bytes, size: int) -> bool:
    """Tell whether a file of `size` bytes that begins so may be such a scan."""
    rows = _rows(head[: len(head) // _POINT_BYTES * _POINT_BYTES])
    # Nothing but zeros is a file that was never filled.
    return size % _POINT_BYTES == 0 and bool(rows.any()) and _are_points(rows)


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open scan; the scanner is at (0, 0, 0).

    Raises
    ------
    FileFormatError
        If a value is not finite, or too large for a coordinate in metres.
    """
    count = os.fstat(file.fileno()).st_size // _POINT_BYTES
    offsets = np.empty((count, 3), np.float32)
    intensity = np.empty(count, np.float32)
    for start in range(0, count, _BLOCK_POINTS):
        data = file.read(_POINT_BYTES * min(_BLOCK_POINTS, count - start))
        rows = _rows(data)
        if not _are_points(rows):
            raise FileFormatError(
                f"{source}: is not a KITTI scan: a value is not finite, or {_FARTHEST:g} or more"
            )
        offsets[start : start + len(rows)] = rows[:, :3]
        intensity[start : start + len(rows)] = rows[:, 3]
        progress.advance(len(data))
    return PointCloud(offsets, viewpoint=np.zeros(3), fields={"intensity": intensity})


def _rows(data: bytes) -> NDArray[Any]:
    return np.frombuffer(data, "<f4").reshape(-1, 4)


def _are_points(rows: NDArray[Any]) -> bool:
    return bool(np.isfinite(rows[:, 3]).all() and (np.abs(rows[:, :3]) < _FARTHEST).all())
