"""`surfsig clean`: fewer points, and none that stray."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from surfsig import defaults
from surfsig.cli.console import on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, quiet_option, threads_option


@click.command("clean", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@click.argument("output", type=CLOUD)
@click.option("--no-returns", is_flag=True, help="Drop a lidar's missing returns, which are at (0, 0, 0).")
@click.option("--outliers", is_flag=True, help="Drop points that are far from their neighbours.")
@click.option(
    "--neighbors",
    type=int,
    default=defaults.OUTLIER_NEIGHBORS,
    show_default=True,
    help="With --outliers: how many neighbours.",
)
@click.option(
    "--std-ratio",
    type=float,
    default=defaults.OUTLIER_STD_RATIO,
    show_default=True,
    help="With --outliers: standard deviations above the mean distance that are far.",
)
@click.option("--voxel", type=float, help="One point per voxel of this size: the mean of its points.")
@input_options
@threads_option
@json_option
@quiet_option
def clean_command(
    file: Path,
    output: Path,
    no_returns: bool,
    outliers: bool,
    neighbors: int,
    std_ratio: float,
    voxel: float | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Write the points of FILE to OUTPUT, cleaned: those in --box, then without outliers, then one per voxel.

    Points that are not finite are dropped by each of these steps, and missing returns by --outliers, too.
    Fields go with their points.

    \b
    Examples:
      surfsig clean scan.ply out.ply --outliers
      surfsig clean lidar.pcd out.pcd --no-returns
      surfsig clean scan.pcd out.ply --box 0,0,0.5,1,1,2 --outliers --std-ratio 1 --voxel 0.002
    """  # noqa: D301
    import surfsig
    from surfsig.files import check_writable

    if reading["box"] is None and not no_returns and not outliers and voxel is None:
        raise click.UsageError("nothing to do: give --box, --no-returns, --outliers or --voxel")
    check_writable(output)
    shown = on_terminal() and not quiet
    with progress_bar("reading", "bytes", shown=shown) as progress:
        cloud = surfsig.read(file, progress=progress, **reading)
    points = {"read": len(cloud)}
    if no_returns:
        cloud = surfsig.remove_missing_returns(cloud)
        points["not_missing_returns"] = len(cloud)
    if outliers:
        with progress_bar("removing outliers", "points", shown=shown) as progress:
            cloud = surfsig.remove_outliers(cloud, neighbors, std_ratio, threads=threads, progress=progress)
        points["not_outliers"] = len(cloud)
    if voxel is not None:
        with progress_bar("downsampling", "columns", shown=shown) as progress:
            cloud = surfsig.downsample(cloud, voxel, threads=threads, progress=progress)
        points["voxels"] = len(cloud)
    with progress_bar("writing", "points", shown=shown) as progress:
        surfsig.write(output, cloud, progress=progress)
    if as_json:
        print_json({"input": str(file), "output": str(output), "points": points})
    elif shown:
        rows = [(name.replace("_", " "), f"{count:,}") for name, count in points.items()]
        print_table(f"{output}, points", rows, err=True)
