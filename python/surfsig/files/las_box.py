"""What the header alone of a LAS, LAZ or COPC file says: how many points there are, and in which box."""

from __future__ import annotations

import os
import warnings
from pathlib import Path
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import FileFormatError
from surfsig.files.las_header import read_header


class LasSummary(NamedTuple):
    """What a header says.

    Attributes
    ----------
    points
        How many it promises.
    box
        (2, 3), the lowest and the highest corner.
    fields
        Names of the dimensions but X, Y and Z.
    coordinate_system
        None where it says nothing.
    is_copc
        Whether the file has an octree.
    """

    points: int
    box: NDArray[np.float64]
    fields: tuple[str, ...]
    coordinate_system: CoordinateSystem | None
    is_copc: bool


def las_summary(path: Path) -> LasSummary:
    """Read the header of a file.

    Raises
    ------
    OSError, FileFormatError
        If it cannot be read.
    """
    with path.open("rb") as file, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        header, promised, system = read_header(file, str(path), os.fstat(file.fileno()).st_size)
    names = tuple(name for name in header.point_format.dimension_names if name not in "XYZ")
    box = np.array([header.mins, header.maxs], np.float64)
    is_copc = any(record.user_id == "copc" for record in header.vlrs)
    return LasSummary(promised[0], box, names, system, is_copc)


def las_box(path: Path) -> NDArray[np.float64] | None:
    """Give the box of a file's points by its header; None where that is no box, or no header of LAS."""
    try:
        box = las_summary(path).box
    except (OSError, FileFormatError):
        return None
    return box if np.isfinite(box).all() and (box[0] <= box[1]).all() else None
