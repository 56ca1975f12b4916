"""Columns without names: whether the first three can be the coordinates."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.number_words import is_missing

# With fewer rows and more columns than this, nameless numbers are hardly points: the table is transposed.
FEW_ROWS, MANY_COLUMNS = 6, 16
# Seconds since 1970 are more; no coordinate in metres is, on the Earth.
_SMALLEST_TIME = 1e9
# By how much a file's times differ at most, as a share: the seconds since 1970 by twenty days.
_TIMES_SHARE = 0.001
# Rows that are enough to say that values run on, or never change.
_FEWEST_RUNNING, _FEWEST_CONSTANT = 3, 8
# The last three columns of a PTS file with six or seven.
_COLOURS = ["red", "green", "blue"]


def first_columns(rows: list[list[str]], places: Sequence[int], hint: str, source: str) -> list[int]:
    """Choose the coordinates among columns that nobody named.

    Parameters
    ----------
    rows
        Cells of some rows, of the columns of numbers.
    places
        Where these columns are in the file.
    hint
        How the caller names columns.
    source
        The file's name, for messages.

    Returns
    -------
    The places of x, y and z.

    Raises
    ------
    FileFormatError
        If the first column counts the rows or gives a time, if there are words before the coordinates, or
        many columns and hardly a row.

    Warns
    -----
    UserWarning
        If the first three may be something else.
    """
    if len(places) < 3:
        raise FileFormatError(
            f"{source}: not a table of points: {len(places)} columns of numbers where a point needs three"
        )
    if list(places[:3]) != [0, 1, 2] and len(places) != 3:
        raise FileFormatError(
            f"{source}: not a table of points: the first three columns are not all numbers, and no header "
            f"names the coordinates; {hint} does"
        )
    if len(rows) < FEW_ROWS and len(places) > MANY_COLUMNS:
        raise FileFormatError(
            f"{source}: {len(rows)} rows of {len(places)} numbers without names are hardly points: is the "
            "table transposed? a header, or columns=, says that it is not"
        )
    if len(places) > 3:
        reason = _plainly_none(rows)
        if reason is not None:
            raise FileFormatError(
                f"{source}: no header names the coordinates, and the first column {reason}; {hint} names them"
            )
        doubt = _doubt(rows)
        if doubt is not None:
            warnings.warn(
                f"{source}: no header names the coordinates, so the first three columns are x, y, z, "
                f"although {doubt}; {hint} says otherwise",
                stacklevel=5,
            )
    return list(places[:3])


def is_running(cells: Sequence[str]) -> bool:
    """Tell whether a column counts its rows: whole numbers, each one more than that above."""
    if len(cells) < _FEWEST_RUNNING or not all(cell.isdecimal() and len(cell) < 18 for cell in cells):
        return False
    return bool((np.diff([int(cell) for cell in cells]) == 1).all())


def names_of_counted(rows: list[list[str]]) -> list[str]:
    """Name the columns of a file that begins with the number of its points: x y z, intensity, colours."""
    width = len(rows[0])
    more = [f"column_{i + 1}" for i in range(3, width)]
    coloured = width in (6, 7) and all(_is_byte(cell) for row in rows for cell in row[-3:])
    if coloured:
        more[-3:] = _COLOURS
    if width in (4, 7):
        more[0] = "intensity"
    return ["x", "y", "z", *more]


def _is_byte(cell: str) -> bool:
    return cell.isdecimal() and len(cell) < 4 and int(cell) < 256


def _plainly_none(rows: list[list[str]]) -> str | None:
    first = [row[0] for row in rows]
    others = [[row[i] for row in rows] for i in (1, 2, 3)]
    if is_running(first) and all(not _are_whole(column) for column in others):
        return "counts the rows"
    return "looks like a time" if _is_time(_values(first)) and not any(map(_is_far, others)) else None


def _is_time(values: NDArray[np.float64]) -> bool:
    """Tell whether values run on from far, by little."""
    if len(values) < 2 or values[0] < _SMALLEST_TIME:
        return False
    return bool((np.diff(values) >= 0).all() and 0 < np.ptp(values) < _TIMES_SHARE * values[0])


def _is_far(cells: Sequence[str]) -> bool:
    return bool((_values(cells) >= _SMALLEST_TIME).any())


def _doubt(rows: list[list[str]]) -> str | None:
    columns = [[row[i] for row in rows] for i in range(len(rows[0]))]
    if is_running(columns[0]):
        return "the first counts the rows"
    constant = [len(set(column)) == 1 for column in columns]
    if len(rows) >= _FEWEST_CONSTANT and sum(constant[:3]) >= 2 and constant[3:].count(False) >= 3:
        return "two of them never change"
    # FARO's rows and columns of a scan; a grid's heights may have slopes or normals beside them.
    if (
        len(columns) >= 5
        and [_are_whole(column) for column in columns[:5]] == [True, True, False, False, False]
        and any(np.abs(_values(column)).max(initial=0) > 1 for column in columns[3:5])
    ):
        return "the first two hold whole numbers and the next three do not"
    if _are_whole(columns[0]) and not any(map(_are_whole, columns[1:4])) and len(rows) > 1:
        return "the first holds whole numbers and the next three do not"
    if len(columns) >= 6 and all(map(_are_whole, columns[:3])):
        # Normals beside coordinates in whole millimetres are fractions too.
        further = [_values(column) for column in columns[3:6]]
        if not any(map(_are_whole, columns[3:6])) and any(
            np.abs(values).max(initial=0) > 1 for values in further
        ):
            return "they hold whole numbers and the next three do not"
    return None


def _are_whole(cells: Sequence[str]) -> bool:
    return all(is_missing(cell) or cell.lstrip("+-").isdecimal() for cell in cells)


def _values(cells: Sequence[str]) -> NDArray[np.float64]:
    """Give the finite numbers of a column."""
    values = []
    for cell in cells:
        try:
            values.append(float(cell.replace(",", ".")))
        except ValueError:
            continue
    array = np.array(values, np.float64)
    return array[np.isfinite(array)]
