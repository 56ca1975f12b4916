"""XYZ, CSV, TXT, ASC: a point per line, with white space, commas, semicolons or tabs between the numbers."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass
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
    tokens_of,
    warn_dropped,
    warn_unterminated,
)
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

_HEAD_BYTES = 1 << 16
# Maple writes a list of points as "Points:=[", then "[x, y, z], " per line, then "];".
_MAPLE = re.compile(r"\w+\s*:=\s*\[\s*$")
_DECIMAL = re.compile(r"[.eE]")
_BRACKETS = str.maketrans("[],;", "    ")


@dataclass
class Layout:
    """How the lines of a file are to be read.

    Attributes
    ----------
    names
        A name per column.
    delimiter
        What stands between two numbers; None is white space.
    skip
        Lines before the first point.
    brackets
        The numbers stand in Maple's brackets.
    decimals
        The columns whose first number is written with a decimal point or an exponent.
    """

    names: list[str]
    delimiter: str | None
    skip: int
    brackets: bool
    decimals: list[str]


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open text file.

    Every line must hold the same number of values, at least three. Names come from a first line of words or
    from a comment right above the points; x, y, z may then be any columns, otherwise they are the first
    three. Further columns become fields (``column_4`` and so on where nothing names them). A last line that
    is cut off is dropped, with a warning.

    Raises
    ------
    FileFormatError
        Naming the first line that cannot be understood.
    """
    file = decoded(file)
    start = file.tell()
    layout = _layout(file.read(_HEAD_BYTES), source)
    file.seek(start)
    blocks = [
        _parse_block(block, layout, source)
        for block in _without_bad_end(line_blocks(file, 1, progress), layout, source)
    ]
    table = np.concatenate(blocks)
    return cloud_from_columns(
        {name: table[:, i] for i, name in enumerate(layout.names)}, source=source, decimals=layout.decimals
    )


def _layout(head: bytes, source: str) -> Layout:
    comment: list[str] = []
    header: list[str] = []
    brackets = False
    lines = head.decode("utf-8", errors="replace").splitlines()
    for number, line in enumerate(lines):
        if not line.strip():
            continue
        if not content(line, comments=True):
            comment = _words(line.strip().lstrip("#/ \t"))
            continue
        if _MAPLE.match(line.strip()) and not brackets:
            brackets = True
            continue
        text = line.translate(_BRACKETS) if brackets else line
        delimiter = next((mark for mark in ";," if mark in text), None)
        tokens = tokens_of(text, delimiter)
        width = len(tokens)
        wrong = fault(text, width, delimiter, comments=True)
        if wrong is None and width >= 3:
            names = _names(header, comment, width)
            decimals = [name for name, token in zip(names, tokens, strict=True) if _DECIMAL.search(token)]
            return Layout(names, delimiter, number, brackets, decimals)
        cut_off = number == len(lines) - 1 and not head.endswith(b"\n")
        if header or brackets or wrong is None or cut_off:
            reason = wrong[0] if wrong else f"{width} values where a point needs three"
            raise FileFormatError(f"{source}: not a table of points: line {number + 1}: {reason}")
        header = _words(line)
    if header:
        raise FileFormatError(
            f"{source}: not a table of points: line 1: {' '.join(header)[:40]!r} and no numbers"
        )
    raise FileFormatError(f"{source}: holds no points")


def _words(line: str) -> list[str]:
    delimiter = next((mark for mark in ";," if mark in line), None)
    return [word.strip().strip("\"'") for word in line.strip().split(delimiter)]


def _names(header: list[str], comment: list[str], width: int) -> list[str]:
    """Name the columns: by the header, by a comment that names x, y, z, or by their numbers."""
    given = header if 3 <= len(header) <= width else []
    if not given and len(comment) == width and {"x", "y", "z"} <= {word.lower() for word in comment}:
        given = comment
    names = given + [f"column_{i + 1}" for i in range(len(given), width)]
    if not {"x", "y", "z"} <= {name.lower() for name in names}:
        names[:3] = ["x", "y", "z"]
    taken: set[str] = set()
    for i, name in enumerate(names):
        names[i] = f"column_{i + 1}" if not name or name.lower() in taken else name
        taken.add(names[i].lower())
    return names


def _parse_block(block: Block, layout: Layout, source: str) -> NDArray[np.float64]:
    skip = max(layout.skip + 1 - block.first, 0)
    lines = block.lines[skip:]
    if layout.brackets:
        lines = [line.translate(_BRACKETS) for line in lines]
    return parse(
        lines,
        np.float64,
        len(layout.names),
        source=source,
        first=block.first + skip,
        delimiter=layout.delimiter,
        comments=True,
    )


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
        if not any("]" in line and not line.translate(_BRACKETS).strip() for line in waiting.lines[-3:]):
            raise FileFormatError(f"{source}: cut off: its list of points has no closing bracket")
        yield waiting
        return
    last = max((i for i, line in enumerate(waiting.lines) if content(line, comments=True)), default=None)
    if last is not None:
        wrong = fault(waiting.lines[last], len(layout.names), layout.delimiter, comments=True)
        unterminated = waiting.unterminated and last == len(waiting.lines) - 1
        if wrong is not None and (unterminated or wrong[1]):
            warn_dropped(source, waiting.first + last)
            waiting.lines = waiting.lines[:last]
        elif unterminated:
            warn_unterminated(source, waiting.first + last)
    yield waiting
