"""`surfsig library`: models in a file, prepared to be found."""

from __future__ import annotations

from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import number, print_columns, print_json
from surfsig.cli.options import CLOUD, input_options, json_option, threads_option

if TYPE_CHECKING:
    from surfsig import Library


@click.group("library", no_args_is_help=True)
def library_command() -> None:
    """Keep models in one file, for `surfsig find --library`.

    \b
    Examples:
      surfsig library add things.db cup cup.ply
      surfsig library add things.db meshes/ --unit mm
      surfsig library list things.db
      surfsig library remove things.db cup
    """  # noqa: D301


@library_command.command("add", no_args_is_help=True)
@click.argument("library", type=CLOUD)
@click.argument("models", nargs=-1, required=True, metavar="NAME FILE | FILES...")
@click.option("--replace", is_flag=True, help="Also where there is a model of this name.")
@input_options
@threads_option
def add_command(
    library: Path, models: tuple[str, ...], replace: bool, threads: int | None, **reading: Any
) -> None:
    """Add models to LIBRARY, which is made where there is none.

    Give one model's NAME and FILE, or files and folders: each file is then a model with the file's name.
    Points are spread over the outer surface of a mesh.
    """
    import surfsig

    store = surfsig.Library(library)
    found: Iterable[tuple[str, surfsig.PointCloud]]
    if len(models) == 2 and not Path(models[0]).exists():
        found = [(models[0], surfsig.read_model(models[1], **reading))]
    else:
        found = surfsig.read_models(models, **reading)
    unit = "m" if reading.get("unit") else None
    for name, cloud in found:
        try:
            entry = store.add(name, cloud, unit=unit, replace=replace, threads=threads)
        except surfsig.InvalidInputError as error:
            text = str(error)
            raise surfsig.InvalidInputError(
                text if text.startswith(str(library)) else f"{name}: {text}"
            ) from None
        click.echo(f"{library}: added {entry.name}, {entry.points:,} points")


@library_command.command("list", no_args_is_help=True)
@click.argument("library", type=CLOUD)
@json_option
def list_command(library: Path, as_json: bool) -> None:
    """List the models of LIBRARY."""
    entries = _existing(library).list()
    if as_json:
        print_json({"file": str(library), "models": [entry._asdict() for entry in entries]})
        return
    header = ("name", "points", "radius", "unit", "added")
    rows = [
        (entry.name, f"{entry.points}", number(entry.radius), entry.unit or "-", entry.added)
        for entry in entries
    ]
    print_columns(f"{library}: {len(rows)} model{'' if len(rows) == 1 else 's'}", header, rows)


@library_command.command("remove", no_args_is_help=True)
@click.argument("library", type=CLOUD)
@click.argument("name")
def remove_command(library: Path, name: str) -> None:
    """Remove the model NAME from LIBRARY."""
    _existing(library).remove(name)
    click.echo(f"{library}: removed {name}")


def _existing(path: Path) -> Library:
    import surfsig

    if not path.exists():
        raise surfsig.InvalidInputError(f"{path}: no such file")
    return surfsig.Library(path)
