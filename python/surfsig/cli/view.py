"""`surfsig view`: a file in the browser."""

from __future__ import annotations

import contextlib
import webbrowser
from pathlib import Path
from typing import Any

import click

from surfsig.cli.console import on_terminal, progress_bar
from surfsig.cli.options import CLOUD, input_options


@click.command("view", no_args_is_help=True)
@click.argument("file", type=CLOUD)
@click.option(
    "--port", type=click.IntRange(0, 65535), default=0, help="Where to serve.  [default: any free one]"
)
@click.option("--no-browser", is_flag=True, help="Only serve, and say where.")
@input_options
def view_command(file: Path, port: int, no_browser: bool, **reading: Any) -> None:
    """Show FILE in the browser: curvature, where else a surface occurs, planes, pipes and balls.

    The page is served on 127.0.0.1 until Ctrl-C, and computes in the browser. FILE may have any format that
    surfsig reads.

    \b
    Examples:
      surfsig view scan.e57
      surfsig view scan.laz --no-browser --port 8000
    """  # noqa: D301
    from surfsig.files import read
    from surfsig.page import serve_cloud

    with progress_bar("reading", "bytes", shown=on_terminal()) as progress:
        cloud = read(file, progress=progress, **reading)
    with serve_cloud(cloud, file.name, port) as server:
        click.echo(f"{file} is at {server.url} until Ctrl-C")
        if not no_browser:
            webbrowser.open(server.url)
        with contextlib.suppress(KeyboardInterrupt):
            server.serve_forever()
