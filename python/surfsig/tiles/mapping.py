"""A caller's own function on every tile: `map_tiles`."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Generic, TypeVar

import numpy as np
from numpy.typing import NDArray

from surfsig.arguments import whole_number
from surfsig.errors import InvalidInputError
from surfsig.files.paths import Paths
from surfsig.point_cloud import PointCloud
from surfsig.tiles.binning import cut_by_count, store_of
from surfsig.tiles.job import MOST_TILES
from surfsig.tiles.memory import memory_bytes, points_per_tile
from surfsig.tiles.run import connected, run_here, run_on_cluster
from surfsig.tiles.source import Source
from surfsig.tiles.store import Store

if TYPE_CHECKING:
    from distributed import Client

Result = TypeVar("Result")


def map_tiles(
    function: Callable[[PointCloud, NDArray[np.bool_]], Result],
    source: Paths,
    store: str | os.PathLike[str],
    *,
    halo: float,
    memory: int | float | str | None = None,
    tiles: int | None = None,
    client: Client | str | None = None,
) -> Iterator[tuple[int, Result]]:
    """Call a function with the points of each tile of files that need not fit into memory.

    Parameters
    ----------
    function
        Called with a tile's points and those around it, in the order of the input, and with a mask (n,) of
        the tile's own. For a cluster it must be one that pickle, or cloudpickle, knows.
    source
        Files, a folder or a pattern, as for `read`.
    store
        A folder for the tiles' points; one that was made of the same files before is used again.
    halo
        Distance from a tile within which points are given with it, in the input's own unit.
    memory, tiles, client
        As for `extract_tiles`. What the function itself needs comes on top.

    Yields
    ------
    int, result
        The number of a tile, and what the function returned for it: in the tiles' order here, on a cluster in
        the order in which they are done. Tiles without points are left out.

    Raises
    ------
    OSError, FileFormatError
        If the input cannot be read, or the store not be written.
    InvalidInputError
        If an argument has no meaning.
    """
    if not (np.isfinite(halo) and halo >= 0):
        raise InvalidInputError(f"halo must be a finite number, 0 or more, not {halo!r:.40}")
    wanted = None if tiles is None else whole_number(tiles, "tiles", MOST_TILES)
    budget = memory_bytes(memory)
    folder = Path(store).absolute()

    def fits(found: Store) -> bool:
        return len(found.plan) >= (wanted or 1)

    with connected(client) as cluster:
        cut = cut_by_count(partial(points_per_tile, budget), wanted)
        found = store_of(Source.of(source), folder, cut, same_plan=fits)
        for one in found.unreadable:
            raise InvalidInputError(one.error)
        task = MapTask(found, function, halo)
        filled = [tile for tile, count in enumerate(found.counts) if count]
        yield from run_here(task, filled) if cluster is None else run_on_cluster(task, filled, cluster)


@dataclass(frozen=True)
class MapTask(Generic[Result]):
    """A function on one tile."""

    source: Store
    function: Callable[[PointCloud, NDArray[np.bool_]], Result]
    halo: float

    def __call__(self, tile: int, threads: int | None = None) -> Result:
        """Read the tile, and call the function."""
        points = self.source.read(tile, self.halo)
        return self.function(points.cloud, points.own)
