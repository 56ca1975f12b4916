"""One run over the tiles of a source: what it was asked for, where it stands, and how it goes on."""

from __future__ import annotations

import contextlib
import math
import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from surfsig.errors import SurfsigError
from surfsig.files.atomic import check_target
from surfsig.progress import ProgressCallback
from surfsig.tiles.binning import cut_by_count, store_of
from surfsig.tiles.copc import copc_of
from surfsig.tiles.lock import locked
from surfsig.tiles.manifest import (
    PIECES,
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
from surfsig.tiles.plan import Plan
from surfsig.tiles.run import connected, run_here, run_on_cluster, worker_memory
from surfsig.tiles.source import Source
from surfsig.tiles.store import Store
from surfsig.tiles.task import TilePoints, TileSource

if TYPE_CHECKING:
    from distributed import Client

TileProgress = Callable[[str, int, int], object]
"""Called with what is done ("reading", "binning": bytes; "extracting", "finding surfaces", "measuring",
"writing": points), how much, and of all."""

TileTask = Callable[[int, int | None, TilePoints | None], Record]
"""Works on a tile by some threads, tells how far it has come, and gives the tile's record."""

WORKER_SHARE = 0.6
"""Share of a worker's memory limit that a tile may need: beyond it Dask begins to pause workers."""

MOST_TILES = 1 << 24
"""Tiles that may be asked for."""

_MANIFEST_SECONDS = 10.0
"""How often the manifest is written while tiles are finished; their records say the same."""


class TilesFailedError(SurfsigError):
    """Some tiles could not be read; all others are done, and the manifest names both."""


@dataclass(frozen=True)
class TileJob:
    """What a run is asked for.

    Attributes
    ----------
    source
        The files.
    out
        The folder of parts.
    arguments
        What parts depend on, for the manifest; with the suffix of parts.
    store
        The folder of the store.
    tiles
        At least so many.
    threads
        Of tasks that run here.
    progress
        Who is told.
    point_bytes
        What a point of a tile needs beside its rows.
    needs_numbers
        Whether points' numbers in the input must be known, which an octree does not tell.
    """

    source: Source
    out: Path
    arguments: Mapping[str, Any]
    store: Path
    tiles: int | None
    threads: int | None
    progress: TileProgress | None
    point_bytes: int
    needs_numbers: bool

    @classmethod
    def store_in(cls, out: Path, store: Any) -> Path:
        """Name the folder of the store, by default one in the output."""
        return out / STORE if store is None else Path(store).absolute()

    @contextlib.contextmanager
    def begun(
        self, memory: int | float | str | None, client: Client | str | None, *, restart: bool
    ) -> Iterator[TileRun]:
        """Begin the run, or go on with it, once input and output are known to be as they must be.

        Raises
        ------
        OSError, FileFormatError, InvalidInputError
            If the folder cannot be written to or has other files, or no input can be read.
        """
        if memory is not None:
            memory_bytes(memory)
        fingerprint = self.source.fingerprint()
        check_output(self.out, self.arguments, fingerprint, restart=restart)
        (self.out / RECORDS).mkdir(parents=True, exist_ok=True)
        check_target(self.out / f"tile{self.arguments['suffix']}")
        with locked(self.out), connected(client) as cluster:
            if restart:
                cleared(self.out)
            if memory is None and cluster is not None:
                limit = worker_memory(cluster)
                memory = None if limit is None else WORKER_SHARE * limit
            yield TileRun(self, self._prepared(memory_bytes(memory)), cluster, fingerprint)

    def _prepared(self, budget: int) -> TileSource:
        def fits(store: Store) -> bool:
            rows = max(layout.dtype.itemsize for layout in store.layouts)
            most = max(store.counts, default=0)
            return len(store.plan) >= (self.tiles or 1) and most <= 1.2 * points_per_tile(
                budget, rows, self.point_bytes
            )

        most_points = partial(points_per_tile, budget, point_bytes=self.point_bytes)
        cut = cut_by_count(most_points, self.tiles)
        manifest = read_manifest(self.out)
        is_begun = any((self.out / RECORDS).glob("*.json")) or any((self.out / PIECES).glob("*.npz"))
        if manifest is not None and is_begun:
            # Once parts, or pieces of surfaces, are there, the tiles are what they are.
            plan = Plan.from_json(manifest["plan"])
            cut, fits = (lambda survey: plan), (lambda store: bool(store.plan.root == plan.root))
        if not self.needs_numbers and self.store == self.out / STORE:
            indexed = copc_of(self.source, cut, self.told("reading"))
            if indexed is not None:
                return indexed
        return store_of(
            self.source, self.store, cut, self.told("reading"), self.told("binning"), same_plan=fits
        )

    def told(self, what: str) -> ProgressCallback | None:
        """Give what tells how far something has come."""
        if self.progress is None:
            return None
        progress = self.progress
        return lambda done, total: progress(what, done, total)


@dataclass(frozen=True)
class TileRun:
    """A run that has begun.

    Attributes
    ----------
    job
        What it is asked for.
    source
        What gives the points.
    cluster
        Whose workers work; None for this process.
    fingerprint
        Of the input.
    """

    job: TileJob
    source: TileSource
    cluster: Client | None
    fingerprint: Mapping[str, Any]
    failed: dict[int, Record] = field(default_factory=dict)

    def block(self, halo: float) -> None:
        """Leave out the tiles that a file which cannot be read may have points in or around."""
        for one in reversed(self.source.unreadable):
            for tile in self.source.plan.touching(one.box + np.array([[-halo], [halo]])):
                self.failed[tile] = {"tile": tile, "error": one.error}

    def work(self, task: TileTask, what: str, tiles: Sequence[int]) -> Iterator[tuple[int, Record]]:
        """Run a task on tiles, the others of which are done; give each with its record, as they come."""
        counts, told = self.source.counts, self.job.told(what)
        total = self.source.facts.count
        done = total - sum(counts[tile] for tile in tiles)

        def here(tile: int) -> Record:
            before = done

            def in_tile(points: int, of: int) -> None:
                if told is not None:
                    told(before + counts[tile] * points // max(of, 1), total)

            return task(tile, self.job.threads, in_tile)

        runs = run_here(here, tiles) if self.cluster is None else run_on_cluster(task, tiles, self.cluster)
        with contextlib.closing(runs):
            for tile, record in runs:
                done += counts[tile]
                if told is not None:
                    told(done, total)
                if "error" in record:
                    self.failed[tile] = record
                yield tile, record

    def write_parts(self, task: TileTask, what: str) -> list[Record]:
        """Run the task that writes parts on all tiles that are not done, and keep the manifest.

        Returns
        -------
        list of dict
            The records of all tiles in their order, also of those that failed.
        """
        out, number = self.job.out, len(self.source.plan)
        records = finished_records(out, range(number)) | self.failed
        left = [tile for tile in range(number) if tile not in records]
        written = -math.inf
        with self._manifest_at_end(records):
            for tile, record in self.work(task, what, left):
                records[tile] = record
                if time.monotonic() - written > _MANIFEST_SECONDS:
                    self._write_manifest(records, finished=False)
                    written = time.monotonic()
        remove_unfinished(out)
        return [records[tile] for tile in sorted(records)]

    def check_failures(self) -> None:
        """Raise a `TilesFailedError` if a tile failed."""
        if self.failed:
            first = self.failed[min(self.failed)]
            raise TilesFailedError(
                f"{self.job.out}: {len(self.failed)} of {len(self.source.plan)} tiles could not be read, the "
                f"others are done: tile {first['tile']}: {first['error']}"
            )

    @contextlib.contextmanager
    def _manifest_at_end(self, records: dict[int, Record]) -> Iterator[None]:
        self._write_manifest(records, finished=False)
        finished = False
        try:
            yield
            finished = True
        finally:
            with contextlib.suppress(OSError) if not finished else contextlib.nullcontext():
                self._write_manifest(records, finished=finished)

    def write_manifest(self) -> None:
        """Write the manifest of a run without parts so far."""
        self._write_manifest({}, finished=False)

    def _write_manifest(self, records: Mapping[int, Record], *, finished: bool) -> None:
        source, facts = self.source, self.source.facts
        values = {
            "arguments": self.job.arguments,
            "inputs": self.fingerprint,
            "points": facts.count,
            "bounds": facts.bounds.tolist() if facts.finite else None,
            "unreadable": [{"path": str(one.path), "error": one.error} for one in source.unreadable],
            "plan": source.plan.to_json(),
            "boxes": [[_finite(corner) for corner in box] for box in source.plan.boxes.tolist()],
        }
        tiles = [records[tile] for tile in sorted(records)]
        write_manifest(self.job.out, {**values, "finished": finished, "tiles": tiles})


def _finite(corner: list[float]) -> list[float | None]:
    return [value if math.isfinite(value) else None for value in corner]
