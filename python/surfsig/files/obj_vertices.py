"""The vertices of an OBJ file: coordinates, and what programs write behind them."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.colours import ALPHA, CHANNELS
from surfsig.files.lines import parse, tokens_of

# The format's colours are decimals from 0 to 1, of which 0 and 1 may be written without a point.
COLOURS = (*CHANNELS, ALPHA)
WEIGHT = "w"

# The numbers of a vertex that have a meaning; of any others only the coordinates are read.
_WIDTHS = (3, 4, 6, 7)
_OTHER_WIDTH = 0


class Vertices:
    """Vertices, gathered block by block.

    Behind x, y, z stand: nothing; a weight w; a colour r, g, b; r, g, b and alpha; or w and r, g, b.

    Parameters
    ----------
    source
        The file's name, for messages.
    """

    def __init__(self, source: str) -> None:
        self._source = source
        # Rows with as many columns as the longest of them; NaN where a vertex has fewer numbers.
        self._tables: list[NDArray[np.float64]] = []
        # How many numbers each vertex of a table has.
        self._widths: list[NDArray[np.uint8]] = []

    def add(self, lines: list[str], first: int) -> None:
        """Take the lines of some vertices, without their first word; empty ones are those of other things.

        Raises
        ------
        FileFormatError
            If a line does not hold three numbers or more; the message names it.
        """
        start = next((i for i, line in enumerate(lines) if line), None)
        if start is None:
            return
        count = len(tokens_of(lines[start], None))
        width = count if count in _WIDTHS else 3
        try:
            table = self._parsed(lines, first, width)
            widths = np.full(len(table), width, np.uint8)
        except FileFormatError:
            counts = [len(tokens_of(line, None)) for line in lines]
            if {count for count in counts if count} <= {width}:
                raise
            table, widths = self._mixed(lines, first, counts)
        self._tables.append(table)
        self._widths.append(widths)

    def finished(self, count: int) -> tuple[NDArray[np.float64], dict[str, NDArray[Any]]]:
        """Give the coordinates (n, 3) of `count` vertices, and further columns.

        Weights are the column w, if one is not 1. Where only some vertices have a colour, that of the others
        is NaN.

        Raises
        ------
        FileFormatError
            If a vertex has no numbers, or there is none.

        Warns
        -----
        UserWarning
            If only some vertices have a colour, a weight is not 1, or numbers are left out.
        """
        if sum(map(len, self._tables)) != count or not count:
            raise FileFormatError(f"{self._source}: has no vertices, or some without numbers")
        widths = np.concatenate(self._widths)
        if (widths == 3).all():
            return np.concatenate(self._tables), {}
        table = _beside(self._tables)
        colours, weights = self._meaning(table, widths)
        columns: dict[str, NDArray[Any]] = {}
        coloured = ~np.isnan(colours[:, :3]).any(axis=1)
        if coloured.any():
            if not coloured.all():
                self._warn(
                    f"{coloured.sum()} of {count} vertices have a colour; red, green and blue of the others "
                    "are NaN"
                )
            columns.update(zip(CHANNELS, colours.T, strict=False))
            if not np.isnan(colours[coloured, 3]).any():
                columns[ALPHA] = colours[:, 3]
        if not (weights == 1).all():
            self._warn(f"weights of vertices are not used; they are the field '{WEIGHT}'")
            columns[WEIGHT] = weights
        return np.ascontiguousarray(table[:, :3]), columns

    def _meaning(
        self, table: NDArray[np.float64], widths: NDArray[np.uint8]
    ) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
        """Give colours (n, 4), NaN where there are none, and weights (n,)."""
        colours = np.full((len(table), 4), np.nan)
        weights = np.ones(len(table))
        weights[widths == 4] = table[widths == 4, 3]
        colours[widths == 6, :3] = table[widths == 6, 3:6]
        seven = widths == 7
        if seven.any():
            fourth, last = table[seven, 3], table[seven, 6]
            weighted = bool((fourth == 1).all() and (last != 1).any())
            if (fourth == 1).all():
                taken = "weights and r, g, b" if weighted else "r, g, b and alpha"
                self._warn(f"of the four numbers behind the coordinates the first is 1: taken as {taken}")
            if weighted:
                colours[seven, :3] = table[seven, 4:7]
            else:
                colours[seven] = table[seven, 3:7]
        unknown = int((widths == _OTHER_WIDTH).sum())
        if unknown:
            self._warn(
                f"numbers behind the coordinates of {unknown} vertices are left out: they are no weight and "
                "no colour"
            )
        return colours, weights

    def _mixed(
        self, lines: list[str], first: int, counts: list[int]
    ) -> tuple[NDArray[np.float64], NDArray[np.uint8]]:
        """Take lines that differ in how many numbers they have."""
        known = [count if count in _WIDTHS else _OTHER_WIDTH for count in counts]
        widths = np.array([width for width, count in zip(known, counts, strict=True) if count], np.uint8)
        table = np.full((len(widths), _WIDTHS[-1]), np.nan)
        for width in np.unique(widths).tolist():
            chosen = [""] * len(lines)
            for i, line in enumerate(lines):
                if counts[i] and known[i] == width:
                    chosen[i] = line if width else " ".join(tokens_of(line, None)[:3])
            rows = self._parsed(chosen, first, width or 3)
            table[widths == width, : rows.shape[1]] = rows
        return table, widths

    def _parsed(self, lines: list[str], first: int, width: int) -> NDArray[np.float64]:
        return parse(lines, np.float64, width, source=self._source, first=first, comments=True)

    def _warn(self, text: str) -> None:
        warnings.warn(f"{self._source}: {text}", stacklevel=4)


def _beside(tables: Sequence[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Put tables below one another, NaN in columns that they lack."""
    joined = np.full((sum(map(len, tables)), _WIDTHS[-1]), np.nan)
    start = 0
    for table in tables:
        joined[start : start + len(table), : table.shape[1]] = table
        start += len(table)
    return joined
