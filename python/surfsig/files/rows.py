"""Rows of binary numbers, a point each, written block by block: the shared part of PLY and PCD."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.files.columns import Chunks, aligned_blocks
from surfsig.files.progress import Progress


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
