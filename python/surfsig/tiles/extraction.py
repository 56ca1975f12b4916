"""Curvature of clouds of any size: `extract_tiles`."""

from __future__ import annotations

import os
import warnings
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Literal

from numpy.typing import ArrayLike

from surfsig import _surfsig
from surfsig.arguments import thread_count, whole_number
from surfsig.curvature import FEW_TOO_COARSE, neighborhood
from surfsig.defaults import AXES, FIT, Axes, Fit
from surfsig.errors import InvalidInputError
from surfsig.files import formats
from surfsig.files.paths import Paths
from surfsig.files.read_file import ReadOptions
from surfsig.point_cloud import position_array
from surfsig.tiles.dataset import TileDataset
from surfsig.tiles.job import MOST_TILES, TileJob, TileProgress
from surfsig.tiles.manifest import Record
from surfsig.tiles.memory import POINT_BYTES
from surfsig.tiles.nearest import distances_in
from surfsig.tiles.source import Source
from surfsig.tiles.task import ExtractTask, How, TileSource

if TYPE_CHECKING:
    from distributed import Client

MARGIN = 2e-4
"""By how much a halo is wider than the radius, in radii: twice what the core allows for rounding."""

_FIRST_HALO = 4.0
"""Halo, in distances to the k-th neighbour, of neighbourhoods that choose their own size; it can grow."""


def extract_tiles(
    source: Paths,
    out: str | os.PathLike[str],
    radius: float | Literal["auto"] | None = None,
    *,
    neighbors: int | None = None,
    axes: Axes = AXES,
    fit: Fit = FIT,
    viewpoint: ArrayLike | None = None,
    robust: bool = False,
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
) -> TileDataset:
    """Extract curvature of the points of files that need not fit into memory, tile by tile.

    The files are binned once into a store of tiles (COPC files are read as they are, by their octree); each
    tile is then read with a halo of its neighbours' points, extracted as `extract` does, and written as a
    part. Every point is written once, by the tile that it belongs to, with the bits that `extract` gives of
    all files together (`read` joins them). A call with the same arguments goes on where another one stopped.

    Parameters
    ----------
    source
        Files, a folder or a pattern, as for `read`. LAS, LAZ, binary PLY and text are read in blocks; of
        others each file must fit into memory.
    out
        The folder of the parts, ``tile_000000.laz`` and so on, of ``manifest.json``, and of what is needed to
        go on.
    radius, neighbors, axes, fit, robust
        As for `extract`.
    viewpoint
        Where the sensor stood, (3,); by default what the files say, as for `extract`.
    memory
        What this process, or each worker of a cluster, may need: bytes, or words such as "4GB". By default
        half of the memory that is free, or six tenths of the smallest worker's limit. Tiles are cut so that
        they fit.
    tiles
        At least so many tiles.
    client
        A Dask client (`distributed.Client`), or the address of a scheduler such as "tcp://host:8786", whose
        workers see the same files under the same paths. By default the tiles are worked on here, one after
        the other, each by all threads. A worker works on one tile at a time, with as many threads as it has.
    suffix
        Of the parts: ".laz", ".las", ".ply", ".parquet", or another that `write` knows.
    numbers
        Whether parts have a column ``point_number``: each point's number in the input, from 0.
    store
        Folder of the store; by default ``store`` in `out`. Another run over the same files may use it again.
    restart
        Whether the parts of a run that was begun with other arguments are removed.
    box, unit, columns
        As for `read`.
    threads
        Number of threads here; all cores by default. The result is the same, bit for bit.
    progress
        Called as `TileProgress` says.

    Returns
    -------
    TileDataset
        The parts, as `open` gives them.

    Raises
    ------
    OSError
        If the output cannot be written; what is finished stays.
    FileFormatError
        If no file can be read.
    InvalidInputError
        If an argument has no meaning, or `out` was begun with others, holds other files, or has another run
        at work.
    TilesFailedError
        At the end, if some tiles could not be read.

    Warns
    -----
    UserWarning
        As `read` and `extract`, once for all tiles.
    """
    size, most = neighborhood(radius, neighbors, axes)
    if fit != "paraboloid" and axes == "sensor":
        raise InvalidInputError("only fit='paraboloid' is fitted in the sensor's axes")
    seen_from = None if viewpoint is None else tuple(position_array(viewpoint, "viewpoint").tolist())
    how = How(size, most, axes, fit, seen_from, bool(robust))
    folder = Path(out).absolute()
    formats.of_output(folder / f"tile{suffix}")
    job = TileJob(
        Source.of(source, ReadOptions(box=box, unit=unit, columns=columns)),
        folder,
        {"task": "curvature", **how.arguments(), "suffix": suffix, "numbers": bool(numbers)},
        TileJob.store_in(folder, store),
        None if tiles is None else whole_number(tiles, "tiles", MOST_TILES),
        thread_count(threads),
        progress,
        POINT_BYTES,
        bool(numbers),
    )
    with job.begun(memory, client, restart=restart) as run:
        distances = _distances(run.source, how)
        halo = _halo(how, distances)
        run.block(halo)
        task = ExtractTask(run.source, folder, suffix, how, halo, distances, bool(numbers))
        records = run.write_parts(task, "extracting")
        _warn_if_too_coarse(records)
        run.check_failures()
        return TileDataset(folder)


def _distances(store: TileSource, how: How) -> tuple[float, ...]:
    """Look how far neighbours are, where neighbourhoods choose their own size, as the core does."""
    if how.radius == "auto":
        return distances_in(store, _surfsig.FEWEST_AUTO_POINTS)
    if how.radius is None and how.neighbors is not None:
        return distances_in(store, how.neighbors)
    return ()


def _halo(how: How, distances: tuple[float, ...]) -> float:
    if distances:
        return _FIRST_HALO * distances[len(distances) // 2]
    assert isinstance(how.radius, float)
    return how.radius * (1 + MARGIN)


def _warn_if_too_coarse(records: Sequence[Record]) -> None:
    points = sum(record.get("points", 0) for record in records)
    coarse = sum(record.get("status", {}).get("too_coarse", 0) for record in records)
    if coarse > FEW_TOO_COARSE * points:
        warnings.warn(
            f"coordinates come in steps too coarse for the radius: {coarse} of {points} places have no "
            "curvature (status too_coarse)",
            stacklevel=3,
        )
