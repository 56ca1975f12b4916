"""Binning files into a store: two looks at all points, one after the other, in bounded memory."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.atomic import naming
from surfsig.progress import ProgressCallback
from surfsig.tiles.lock import locked
from surfsig.tiles.memory import release_memory
from surfsig.tiles.plan import Plan, planned
from surfsig.tiles.rows import Layout
from surfsig.tiles.sampling import Sampling
from surfsig.tiles.source import Source
from surfsig.tiles.store import (
    Blocks,
    Store,
    coordinates,
    read_index,
    removed,
    rows_from,
    rows_path,
)
from surfsig.tiles.survey import (
    FIRST_SHARE,
    LostFileError,
    SecondLook,
    Survey,
    Unreadable,
    blocks_again,
    surveyed,
    unreadable_file,
    warn_of_differences,
)

BLOCK_ROWS = 1 << 15
"""Rows of a block that is read as one: some 2 MB, and a halo reads little that it does not need."""

MOST_EXCESS = 1.15
"""Points of the largest tile over those that the first look expected, from which on all points are looked at
first: memory is reckoned by them."""

BUFFER_BYTES = 128 << 20
"""Rows that wait in memory for their tiles' files; with fewer tiles, each gets larger pieces at a time."""

Cut = Callable[[Survey], Plan]
"""Makes the plan of the tiles once it is known where points are."""


def cut_by_count(most_points: Callable[[int], int], tiles: int | None) -> Cut:
    """Cut tiles of so many points, as the bytes of a row allow, and at least so many tiles."""
    return lambda survey: planned(survey.cells, most_points(survey.row_bytes), tiles)


def store_of(
    source: Source,
    folder: Path,
    cut: Cut,
    reading: ProgressCallback | None = None,
    binning: ProgressCallback | None = None,
    *,
    same_plan: Callable[[Store], bool] = lambda store: True,
) -> Store:
    """Open the store of these files, or make it.

    Parameters
    ----------
    source
        The files.
    folder
        Where the store is or will be.
    cut
        Makes the plan.
    reading, binning
        Called with the bytes read so far and the size of all files, in the first look and the second.
    same_plan
        Whether a store of the same files can be used as it is.

    Raises
    ------
    OSError, FileFormatError
        If files cannot be read, or the store cannot be written.
    """
    fingerprint = source.fingerprint()
    values = read_index(folder)
    if values is not None and values["source"] == fingerprint:
        store = Store.open(folder)
        if store.is_whole() and same_plan(store):
            return store
    folder.mkdir(parents=True, exist_ok=True)
    with locked(folder):
        store = _made(source, folder, cut, reading, binning)
        if source.fingerprint() != fingerprint:
            raise FileFormatError(f"{folder}: the input files changed while they were read")
        store.write_index(fingerprint)
    return store


def _made(
    source: Source,
    folder: Path,
    cut: Cut,
    reading: ProgressCallback | None,
    binning: ProgressCallback | None,
) -> Store:
    unreadable: list[Unreadable] = []
    share = FIRST_SHARE
    while True:
        removed(folder)
        survey = surveyed(source, reading, unreadable, share)
        plan = cut(survey)
        release_memory()
        try:
            store = _binned(survey, source, folder, plan, binning)
        except LostFileError as lost:
            # Its points that were binned must not stay: all is begun anew without it.
            file, error = lost.args
            unreadable.append(unreadable_file(file, source, error))
            continue
        expected = np.bincount(plan.owners(survey.cells.places()), survey.cells.counts, len(plan))
        if share == 1 or max(store.counts) <= MOST_EXCESS * max(expected.max(), BLOCK_ROWS):
            return store
        # What the first look saw was not like the rest.
        share = 1


def _binned(
    survey: Survey, source: Source, folder: Path, plan: Plan, progress: ProgressCallback | None
) -> Store:
    layouts = list(dict.fromkeys(survey.layouts))
    layout_of_file = [layouts.index(layout) for layout in survey.layouts]
    bins = _Bins(folder, layouts)
    sampling = Sampling(survey.count, survey.finite)
    finite = 0
    counts = np.zeros(len(plan), np.int64)
    number = 0
    looks: list[SecondLook] = []
    for file, finish, cloud in blocks_again(survey, source.options, progress):
        if file == len(looks):
            looks.append(SecondLook(finish))
        layout = layout_of_file[file]
        if Layout.of(cloud) != layouts[layout]:
            raise FileFormatError(f"{survey.files[file]}: changed while it was read")
        points = np.asarray(cloud.points, np.float64)
        looks[file].add(cloud, points)
        finite += sampling.take(file, cloud, points, number, finite)
        owners = plan.owners(points)
        rows = layouts[layout].rows(cloud, np.arange(number, number + len(cloud), dtype=np.uint64), file)
        number += len(cloud)
        # Whole numbers of 16 bits are sorted without comparing them.
        order = np.argsort(owners.astype(np.uint16) if len(plan) <= 1 << 16 else owners, kind="stable")
        sizes = np.bincount(owners, minlength=len(plan))
        counts += sizes
        ends = np.cumsum(sizes)
        for tile in np.flatnonzero(sizes):
            # NumPy's `take` copies whole rows: indexing them by an array takes ten times as long.
            bins.add(int(tile), layout, rows.take(order[ends[tile] - sizes[tile] : ends[tile]]))
    if number != survey.count:
        raise FileFormatError(f"{survey.files[0].parent}: the input files changed while they were read")
    bins.flush()
    for look in looks:
        look.take_over(survey)
    warn_of_differences(survey)
    origins = np.array([head.sample.origin for head in survey.heads])
    for bin_number in range(len(plan)):
        for layout, kind in enumerate(layouts):
            _sort(rows_path(folder, bin_number, layout), kind, origins)
            release_memory()
    return Store(
        folder,
        plan,
        tuple(counts.tolist()),
        tuple(survey.heads),
        tuple(layouts),
        tuple(layout_of_file),
        tuple(survey.unreadable),
        sampling.facts(survey),
    )


