"""Where an output is a folder: options, progress and summary of work in tiles."""

from __future__ import annotations

import contextlib
import time
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import click

from surfsig.cli.console import number, print_json, print_table, quantity
from surfsig.cli.options import CLOUD

if TYPE_CHECKING:
    from surfsig.cli.options import Function
    from surfsig.tiles import TileDataset, TileProgress

_OPTIONS = ("tiles", "memory", "scheduler", "restart", "format_", "numbers", "store")


def tile_options(command: Function) -> Function:
    """Add what work in tiles can be asked for."""
    options = (
        click.option("--tiles", type=int, metavar="N", help="Work in at least N tiles."),
        click.option(
            "--memory",
            metavar="SIZE",
            help="What this process, or each worker, may need, as 4GB; tiles are cut so that they fit.  "
            "[default: half of what is free]",
        ),
        click.option(
            "--scheduler",
            metavar="ADDRESS",
            help="Of a Dask cluster that works on the tiles, as tcp://host:8786.",
        ),
        click.option("--restart", is_flag=True, help="Begin anew in a folder of another run."),
        click.option(
            "--format",
            "format_",
            type=click.Choice(["laz", "las", "parquet", "ply", "npz"]),
            help="Of the tiles' files.  [default: laz]",
        ),
        click.option(
            "--numbers", is_flag=True, help="Of tiles: write each point's number in the input (point_number)."
        ),
        click.option(
            "--store",
            type=CLOUD,
            metavar="FOLDER",
            help="Where the input is binned; runs over the same files share it.  [default: store in -o]",
        ),
    )
    for option in reversed(options):
        command = option(command)
    return command


def split_options(options: Mapping[str, Any]) -> tuple[dict[str, Any], dict[str, Any]]:
    """Part the options of tiles from those of reading."""
    tiling = {name: options[name] for name in _OPTIONS}
    return tiling, {name: value for name, value in options.items() if name not in _OPTIONS}


def is_tiled(output: Path, tiling: Mapping[str, Any]) -> bool:
    """Tell whether the output is a folder of tiles.

    Raises
    ------
    click.UsageError
        If it is a file, and an option is for tiles only.
    """
    from surfsig.files import formats

    known = {extension for kind in formats.FORMATS if kind.write is not None for extension in kind.extensions}
    if not output.suffix or (output / "manifest.json").exists():
        return True
    if output.is_dir() and output.suffix.lower() not in known:
        return True
    asked = next((name for name in _OPTIONS if tiling[name]), None)
    if asked is not None:
        option = asked.rstrip("_")
        if output.suffix.lower() in known:
            raise click.UsageError(f"--{option} needs a folder for the tiles: -o out/, not {output}")
        return True
    return False


def name_of(files: Sequence[Path]) -> str:
    """Name files in a line."""
    return str(files[0]) if len(files) == 1 else f"{files[0]} and {len(files) - 1} more"


def refuse_without_tiles(tiling: Mapping[str, Any]) -> None:
    """Refuse options of tiles where there is no folder for these.

    Raises
    ------
    click.UsageError
        Naming the option.
    """
    asked = next((name for name in _OPTIONS if tiling[name]), None)
    if asked is not None:
        raise click.UsageError(f"--{asked.rstrip('_')} needs a folder for the tiles: -o out/")


def refuse_in_tiles(**options: Any) -> None:
    """Refuse what is not done in tiles.

    Raises
    ------
    click.UsageError
        Naming the option.
    """
    for name, value in options.items():
        if value and name not in ("box", "unit", "columns"):
            raise click.UsageError(f"--{name.replace('_', '-')} is not for work in tiles: give -o a file")


def refuse_too_large(source: Any, told: str) -> None:
    """Refuse an input that does not fit into memory, as far as headers and sizes tell.

    Raises
    ------
    InvalidInputError
        With the advice to give a folder.
    """
    from surfsig import InvalidInputError
    from surfsig.cli.console import size_text
    from surfsig.tiles.memory import LARGE_SHARE, WHOLE_BYTES, total_bytes
    from surfsig.tiles.source import Source

    try:
        files = Source.of(source).files
        size = sum(file.stat().st_size for file in files)
    except Exception:
        # Whoever reads it says what is wrong.
        return
    total = total_bytes()
    if size <= LARGE_SHARE * total:
        # Of small files the headers need not be asked: points are never compressed a hundredfold.
        if size * 100 <= total:
            return
        import surfsig

        try:
            opened = surfsig.open(source)
        except Exception:
            return
        points = opened.points if isinstance(opened, surfsig.FileDataset) else None
        size = 0 if points is None else points * WHOLE_BYTES
        if size <= total:
            return
    raise InvalidInputError(
        f"{told}: needs some {size_text(max(size, 1))} of memory, and the machine has {size_text(total)}: "
        "give a folder (-o out/) to work in tiles"
    )


