"""How the lines of a text file are to be read: where rows begin, what is between values, what is x, y, z."""

from __future__ import annotations

import re
import warnings
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.coordinate_names import coordinates_of
from surfsig.files.decimal_commas import decimal_comma_of, refuse_blanks_and_commas, refuse_cut_numbers
from surfsig.files.encodings import names_decoded
from surfsig.files.first_columns import first_columns, names_of_counted
from surfsig.files.lines import cells_of, content, fault, is_comment, split_lines, tokens_of
from surfsig.files.number_words import (
    has_decimal_point,
    has_thousands,
    is_missing,
    why_no_number,
)
from surfsig.files.options import LEFT_OUT, check_width
from surfsig.files.text_header import are_words, is_value, names_above, unique_names
from surfsig.files.text_notes import viewpoint_of

# Lines of words above the first row: titles, names, units. With more of them it is prose; where none of them
# names coordinates, more than a title is the beginning of another format (an ESRI grid, ...).
_MOST_HEADER_LINES, _MOST_TITLE_LINES = 30, 1
# Lines that the layout is judged by.
_SAMPLE_LINES = 300
_DELIMITERS = (None, "\t", ";", ",")
# Excel reads this line as which delimiter follows.
_SEPARATOR_LINE = re.compile(r"sep=(.)\s*$", re.IGNORECASE)
# Maple writes a list of points as "Points:=[", then "[x, y, z], " per line, then "];".
_MAPLE = re.compile(r"\w+\s*:=\s*\[\s*$")
_BRACKETS = str.maketrans("[],;", "    ")
_COUNT = re.compile(r"\s*\d+\s*$")
_FRACTIONAL = re.compile(r"[.,eE]")


@dataclass
class Layout:
    """How the lines of a file are to be read.

    Attributes
    ----------
    names
        A name per column of the file.
    kept
        The columns that are read, by their place.
    delimiter
        What stands between two numbers; None is white space.
    skip
        Lines before the first row.
    decimal_comma
        Numbers are written as 1,25.
    brackets
        The numbers stand in Maple's brackets.
    viewpoint
        Where the sensor stood, by a comment that surfsig writes; None if there is none.
    count
        The number of points that the line above them gives; None if there is none.
    decimals
        The columns with numbers that are written with a decimal point or an exponent.
    """

    names: list[str]
    kept: list[int]
    delimiter: str | None
    skip: int
    decimal_comma: bool = False
    brackets: bool = False
    count: int | None = None
    viewpoint: NDArray[np.float64] | None = None
    decimals: frozenset[str] = frozenset()

    @property
    def width(self) -> int:
        """Columns of the file."""
        return len(self.names)

    def plain(self, line: str) -> str:
        """Give a line without Maple's brackets."""
        return line.translate(_BRACKETS) if self.brackets else line


@dataclass
class _Table:
    """Rows by one delimiter: their cells, and how well they fit."""

    delimiter: str | None
    first: int
    rows: list[list[str]]
    words: int
    fitting: float
    lines: list[str]


def layout_of(head: bytes, whole: bool, source: str, columns: Sequence[str] | None) -> Layout:
    """Recognise the layout by a file's first bytes.

    Parameters
    ----------
    head
        The file's beginning.
    whole
        It is all of the file.
    source
        The file's name, for messages.
    columns
        The columns' names as the caller gives them; None where the file is to say.

    Raises
    ------
    FileFormatError
        If there are no rows of numbers, or it cannot be known which columns are the coordinates.
    InvalidInputError
        If `columns` does not fit.

    Warns
    -----
    UserWarning
        If columns are left out, or the first three are a doubtful choice.
    """
    lines = split_lines(names_decoded(head))
    if not whole and len(lines) > 1:
        lines.pop()
    start = _after_brackets(lines)
    brackets = start > 0
    forced: str | None = None
    if not brackets:
        for number, line in enumerate(lines):
            if line.strip():
                excel = _SEPARATOR_LINE.match(line.strip())
                if excel is not None:
                    forced, start = excel[1], number + 1
                break
    shown = [line.translate(_BRACKETS) for line in lines] if brackets else lines
    delimiters = (forced,) if forced is not None else (None,) if brackets else _DELIMITERS
    tables = [found for mark in delimiters if (found := _table(shown, start, mark)) is not None]
    if not tables:
        raise FileFormatError(f"{source}: {_why_not_points(shown, start)}")
    best = min(tables, key=lambda found: (found.words, -found.fitting))
    above = [
        (number, line) for number, line in enumerate(shown[: best.first]) if number >= start and line.strip()
    ]
    if len(above) > _MOST_HEADER_LINES and any(not is_comment(line) for _, line in above):
        raise FileFormatError(f"{source}: {_why_not_points(shown, start)}")
    for number, line in above:
        _refuse_broken_row(line, number, best, source)
    layout = _described(best, [line for _, line in above], source, columns)
    layout.brackets = brackets
    layout.viewpoint = viewpoint_of(line for _, line in above if is_comment(line))
    return layout


