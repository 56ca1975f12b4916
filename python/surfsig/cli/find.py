"""`surfsig find`: where instances of a model, or of a library's models, are in a scene."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click
import numpy as np
from numpy.typing import NDArray

from surfsig import defaults
from surfsig.cli.console import on_terminal, print_columns, print_json, progress_bar, write_json
from surfsig.cli.options import (
    CLOUD,
    check_results,
    corners,
    input_options,
    quiet_option,
    result_options,
    threads_option,
)

if TYPE_CHECKING:
    import surfsig


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
@click.option("--at-most", type=int, metavar="N", help="The N most probable instances only.")
@click.option("--only", multiple=True, metavar="NAME", help="Of a library, this model only; may be repeated.")
@click.option(
    "--scene-box",
    type=corners,
    metavar="X0,Y0,Z0,X1,Y1,Z1",
    help="Look only between these corners of the scene, in its coordinates as they were read.",
)
@click.option(
    "--bop",
    type=CLOUD,
    metavar="FILE.csv",
    help="Write the poses as the BOP benchmark reads them; coordinates are in metres.",
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
    at_most: int | None,
    only: tuple[str, ...],
    scene_box: Any,
    bop: Path | None,
    threads: int | None,
    quiet: bool,
    **reading: Any,
) -> None:
    """Find every instance of MODEL in SCENE: pose, score, and how much of it is seen.

    The exit code is 0 also where there is none. MODEL is a scan or a mesh of the whole object, or one view of
    it. The options of reading count for both files, where they have a meaning. The output has the scene's
    points and fields, and instance (its number, -1 for none).

    \b
    Examples:
      surfsig find cup.ply scene.pcd
      surfsig find cup.ply scene.pcd --json found.json -o labelled.ply
      surfsig find cup.ply scene.pcd --report before_and_after.html
      surfsig find --library things.db scene.pcd --only cup --at-most 1
      surfsig find cup.obj depth.png --intrinsics 575,575,320,240 --bop poses.csv
    """  # noqa: D301
    import surfsig

    if len(files) != (2 if library is None else 1):
        wanted = "MODEL and SCENE" if library is None else "SCENE alone, beside --library"
        raise click.UsageError(f"give {wanted}")
    scene_file = files[-1]
    on_stdout = check_results(output, json_file, report, bop)
    model: surfsig.Library | dict[str, surfsig.PointCloud]
    if library is None:
        model = {files[0].stem: surfsig.read_model(files[0], **_of_model(files[0], reading))}
    else:
        if not library.exists():
            raise surfsig.InvalidInputError(f"{library}: no such file")
        model = surfsig.Library(library)
    shown = on_terminal() and not quiet
    with progress_bar("reading", "bytes", shown=shown) as progress:
        scene = surfsig.read(scene_file, progress=progress, **{**reading, "samples": None})
    with progress_bar("finding", "steps", shown=shown) as progress:
        found = surfsig.find_instances(
            model,
            scene,
            score=score,
            at_most=at_most,
            only=only or None,
            mask=None if scene_box is None else _inside(scene, scene_box),
            threads=threads,
            progress=progress,
        )
    if output is not None:
        with progress_bar("writing", "points", shown=shown) as progress:
            surfsig.write(output, scene, {"instance": found.labels}, progress=progress)
    if report is not None:
        found.write_report(report, title=f"{found.summary()} in {scene_file.name}")
    if bop is not None:
        found.write_bop(bop)
    tried = f" among {found.sought} models" if library is not None else ""
    values = {"file": str(scene_file), **found.values()}
    if on_stdout:
        print_json(values)
    elif json_file is not None:
        write_json(json_file, values)
    if not on_stdout and not quiet:
        if len(found):
            print_columns(f"{scene_file}: {found.summary()}{tried}", *found.table())
        else:
            click.echo(f"{scene_file}: {found.summary()}{tried}")


def _of_model(file: Path, reading: dict[str, Any]) -> dict[str, Any]:
    """Leave out what only says how a depth image is read, where the model is none."""
    if file.suffix.lower() == ".png":
        return reading
    return {**reading, "intrinsics": None, "depth_scale": None}


def _inside(scene: surfsig.PointCloud, box: Any) -> NDArray[np.bool_]:
    low, high = np.asarray(box, np.float64).reshape(2, 3)
    points = scene.points
    return np.asarray(((points >= low) & (points <= high)).all(axis=1))
