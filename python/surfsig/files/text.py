"""XYZ, CSV, TXT, ASC, PTS: a point per line, with white space, commas, semicolons or tabs between numbers."""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import cloud_from_columns
from surfsig.files.encodings import decoded
from surfsig.files.lines import (
    Block,
    content,
    fault,
    line_blocks,
    parse,
    warn_dropped,
    warn_unterminated,
)
from surfsig.files.scans import joined_scans, scan_number
from surfsig.files.text_layout import Layout, count_of, layout_of
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# What the layout is told by: a thousand rows, or, where they are very wide, a few.
_HEAD_BYTES, _MOST_HEAD_BYTES = 1 << 16, 1 << 22
_HEAD_LINES = 8


def read(
    file: BinaryIO,
    source: str,
    progress: Progress,
    *,
    columns: Sequence[str] | None = None,
    scan: int | None = None,
    unit: str | None = None,
) -> PointCloud:
    """Read an open text file.

    Every line must hold the same number of values, at least three. Names come from a line or a comment above
    the points, or from `columns`; without any the first three are x, y, z, further ones ``column_4`` and so
    on. What holds words is left out, with a warning. A last line that is cut off is dropped, with a warning.

    Where a line with the number of points stands above them (PTS), more such lines begin further scans: they
    are joined, with the field ``scan``, or `scan` chooses one.

    Raises
    ------
    FileFormatError
        Naming the first line that cannot be understood, or the columns that may be the coordinates.
    InvalidInputError
        If `columns` has not a name for each, or there is no such scan.
    """
    file = decoded(file)
    layout = _layout(file, source, columns)
    tables = _tables(file, layout, source, progress)
    _warn_of_counts(tables, source)
    if scan is not None:
        tables = [tables[scan_number(scan, len(tables), source)]]
    names = [layout.names[i] for i in layout.kept]
    return joined_scans(
        [
            cloud_from_columns(
                {name: table[:, i] for i, name in enumerate(names)},
                source=source,
                viewpoint=layout.viewpoint,
                decimals=layout.decimals,
                unit=unit,
            )
            for _, table in tables
        ],
        source,
    )


def clouds(
    file: BinaryIO,
    source: str,
    progress: Progress,
    *,
    columns: Sequence[str] | None = None,
    unit: str | None = None,
) -> tuple[Layout, Iterator[PointCloud]] | None:
    """Give an open file's points block by block, with colours as the text has them.

    Returns
    -------
    Layout and iterator of PointCloud, or None
        None where the file must be read as one: several scans, or a list in brackets.

    Raises
    ------
    FileFormatError, InvalidInputError
        As `read`.
    """
    file = decoded(file)
    layout = _layout(file, source, columns)
    if layout.count is not None or layout.brackets:
        return None
    return layout, _clouds(file, layout, source, progress, unit)


def _clouds(
    file: BinaryIO, layout: Layout, source: str, progress: Progress, unit: str | None
) -> Iterator[PointCloud]:
    names = [layout.names[i] for i in layout.kept]
    for block in _without_bad_end(line_blocks(file, 1, progress), layout, source):
        skip = max(layout.skip + 1 - block.first, 0)
        table = _parsed(block.lines[skip:], block.first + skip, layout, source)
        yield cloud_from_columns(
            {name: table[:, i] for i, name in enumerate(names)},
            source=source,
            viewpoint=layout.viewpoint,
            decimals=layout.decimals,
            unit=unit,
            typed_colours=False,
        )


def _layout(file: BinaryIO, source: str, columns: Sequence[str] | None) -> Layout:
    """Tell by the first lines how a text is to be read, and leave the file where it is."""
    start = file.tell()
    head = part = file.read(_HEAD_BYTES)
    while (
        head.count(b"\n") + head.count(b"\r") < _HEAD_LINES
        and len(part) == _HEAD_BYTES
        and len(head) < _MOST_HEAD_BYTES
    ):
        head += (part := file.read(_HEAD_BYTES))
    layout = layout_of(head, len(part) < _HEAD_BYTES, source, columns)
    file.seek(start)
    return layout


def _tables(
    file: BinaryIO, layout: Layout, source: str, progress: Progress
) -> list[tuple[int | None, NDArray[np.float64]]]:
    """Read the rows, one table for each scan, with the number of points that the line above it promises."""
    scans: list[tuple[int | None, list[NDArray[np.float64]]]] = [(layout.count, [])]
    for block in _without_bad_end(line_blocks(file, 1, progress), layout, source):
        skip = max(layout.skip + 1 - block.first, 0)
        lines, first = block.lines[skip:], block.first + skip
        begin = 0
        if layout.count is not None:
            for number, line in enumerate(lines):
                count = count_of(line)
                if count is not None:
                    scans[-1][1].append(_parsed(lines[begin:number], first + begin, layout, source))
                    scans.append((count, []))
                    begin = number + 1
        scans[-1][1].append(_parsed(lines[begin:], first + begin, layout, source))
    return [(count, np.concatenate(blocks)) for count, blocks in scans]


def _parsed(lines: list[str], first: int, layout: Layout, source: str) -> NDArray[np.float64]:
    if layout.brackets:
        lines = [layout.plain(line) for line in lines]
    return parse(
        lines,
        np.float64,
        layout.width,
        source=source,
        first=first,
        delimiter=layout.delimiter,
        comments=True,
        decimal_comma=layout.decimal_comma,
        kept=layout.kept if len(layout.kept) < layout.width else None,
    )


def _warn_of_counts(tables: list[tuple[int | None, NDArray[np.float64]]], source: str) -> None:
    for number, (count, table) in enumerate(tables):
        if count is not None and count != len(table):
            which = f" of scan {number}" if len(tables) > 1 else ""
            warnings.warn(
                f"{source}: the count{which} promises {count} points, {len(table)} are there", stacklevel=3
            )
            return


def _without_bad_end(blocks: Iterator[Block], layout: Layout, source: str) -> Iterator[Block]:
    """Pass the blocks on, without a last line that is cut off."""
    waiting: Block | None = None
    for block in blocks:
        if waiting is not None:
            yield waiting
        waiting = block
    if waiting is None:
        return
    if layout.brackets:
        if not any("]" in line and not layout.plain(line).strip() for line in waiting.lines[-3:]):
            raise FileFormatError(f"{source}: cut off: its list of points has no closing bracket")
        yield waiting
        return
    last = next(
        (i for i in reversed(range(len(waiting.lines))) if content(waiting.lines[i], True, layout.delimiter)),
        None,
    )
    if last is not None:
        wrong = fault(
            waiting.lines[last], layout.width, layout.delimiter, True, layout.decimal_comma, layout.kept
        )
        unterminated = waiting.unterminated and last == len(waiting.lines) - 1
        if wrong is not None and (unterminated or wrong[1]):
            warn_dropped(source, waiting.first + last)
            waiting.lines = waiting.lines[:last]
        elif unterminated:
            warn_unterminated(source, waiting.first + last)
    yield waiting
