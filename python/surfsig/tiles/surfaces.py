"""Surfaces of clouds of any size: `find_surfaces_tiles`."""

from __future__ import annotations

import os
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike

from surfsig.arguments import thread_count, whole_number
from surfsig.errors import InvalidInputError
from surfsig.files import formats
from surfsig.files.paths import Paths
from surfsig.files.read_file import ReadOptions
from surfsig.shapes.surface import Kind
from surfsig.surfaces.search import AskedSurfaces, asked_surfaces
from surfsig.tiles.job import MOST_TILES, TileJob, TileProgress, TileRun, TileTask
from surfsig.tiles.manifest import (
    PIECES,
    TABLES,
    finished_records,
    is_new,
    remove_pieces,
    remove_records,
)
from surfsig.tiles.memory import SURFACE_POINT_BYTES
from surfsig.tiles.nearest import distances_in
from surfsig.tiles.source import Source
from surfsig.tiles.surface_joining import joined_pieces
from surfsig.tiles.surface_parts import MeasureTask, WriteTask, assembled, write_surfaces
from surfsig.tiles.surface_pieces import FindTask, Found, LinkTask
from surfsig.tiles.surface_result import TileSurfaces, write_tables
from surfsig.tiles.task import TileSource

if TYPE_CHECKING:
    from distributed import Client

HALO_NEIGHBORS = 1000
"""A halo is as wide as it is far to so many nearest points: the core judges noise by as many points around a
place."""

MARGIN = 1.1
"""By how much it is wider, as density differs from place to place."""


def find_surfaces_tiles(
    source: Paths,
    out: str | os.PathLike[str],
    *,
    min_points: int | None = None,
    noise: float | None = None,
    kinds: Sequence[Kind] | None = None,
    halo: float | None = None,
    memory: int | float | str | None = None,
    tiles: int | None = None,
    client: Client | str | None = None,
    suffix: str = ".laz",
    numbers: bool = False,
    store: str | os.PathLike[str] | None = None,
    restart: bool = False,
    box: ArrayLike | None = None,
    unit: str | None = None,
    columns: str | None = None,
    threads: int | None = None,
    progress: TileProgress | None = None,
) -> TileSurfaces:
    """Find the surfaces of files that need not fit into memory, tile by tile.

    Each tile finds its own surfaces, as `find_surfaces` does, with a halo of its neighbours' points. Those of
    neighbouring tiles are one where one fit explains them as well as two, by the test that joins pieces
    within a cloud; so a wall or a pipe over many tiles is one surface. It is then fitted to all its points:
    sums over the points of each tile, which add, tell its least squares and its errors. The result does not
    depend on the number of workers; where tiles are cut elsewhere, points at surfaces' borders may have
    another surface. A call with the same arguments goes on where another one stopped.

    Parameters
    ----------
    source
        Files, a folder or a pattern, as for `read`.
    out
        The folder of the parts, ``tile_000000.laz`` and so on, of the tables ``surfaces.json``,
        ``surfaces.csv`` and, where PyArrow is installed, ``surfaces.parquet``, of ``manifest.json``, and of
        what is needed to go on.
    min_points, noise, kinds
        As for `find_surfaces`; by default the fewest points follow from those of each tile.
    halo
        Distance from a tile within which its neighbours' points are given with it, in the input's own unit;
        by default as far as it is to the 1,000th neighbour.
    memory, tiles, client, suffix, numbers, store, restart, box, unit, columns, threads
        As for `extract_tiles`.
    progress
        Called as `TileProgress` says.

    Returns
    -------
    TileSurfaces
        The surfaces, and the parts. These have the fields of the input, and the columns that
        `Surfaces.columns` names.

    Raises
    ------
    OSError, FileFormatError, InvalidInputError
        As `extract_tiles`.
    TilesFailedError
        At the end, if some tiles could not be read; parts and tables have what the others have.
    """
    asked = asked_surfaces(min_points, noise, kinds)
    if halo is not None and not (np.isfinite(halo) and halo > 0):
        raise InvalidInputError(f"halo must be a finite number above 0, not {halo!r:.40}")
    folder = Path(out).absolute()
    formats.of_output(folder / f"tile{suffix}")
    arguments = {
        "task": "surfaces",
        "min_points": asked.min_points,
        "noise": asked.noise,
        "kinds": list(asked.kinds),
        "halo": halo,
        "suffix": suffix,
        "numbers": bool(numbers),
    }
    job = TileJob(
        Source.of(source, ReadOptions(box=box, unit=unit, columns=columns)),
        folder,
        arguments,
        TileJob.store_in(folder, store),
        None if tiles is None else whole_number(tiles, "tiles", MOST_TILES),
        thread_count(threads),
        progress,
        SURFACE_POINT_BYTES,
        # By their numbers points are known again in a neighbour's halo.
        needs_numbers=True,
    )
    with job.begun(memory, client, restart=restart) as run:
        _work(run, asked, halo)
        run.check_failures()
        return TileSurfaces(folder)


def _work(run: TileRun, asked: AskedSurfaces, halo: float | None) -> None:
    """Find, compare, join, measure and write; what has been written before is not done again."""
    out, source = run.job.out, run.source
    everything = range(len(source.plan))
    run.block(0.0)
    is_written = (out / TABLES[0]).exists() and len(finished_records(out, everything)) == len(everything)
    if is_written and not run.failed:
        return
    (out / PIECES).mkdir(exist_ok=True)
    run.write_manifest()
    facts = source.facts
    origin = facts.bounds.mean(axis=0) if facts.finite else np.zeros(3)
    place = (float(origin[0]), float(origin[1]), float(origin[2]))
    reach = _halo(source, halo)
    _stage(run, FindTask(source, out, asked, reach, place), "finding surfaces", "found")
    there = [tile for tile in everything if tile not in run.failed]
    if is_new(out, "there", there):
        # Of a tile that could not be read before its neighbours know nothing.
        remove_pieces(out, "links", "sums")
    _stage(run, LinkTask(source, out, reach), "comparing", "links")
    joined_pieces(out, source.plan, there).write(out)
    _stage(run, MeasureTask(source, out, place), "measuring", "sums")
    there = [tile for tile in everything if tile not in run.failed]
    surfaces, numbers = assembled(out, there, origin)
    write_surfaces(out, surfaces, numbers)
    if is_new(out, "surfaces", surfaces):
        # The parts, if there are any, have other numbers.
        remove_records(out)
    task = WriteTask(source, out, run.job.arguments["suffix"], run.job.arguments["numbers"])
    records = run.write_parts(task, "writing")
    write_tables(out, surfaces, sum(record.get("points", 0) for record in records))
    if not run.failed:
        remove_pieces(out)


def _halo(source: TileSource, halo: float | None) -> float:
    if halo is not None:
        return float(halo)
    distances = distances_in(source, min(HALO_NEIGHBORS, max(source.facts.finite, 1)))
    return MARGIN * distances[len(distances) // 2] if distances else 0.0


def _stage(run: TileRun, task: TileTask, what: str, stage: str) -> None:
    """Run a task on the tiles of which the stage has written nothing."""
    out = run.job.out
    left = [
        tile
        for tile in range(len(run.source.plan))
        if tile not in run.failed and not Found.of(out, tile, stage).path.exists()
    ]
    for _ in run.work(task, what, left):
        pass
