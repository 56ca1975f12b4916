"""Curvature of clouds of any size: `extract_tiles`."""

from __future__ import annotations

import contextlib
import math
import os
import time
import warnings
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from surfsig import _surfsig
from surfsig.arguments import thread_count, whole_number
from surfsig.curvature import FEW_TOO_COARSE, neighborhood
from surfsig.defaults import AXES, FIT, Axes, Fit
from surfsig.errors import InvalidInputError, SurfsigError
from surfsig.files import formats
from surfsig.files.atomic import check_target
from surfsig.files.paths import Paths
from surfsig.files.read_file import ReadOptions
from surfsig.point_cloud import position_array
from surfsig.progress import ProgressCallback
from surfsig.tiles.binning import cut_by_count, store_of
from surfsig.tiles.copc import copc_of
from surfsig.tiles.dataset import TileDataset
from surfsig.tiles.lock import locked
from surfsig.tiles.manifest import (
    RECORDS,
    STORE,
    Record,
    check_output,
    cleared,
    finished_records,
    read_manifest,
    remove_unfinished,
    write_manifest,
)
from surfsig.tiles.memory import memory_bytes, points_per_tile
from surfsig.tiles.nearest import distances_to_nearest
from surfsig.tiles.plan import Plan
from surfsig.tiles.run import connected, run_here, run_on_cluster, worker_memory
from surfsig.tiles.source import Source
from surfsig.tiles.store import Store
from surfsig.tiles.task import ExtractTask, How, TileSource

if TYPE_CHECKING:
    from distributed import Client

TileProgress = Callable[[str, int, int], object]
"""Called with what is done ("reading", "binning": bytes; "extracting": points), how much, and of all."""

MARGIN = 2e-4
"""By how much a halo is wider than the radius, in radii: twice what the core allows for rounding."""

WORKER_SHARE = 0.6
"""Share of a worker's memory limit that a tile may need: beyond it Dask begins to pause workers."""

_FIRST_HALO = 4.0
"""Halo, in distances to the k-th neighbour, of neighbourhoods that choose their own size; it can grow."""

_MANIFEST_SECONDS = 10.0
"""How often the manifest is written while tiles are finished; their records say the same."""


class TilesFailedError(SurfsigError):
    """Some tiles could not be read; all others are done, and the manifest names both."""


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
    wanted = None if tiles is None else whole_number(tiles, "tiles", 1 << 24)
    job = _Job(
        Source.of(source, ReadOptions(box=box, unit=unit, columns=columns)),
        folder,
        how,
        {**how.arguments(), "suffix": suffix, "numbers": bool(numbers)},
        folder / STORE if store is None else Path(store).absolute(),
        wanted,
        thread_count(threads),
        progress,
    )
    if memory is not None:
        memory_bytes(memory)
    fingerprint = job.source.fingerprint()
    check_output(folder, job.arguments, fingerprint, restart=restart)
    (folder / RECORDS).mkdir(parents=True, exist_ok=True)
    check_target(folder / f"tile{suffix}")
    with locked(folder), connected(client) as cluster:
        if restart:
            cleared(folder)
        return job.run(memory, cluster, fingerprint)


