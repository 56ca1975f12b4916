"""The reproduction as files: tables, figures and the page."""

from __future__ import annotations

import json
from collections.abc import Callable
from itertools import chain
from pathlib import Path
from typing import Any

from ..files.atomic import replacing
from .canvas import check_matplotlib, png
from .charts import charts
from .figures import paper_figures
from .page import page
from .report import report
from .reproduction import Reproduction
from .sheet import csv_text

#: How many figures there are: the paper's seven, and what was found.
FIGURES = 14


def write_reproduction(
    result: Reproduction,
    folder: str | Path,
    *,
    progress: Callable[[int, int], object] | None = None,
) -> dict[str, Any]:
    """Write `tables.json`, `tables.csv`, the figures as PNG, and `index.html`, which holds all of it.

    Parameters
    ----------
    result
        From `reproduce`.
    folder
        Made if need be; files of these names in it are replaced.
    progress
        Called with the number of figures drawn and their total.

    Returns
    -------
    dict
        What `tables.json` holds.

    Raises
    ------
    InvalidInputError
        If Matplotlib is not installed.
    OSError
        If a file cannot be written.
    """
    check_matplotlib()
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    values = report(result)
    figures: dict[str, tuple[str, bytes]] = {}
    for name, caption, figure in chain(paper_figures(), charts(result)):
        figures[name] = (caption, png(figure))
        if progress is not None:
            progress(len(figures), FIGURES)
    for name, (_, image) in figures.items():
        _write(folder / f"{name}.png", image)
    _write(folder / "tables.json", json.dumps(values, indent=1, allow_nan=False).encode())
    _write(folder / "tables.csv", csv_text(values).encode())
    _write(folder / "index.html", page(values, figures).encode())
    return values


def _write(path: Path, content: bytes) -> None:
    with replacing(path) as file:
        file.write(content)
