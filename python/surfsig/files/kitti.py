"""KITTI's Velodyne scans: x, y, z and intensity of each point as float32, and nothing else."""

from __future__ import annotations

import os
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import cloud_from_columns, filled_columns
from surfsig.files.opening import Opening
from surfsig.files.progress import Progress
from surfsig.files.rows import row_blocks
from surfsig.point_cloud import PointCloud

_ROW = np.dtype([(name, "<f4") for name in ("x", "y", "z", "intensity")])
# No sensor looks as far (in metres, or even in millimetres).
_FAR = 1e6


def recognise(opening: Opening) -> bool:
    """Tell by the extension, a size of whole points, and numbers that can be coordinates."""
    # The digits of a table would make small, plausible numbers.
    if opening.extension != ".bin" or opening.size % _ROW.itemsize or opening.is_text:
        return False
    values = np.frombuffer(opening.head, "<f4")
    return bool(values.any() and _plausible(values).all())


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open scan; the sensor, and so the viewpoint, is at (0, 0, 0).

    Raises
    ------
    FileFormatError
        If it holds what can be no coordinate.
    """
    count = os.fstat(file.fileno()).st_size // _ROW.itemsize
    columns = filled_columns(_ROW, count, row_blocks(file, _ROW, count, source, progress))
    cloud = cloud_from_columns(columns, source=source, viewpoint=np.zeros(3))
    wrong = np.flatnonzero(~_plausible(cloud.offsets).all(axis=1))
    if len(wrong):
        place = ", ".join(f"{value:.3g}" for value in cloud.offsets[wrong[0]])
        raise FileFormatError(f"{source}: no KITTI scan: its point {wrong[0]} would be at ({place})")
    return cloud


def _plausible(values: NDArray[np.float32]) -> NDArray[np.bool_]:
    # NaN is not below anything.
    plausible: NDArray[np.bool_] = np.abs(values) < _FAR
    return plausible
