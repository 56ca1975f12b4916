"""`surfsig find`: where instances of a model, or of a library's models, are in a scene."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from surfsig import defaults
from surfsig.cli.console import on_terminal, print_columns, print_json, progress_bar, write_json
from surfsig.cli.options import (
    CLOUD,
    check_results,
    input_options,
    quiet_option,
    result_options,
    threads_option,
)


@click.command("find", no_args_is_help=True)
@click.argument("files", nargs=-1, type=CLOUD, metavar="[MODEL] SCENE")
@click.option(
    "--library", type=CLOUD, metavar="FILE", help="Look for all models of a library; then no MODEL."
)
@result_options("poses, covariances and scores", "the scene, before and after")
@click.option(
    "--score",
    type=float,
    default=defaults.INSTANCE_SCORE,
    show_default=True,
    help="Of an instance, at least, 0 to 1.",
)
@input_options
@threads_option
@quiet_option
def find_command(
    files: tuple[Path, ...],
    library: Path | None,
    output: Path | None,
    json_file: Path | None,
    report: Path | None,
    score: float,
    threads: int | None,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find every instance of MODEL in SCENE: pose, score, and how much of it is seen.

    The exit code is 0 also where there is none. MODEL is a scan or a mesh of the whole object, or one view of
    it. The options of reading count for both files. The output has the scene's points and fields, and
    instance (its number, -1 for none).

    \b
    Examples:
      surfsig find cup.ply scene.pcd
      surfsig find cup.ply scene.pcd --json found.json -o labelled.ply
      surfsig find cup.ply scene.pcd --report before_and_after.html
      surfsig find --library things.db scene.pcd
    """  # noqa: D301
    import surfsig

    if len(files) != (2 if library is None else 1):
        wanted = "MODEL and SCENE" if library is None else "SCENE alone, beside --library"
        raise click.UsageError(f"give {wanted}")
    scene_file = files[-1]
    on_stdout = check_results(output, json_file, report)
    model: surfsig.Library | dict[str, surfsig.PointCloud]
    if library is None:
        model = {files[0].stem: surfsig.read(files[0], **reading)}
    else:
        if not library.exists():
            raise surfsig.InvalidInputError(f"{library}: no such file")
        model = surfsig.Library(library)
    shown = on_terminal() and not quiet
    with progress_bar("reading", "bytes", shown=shown) as progress:
        scene = surfsig.read(scene_file, progress=progress, **reading)
    with progress_bar("finding", "steps", shown=shown) as progress:
        found = surfsig.find_instances(model, scene, score=score, threads=threads, progress=progress)
    if output is not None:
        with progress_bar("writing", "points", shown=shown) as progress:
            surfsig.write(output, scene, {"instance": found.labels}, progress=progress)
    if report is not None:
        found.write_report(report, title=f"{found.summary()} in {scene_file.name}")
    values = {"file": str(scene_file), **found.values()}
    if on_stdout:
        print_json(values)
    elif json_file is not None:
        write_json(json_file, values)
    if not on_stdout and not quiet:
        if len(found):
            print_columns(f"{scene_file}: {found.summary()}", *found.table())
        else:
            click.echo(f"{scene_file}: {found.summary()}")