class _Job:
    """One run."""

    def __init__(
        self,
        source: Source,
        out: Path,
        how: How,
        arguments: dict[str, Any],
        store: Path,
        tiles: int | None,
        threads: int | None,
        progress: TileProgress | None,
    ) -> None:
        self.source = source
        self.arguments = arguments
        self._out, self._how, self._store, self._tiles = out, how, store, tiles
        self._threads, self._progress = threads, progress

    def run(
        self, memory: int | float | str | None, cluster: Client | None, fingerprint: dict[str, Any]
    ) -> TileDataset:
        if memory is None and cluster is not None:
            limit = worker_memory(cluster)
            memory = None if limit is None else WORKER_SHARE * limit
        budget = memory_bytes(memory)
        store = self._prepared(budget)
        distances = self._distances(store)
        task = ExtractTask(
            store,
            self._out,
            self.arguments["suffix"],
            self._how,
            self._halo(distances),
            distances,
            self.arguments["numbers"],
        )
        blocked = _blocked(store, task.halo)
        records = finished_records(self._out, range(len(store.plan)))
        records |= {tile: {"tile": tile, "error": error} for tile, error in blocked.items()}
        facts = store.facts
        values = {
            "arguments": self.arguments,
            "inputs": fingerprint,
            "points": facts.count,
            "bounds": facts.bounds.tolist() if facts.finite else None,
            "unreadable": [{"path": str(one.path), "error": one.error} for one in store.unreadable],
            "plan": store.plan.to_json(),
            "boxes": [[_finite(corner) for corner in box] for box in store.plan.boxes.tolist()],
        }
        self._work(task, records, values, cluster)
        remove_unfinished(self._out)
        failed = [record for record in records.values() if "error" in record]
        if failed:
            first = failed[0]
            raise TilesFailedError(
                f"{self._out}: {len(failed)} of {len(store.plan)} tiles could not be read, the others are "
                f"done: tile {first['tile']}: {first['error']}"
            )
        return TileDataset(self._out)

    def _prepared(self, budget: int) -> TileSource:
        def fits(store: Store) -> bool:
            rows = max(layout.dtype.itemsize for layout in store.layouts)
            most = max(store.counts, default=0)
            return len(store.plan) >= (self._tiles or 1) and most <= 1.2 * points_per_tile(budget, rows)

        cut = cut_by_count(partial(points_per_tile, budget), self._tiles)
        manifest = read_manifest(self._out)
        if manifest is not None and any((self._out / RECORDS).glob("*.json")):
            # Once parts are there, the tiles are what they are.
            plan = Plan.from_json(manifest["plan"])
            cut, fits = (lambda survey: plan), (lambda store: bool(store.plan.root == plan.root))
        if not self.arguments["numbers"] and self._store == self._out / STORE:
            indexed = copc_of(self.source, cut, self._told("reading"))
            if indexed is not None:
                return indexed
        return store_of(
            self.source, self._store, cut, self._told("reading"), self._told("binning"), same_plan=fits
        )

    def _told(self, what: str) -> ProgressCallback | None:
        if self._progress is None:
            return None
        progress = self._progress
        return lambda done, total: progress(what, done, total)

    def _distances(self, store: TileSource) -> tuple[float, ...]:
        """Look how far neighbours are, where neighbourhoods choose their own size, as the core does."""
        how, facts = self._how, store.facts
        if how.radius == "auto":
            k = _surfsig.FEWEST_AUTO_POINTS
        elif how.radius is None and how.neighbors is not None:
            k = how.neighbors
        else:
            return ()

        def points_in(box: Any) -> Any:
            cloud = store.read_box(box)
            return np.asarray(cloud.points, np.float64)

        volume = np.prod(np.sort(np.ptp(facts.bounds, axis=0))[1:]) if facts.finite else 0.0
        first = math.sqrt(max(float(volume), 0.0) * k / max(facts.finite, 1)) or 1.0
        return tuple(distances_to_nearest(facts.places, k, first, points_in, facts.bounds))

    def _halo(self, distances: tuple[float, ...]) -> float:
        if distances:
            return _FIRST_HALO * distances[len(distances) // 2]
        assert isinstance(self._how.radius, float)
        return self._how.radius * (1 + MARGIN)

    def _work(
        self,
        task: ExtractTask,
        records: dict[int, Record],
        values: dict[str, Any],
        cluster: Client | None,
    ) -> None:
        """Run the task on all tiles that are not done, and keep the manifest."""
        store = task.source
        total = store.facts.count
        left = [tile for tile in range(len(store.plan)) if tile not in records]
        done = sum(store.counts[tile] for tile in records)
        told = self._told("extracting")

        def here(tile: int) -> Record:
            own = store.counts[tile]
            before = done

            def in_tile(points: int, of: int) -> None:
                if told is not None:
                    told(before + own * points // max(of, 1), total)

            return task(tile, self._threads, in_tile)

        runs = run_here(here, left) if cluster is None else run_on_cluster(task, left, cluster)
        written = -math.inf
        with contextlib.closing(runs), self._manifest_at_end(records, values):
            for tile, record in runs:
                records[tile] = record
                done += store.counts[tile]
                if told is not None:
                    told(done, total)
                if time.monotonic() - written > _MANIFEST_SECONDS:
                    self._write(records, values, finished=False)
                    written = time.monotonic()
        _warn_if_too_coarse(records)

    @contextlib.contextmanager
    def _manifest_at_end(self, records: dict[int, Record], values: dict[str, Any]) -> Any:
        self._write(records, values, finished=False)
        finished = False
        try:
            yield
            finished = True
        finally:
            with contextlib.suppress(OSError) if not finished else contextlib.nullcontext():
                self._write(records, values, finished=finished)

    def _write(self, records: dict[int, Record], values: dict[str, Any], *, finished: bool) -> None:
        tiles = [records[tile] for tile in sorted(records)]
        write_manifest(self._out, {**values, "finished": finished, "tiles": tiles})


def _blocked(store: TileSource, halo: float) -> dict[int, str]:
    """Give the tiles that a file which cannot be read may have points in or around, with its error."""
    return {
        tile: one.error
        for one in reversed(store.unreadable)
        for tile in store.plan.touching(one.box + np.array([[-halo], [halo]]))
    }


def _finite(corner: list[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in corner]


def _warn_if_too_coarse(records: dict[int, Record]) -> None:
    points = sum(record.get("points", 0) for record in records.values())
    coarse = sum(record.get("status", {}).get("too_coarse", 0) for record in records.values())
    if coarse > FEW_TOO_COARSE * points:
        warnings.warn(
            f"coordinates come in steps too coarse for the radius: {coarse} of {points} places have no "
            "curvature (status too_coarse)",
            stacklevel=5,
        )
