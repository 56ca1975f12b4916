"""The surfaces as a table of numbers: for pandas, as CSV, and as an Excel workbook."""

from __future__ import annotations

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from surfsig.convert.libraries import library
from surfsig.files.atomic import replacing
from surfsig.shapes.surface import Surface

_WIDTH = 12
"""Of the columns of the workbook, in characters: a number with its sign, point and exponent."""


def table_columns(surfaces: Sequence[Surface]) -> dict[str, Any]:
    """Give the columns that `Surfaces.to_pandas` names, each with a value for each surface."""

    def values(name: str) -> Any:
        return np.array([getattr(surface, name) for surface in surfaces])

    columns: dict[str, Any] = {"kind": [surface.kind for surface in surfaces]}
    columns |= {name: values(name) for name in ("radius", "radius_std")}
    intervals = np.array([surface.interval for surface in surfaces]).reshape(-1, 2)
    columns |= dict(zip(("radius_low", "radius_high"), intervals.T, strict=True))
    columns |= {name: values(name) for name in ("major_radius", "half_angle")}
    for name in ("center", "axis"):
        vectors = values(name).reshape(-1, 3)
        columns |= {f"{name}_{letter}": vectors[:, i] for i, letter in enumerate("xyz")}
    return columns | {name: values(name) for name in ("length", "width", "arc", "area", "count", "rms")}


def excel_library() -> Any:
    """Import XlsxWriter.

    Raises
    ------
    InvalidInputError
        If it is not installed.
    """
    return library("xlsxwriter", "XlsxWriter", "surfsig[excel]")


def write_csv(surfaces: Sequence[Surface], path: str | Path) -> None:
    """Write the table as text, as `Surfaces.write_csv` says."""
    text = io.StringIO()
    csv.writer(text, lineterminator="\n").writerows(_rows(surfaces))
    with replacing(Path(path)) as file:
        file.write(text.getvalue().encode())


def write_excel(surfaces: Sequence[Surface], path: str | Path) -> None:
    """Write the table as a workbook, as `Surfaces.write_excel` says."""
    data = io.BytesIO()
    workbook = excel_library().Workbook(data, {"in_memory": True})
    sheet = workbook.add_worksheet("surfaces")
    header = workbook.add_format({"bold": True})
    for number, row in enumerate(_rows(surfaces)):
        sheet.write_row(number, 0, row, None if number else header)
    sheet.freeze_panes(1, 2)
    sheet.set_column(0, len(row) - 1, _WIDTH)
    workbook.close()
    with replacing(Path(path)) as file:
        file.write(data.getvalue())


def _rows(surfaces: Sequence[Surface]) -> Iterator[list[Any]]:
    """Give the header and a row for each surface; None for what its kind does not have."""
    columns = table_columns(surfaces)
    yield ["number", *columns]
    for number, row in enumerate(zip(*columns.values(), strict=True)):
        plain = [value.item() if isinstance(value, np.generic) else value for value in row]
        yield [number, *(None if isinstance(v, float) and not math.isfinite(v) else v for v in plain)]
