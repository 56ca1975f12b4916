"""One task: a tile is read with its halo, extracted, and written as a part."""

from __future__ import annotations

import hashlib
import time
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal, Protocol

import numpy as np
from numpy.typing import NDArray

from surfsig.curvature import WholeCloud, extract_part
from surfsig.defaults import Axes, Fit
from surfsig.errors import FileFormatError
from surfsig.files import write
from surfsig.point_cloud import PointCloud
from surfsig.status import count_statuses
from surfsig.tiles.manifest import Record, write_record
from surfsig.tiles.plan import Plan
from surfsig.tiles.rows import FileHead
from surfsig.tiles.sampling import WholeFacts
from surfsig.tiles.store import TileCloud
from surfsig.tiles.survey import Unreadable

WIDER = 2.0
"""By how much a halo grows that did not hold the neighbourhoods of all points."""

MOSTLY_OWN = 0.9
"""Where a larger part of the points that were read is the tile's own, curvature is extracted at all of them:
choosing some costs 12 to 30 % of the extraction, and the others are dropped."""

TilePoints = Callable[[int, int], object]
"""Called with the points of a tile that are done, and all of them."""


class TileSource(Protocol):
    """What gives the points of tiles: a store, or files with an index."""

    @property
    def plan(self) -> Plan:
        """The tiles."""

    @property
    def counts(self) -> tuple[int, ...]:
        """Points of each tile; of files with an index about so many."""

    @property
    def facts(self) -> WholeFacts:
        """What is known of all points."""

    @property
    def heads(self) -> tuple[FileHead, ...]:
        """What is known of each file."""

    @property
    def unreadable(self) -> tuple[Unreadable, ...]:
        """Files that cannot be read."""

    def read(self, tile: int, halo: float) -> TileCloud:
        """Read a tile and all points within a distance of it."""

    def read_box(self, box: NDArray[np.float64]) -> PointCloud:
        """Read the points in a box (2, 3), to which both corners belong."""


@dataclass(frozen=True)
class How:
    """How curvature is extracted; the names are the keywords of `surfsig.extract`."""

    radius: float | Literal["auto"] | None
    neighbors: int | None
    axes: Axes
    fit: Fit
    viewpoint: tuple[float, float, float] | None
    robust: bool

    def arguments(self) -> dict[str, Any]:
        """Give them for the manifest."""
        viewpoint = None if self.viewpoint is None else list(self.viewpoint)
        return {
            "radius": self.radius,
            "neighbors": self.neighbors,
            "axes": self.axes,
            "fit": self.fit,
            "viewpoint": viewpoint,
            "robust": self.robust,
        }