def count_of(line: str) -> int | None:
    """Give the number of points that a line of its own promises; None if it is no such line."""
    return int(line) if _COUNT.match(line) and len(line.strip()) <= 18 else None


def _after_brackets(lines: Sequence[str]) -> int:
    for number, line in enumerate(lines):
        if line.strip() and not is_comment(line):
            return number + 1 if _MAPLE.match(line.strip()) else 0
    return 0


def _table(lines: Sequence[str], start: int, delimiter: str | None) -> _Table | None:
    """Find the rows that this delimiter gives; None if it gives none."""
    numbers: list[int] = []
    cut: list[list[str]] = []
    for number in range(start, len(lines)):
        text = content(lines[number], True, delimiter)
        if text:
            numbers.append(number)
            cut.append(cells_of(text, delimiter))
        if len(cut) == _SAMPLE_LINES:
            break
    for place, cells in enumerate(cut):
        if not _is_row(cut, place):
            continue
        kinds = _numeric(cells)
        words = kinds.count(False)
        same = [row for row in cut[place:] if len(row) == len(cells)]
        if delimiter is None and words and (2 * words > len(cells) or len(same) < 2):
            # A sentence with three numbers in it.
            return None
        fitting = sum(1 for row in same if _fits(row, kinds)) / (len(cut) - place)
        return _Table(delimiter, numbers[place], same, words, fitting, [lines[i] for i in numbers[place:]])
    return None


def _is_row(cut: list[list[str]], place: int) -> bool:
    """Tell whether the cells of a line are a point's and not a title, names or units."""
    cells = cut[place]
    if len(cells) < 3:
        return False
    kinds = _numeric(cells)
    numbers = sum(1 for cell in cells if cell and is_value(cell))
    if all(kinds):
        return numbers > 0 and not _are_numbers_of_columns(cells, cut[place + 1 :])
    return numbers >= 3 and (place + 1 == len(cut) or _fits(cut[place + 1], kinds))


def _are_numbers_of_columns(cells: list[str], rest: list[list[str]]) -> bool:
    """Tell whether a first line 0, 1, 2, ... numbers the columns, as pandas names them, and is no point."""
    named = cells[1:] if not cells[0] else cells
    if named != [str(i) for i in range(len(named))] or not rest:
        return False
    # The index of the rows has no name; without it only numbers with a point beneath tell.
    return not cells[0] or all(has_decimal_point(cell) for row in rest for cell in row[:3])


def _refuse_broken_row(line: str, number: int, table: _Table, source: str) -> None:
    """Refuse a line above the rows that is one of them but for some damage, and no header."""
    if is_comment(line):
        return
    cells = cells_of(content(line, True, table.delimiter), table.delimiter)
    width = len(table.rows[0])
    values = sum(1 for cell in cells if cell and is_value(cell))
    fractions = any(has_decimal_point(cell) for cell in cells)
    if 2 * values <= len(cells) or (not fractions and len(cells) != width):
        return
    if coordinates_of(unique_names(cells), source) is not None or _are_numbers_of_columns(cells, table.rows):
        return
    kinds = _numeric(table.rows[0])
    kept = [i for i, kind in enumerate(kinds) if kind]
    wrong = fault(line, width, table.delimiter, True, kept=kept)
    if wrong is not None and len(cells) > 1:
        raise FileFormatError(f"{source}: line {number + 1}: {wrong[0]}")


def _numeric(cells: list[str]) -> list[bool]:
    return [is_value(cell) or is_missing(cell) for cell in cells]


def _fits(row: list[str], kinds: list[bool]) -> bool:
    """Tell whether a row has numbers where another has them."""
    if len(row) != len(kinds):
        return False
    return all(not kind or is_value(cell) or is_missing(cell) for cell, kind in zip(row, kinds, strict=True))


