"""Rows of a fixed size, as binary files and structured arrays have them, taken apart into columns."""

from __future__ import annotations

from collections.abc import Iterator
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.progress import Progress

# A block of rows stays in the processor's cache while it is taken apart.
BLOCK_BYTES = 1 << 18


def read_columns(
    file: BinaryIO, dtype: np.dtype[Any], count: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    """Read rows from an open file, block by block, so that nothing but the columns takes memory.

    Parameters
    ----------
    file
        Open where the rows begin. That it is long enough for them has been checked.
    dtype
        Of a row: structured, packed or with gaps.
    count
        Number of rows.
    source, progress
        The file's name, and whom to tell of bytes read.

    Returns
    -------
    dict
        As of `columns_of`.

    Raises
    ------
    FileFormatError
        If the file ends early all the same (it is shortened while it is read).
    """
    columns = _empty_columns(dtype, count)
    for start, stop in _blocks(count, dtype.itemsize):
        data = file.read((stop - start) * dtype.itemsize)
        if len(data) < (stop - start) * dtype.itemsize:
            raise FileFormatError(f"{source}: cut off while it was read")
        _fill(columns, start, np.frombuffer(data, dtype))
        progress.advance(len(data))
    return columns


def columns_of(rows: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Take a structured array apart into columns of the machine's byte order.

    All are contiguous but x, y and z: where these have one type, they lie side by side as (n, 3), the form
    in which a cloud takes them without another copy.
    """
    columns = _empty_columns(rows.dtype, len(rows))
    for start, stop in _blocks(len(rows), rows.dtype.itemsize):
        _fill(columns, start, rows[start:stop])
    return columns


def _empty_columns(dtype: np.dtype[Any], count: int) -> dict[str, NDArray[Any]]:
    names = dtype.names or ()
    kinds = {name: dtype[name].base.newbyteorder("=") for name in names}
    axes = {name.lower(): name for name in names if name.lower() in ("x", "y", "z") and not dtype[name].shape}
    columns = {}
    if len(axes) == 3 and len({kinds[name] for name in axes.values()}) == 1:
        points = np.empty((count, 3), kinds[axes["x"]])
        columns = {axes[axis]: points[:, i] for i, axis in enumerate("xyz")}
    return {
        name: columns[name] if name in columns else np.empty((count, *dtype[name].shape), kinds[name])
        for name in names
    }


def _blocks(count: int, row_bytes: int) -> Iterator[tuple[int, int]]:
    step = max(BLOCK_BYTES // max(row_bytes, 1), 1)
    return ((start, min(start + step, count)) for start in range(0, count, step))


def _fill(columns: dict[str, NDArray[Any]], start: int, block: NDArray[Any]) -> None:
    for name, column in columns.items():
        column[start : start + len(block)] = block[name]
