"""Numbers from lines of text, a block at a time: the shared part of XYZ/CSV, ASCII PLY and ASCII PCD."""

from __future__ import annotations

import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import DTypeLike, NDArray

from surfsig.errors import FileFormatError
from surfsig.files.progress import Progress

BLOCK_BYTES = 1 << 22


@dataclass
class Block:
    """Some whole lines of a file.

    Attributes
    ----------
    lines
        The lines, without their ends.
    first
        The number of the first one, counted from 1.
    unterminated
        The last one is the file's last and has no line end: it may be cut off.
    """

    lines: list[str]
    first: int
    unterminated: bool = False


def line_blocks(file: BinaryIO, first: int, progress: Progress) -> Iterator[Block]:
    """Read the rest of a file as blocks of whole lines; `first` is the number of its next line."""
    rest = b""
    while data := file.read(BLOCK_BYTES):
        progress.advance(len(data))
        whole, end, tail = (rest + data).rpartition(b"\n")
        rest = tail
        if end:
            lines = _split(whole + end)
            yield Block(lines, first)
            first += len(lines)
    if rest:
        yield Block(_split(rest), first, unterminated=not rest.endswith(b"\r"))


def take_rows(
    file: BinaryIO,
    dtype: np.dtype[Any],
    count: int,
    *,
    source: str,
    first: int,
    progress: Progress,
    skip: int = 0,
    after: int = 0,
    select: Callable[[str], str] | None = None,
) -> NDArray[Any]:
    """Read a known number of rows, one a line, as ASCII PLY and PCD have them.

    Parameters
    ----------
    file
        Open, at the beginning of a line.
    dtype
        Structured, one number per field.
    count
        Rows to read.
    source, first, progress
        The file's name, the number of its next line, and whom to tell.
    skip, after
        Lines before the rows and after them; all must be there.
    select
        Takes from a line the part that holds the row's numbers.

    Returns
    -------
    numpy.ndarray
        (count,) of `dtype`.

    Raises
    ------
    FileFormatError
        If a line is missing or holds anything else.
    """
    width = len(dtype.names or ())
    rows: list[NDArray[Any]] = [np.empty(0, dtype)]
    seen = 0
    for block in line_blocks(file, first, progress):
        filled = [i for i, line in enumerate(block.lines) if line.strip()]
        start, stop = max(skip - seen, 0), min(skip + count - seen, len(filled))
        seen += len(filled)
        if start < stop:
            begin = filled[start]
            lines = block.lines[begin : filled[stop - 1] + 1]
            if select is not None:
                lines = [select(line) for line in lines]
            rows.append(parse(lines, dtype, width, source=source, first=block.first + begin))
            if block.unterminated and seen == skip + count:
                warn_unterminated(source, block.first + filled[stop - 1])
    if seen < skip + count + after:
        raise FileFormatError(
            f"{source}: cut off: its header promises {skip + count + after} lines of data, {seen} are there"
        )
    return np.concatenate(rows)


def parse(
    lines: Sequence[str],
    dtype: DTypeLike,
    width: int,
    *,
    source: str,
    first: int,
    delimiter: str | None = None,
    comments: bool = False,
) -> NDArray[Any]:
    """Turn lines into rows of numbers.

    Parameters
    ----------
    lines
        One row each; empty ones are skipped.
    dtype
        Of one number, which gives (m, width), or structured with `width` fields, which gives (m,).
    width
        Numbers per line.
    source, first
        The file's name and the number of the first line, for messages.
    delimiter
        What stands between two numbers; None is white space.
    comments
        Text after ``#`` or ``//`` is skipped.

    Raises
    ------
    FileFormatError
        Naming the first line that does not hold `width` numbers.
    """
    structured = np.dtype(dtype).names is not None
    marks: str | list[str] | None = None
    if comments:
        # Two marks make NumPy take a slow path, so the second is named only where it occurs.
        marks = ["#", "//"] if any("//" in line for line in lines) else "#"
    if not any(content(line, comments) for line in lines):
        return np.empty(0 if structured else (0, width), dtype)
    trailing = delimiter is not None
    try:
        rows = np.loadtxt(
            lines,
            dtype=dtype,
            comments=marks,
            delimiter=delimiter,
            ndmin=1 if structured else 2,
            usecols=range(width) if trailing and _ends_with(lines, delimiter, comments) else None,
        )
    except (ValueError, OverflowError) as error:
        number, reason = _first_bad(lines, width, delimiter, comments) or (0, str(error))
        where = f"line {first + number}"
        raise FileFormatError(f"{source}: {where}: {reason}") from None
    if not structured and rows.shape[1] != width:
        number, reason = _first_bad(lines, width, delimiter, comments) or (0, "wrong number of columns")
        raise FileFormatError(f"{source}: line {first + number}: {reason}")
    return rows


def fault(line: str, width: int, delimiter: str | None, comments: bool) -> tuple[str, bool] | None:
    """Say what is wrong with one line, and whether it only ends too early; None if nothing is."""
    tokens = tokens_of(line, delimiter, comments)
    if not tokens:
        return None
    for token in tokens[:width]:
        try:
            float(token)
        except ValueError:
            hint = " (write a decimal point, not a comma)" if re.fullmatch(r"[-+]?\d+,\d+", token) else ""
            return f"{token[:40]!r} is not a number{hint}", False
    if len(tokens) != width:
        return f"{len(tokens)} values where {width} are expected", len(tokens) < width
    return None


def content(line: str, comments: bool) -> str:
    """Give the part of a line that holds values: without comment and white space around it."""
    if comments:
        line = line.partition("#")[0].partition("//")[0]
    return line.strip()


def tokens_of(line: str, delimiter: str | None, comments: bool = True) -> list[str]:
    """Cut a line into its values; a delimiter at the end adds none."""
    text = content(line, comments)
    tokens = [token.strip() for token in text.split(delimiter)] if text else []
    return tokens[:-1] if tokens and not tokens[-1] else tokens


def warn_dropped(source: str, number: int) -> None:
    """Say that the last line of a file is cut off and was left out."""
    warnings.warn(f"{source}: the last line ({number}) is cut off and was dropped", stacklevel=2)


def warn_unterminated(source: str, number: int) -> None:
    """Say that the last line of a file is complete only as far as anybody can tell."""
    warnings.warn(
        f"{source}: the last line ({number}) has no line end; "
        "if the file was cut off, its last value is wrong",
        stacklevel=2,
    )


def _split(data: bytes) -> list[str]:
    # Names were read from the header; among numbers, every byte that is not ASCII is an error anyway.
    text = data.decode("latin-1")
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removesuffix("\n").split("\n")


def _ends_with(lines: Sequence[str], delimiter: str | None, comments: bool) -> bool:
    first = next(text for line in lines if (text := content(line, comments)))
    return delimiter is not None and first.endswith(delimiter)


def _first_bad(
    lines: Sequence[str], width: int, delimiter: str | None, comments: bool
) -> tuple[int, str] | None:
    for number, line in enumerate(lines):
        found = fault(line, width, delimiter, comments)
        if found is not None:
            return number, found[0]
    return None
