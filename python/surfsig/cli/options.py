"""Options and types that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Literal

import click

from surfsig import defaults
from surfsig.files.options import UNITS

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, TypeVar

    Function = TypeVar("Function", bound="Callable[..., Any]")


def _numbers(text: str, count: int, example: str) -> list[float]:
    try:
        values = [float(part) for part in text.split(",")]
    except ValueError:
        values = []
    if len(values) != count:
        word = {3: "three", 4: "four", 6: "six"}[count]
        raise click.BadParameter(f"{text!r} is not {word} numbers such as {example}")
    return values


def radius_or_auto(text: str) -> float | Literal["auto"]:
    """Turn "0.02" into a number, and leave the word "auto"."""
    if text == "auto":
        return "auto"
    try:
        return float(text)
    except ValueError:
        raise click.BadParameter(f"must be a number, or auto, not {text!r}") from None


def position(text: str) -> tuple[float, float, float]:
    """Turn "1,2.5,-3" into three floats; the type of options that name a place."""
    x, y, z = _numbers(text, 3, "0.1,-0.25,3")
    return x, y, z


def corners(text: str) -> list[list[float]]:
    """Turn "0,0,0,1,2,3" into the two corners of a box, the lowest first."""
    values = _numbers(text, 6, "-1,-1,0,1,1,2.5")
    return [values[:3], values[3:]]


def pinhole(text: str) -> list[float]:
    """Turn "525,525,319.5,239.5" into the four numbers of a camera."""
    return _numbers(text, 4, "525,525,319.5,239.5")


def words(text: str) -> list[str]:
    """Turn "plane,cylinder" into its words."""
    return [word.strip() for word in text.split(",")]


# Whether the file exists and is one is found out when it is opened, with the same message as from Python.
CLOUD = click.Path(path_type=Path)


def input_options(command: Function) -> Function:
    """Add what `surfsig.read` can be asked for, under the names of its keywords (`**reading` takes them)."""
    options = (
        click.option(
            "--unit",
            type=click.Choice(list(UNITS)),
            help="The unit of the file's numbers. All is then in metres: radius, positions, output.",
        ),
        click.option(
            "--box",
            type=corners,
            metavar="X0,Y0,Z0,X1,Y1,Z1",
            help="Only the points between these corners, in the file's unit.",
        ),
        click.option(
            "--columns",
            metavar="NAMES",
            help="Of text and rows of float32: a name for each column, as x,y,z,intensity; _ leaves one out.",
        ),
        click.option(
            "--scan", type=int, metavar="N", help="Of an E57, PTX or PTS file, only its scan N, from 0."
        ),
        click.option(
            "--samples", type=int, metavar="N", help="Of a mesh, N points spread over it, not its vertices."
        ),
        click.option(
            "--intrinsics",
            type=pinhole,
            metavar="FX,FY,CX,CY",
            help="Of a depth image: the camera's focal lengths and centre, in pixels.",
        ),
        click.option(
            "--depth-scale",
            type=float,
            metavar="S",
            help="Of a depth image: units of its numbers per unit of length.  [default: 1000]",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def axes_option(command: Function) -> Function:
    """Add --axes."""
    return click.option(
        "--axes",
        type=click.Choice(["surface", "sensor"]),
        default=defaults.AXES,
        show_default=True,
        help="Fit in the surface's own axes, or in the sensor's (the paper's way; turns with the object).",
    )(command)


def fit_option(command: Function) -> Function:
    """Add --fit."""
    return click.option(
        "--fit",
        type=click.Choice(["paraboloid", "quadric", "auto"]),
        default=defaults.FIT,
        show_default=True,
        help="The paper's surface; one that is unbiased on large balls; or for each point what errs less.",
    )(command)


def threads_option(command: Function) -> Function:
    """Add --threads."""
    return click.option(
        "--threads", type=int, default=None, metavar="N", help="Threads to use.  [default: all cores]"
    )(command)


def quiet_option(command: Function) -> Function:
    """Add --quiet."""
    return click.option("-q", "--quiet", is_flag=True, help="No progress and no summary.")(command)


def json_option(command: Function) -> Function:
    """Add --json."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON object to stdout.")(command)


def result_options(values: str, page: str) -> Callable[[Function], Function]:
    """Add -o, --json and --report; the words say what is written."""
    formats = "A .ply, .pcd, .las, .laz, .e57, .npz, .parquet, .csv or .xyz file."
    options = [
        click.option("-o", "--output", type=CLOUD, help=formats),
        click.option(
            "--json",
            "json_file",
            type=CLOUD,
            metavar="FILE|-",
            help=f"Write {values} as JSON; - is stdout.",
        ),
        click.option("--report", type=CLOUD, metavar="FILE.html", help=f"Write a page with {page}."),
    ]

    def added(command: Function) -> Function:
        for option in reversed(options):
            command = option(command)
        return command

    return added


def check_results(
    output: Path | None, json_file: Path | None, report: Path | None, *others: Path | None
) -> bool:
    """Refuse what cannot be written before there is work; tell whether JSON goes to stdout."""
    from surfsig.files import check_writable
    from surfsig.files.atomic import check_target

    on_stdout = json_file is not None and str(json_file) == "-"
    if output is not None:
        check_writable(output)
    for target in (report, None if on_stdout else json_file, *others):
        if target is not None:
            check_target(target)
    return on_stdout
