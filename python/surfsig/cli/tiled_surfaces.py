"""`surfsig surfaces` where the output is a folder: work in tiles."""

from __future__ import annotations

import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from surfsig.cli.console import print_columns, print_json, write_json
from surfsig.cli.tiles import name_of, tile_arguments, tile_progress


@dataclass(frozen=True)
class Tables:
    """Where tables of surfaces are to be written, beside those in the folder; None for nowhere."""

    json: Path | None
    csv: Path | None
    excel: Path | None


def find_in_tiles(
    files: Sequence[Path],
    output: Path,
    asked: Mapping[str, Any],
    tiling: Mapping[str, Any],
    reading: Mapping[str, Any],
    tables: Tables,
    shown: bool,
    quiet: bool,
) -> None:
    """Find surfaces in tiles, and say what came of it."""
    import surfsig
    from surfsig.cli.options import check_results
    from surfsig.surfaces.table import excel_library
    from surfsig.surfaces.wording import run_rows

    on_stdout = check_results(None, tables.json, None, tables.csv, tables.excel)
    if tables.excel is not None:
        excel_library()
    clock = time.perf_counter()
    with tile_progress(shown) as progress:
        found = surfsig.find_surfaces_tiles(
            files[0] if len(files) == 1 else files,
            output,
            **asked,
            **tile_arguments(tiling, reading),
            progress=progress,
        )
    if not len(found):
        warnings.warn(f"{name_of(files)}: {found.summary()}", stacklevel=1)
    if tables.csv is not None:
        found.write_csv(tables.csv)
    if tables.excel is not None:
        found.write_excel(tables.excel)
    runs = found.pipe_runs()
    values = {
        "output": str(output),
        "summary": found.summary(),
        "points": len(found.tiles),
        "tiles": len(found.tiles.tiles),
        "surfaces": [
            {"number": number, **surface.to_dict(), "tiles": list(surface.tiles)}
            for number, surface in enumerate(found)
        ],
        "pipe_runs": [run.to_dict() for run in runs],
        "seconds": time.perf_counter() - clock,
    }
    if on_stdout:
        print_json(values)
    elif tables.json is not None:
        write_json(tables.json, values)
    if len(found) and not on_stdout and not quiet:
        header, rows = found.table()
        print_columns(f"{output}: {found.summary()}", header, [*rows, *run_rows(runs)])
