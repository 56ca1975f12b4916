"""Numbers from lines of text, a block at a time: the shared part of XYZ/CSV, ASCII PLY and ASCII PCD."""

from __future__ import annotations

import csv
import re
import warnings
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import DTypeLike, NDArray

from surfsig.errors import FileFormatError
from surfsig.files.number_words import (
    BEGINS_WITH_FORMULA,
    in_one_spelling,
    is_missing,
    is_number,
    why_no_number,
)
from surfsig.progress import Progress

BLOCK_BYTES = 1 << 22
COMMENT_MARKS = ("#", "//", "%")
# Behind values: "1.#QNAN" is a number.
_COMMENT_BEHIND = re.compile(r"\s(?=#|//)")
_QUOTED_WORDS = re.compile(r'"[^"]*"|[^\s"]+')
_POINT = re.compile(r"\d\.|\.\d")


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
    # Pieces of a line whose end was not read yet: joined once, however many there are.
    begun: list[bytes] = []
    while data := file.read(BLOCK_BYTES):
        progress.advance(len(data))
        end = data.rfind(b"\n")
        if end < 0:
            # The last byte may be the first half of a line end of two.
            end = data.rfind(b"\r", 0, -1)
        if end < 0:
            begun.append(data)
            continue
        lines = _split(b"".join([*begun, data[: end + 1]]))
        begun = [data[end + 1 :]]
        yield Block(lines, first)
        first += len(lines)
    rest = b"".join(begun)
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
    decimal_comma: bool = False,
    kept: Sequence[int] | None = None,
) -> NDArray[Any]:
    """Turn lines into rows of numbers.

    NaN and infinity may be written in any of the ways of `number_words`; between two delimiters, nothing is
    NaN.

    Parameters
    ----------
    lines
        One row each; empty ones are skipped.
    dtype
        Of one number, which gives (m, columns), or structured with `width` fields, which gives (m,).
    width
        Values per line.
    source, first
        The file's name and the number of the first line, for messages.
    delimiter
        What stands between two values; None is white space.
    comments
        Lines that begin with ``#``, ``//`` or ``%`` are skipped, and what follows a blank and ``#`` or
        ``//``.
    decimal_comma
        Numbers are written as 1,25.
    kept
        The columns that hold numbers, all by default; the others are left out.

    Raises
    ------
    FileFormatError
        Naming the first line that does not hold `width` values, or another word where a number belongs.
    """
    structured = np.dtype(dtype).names is not None
    columns = width if kept is None else len(kept)
    if not any(content(line, comments, delimiter) for line in lines):
        return np.empty(0 if structured else (0, columns), dtype)
    rows = _plain_rows(lines, dtype, width, delimiter, decimal_comma, kept)
    if rows is not None:
        return rows
    reason = "not a row of numbers"
    repaired = _repaired(lines, width, delimiter, comments, decimal_comma, kept)
    if repaired is not None:
        mark = None if delimiter is None else "\t"
        try:
            rows = np.loadtxt(repaired, dtype, comments=None, delimiter=mark, ndmin=1 if structured else 2)
        except (ValueError, OverflowError) as error:
            reason = str(error)
        else:
            if structured or rows.shape[1] == columns:
                return rows
    for number, line in enumerate(lines):
        wrong = fault(line, width, delimiter, comments, decimal_comma, kept)
        if wrong is not None:
            raise FileFormatError(f"{source}: line {first + number}: {wrong[0]}")
    raise FileFormatError(f"{source}: line {first}: {reason}")


def fault(
    line: str,
    width: int,
    delimiter: str | None,
    comments: bool,
    decimal_comma: bool = False,
    kept: Sequence[int] | None = None,
) -> tuple[str, bool] | None:
    """Say what is wrong with one line, and whether it only ends too early; None if nothing is."""
    tokens = tokens_of(line, delimiter, comments, width)
    if not tokens:
        return None
    for i in range(width) if kept is None else kept:
        token = tokens[i] if i < len(tokens) else "0"
        missing = delimiter is not None and is_missing(token)
        if not missing and not is_number(token, decimal_comma):
            return why_no_number(token, decimal_comma), False
    if len(tokens) != width:
        return f"{len(tokens)} values where {width} are expected", len(tokens) < width
    return None


