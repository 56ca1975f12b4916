"""`surfsig fit`: a sphere, cylinder or plane in a scan, with its radius and how sure it is."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, position, threads_option
from surfsig.defaults import INTERVAL
from surfsig.digits import rounded, with_error

if TYPE_CHECKING:
    from surfsig import Surface


@click.group("fit", no_args_is_help=True)
def fit_command() -> None:
    """Fit a sphere, a cylinder or a plane to a scan, and say how sure it is.

    \b
    Examples:
      surfsig fit sphere ball.ply                            all points are the sphere's
      surfsig fit sphere scan.ply --near 1.7,2.5,0           the one in a scan that is near a place
      surfsig fit cylinder scan.ply --near 0,0.1,0.7 --radius 0.03 --json | jq .interval
    """  # noqa: D301


def _shape_command(name: str, fit: str, text: str) -> click.Command:
    """Make the command of one shape: they differ in the function that fits."""

    @click.argument("file", type=CLOUD)
    @click.option(
        "--near",
        type=position,
        metavar="X,Y,Z",
        help="A place on the surface: the shape grows from there over the scan.  [default: all points]",
    )
    @click.option(
        "--radius",
        type=float,
        metavar="R",
        help="With --near: of the ball to begin with, about the object's size.  [default: by the points]",
    )
    @click.option("--robust", is_flag=True, help="Leave out points that are far from the surface.")
    @input_options
    @threads_option
    @json_option
    def command(
        file: Path,
        near: tuple[float, float, float] | None,
        radius: float | None,
        robust: bool,
        threads: int | None,
        as_json: bool,
        **reading: Any,
    ) -> None:
        import surfsig
        from surfsig.missing_returns import warn_of_missing_returns

        shown = on_terminal()
        with progress_bar("reading", "bytes", shown=shown) as progress:
            cloud = surfsig.read(file, progress=progress, **reading)
        warn_of_missing_returns(cloud, str(file))
        try:
            with progress_bar("fitting", "steps", shown=shown) as progress:
                surface = getattr(surfsig, fit)(
                    cloud, near=near, radius=radius, robust=robust, threads=threads, progress=progress
                )
        except surfsig.InvalidInputError as error:
            raise surfsig.InvalidInputError(f"{file}: {error}") from None
        if as_json:
            print_json({"file": str(file), **surface.to_dict(), "points": len(cloud)})
        else:
            print_table(str(file), _rows(surface, len(cloud)), err=False)

    return click.command(name, help=text, no_args_is_help=True)(command)


def _rows(surface: Surface, points: int) -> list[tuple[str, str]]:
    rows = []
    if surface.kind != "plane":
        low, high = surface.interval
        ends = " to ".join(rounded(end, surface.radius_std) for end in (low, high))
        size = with_error(surface.radius, surface.radius_std)
        rows.append(("radius", f"{size}, {INTERVAL:.0%} interval {ends}"))
    rows.append(("center", _with_errors(surface.center, surface.center_std)))
    if surface.kind != "sphere":
        direction = "normal" if surface.kind == "plane" else "axis"
        rows.append((direction, _with_errors(surface.axis, surface.axis_std)))
    rows.append(("rms", f"{number(surface.rms)} from the {surface.kind}"))
    rows.append(("points", f"{surface.count:,} of {points:,}"))
    return rows


def _with_errors(values: Any, errors: Any) -> str:
    pairs = zip(values, errors, strict=True)
    return ", ".join(with_error(value, error) for value, error in pairs)


for _command in (
    _shape_command("sphere", "fit_sphere", "Fit a sphere to the points of FILE, or to one that is in it."),
    _shape_command("cylinder", "fit_cylinder", "Fit a cylinder to the points of FILE, or to one in it."),
    _shape_command("plane", "fit_plane", "Fit a plane to the points of FILE, or to one that is in it."),
):
    fit_command.add_command(_command)