class _Bins:
    """Rows on the way to their tiles' files."""

    def __init__(self, folder: Path, layouts: list[Layout]) -> None:
        self._folder = folder
        self._layouts = layouts
        self._waiting: dict[tuple[int, int], list[NDArray[Any]]] = {}
        self._bytes = 0

    def add(self, tile: int, layout: int, rows: NDArray[Any]) -> None:
        self._waiting.setdefault((tile, layout), []).append(rows)
        self._bytes += rows.nbytes
        if self._bytes > BUFFER_BYTES:
            self.flush()

    def flush(self) -> None:
        for (tile, layout), parts in sorted(self._waiting.items()):
            path = rows_path(self._folder, tile, layout)
            with naming(path), path.open("ab") as file:
                for rows in parts:
                    file.write(rows.data)
        self._waiting, self._bytes = {}, 0
        release_memory()


def _sort(path: Path, layout: Layout, origins: NDArray[np.float64]) -> None:
    """Sort a tile's rows into blocks of neighbouring points, each in the order of the input."""
    if not path.exists():
        return
    dtype = layout.dtype
    rows = rows_from(path, dtype, 0, path.stat().st_size // dtype.itemsize)
    columns = np.ascontiguousarray(coordinates(rows, origins).T)
    starts, lowest, highest = [0], [], []
    with naming(path), path.open("r+b") as file:
        for block in _blocks(columns):
            file.write(rows.take(block).data)
            starts.append(starts[-1] + len(block))
            low, high = zip(*(_limits(column[block]) for column in columns), strict=True)
            lowest.append(low)
            highest.append(high)
    Blocks(np.array(starts), np.array(lowest), np.array(highest)).write(path)


def _limits(values: NDArray[np.float64]) -> tuple[float, float]:
    """Give the lowest and the highest number; of none, numbers that are none."""
    low, high = values.min(), values.max()
    if np.isnan(low):
        low, high = np.fmin.reduce(values), np.fmax.reduce(values)
    return float(low), float(high)


def _blocks(columns: NDArray[np.float64]) -> Iterator[NDArray[np.int64]]:
    """Cut points (3, n) into blocks of neighbours; numbers ascend in each.

    First by a grid, whose cells are sorted without comparing points; cells with too many points are cut in
    two along their longest side until few are left.
    """
    cells = _cells(columns)
    order = np.argsort(cells, kind="stable")
    ends = np.cumsum(np.bincount(cells))
    for start, end in zip([0, *ends[:-1].tolist()], ends.tolist(), strict=True):
        left = [order[start:end]] if start < end else []
        while left:
            numbers = left.pop()
            below = _below(columns[:, numbers]) if len(numbers) > BLOCK_ROWS else None
            if below is None:
                yield numbers
            else:
                left += [numbers[~below], numbers[below]]


def _cells(columns: NDArray[np.float64]) -> NDArray[np.uint16]:
    """Give each point its cell of a grid along the two longest sides, of half a block of points each."""
    limits = [_limits(column) for column in columns]
    with np.errstate(invalid="ignore"):
        lengths = np.nan_to_num([high - low for low, high in limits], nan=0.0, posinf=0.0)
    side = int(np.clip(np.sqrt(2 * columns.shape[1] / BLOCK_ROWS), 1, 255))
    cells = np.zeros(columns.shape[1], np.uint16)
    for axis in np.argsort(lengths)[1:]:
        cells *= np.uint16(side)
        if lengths[axis] > 0:
            with np.errstate(invalid="ignore"):
                place = (columns[axis] - limits[axis][0]) * (side / lengths[axis])
                cells += np.clip(np.nan_to_num(place), 0, side - 1).astype(np.uint16)
    return cells


def _below(columns: NDArray[np.float64]) -> NDArray[np.bool_] | None:
    """Cut points (3, n) in two along their longest side; None where all are in one place."""
    with np.errstate(invalid="ignore"):
        lengths = np.nan_to_num([high - low for low, high in map(_limits, columns)], nan=0.0, posinf=0.0)
    along = columns[int(np.argmax(lengths))]
    below: NDArray[np.bool_] = along < np.partition(along, len(along) // 2)[len(along) // 2]
    return below if below.any() else None