def content(line: str, comments: bool, delimiter: str | None = None) -> str:
    """Give the part of a line that holds values: without comment and white space around it."""
    # A tab at either end may stand beside an empty value.
    text = line.strip(" \r\n") if delimiter == "\t" else line.strip()
    if comments and text:
        if is_comment(text):
            return ""
        if "#" in text or "//" in text:
            ends = _COMMENT_BEHIND.finditer(text)
            end = next((found for found in ends if not BEGINS_WITH_FORMULA.match(text, found.end())), None)
            # Values behind it show that it is part of a word.
            if end is not None and (delimiter is None or delimiter not in text[end.start() :].strip()):
                return text[: end.start()].rstrip(" ")
    return text


def is_comment(line: str) -> bool:
    """Tell whether a line is a comment; one that begins with a spreadsheet's #N/A is not."""
    text = line.lstrip()
    return text.startswith(COMMENT_MARKS) and BEGINS_WITH_FORMULA.match(text) is None


def cells_of(text: str, delimiter: str | None) -> list[str]:
    """Cut a line's content at its delimiters; those within quotes count for nothing."""
    if '"' not in text:
        return text.split() if delimiter is None else [cell.strip() for cell in text.split(delimiter)]
    if delimiter is None:
        return [word.strip('"') for word in _QUOTED_WORDS.findall(text)]
    try:
        return [cell.strip() for cell in next(csv.reader([text], delimiter=delimiter, skipinitialspace=True))]
    except csv.Error:
        return [cell.strip() for cell in text.split(delimiter)]


def tokens_of(line: str, delimiter: str | None, comments: bool = True, width: int | None = None) -> list[str]:
    """Cut a line into its values; a delimiter behind the last of them (of `width`, if given) adds none."""
    text = content(line, comments, delimiter)
    tokens = cells_of(text, delimiter) if text else []
    ends_empty = bool(tokens) and not tokens[-1] and len(tokens) != width
    return tokens[:-1] if ends_empty else tokens


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


def split_lines(text: str) -> list[str]:
    """Cut text at its line ends, whichever system's they are."""
    if "\r" in text:
        text = text.replace("\r\n", "\n").replace("\r", "\n")
    return text.removesuffix("\n").split("\n")


def _split(data: bytes) -> list[str]:
    # Names were read from the header; among numbers, every byte that is not ASCII is an error anyway.
    return split_lines(data.decode("latin-1"))


def _plain_rows(
    lines: Sequence[str],
    dtype: DTypeLike,
    width: int,
    delimiter: str | None,
    decimal_comma: bool,
    kept: Sequence[int] | None,
) -> NDArray[Any] | None:
    """Read lines that NumPy reads as they are; None if it does not."""
    trailing = delimiter is not None and next(filter(str.strip, lines)).rstrip().endswith(delimiter)
    if kept is not None or trailing:
        # NumPy does not look at the columns that it leaves out.
        if any('"' in line for line in lines):
            return None
        if delimiter is None:
            found = {len(line.split()) for line in lines} - {0}
        else:
            found = {line.count(delimiter) + 1 for line in lines if line.strip()}
        if found != {width + trailing} and found != {width}:
            return None
        kept = range(width) if kept is None else kept
    if decimal_comma:
        text = "\n".join(lines)
        if "." in text or delimiter == ",":
            return None
        lines = text.replace(",", ".").split("\n")
    structured = np.dtype(dtype).names is not None
    try:
        rows = np.loadtxt(
            lines, dtype, comments=None, delimiter=delimiter, usecols=kept, ndmin=1 if structured else 2
        )
    except (ValueError, OverflowError):
        return None
    return rows if structured or rows.shape[1] == (width if kept is None else len(kept)) else None


def _repaired(
    lines: Sequence[str],
    width: int,
    delimiter: str | None,
    comments: bool,
    decimal_comma: bool,
    kept: Sequence[int] | None,
) -> list[str] | None:
    """Give the columns that are kept as NumPy reads them, with tabs between values if there is a delimiter.

    None if a line has not `width` values.
    """
    rows = []
    for line in lines:
        text = content(line, comments, delimiter)
        if not text:
            continue
        if delimiter is not None or kept is not None or '"' in text:
            cells = tokens_of(text, delimiter, False, width)
            if len(cells) != width:
                return None
            text = "\t".join(cells if kept is None else [cells[i] for i in kept])
        rows.append(text)
    text = "\n".join(rows)
    if decimal_comma:
        if _POINT.search(text):
            return None
        text = text.replace(",", ".")
    return in_one_spelling(text, tabs=delimiter is not None).split("\n")
