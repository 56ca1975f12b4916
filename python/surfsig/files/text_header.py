"""The names of a text file's columns, as the lines above its rows give them."""

from __future__ import annotations

import itertools
from collections.abc import Iterator, Sequence

from surfsig.errors import FileFormatError
from surfsig.files.columns import unique_name
from surfsig.files.coordinate_names import coordinates_of, is_unit, with_unit
from surfsig.files.first_columns import is_running
from surfsig.files.lines import cells_of, content, is_comment
from surfsig.files.number_words import has_decimal_comma, is_missing, is_number


def names_above(
    above: list[str], delimiter: str | None, rows: list[list[str]], source: str
) -> list[str] | None:
    """Find the names of the columns above the rows, in a line or in a comment.

    A line that names coordinates counts before any other with a name per column, and the nearest to the
    rows before those further up.

    Parameters
    ----------
    above
        The lines above the rows that are not empty.
    delimiter
        What stands between the rows' values; None is white space.
    rows
        Cells of some rows.
    source
        The file's name, for messages.

    Returns
    -------
    list of str or None
        A name for each of the first columns, or for all; None if no line can be that.

    Raises
    ------
    FileFormatError
        If several columns may be the same coordinate.
    """
    width = len(rows[0])
    nameless: list[str] | None = None
    units: list[str] = []
    for line in reversed(above):
        comment = is_comment(line)
        text = line.strip().lstrip("#/% \t!") if comment else content(line, False, delimiter)
        for cells in _names_in(text, delimiter, comment):
            if all(map(is_unit, cells)) and any(cells):
                units = units or cells
                continue
            if len(cells) == width - 1 and width > 3 and _are_row_names(rows, source):
                # R gives no name to the column of the rows' names.
                cells = ["row", *cells]
            if not 3 <= len(cells) <= width or (comment and len(cells) != width):
                continue
            found = coordinates_of(unique_names(cells), source)
            if found is not None:
                return [
                    with_unit(name, unit) if name in found.names else name
                    for name, unit in itertools.zip_longest(cells, units[: len(cells)], fillvalue="")
                ]
            if nameless is None and not comment and len(cells) == width:
                nameless = cells
    return nameless


def _names_in(text: str, delimiter: str | None, comment: bool) -> Iterator[list[str]]:
    """Cut a line into names, by the rows' own first; a comment may use another, or start with a word."""
    marks = [delimiter]
    if comment:
        marks += [",", ";", "\t", None]
    elif delimiter is None:
        # Names of several words.
        marks.append("\t")
    for mark in marks:
        yield [cell.strip("\"'") for cell in cells_of(text, mark)]
    if comment:
        for mark in ":=":
            if mark in text:
                yield text.partition(mark)[2].replace(",", " ").split()


def _are_row_names(rows: list[list[str]], source: str) -> bool:
    """Tell whether the first column, for which a name is missing, holds names or numbers of rows.

    Raises
    ------
    FileFormatError
        If its whole numbers may be coordinates as well.
    """
    first = [row[0] for row in rows]
    if are_words(first) or is_running(first):
        return True
    if not rows[0][-1] or not all(cell.isdecimal() for cell in first) or len(rows) < 2:
        return False
    # A table of which rows were chosen keeps their numbers.
    if len(set(first)) == len(first) and not any(
        all(cell.lstrip("+-").isdecimal() for cell in column)
        for column in ([row[i] for row in rows] for i in (1, 2, 3))
    ):
        return True
    raise FileFormatError(
        f"{source}: its header names {len(rows[0]) - 1} columns, its rows hold {len(rows[0])} values, and "
        "the first may be x or the number of a row: name each of them by columns="
    )


def unique_names(names: Sequence[str]) -> list[str]:
    """Name what has no name, or one that is taken, by its place."""
    unique: list[str] = []
    taken: set[str] = set()
    for i, name in enumerate(names):
        known = not name or name.lower() in taken
        unique.append(unique_name(f"column_{i + 1}", taken) if known else name)
        taken.add(unique[-1].lower())
    return unique


def is_value(cell: str) -> bool:
    """Tell whether a cell is a number, be it with a decimal comma."""
    return is_number(cell) or has_decimal_comma(cell)


def are_words(cells: list[str]) -> bool:
    """Tell whether most of a column's values are no numbers; single ones are taken for damage."""
    there = [cell for cell in cells if not is_missing(cell)]
    return 2 * sum(1 for cell in there if not is_value(cell)) > len(there)
