"""Rows of binary numbers, a point each, block by block: the shared part of PLY, PCD and NPY."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import Chunks, aligned_blocks
from surfsig.progress import Progress

# Small enough to stay in a processor's cache while it is split into columns.
BLOCK_BYTES = 1 << 19


def row_blocks(
    file: BinaryIO, dtype: np.dtype[Any], count: int, source: str, progress: Progress
) -> Iterator[NDArray[Any]]:
    """Read rows block by block; a block is valid until the next one is asked for.

    Raises
    ------
    FileFormatError
        If the file ends before.
    """
    rows = max(1, BLOCK_BYTES // max(1, dtype.itemsize))
    buffer = np.empty(min(rows, count), dtype)
    for start in range(0, count, rows):
        block = buffer[: count - start]
        if not filled(file, block, progress):
            raise FileFormatError(f"{source}: cut off: {count} points are promised, the file ends before")
        yield block


def filled(file: IO[bytes], array: NDArray[Any], progress: Progress | None = None) -> bool:
    """Fill a contiguous array with what comes next in a file; False if the file ends before."""
    if not array.nbytes:
        return True
    view = array.reshape(-1).view(np.uint8)
    for start in range(0, len(view), BLOCK_BYTES):
        part = view[start : start + BLOCK_BYTES]
        if file.readinto(part.data) != len(part):  # type: ignore[attr-defined]
            return False
        if progress is not None:
            progress.advance(len(part))
    return True


def write_rows(
    file: BinaryIO,
    columns: Sequence[tuple[str, NDArray[Any]]],
    chunks: tuple[str, Chunks] | None,
    count: int,
    progress: Progress,
) -> None:
    """Write one packed little-endian row per point.

    Parameters
    ----------
    file
        Open for writing, at the place of the first row.
    columns
        The types to write (``f4``, ``u1``, ...) and (n,) or (n, k) values, in the order of a row.
    chunks
        The type and the values of the chunked column, which ends a row; None if there is none.
    count, progress
        The number of points, n, and whom to tell.

    Raises
    ------
    InvalidInputError
        If the blocks of `chunks` do not fit (`aligned_blocks`).
    """
    parts = [(f"{i}", "<" + kind, values.shape[1:]) for i, (kind, values) in enumerate(columns)]
    if chunks is not None:
        parts.append(("chunks", "<" + chunks[0], (chunks[1].width,)))
    dtype = np.dtype(parts)
    for rows, block in aligned_blocks(None if chunks is None else chunks[1], count):
        packed = np.empty(rows.stop - rows.start, dtype)
        for i, (_, values) in enumerate(columns):
            packed[f"{i}"] = values[rows]
        if block is not None:
            packed["chunks"] = block
        file.write(packed.data)
        progress.advance(len(packed))