def tile_arguments(tiling: Mapping[str, Any], reading: Mapping[str, Any]) -> dict[str, Any]:
    """Name options of tiles and of reading as functions call them."""
    return {
        "memory": tiling["memory"],
        "tiles": tiling["tiles"],
        "client": tiling["scheduler"],
        "suffix": f".{tiling['format_'] or 'laz'}",
        "numbers": tiling["numbers"],
        "store": tiling["store"],
        "restart": tiling["restart"],
        **{name: reading[name] for name in ("box", "unit", "columns")},
    }


def extract_in_tiles(
    files: Sequence[Path],
    output: Path,
    how: Mapping[str, Any],
    tiling: Mapping[str, Any],
    reading: Mapping[str, Any],
    shown: bool,
    as_json: bool,
) -> None:
    """Work in tiles, and say what came of it."""
    import surfsig

    clock = time.perf_counter()
    with tile_progress(shown) as progress:
        found = surfsig.extract_tiles(
            files[0] if len(files) == 1 else files,
            output,
            **how,
            **tile_arguments(tiling, reading),
            progress=progress,
        )
    summary = _summary(found, time.perf_counter() - clock)
    if as_json:
        print_json(summary)
    elif shown:
        print_table(f"{output}, {found.manifest['arguments']['axes']} axes", _rows(summary), err=True)


def _summary(found: TileDataset, seconds: float) -> dict[str, Any]:
    records = found.manifest["tiles"]
    points = len(found)
    return {
        "output": str(found.folder),
        "arguments": found.manifest["arguments"],
        "points": points,
        "tiles": len(found.tiles),
        "read_per_point": sum(record.get("read", 0) for record in records) / max(points, 1),
        "status": found.status_counts(),
        "seconds": seconds,
        "points_per_second": points / seconds if seconds else None,
    }


def _rows(summary: Mapping[str, Any]) -> list[tuple[str, str]]:
    rows = [("points", f"{summary['points']:,} in {summary['tiles']:,} tiles")]
    rows += [(status.replace("_", " "), f"{count:,}") for status, count in summary["status"].items()]
    rows.append(("points read", f"{number(summary['read_per_point'])} times those of the tiles"))
    rate = summary["points_per_second"]
    rows.append(("time", f"{summary['seconds']:.1f} s" + (f" ({quantity(rate)} points/s)" if rate else "")))
    return rows


@contextlib.contextmanager
def tile_progress(shown: bool) -> Iterator[TileProgress | None]:
    """Show one bar after the other, with rate, time left, and the memory of this process."""
    if not shown:
        yield None
        return
    from rich import progress
    from rich.console import Console
    from rich.text import Text

    from surfsig.cli.console import size_text
    from surfsig.tiles.memory import resident_bytes

    class Rate(progress.ProgressColumn):
        def render(self, task: progress.Task) -> Any:
            unit = "bytes" if task.description in ("reading", "binning") else "points"
            return Text(f"{quantity(task.speed)} {unit}/s" if task.speed else "")

    class Memory(progress.ProgressColumn):
        def render(self, task: progress.Task) -> Any:
            return Text(f"{size_text(resident_bytes())} of memory")

    columns = (
        progress.TextColumn("{task.description}"),
        progress.BarColumn(),
        progress.TaskProgressColumn(),
        Rate(),
        progress.TimeRemainingColumn(),
        Memory(),
    )
    with progress.Progress(*columns, console=Console(stderr=True), transient=True) as bar:
        tasks: dict[str, progress.TaskID] = {}

        def told(what: str, done: int, total: int) -> None:
            if what not in tasks:
                tasks[what] = bar.add_task(what, total=None)
            bar.update(tasks[what], completed=done, total=total)

        yield told
