"""`surfsig register`: how a scan lies in another."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from surfsig.cli.console import on_terminal, print_columns, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, quiet_option, threads_option


@click.command("register", no_args_is_help=True)
@click.argument("scans", type=CLOUD, nargs=-1, required=True, metavar="SOURCE TARGET | SCANS...")
@click.option(
    "-o",
    "--output",
    type=CLOUD,
    metavar="FILE",
    help="Write the source, moved into the target, in any format; of three scans and more the poses: JSON.",
)
@click.option(
    "--merged",
    type=CLOUD,
    metavar="FILE",
    help="Of three scans and more: write those that belong together as one cloud, in any format.",
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
    scans: tuple[Path, ...],
    output: Path | None,
    merged: Path | None,
    init: Path | None,
    radius: float | None,
    report: Path | None,
    threads: int | None,
    as_json: bool,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find how SOURCE lies in TARGET: the pose T_target_source, from any start, and whether to trust it.

    Shows the pose, its standard deviations, what overlaps, the directions in which the geometry does not hold
    the scan (a plane slides), and why a pose is not trusted. Where no place is found again, that is said, and
    nothing is written.

    Of three and more SCANS all pairs are registered, and the poses of those that belong together are made one
    consistent set; the others are named.

    \b
    Examples:
      surfsig register scan_2.ply scan_1.ply -o aligned.ply
      surfsig register a.pcd b.pcd --json > pose.json
      surfsig register a.pcd b.pcd --report before_and_after.html
      surfsig register floor_*.ply -o poses.json --merged floor.ply
    """  # noqa: D301
    if len(scans) < 2:
        raise click.UsageError("at least two scans are registered, and there is one")
    shown = on_terminal() and not quiet and not as_json
    if len(scans) == 2:
        if merged is not None:
            raise click.UsageError("--merged is for three scans and more; -o writes the source, moved")
        _register_pair(scans[0], scans[1], output, init, radius, report, threads, as_json, shown, reading)
        return
    if init is not None or report is not None:
        raise click.UsageError("--init and --report are for two scans")
    _register_several(scans, output, merged, radius, threads, as_json, shown, reading)


def _register_pair(
    source: Path,
    target: Path,
    output: Path | None,
    init: Path | None,
    radius: float | None,
    report: Path | None,
    threads: int | None,
    as_json: bool,
    shown: bool,
    reading: dict[str, Any],
) -> None:
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


def _register_several(
    files: tuple[Path, ...],
    output: Path | None,
    merged: Path | None,
    radius: float | None,
    threads: int | None,
    as_json: bool,
    shown: bool,
    reading: dict[str, Any],
) -> None:
    import json

    import surfsig
    from surfsig.files import check_writable
    from surfsig.files.atomic import check_target, replacing

    if output is not None:
        if output.suffix.lower() != ".json":
            raise click.UsageError(f"{output}: the poses of several scans are written as .json")
        check_target(output)
    if merged is not None:
        check_writable(merged)
    with progress_bar("reading", "bytes", shown=shown) as progress:
        clouds = [surfsig.read(path, progress=progress, **reading) for path in files]
    with progress_bar("pairs", "pairs", shown=shown) as progress:
        found = surfsig.register_multiway(
            clouds, names=[str(path) for path in files], radius=radius, threads=threads, progress=progress
        )
    if output is not None:
        with replacing(output) as file:
            file.write((json.dumps(found.values(), indent=2) + "\n").encode())
    if merged is not None:
        surfsig.write(merged, found.merged(clouds))
    if as_json:
        print_json(found.values())
        return
    together = int(found.belongs.sum())
    reference = found.names[found.reference]
    print_columns(
        f"{together} of {len(files)} scans belong together, in the coordinates of {reference}",
        ("scan", "place", "standard deviation", "pairs"),
        found.rows(),
    )
