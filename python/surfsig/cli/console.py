"""What is shown on a terminal and for programs: progress bars, tables, JSON. Nothing is shown in a pipe."""

from __future__ import annotations

import contextlib
import sys
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from pathlib import Path
from typing import Any

import click


def on_terminal() -> bool:
    """Tell whether a person may be reading stderr."""
    return sys.stderr.isatty()


@contextlib.contextmanager
def progress_bar(what: str, unit: str, *, shown: bool) -> Iterator[Callable[[int, int], None] | None]:
    """Show a bar with rate and time left while the block runs.

    Parameters
    ----------
    what
        What is being done, in a word.
    unit
        What is counted: "points", or "bytes".
    shown
        False gives None in place of the callback and shows nothing.

    Yields
    ------
    callable or None
        To be called with what is done and what there is in all.
    """
    if not shown:
        yield None
        return
    from rich import progress
    from rich.console import Console

    def rate(task: progress.Task) -> str:
        return f"{quantity(task.speed)} {unit}/s" if task.speed else ""

    class Rate(progress.ProgressColumn):
        def render(self, task: progress.Task) -> Any:
            from rich.text import Text

            return Text(rate(task))

    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        Rate(),
        progress.TimeRemainingColumn(),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        task = bar.add_task(what, total=None)
        yield lambda done, total: bar.update(task, completed=done, total=total)


def print_table(title: str, rows: Iterable[tuple[str, str]], *, err: bool) -> None:
    """Print two columns, the first with names; in a pipe as plain lines, which are not folded."""
    if not (sys.stderr if err else sys.stdout).isatty():
        click.echo(title, err=err)
        lines = list(rows)
        width = max([14, *(len(name) + 2 for name, _ in lines)])
        for name, value in lines:
            click.echo(f"{name:<{width}}{value}", err=err)
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title, title_justify="left", box=None, show_header=False, padding=(0, 2, 0, 0))
    table.add_column(style="bold", no_wrap=True)
    table.add_column(overflow="fold")
    for name, value in rows:
        table.add_row(name, Text(value))
    Console(stderr=err, highlight=False).print(table)


def print_columns(title: str, header: Sequence[str], rows: Sequence[Sequence[str]]) -> None:
    """Print a table of several columns; in a pipe as plain lines, which are not folded."""
    if not sys.stdout.isatty():
        widths = [max(map(len, column)) for column in zip(header, *rows, strict=True)]
        click.echo(title)
        for row in (header, *rows):
            cells = (cell.ljust(width) for cell, width in zip(row, widths, strict=True))
            click.echo("  ".join(cells).rstrip())
        return
    from rich.console import Console
    from rich.table import Table
    from rich.text import Text

    table = Table(title=title, title_justify="left", box=None, padding=(0, 2, 0, 0))
    for name in header:
        table.add_column(name, overflow="fold")
    for row in rows:
        table.add_row(*map(Text, row))
    Console(highlight=False).print(table)


def print_json(values: Mapping[str, Any]) -> None:
    """Print one JSON object on one line; what is not finite becomes null, which JSON knows."""
    from surfsig.files.json_text import json_text

    click.echo(json_text(values))


def write_json(path: Path, values: Mapping[str, Any]) -> None:
    """Write one JSON object to a file, as `print_json` prints it."""
    from surfsig.files.atomic import replacing
    from surfsig.files.json_text import json_text

    with replacing(path) as file:
        file.write(json_text(values, indent=1).encode() + b"\n")


def number(value: float) -> str:
    """Write a number with five digits."""
    return f"{value:.5g}"


def quantity(value: float) -> str:
    """Write a large number short: 1.2 M."""
    for factor, letter in ((1e9, "G"), (1e6, "M"), (1e3, "k")):
        if value >= factor:
            return f"{value / factor:.3g} {letter}"
    return f"{value:.3g}"


def size_text(size: float) -> str:
    """Write bytes short: 1.5 GB."""
    return f"{quantity(size)}B"
