"""`surfsig surfaces`: which parts of a scan are planes, cylinders, spheres, cones and tori."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import on_terminal, print_columns, print_json, progress_bar, write_json
from surfsig.cli.options import (
    CLOUD,
    check_results,
    input_options,
    quiet_option,
    result_options,
    threads_option,
    words,
)
from surfsig.cli.tiled_surfaces import Tables, find_in_tiles
from surfsig.cli.tiles import (
    is_tiled,
    name_of,
    refuse_in_tiles,
    refuse_too_large,
    refuse_without_tiles,
    split_options,
    tile_options,
)

if TYPE_CHECKING:
    from surfsig import Recurrences, Surfaces


@click.command("surfaces", no_args_is_help=True)
@click.argument("files", type=CLOUD, nargs=-1, required=True)
@result_options("the surfaces with all errors", "a view that turns, and the table")
@click.option(
    "--min-points",
    type=int,
    metavar="N",
    help="Fewest points of a surface.  [default: 1/500 of all, 20 to 1000; fewer of what ends at edges]",
)
@click.option(
    "--noise",
    type=float,
    metavar="S",
    help="Standard deviation of the points' distances.  [default: by the points]",
)
@click.option(
    "--kinds",
    type=words,
    metavar="KIND,...",
    help="Which to look for: plane, sphere, cylinder, cone, torus.  [default: all]",
)
@click.option(
    "--export",
    type=CLOUD,
    metavar="FILE",
    help="Write the bounded surfaces as meshes: a .glb, .obj or .dxf file.",
)
@click.option("--csv", "csv_file", type=CLOUD, metavar="FILE.csv", help="Write the table of surfaces as CSV.")
@click.option("--excel", type=CLOUD, metavar="FILE.xlsx", help="Write the table of surfaces for Excel.")
@click.option("--recurrences", is_flag=True, help="Say which objects and surfaces occur more than once, too.")
@tile_options
@input_options
@threads_option
@quiet_option
def surfaces_command(
    files: tuple[Path, ...],
    output: Path | None,
    json_file: Path | None,
    report: Path | None,
    min_points: int | None,
    noise: float | None,
    kinds: list[str] | None,
    export: Path | None,
    csv_file: Path | None,
    excel: Path | None,
    recurrences: bool,
    threads: int | None,
    quiet: bool,
    **more: Any,
) -> None:
    """Find the planes, spheres, cylinders, cones and tori in FILES, with their radii and errors.

    Nothing needs to be set. The output has the input's points and fields, and surface (its number, -1 for
    none), surface_kind and point_class (1 plane, 2 cylinder, 3 sphere, 4 cone, 5 torus, 6 saddle, 7 edge,
    8 free form, 0 unknown), confidence (0 to 1), deviation (signed distance from its surface), and red,
    green, blue by surface. With --recurrences it has piece and recurrence, the numbers of what hangs
    together and of the group of pieces that show the same object (-1 for none), and JSON has their poses,
    each with what is free, equal or of another size, and whether it is trusted.
    Pipes that are joined end to end, by elbows or where their axes meet, are rows of the table and
    pipe_runs of JSON.

    Where the output is a folder, clouds need not fit into memory: they are worked on in tiles, surfaces go on
    from tile to tile, and a second call goes on where the first was stopped. The folder then has the table
    as surfaces.json, .csv and .parquet, too.

    \b
    Examples:
      surfsig surfaces scan.pcd
      surfsig surfaces scan.pcd --recurrences
      surfsig surfaces scan.pcd -o labelled.ply --report report.html
      surfsig surfaces scan.pcd --export model.glb --csv table.csv
      surfsig surfaces city/*.laz -o out/ --memory 4GB
      surfsig surfaces part.ply --unit mm --kinds plane,cylinder --json - | jq '.surfaces[].radius'
    """  # noqa: D301
    import surfsig
    from surfsig.missing_returns import warn_of_missing_returns
    from surfsig.surfaces.export import check_export
    from surfsig.surfaces.table import excel_library
    from surfsig.surfaces.wording import run_rows

    shown = on_terminal() and not quiet
    tiling, reading = split_options(more)
    if output is not None and is_tiled(output, tiling):
        refuse_in_tiles(report=report, export=export, recurrences=recurrences, **reading)
        asked = {"min_points": min_points, "noise": noise, "kinds": kinds, "threads": threads}
        tables = Tables(json_file, csv_file, excel)
        find_in_tiles(files, output, asked, tiling, reading, tables, shown, quiet)
        return
    refuse_without_tiles(tiling)
    file = files[0] if len(files) == 1 else files
    told = name_of(files)
    on_stdout = check_results(output, json_file, report, export, csv_file, excel)
    if export is not None:
        check_export(export)
    if excel is not None:
        excel_library()
    refuse_too_large(file, told)
    with progress_bar("reading", "bytes", shown=shown) as progress:
        cloud = surfsig.read(file, progress=progress, **reading)
    warn_of_missing_returns(cloud, told)
    with progress_bar("finding surfaces", "points", shown=shown) as progress:
        found = surfsig.find_surfaces(
            cloud,
            min_points=min_points,
            noise=noise,
            kinds=kinds,  # type: ignore[arg-type]  # the function says which there are
            threads=threads,
            progress=progress,
        )
    if not len(found):
        warnings.warn(f"{told}: {found.summary()}", stacklevel=1)
    recurring = None
    if recurrences:
        with progress_bar("comparing", "pairs", shown=shown) as progress:
            recurring = surfsig.find_recurrences(found, threads=threads, progress=progress)
    if output is not None:
        columns = {**found.columns(), "colors": found.colors}
        if recurring is not None:
            columns |= {"piece": recurring.labels[0], "recurrence": recurring.group_labels[0]}
        with progress_bar("writing", "points", shown=shown) as progress:
            surfsig.write(output, cloud, columns, progress=progress)
    if report is not None:
        found.write_report(report, title=f"Surfaces of {files[0].name if len(files) == 1 else told}")
    if csv_file is not None:
        found.write_csv(csv_file)
    if excel is not None:
        found.write_excel(excel)
    if on_stdout:
        print_json(_values(told, found, recurring))
    elif json_file is not None:
        write_json(json_file, _values(told, found, recurring))
    if len(found) and not on_stdout and not quiet:
        header, rows = found.table()
        print_columns(f"{told}: {found.summary()}", header, [*rows, *run_rows(found.pipe_runs())])
    if recurring is not None and not on_stdout and not quiet:
        print_columns(f"{told}: {recurring.summary()}", *recurring.table())
    # The last, for where no surface was found there is none to write, which is an error.
    if export is not None:
        found.export(export)


def _values(file: str, found: Surfaces, recurring: Recurrences | None) -> dict[str, Any]:
    """Give what a program may want to know."""
    import numpy as np

    from surfsig import PointClass

    counts = np.bincount(found.classes, minlength=len(PointClass)).tolist()
    values = {
        "file": file,
        "summary": found.summary(),
        "points": len(found.cloud),
        "classes": {kind.name.lower(): counts[kind] for kind in PointClass},
        "surfaces": [{"number": number, **surface.to_dict()} for number, surface in enumerate(found)],
        "pipe_runs": [run.to_dict() for run in found.pipe_runs()],
    }
    return values if recurring is None else values | {"recurrences": recurring.values()}
