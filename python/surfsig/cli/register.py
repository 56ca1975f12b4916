"""`surfsig register`: how a scan lies in another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from surfsig.cli.console import on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, quiet_option, threads_option


@click.command("register", no_args_is_help=True)
@click.argument("source", type=CLOUD)
@click.argument("target", type=CLOUD)
@click.option(
    "-o",
    "--output",
    type=CLOUD,
    metavar="FILE",
    help="Write the source, moved into the target, in any format.",
)
@click.option(
    "--init",
    type=click.Path(path_type=Path),
    metavar="FILE",
    help="A text file with the 16 numbers of T_target_source, roughly: it is refined, nothing is searched.",
)
@click.option(
    "--radius",
    type=float,
    help="Of the patches that are matched, in the files' unit; by default from the scans.",
)
@click.option(
    "--report", type=CLOUD, metavar="FILE.html", help="Write a page with both scans, before and after."
)
@input_options
@threads_option
@json_option
@quiet_option
def register_command(
    source: Path,
    target: Path,
    output: Path | None,
    init: Path | None,
    radius: float | None,
    report: Path | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find how SOURCE lies in TARGET: the pose T_target_source, from any start, and whether to trust it.

    Shows the pose, its standard deviations, what overlaps, and the directions in which the geometry does not
    hold the scan (a plane slides). Where no place is found again, that is said, and nothing is written.

    \b
    Examples:
      surfsig register scan_2.ply scan_1.ply -o aligned.ply
      surfsig register a.pcd b.pcd --json > pose.json
      surfsig register a.pcd b.pcd --report before_and_after.html
    """  # noqa: D301
    import numpy as np

    import surfsig
    from surfsig.files import check_writable
    from surfsig.files.atomic import check_target

    if output is not None:
        check_writable(output)
    if report is not None:
        check_target(report)
    start = None
    if init is not None:
        try:
            start = np.loadtxt(init).reshape(4, 4)
        except (OSError, ValueError) as error:
            raise click.UsageError(f"{init}: no 16 numbers of a pose: {str(error).splitlines()[0]}") from None
    shown = on_terminal() and not quiet and not as_json
    with progress_bar("reading", "bytes", shown=shown) as progress:
        moving = surfsig.read(source, progress=progress, **reading)
        still = surfsig.read(target, progress=progress, **reading)
    found = surfsig.register(moving, still, init=start, radius=radius, threads=threads)
    known = bool(np.isfinite(found.T_target_source).all())
    if output is not None and known:
        surfsig.write(output, found.transform_cloud(moving))
    if report is not None:
        found.write_report(report, moving, still, title=f"{source.name} in {target.name}")
    if as_json:
        print_json({"source": str(source), "target": str(target)} | found.values())
        return
    print_table(f"{source} in {target}", found.rows(), err=False)
