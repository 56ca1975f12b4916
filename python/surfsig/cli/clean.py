"""`surfsig clean`: fewer points, and none that stray."""

from __future__ import annotations

from pathlib import Path

import click

from surfsig import defaults
from surfsig.cli.console import on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, json_option, threads_option


def _box(text: str) -> tuple[tuple[float, ...], tuple[float, ...]]:
    try:
        numbers = tuple(float(part) for part in text.split(","))
    except ValueError:
        numbers = ()
    if len(numbers) != 6:
        raise click.BadParameter(f"{text!r} is not six numbers such as 0,0,0,1,1,0.5")
    return numbers[:3], numbers[3:]


@click.command("clean", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@click.argument("output", type=CLOUD)
@click.option(
    "--crop",
    type=_box,
    metavar="X,Y,Z,X,Y,Z",
    help="Keep the points in this box: its lowest corner, then its highest.",
)
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
@threads_option
@json_option
def clean_command(
    file: Path,
    output: Path,
    crop: tuple[tuple[float, ...], tuple[float, ...]] | None,
    outliers: bool,
    neighbors: int,
    std_ratio: float,
    voxel: float | None,
    threads: int | None,
    as_json: bool,
) -> None:
    """Write the points of FILE to OUTPUT, cleaned: cropped, then without outliers, then one per voxel.

    Points that are not finite are dropped by each of these steps. Fields go with their points.

    \b
    Examples:
      surfsig clean scan.ply out.ply --outliers
      surfsig clean scan.pcd out.ply --crop 0,0,0.5,1,1,2 --outliers --std-ratio 1 --voxel 0.002
    """  # noqa: D301
    import surfsig
    from surfsig.files import check_writable

    if crop is None and not outliers and voxel is None:
        raise click.UsageError("nothing to do: give --crop, --outliers or --voxel")
    check_writable(output)
    with progress_bar("reading", "bytes", shown=on_terminal()) as progress:
        cloud = surfsig.read(file, progress=progress)
    points = {"read": len(cloud)}
    if crop is not None:
        cloud = surfsig.crop(cloud, crop)
        points["in_box"] = len(cloud)
    if outliers:
        cloud = surfsig.remove_outliers(cloud, neighbors, std_ratio, threads=threads)
        points["not_outliers"] = len(cloud)
    if voxel is not None:
        cloud = surfsig.downsample(cloud, voxel)
        points["voxels"] = len(cloud)
    with progress_bar("writing", "points", shown=on_terminal()) as progress:
        surfsig.write(output, cloud, progress=progress)
    if as_json:
        print_json({"input": str(file), "output": str(output), "points": points})
    elif on_terminal():
        rows = [(name.replace("_", " "), f"{count:,}") for name, count in points.items()]
        print_table(f"{output}, points", rows, err=True)
