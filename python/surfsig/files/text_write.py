"""Text output: CSV with a header, or numbers with blanks between them (XYZ, TXT, ASC)."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.files.columns import Chunks, aligned_blocks, column_names, scalar_columns
from surfsig.files.text_notes import note_lines
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# Rows that are text at the same time: some MB.
_BLOCK_ROWS = 1 << 14


def write_csv(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write a line of names, then a point per line, with commas; viewpoint and notes have no place in it."""
    names, arrays = _named_columns(cloud, columns, chunks)
    line = io.StringIO()
    csv.writer(line, lineterminator="\n").writerow(names)
    file.write(line.getvalue().encode())
    _write_rows(file, ",", arrays, chunks, len(cloud), progress)


def write_plain(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write a point per line, with blanks between its numbers.

    Where there are more than x, y, z, their names come first in a line ``//x y z intensity``, as CloudCompare
    writes it; viewpoint and notes are such lines too. Open3D passes over them, and takes the first three
    columns.
    """
    names, arrays = _named_columns(cloud, columns, chunks)
    lines = ["//" + " ".join(name.replace('"', "'") for name in names)] if len(names) > 3 else []
    lines += note_lines(cloud.viewpoint, notes)
    file.write("".join(line + "\n" for line in lines).encode())
    _write_rows(file, " ", arrays, chunks, len(cloud), progress)


def _named_columns(
    cloud: PointCloud, columns: Mapping[str, NDArray[Any]], chunks: Chunks | None
) -> tuple[list[str], list[NDArray[Any]]]:
    scalars = scalar_columns(columns)
    arrays = [*cloud.points.T, *scalars.values()]
    return ["x", "y", "z", *scalars, *(column_names(chunks.name, chunks.width) if chunks else ())], arrays


def _write_rows(
    file: BinaryIO,
    delimiter: str,
    arrays: list[NDArray[Any]],
    chunks: Chunks | None,
    count: int,
    progress: Progress,
) -> None:
    for rows, block in aligned_blocks(chunks, count):
        for start in range(rows.start, rows.stop, _BLOCK_ROWS):
            part = slice(start, min(start + _BLOCK_ROWS, rows.stop))
            values = [array[part] for array in arrays]
            if block is not None:
                values += list(block[start - rows.start : part.stop - rows.start].T)
            cells = [_as_text(column) for column in values]
            text = "\n".join(map(delimiter.join, zip(*cells, strict=True)))
            file.write(text.encode() + b"\n")
            progress.advance(part.stop - start)


def _as_text(values: NDArray[Any]) -> list[str]:
    """Write numbers with as few digits as give back the same bits in their type."""
    if values.dtype.kind == "b":
        values = values.astype(np.uint8)
    if values.dtype == np.float64 or values.dtype.kind in "iu":
        return list(map(repr, values.tolist()))
    text: list[str] = values.astype("U").tolist()
    return text
