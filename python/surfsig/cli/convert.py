"""`surfsig convert`: a cloud in another format."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import click

from surfsig.cli.console import on_terminal, progress_bar
from surfsig.cli.options import CLOUD, input_options, quiet_option


@click.command("convert", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@click.argument("output", type=CLOUD)
@input_options
@quiet_option
def convert_command(file: Path, output: Path, quiet: bool, **reading: Any) -> None:
    """Write the points of FILE to OUTPUT, in the format of its extension, with all their fields.

    The viewpoint and the rows of an organised cloud are kept where the format can hold them. FILE may be a
    folder or a pattern: the points of all its files are then written to one.

    \b
    Examples:
      surfsig convert scan.xyz scan.ply
      surfsig convert part.ply part.npz --unit mm
      surfsig convert 'tiles/*.laz' all.laz
      surfsig convert tile.copc.laz part.las --box 500100,4500200,0,500110,4500210,50
    """  # noqa: D301
    from surfsig.files import check_writable, read, write

    check_writable(output)
    shown = on_terminal() and not quiet
    with progress_bar("reading", "bytes", shown=shown) as progress:
        cloud = read(file, progress=progress, **reading)
    with progress_bar("writing", "points", shown=shown) as progress:
        write(output, cloud, progress=progress)
