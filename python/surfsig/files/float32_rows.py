"""Rows of float32 without a header (.bin): x y z, KITTI's with intensity, nuScenes' with a ring, others."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import cloud_from_columns, filled_columns
from surfsig.files.float32_layout import FARTHEST, LAYOUTS, RowLayout, fitting_layouts, sample
from surfsig.files.options import LEFT_OUT
from surfsig.files.rows import row_blocks
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

_FLOAT_BYTES = 4
_HINT = 'columns="x,y,z,intensity" names the values of a row'


def read(file: BinaryIO, source: str, progress: Progress, columns: Sequence[str] | None = None) -> PointCloud:
    """Read an open file of float32 rows of three to six values, or of those that `columns` names.

    How long a row is follows from what the numbers can be: coordinates are finite and below 1,000 km, an
    intensity is never negative, a ring is a small whole number, colours are whole up to 255, a normal has the
    length 1; and the values at one place of a row are alike. Rows with an intensity are a scanner's, which is
    at (0, 0, 0).

    Raises
    ------
    FileFormatError
        If no layout fits, or several do, or a value makes no sense.
    InvalidInputError
        If the file does not hold whole rows of as many values as `columns` names.
    """
    size = os.fstat(file.fileno()).st_size
    if columns is None:
        layout = _layout(file, size, source)
        names = layout.names
    else:
        layout, names = None, tuple(columns)
        if size % (_FLOAT_BYTES * len(names)):
            raise InvalidInputError(
                f"{source}: has {size} bytes, which are no whole rows of {len(names)} float32, as 'columns' "
                "names"
            )
    # Names of what is left out must differ too.
    dtype = np.dtype([(f"_{i}" if name in LEFT_OUT else name, "<f4") for i, name in enumerate(names)])
    file.seek(0)
    count = size // dtype.itemsize
    values = filled_columns(dtype, count, row_blocks(file, dtype, count, source, progress))
    if layout is not None:
        _check(list(values.values()), layout, source)
    viewpoint = np.zeros(3) if "intensity" in names else None
    kept = {name: values[name] for name in names if name not in LEFT_OUT}
    return cloud_from_columns(kept, source=source, viewpoint=viewpoint)


def _layout(file: BinaryIO, size: int, source: str) -> RowLayout:
    if size % _FLOAT_BYTES:
        raise FileFormatError(f"{source}: has {size} bytes, which are no float32: cut off, or another format")
    count = size // _FLOAT_BYTES
    parts = sample(file, count)
    found = fitting_layouts(parts, count)
    if found.certain:
        if found.layouts[0].signed:
            warnings.warn(
                f"{source}: taken as rows of x y z intensity, although intensities are negative; {_HINT}",
                stacklevel=3,
            )
        return found.layouts[0]
    if not all((np.isfinite(part) & (np.abs(part) < FARTHEST)).all() for part in parts):
        raise FileFormatError(
            f"{source}: holds no rows of float32 that are known: numbers are not finite, or {FARTHEST:g} or "
            f"more; {_HINT}"
        )
    fits = [f"{count // each.width} of {each.told}" for each in found.layouts]
    known = {each.width for each in found.layouts}
    fits += [f"{count // width} of {width} values" for width in sorted(found.widths - known)]
    if not fits:
        told = "; ".join(each.told for each in LAYOUTS)
        raise FileFormatError(f"{source}: its {count} numbers fit no known row of float32 ({told}): {_HINT}")
    raise FileFormatError(
        f"{source}: cannot tell what its rows of float32 are ({', or '.join(fits)}): {_HINT}"
    )


def _check(columns: list[NDArray[Any]], layout: RowLayout, source: str) -> None:
    """Make sure that what the sample says is true of all rows."""
    if layout.fits(columns):
        return
    low, high = 0, len(columns[0])
    while high - low > 1:
        middle = (low + high) // 2
        low, high = (
            (middle, high) if layout.fits([values[low:middle] for values in columns]) else (low, middle)
        )
    shown = " ".join(f"{values[low]:.9g}" for values in columns)
    raise FileFormatError(f"{source}: row {low} ({shown}) cannot be {layout.told}: {_HINT}")