def _described(table: _Table, above: list[str], source: str, columns: Sequence[str] | None) -> Layout:
    """Name the columns, and say which hold numbers."""
    rows = table.rows
    width = len(rows[0])
    header = names_above(above, table.delimiter, rows, source) if columns is None else None
    names = len(columns) if columns is not None else len(header or ())
    named = columns is not None or (header is not None and bool(header[-1]))
    if width > 3 and not any(row[-1] for row in rows) and not (names == width and named):
        # A delimiter behind the last value.
        width -= 1
        rows = [row[:-1] for row in rows]
        header = None if header is None else header[:width]
    words = [i for i in range(width) if are_words([row[i] for row in rows])]
    refuse_blanks_and_commas([rows[0][i] for i in words], source, table.first)
    kept = [i for i in range(width) if i not in words]
    numbers = [[row[i] for i in kept] for row in rows]
    comma = decimal_comma_of(numbers, source)
    if table.delimiter == ",":
        refuse_cut_numbers(rows, table.lines, table.first, names, source)
    counts = [count for line in above if (count := count_of(line)) is not None]
    layout = Layout([], kept, table.delimiter, table.first, comma, count=counts[-1] if counts else None)
    _name_columns(layout, columns, header, words, rows, numbers, above, source)
    fractional = [i for i in range(width) if any(_FRACTIONAL.search(row[i]) for row in rows)]
    layout.decimals = frozenset(layout.names[i] for i in fractional)
    return layout


def _name_columns(
    layout: Layout,
    columns: Sequence[str] | None,
    header: list[str] | None,
    words: list[int],
    rows: list[list[str]],
    numbers: list[list[str]],
    above: list[str],
    source: str,
) -> None:
    """Name the columns: as the caller says, or the header, or by their places."""
    width, kept = len(rows[0]), layout.kept
    if columns is not None:
        check_width(columns, width, source)
        layout.names = list(columns)
        layout.kept = [i for i in range(width) if columns[i] not in LEFT_OUT]
        _refuse_words([i for i in words if i in layout.kept], layout, rows, source)
        return
    if header is not None:
        layout.names = unique_names(header + [""] * (width - len(header)))
        found = coordinates_of(layout.names, source)
        if found is None:
            raise FileFormatError(
                f"{source}: its header ({', '.join(header)[:200]}) names no coordinates; "
                f"{_columns_hint(width)} says which they are"
            )
        _refuse_words([i for i in words if layout.names[i] in found.names], layout, rows, source)
    elif layout.count is not None and not words:
        layout.names = names_of_counted(numbers)
    else:
        titles = [line for line in above if not is_comment(line) and count_of(line) is None]
        if len(titles) > _MOST_TITLE_LINES:
            raise FileFormatError(
                f"{source}: not a table of points: {len(titles)} lines of words begin it "
                f"({titles[0].strip()[:40]!r}), and none names coordinates; {_columns_hint(width)} does"
            )
        layout.names = [f"column_{i + 1}" for i in range(width)]
        for axis, place in zip(
            "xyz", first_columns(numbers, kept, _columns_hint(width), source), strict=True
        ):
            layout.names[place] = axis
    if words:
        told = ", ".join(f"'{layout.names[i]}'" for i in words)
        warnings.warn(f"{source}: left out what holds words and no numbers: {told[:200]}", stacklevel=3)


def _refuse_words(places: Sequence[int], layout: Layout, rows: list[list[str]], source: str) -> None:
    """Refuse columns of words that must be read."""
    for i in places:
        cell = next(row[i] for row in rows if not is_value(row[i]) and not is_missing(row[i]))
        raise FileFormatError(f"{source}: column '{layout.names[i]}': {why_no_number(cell)}")


def _columns_hint(width: int) -> str:
    names = ["x", "y", "z", "_", "_"][:width]
    return (
        f'columns="{",".join(names)}{",..." if width > 5 else ""}" (a name for each of the {width} columns)'
    )


def _why_not_points(lines: Sequence[str], start: int) -> str:
    """Say what is wrong with lines that hold no points."""
    told = "not a table of points"
    header = ""
    for number, line in enumerate(lines[start:], start + 1):
        if not content(line, True):
            continue
        delimiter = next((mark for mark in ";," if mark in line), None)
        width = len(tokens_of(line, delimiter))
        wrong = fault(line, width, delimiter, True)
        if wrong is None or header:
            reason = wrong[0] if wrong else f"{width} values where a point needs three"
            return f"{told}: line {number}: {reason}"
        thousands = next((cell for cell in tokens_of(line, None) if has_thousands(cell)), None)
        if thousands is not None:
            return f"{told}: line {number}: {why_no_number(thousands)}"
        header = f"{told}: line {number}: {' '.join(line.split())[:40]!r} and no numbers"
    return header or "holds no points"
