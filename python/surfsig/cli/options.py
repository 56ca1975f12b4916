"""Options and types that several commands share."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING

import click

from surfsig import defaults

if TYPE_CHECKING:
    from collections.abc import Callable
    from typing import Any, TypeVar

    Function = TypeVar("Function", bound="Callable[..., Any]")


def position(text: str) -> tuple[float, float, float]:
    """Turn "1,2.5,-3" into three floats; the type of options that name a place."""
    try:
        x, y, z = (float(part) for part in text.split(","))
    except ValueError:
        raise click.BadParameter(f"{text!r} is not three numbers such as 0.1,-0.25,3") from None
    return x, y, z


# Whether the file exists and is one is found out when it is opened, with the same message as from Python.
CLOUD = click.Path(path_type=Path)


def axes_option(command: Function) -> Function:
    """Add --axes."""
    return click.option(
        "--axes",
        type=click.Choice(["surface", "sensor"]),
        default=defaults.AXES,
        show_default=True,
        help="Fit in the surface's own axes, or in the sensor's (the paper's way; turns with the object).",
    )(command)


def threads_option(command: Function) -> Function:
    """Add --threads."""
    return click.option(
        "--threads", type=int, default=None, metavar="N", help="Threads to use.  [default: all cores]"
    )(command)


def json_option(command: Function) -> Function:
    """Add --json."""
    return click.option("--json", "as_json", is_flag=True, help="Print one JSON object to stdout.")(command)