@dataclass(frozen=True)
class ExtractTask:
    """What makes a tile's part.

    Attributes
    ----------
    source
        What gives the points.
    out
        The folder of parts.
    suffix
        Of the parts, which says their format.
    how
        How curvature is extracted.
    halo
        Distance from the tile within which points are read at first.
    distances
        How far neighbours are in all of the cloud, where neighbourhoods are no balls of one radius.
    numbers
        Whether the parts have a column ``point_number``.
    """

    source: TileSource
    out: Path
    suffix: str
    how: How
    halo: float
    distances: tuple[float, ...]
    numbers: bool

    def __call__(self, tile: int, threads: int | None = None, progress: TilePoints | None = None) -> Record:
        """Work on a tile; give its record, with an error where it cannot be read.

        Raises
        ------
        OSError
            If the part cannot be written.
        """
        clock, processor = time.perf_counter(), time.process_time()
        try:
            points = self.source.read(tile, self.halo)
        except (OSError, FileFormatError) as error:
            return {"tile": tile, "error": str(error)}
        read = len(points.own)
        if not points.own.any():
            record: Record = {"tile": tile, "part": None, "bytes": 0, "points": 0, "read": read}
            write_record(self.out, record)
            return record
        try:
            cloud, columns, status, wider = self._extracted(tile, points, threads, progress)
        except FileFormatError as error:
            return {"tile": tile, "error": str(error)}
        if self.numbers:
            columns["point_number"] = points.numbers[points.own].astype(np.int64)
        del points
        more = {"read": read + wider, "status": status}
        return write_part(
            self.out, tile, self.suffix, cloud, columns, self.how.arguments(), more, (clock, processor)
        )

    def _extracted(
        self, tile: int, points: TileCloud, threads: int | None, progress: TilePoints | None
    ) -> tuple[PointCloud, dict[str, Any], dict[str, int], int]:
        """Give the tile's own points, their columns and statuses, and how many points were read once more."""
        columns, beyond = self._extract(points, np.flatnonzero(points.own), threads, progress)
        own = points.cloud.at(points.own)
        halo, wider = self.halo, 0
        while len(beyond):
            halo *= WIDER
            again = self.source.read(tile, halo)
            wider += len(again.own)
            at = np.flatnonzero(again.own)[beyond]
            more, left = self._extract(again, at, threads, None)
            for name, values in more.items():
                if not columns[name].flags.writeable or not columns[name].flags.owndata:
                    columns[name] = columns[name].copy()
                columns[name][beyond] = values
            beyond = beyond[left]
        return own, columns, count_statuses(columns["status"]), wider

    def _extract(
        self,
        points: TileCloud,
        at: NDArray[np.int64],
        threads: int | None,
        progress: TilePoints | None,
    ) -> tuple[dict[str, NDArray[Any]], NDArray[np.int64]]:
        """Give the columns of some points, and which of these look beyond what there is."""
        facts = self.source.facts
        # Balls of one radius are never larger than they must be, so that those of a few points more cost less
        # than to look for some points only.
        is_for_all = not self.distances and len(at) >= MOSTLY_OWN * len(points.cloud)
        whole = WholeCloud(
            facts.single_precision, facts.lattice, self.distances, facts.largest, points.complete
        )
        found, beyond = extract_part(
            points.cloud,
            whole,
            self.how.radius,
            neighbors=self.how.neighbors,
            axes=self.how.axes,
            fit=self.how.fit,
            viewpoint=self.how.viewpoint,
            robust=self.how.robust,
            at=None if is_for_all else at,
            threads=threads,
            progress=progress,
        )
        columns = found.columns()
        if not is_for_all or len(at) == len(points.cloud):
            return columns, beyond.astype(np.int64)
        is_beyond = np.zeros(len(points.cloud), np.bool_)
        is_beyond[beyond] = True
        some = {name: values.take(at, axis=0) for name, values in columns.items()}
        return some, np.flatnonzero(is_beyond[at])


def write_part(
    out: Path,
    tile: int,
    suffix: str,
    cloud: PointCloud,
    columns: Mapping[str, Any],
    notes: Mapping[str, Any],
    more: Mapping[str, Any],
    began: tuple[float, float],
) -> Record:
    """Write a tile's part, and its record.

    Parameters
    ----------
    out, tile, suffix
        The folder, the tile's number, and the ending of parts.
    cloud, columns, notes
        As for `surfsig.write`.
    more
        What else the record says.
    began
        When the task began, by the clock and in processor time.
    """
    part = out / f"tile_{tile:06d}{suffix}"
    write(part, cloud, columns, notes={name: str(note) for name, note in notes.items() if note is not None})
    record = {
        "tile": tile,
        "part": part.name,
        "bytes": part.stat().st_size,
        "sha256": _hash(part),
        "points": len(cloud),
        **more,
        "seconds": round(time.perf_counter() - began[0], 3),
        "processor_seconds": round(time.process_time() - began[1], 3),
    }
    write_record(out, record)
    return record


def _hash(path: Path) -> str:
    digest = hashlib.sha256()
    with path.open("rb") as file:
        while data := file.read(1 << 20):
            digest.update(data)
    return digest.hexdigest()
