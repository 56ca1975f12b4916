"""`surfsig fit`: a surface or a curve in a scan, with its size and how sure it is."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import number, on_terminal, print_json, print_table, progress_bar
from surfsig.cli.options import CLOUD, input_options, json_option, position, threads_option
from surfsig.defaults import INTERVAL
from surfsig.digits import rounded, with_error

if TYPE_CHECKING:
    from numpy.typing import NDArray

    from surfsig import PointCloud, Surface


@click.group("fit", no_args_is_help=True)
def fit_command() -> None:
    """Fit a surface, a circle or a line to a scan, and say how sure it is.

    \b
    Examples:
      surfsig fit sphere ball.ply                            all points are the sphere's
      surfsig fit sphere scan.ply --near 1.7,2.5,0           the one in a scan that is near a place
      surfsig fit cylinder scan.ply --near 0,0.1,0.7 --radius 0.03 --json | jq .interval
      surfsig fit cylinder pipe.ply --radius 0.03 --axis 0,0,1   what is known is kept
      surfsig fit plane plate.ply --criterion minimum_zone --json | jq .form_error
      surfsig fit line edge.las --weights intensity          the file's field says how much each point counts
    """  # noqa: D301


_AXIS = click.option(
    "--axis",
    type=position,
    metavar="X,Y,Z",
    help="The direction of the axis or normal, of any length, where it is known.  [default: fitted]",
)
_CRITERION = click.option(
    "--criterion",
    type=click.Choice(["least_squares", "minimum_zone"]),
    default="least_squares",
    show_default=True,
    help="minimum_zone: the largest distance is least, for flatness, roundness, cylindricity.",
)


def _shape_command(name: str, text: str) -> click.Command:
    """Make the command of one shape: they differ in the function that fits, and in what it takes."""
    import inspect

    import surfsig

    fit = getattr(surfsig, f"fit_{name}")
    taken = inspect.signature(fit).parameters

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
        help="With --near: of the ball to begin with, about the object's size.  [default: by the points]  "
        "Without: the radius that a sphere, cylinder or circle has, where it is known.",
    )
    @click.option(
        "--weights",
        metavar="FIELD",
        help="The file's field that says by how much each point's squared distance counts.  [default: alike]",
    )
    @click.option("--robust", is_flag=True, help="Leave out points that are far from the surface.")
    @input_options
    @threads_option
    @json_option
    def command(
        file: Path,
        near: tuple[float, float, float] | None,
        radius: float | None,
        weights: str | None,
        robust: bool,
        threads: int | None,
        as_json: bool,
        axis: tuple[float, float, float] | None = None,
        criterion: str = "least_squares",
        **reading: Any,
    ) -> None:
        from surfsig.missing_returns import warn_of_missing_returns

        shown = on_terminal()
        with progress_bar("reading", "bytes", shown=shown) as progress:
            cloud = surfsig.read(file, progress=progress, **reading)
        warn_of_missing_returns(cloud, str(file))
        try:
            with progress_bar("fitting", "steps", shown=shown) as progress:
                known = {"axis": axis, "criterion": criterion}
                surface = fit(
                    cloud,
                    near=near,
                    radius=radius,
                    weights=None if weights is None else _field(cloud, weights),
                    robust=robust,
                    threads=threads,
                    progress=progress,
                    **{key: value for key, value in known.items() if key in taken},
                )
        except surfsig.InvalidInputError as error:
            raise surfsig.InvalidInputError(f"{file}: {error}") from None
        if as_json:
            print_json({"file": str(file), **surface.to_dict(), "points": len(cloud)})
        else:
            print_table(str(file), _rows(surface, len(cloud)), err=False)

    if "axis" in taken:
        command = _AXIS(command)
    if "criterion" in taken:
        command = _CRITERION(command)
    return click.command(name, help=text, no_args_is_help=True)(command)


def _field(cloud: PointCloud, name: str) -> NDArray[Any]:
    """Give a field of the file, or name those that there are."""
    from surfsig import InvalidInputError

    if name not in cloud.fields:
        names = ", ".join(cloud.fields) or "none"
        raise InvalidInputError(f"no field is called {name!r:.40}: there are {names}")
    return cloud.fields[name]


def _rows(surface: Surface, points: int) -> list[tuple[str, str]]:
    rows = []
    low, high = surface.interval
    if not surface.radius_determined:
        above = f"above {number(low)}" if low > 0 else "noise hides how the points bend"
        rows.append(("radius", f"not determined, {above}"))
    elif math.isfinite(surface.radius):
        size = with_error(surface.radius, surface.radius_std)
        if math.isfinite(surface.radius_std) and surface.radius_std > 0:
            ends = " to ".join(rounded(end, surface.radius_std) for end in (low, high))
            size = f"{size}, {INTERVAL:.0%} interval {ends}"
        rows.append(("radius", size))
    if surface.kind == "torus":
        rows.append(("major radius", with_error(surface.major_radius, surface.major_radius_std)))
    if surface.kind == "cone":
        degrees = with_error(math.degrees(surface.half_angle), math.degrees(surface.half_angle_std))
        rows.append(("half angle", f"{degrees} degrees"))
    rows.append(("center", _with_errors(surface.center, surface.center_std)))
    if surface.kind != "sphere":
        direction = {"plane": "normal", "line": "direction"}.get(surface.kind, "axis")
        rows.append((direction, _with_errors(surface.axis, surface.axis_std)))
    rows.append(("rms", f"{number(surface.rms)} from the {surface.kind}"))
    rows.append(("form error", f"{number(surface.form_error)} from peak to valley"))
    rows.append(("points", f"{surface.count:,} of {points:,}"))
    return rows


def _with_errors(values: Any, errors: Any) -> str:
    pairs = zip(values, errors, strict=True)
    return ", ".join(with_error(value, error) for value, error in pairs)


for _name, _article in (
    ("sphere", "a sphere"),
    ("cylinder", "a cylinder"),
    ("plane", "a plane"),
    ("cone", "a cone"),
    ("torus", "a torus"),
    ("circle", "a circle in space"),
    ("line", "a straight line"),
):
    fit_command.add_command(
        _shape_command(_name, f"Fit {_article} to the points of FILE, or to one that is in it.")
    )
