"""The first look at all points: how many there are and where, and what their fields are."""

from __future__ import annotations

import warnings
from collections.abc import Iterator
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.blocks import Finish, open_blocks, stacked
from surfsig.files.joined import joined
from surfsig.files.options import metres_per
from surfsig.files.read_file import ReadOptions
from surfsig.point_cloud import PointCloud, finite_rows
from surfsig.progress import ProgressCallback
from surfsig.tiles.cell_counts import CellCounts
from surfsig.tiles.rows import FileHead, Layout
from surfsig.tiles.source import Source

_WITNESSES = 256
"""Witnesses beyond which those of blocks are thinned to those of the file."""


@dataclass(frozen=True)
class Unreadable:
    """A file that cannot be read: why, and the box (2, 3) of its points by its header."""

    path: Path
    error: str
    box: NDArray[np.float64]


@dataclass
class Survey:
    """What the first look at all points found.

    Attributes
    ----------
    files, heads, layouts
        Those that can be read; what is known of each; the type of each one's rows.
    unreadable
        Those that cannot.
    cells
        Where the points are.
    count, finite
        All points, and those whose coordinates are finite.
    lowest, highest
        (3,) of the finite coordinates.
    """

    files: list[Path] = field(default_factory=list)
    heads: list[FileHead] = field(default_factory=list)
    layouts: list[Layout] = field(default_factory=list)
    unreadable: list[Unreadable] = field(default_factory=list)
    cells: CellCounts = field(default_factory=CellCounts)
    count: int = 0
    finite: int = 0
    lowest: NDArray[np.float64] = field(default_factory=lambda: np.full(3, np.inf))
    highest: NDArray[np.float64] = field(default_factory=lambda: np.full(3, -np.inf))

    @property
    def row_bytes(self) -> int:
        """Bytes of the widest row."""
        return max(layout.dtype.itemsize for layout in self.layouts)


def surveyed(source: Source, progress: ProgressCallback | None = None) -> Survey:
    """Look at all points once.

    Parameters
    ----------
    source
        The files.
    progress
        Called with the bytes read so far and the size of all files.

    Raises
    ------
    OSError, FileFormatError
        If no file can be read, or one cannot of which nothing says where its points are.

    Warns
    -----
    UserWarning
        As `surfsig.read`, once for each warning.
    """
    found = Survey()
    sizes = [file.stat().st_size for file in source.files]
    done = 0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for file, size in zip(source.files, sizes, strict=True):
            look = _Look(found)
            try:
                look.at(file, source.options, _after(progress, done, sum(sizes)))
            except (OSError, FileFormatError) as error:
                box = _box_by_header(file, source.options)
                if box is None or len(source.files) == 1:
                    raise
                found.unreadable.append(Unreadable(file, str(error), box))
            else:
                look.take_over(file)
            done += size
            if progress is not None:
                progress(done, sum(sizes))
        if len(found.heads) > 1:
            # For what it warns of: fields that not all files have.
            source_name = f"{found.files[0]} and {len(found.files) - 1} more"
            joined(
                [head.finish.cloud(head.witnesses.at(np.arange(0)), head.witnesses) for head in found.heads],
                source_name,
            )
    _warn_once(caught)
    if not found.files:
        raise FileFormatError(found.unreadable[0].error)
    return found


class _Look:
    """What is found in one file, before it is known that all of it can be read."""

    def __init__(self, found: Survey) -> None:
        self._found = found
        self._blocks: list[tuple[int, int, NDArray[np.float64], NDArray[np.float64]]] = []
        self._cells = CellCounts()
        self._finish, self._layout = Finish(), Layout("<f8", ())
        self._witnesses: list[PointCloud] = []

    def at(self, file: Path, options: ReadOptions, progress: ProgressCallback | None) -> None:
        with open_blocks(file, options, progress) as (self._finish, clouds):
            for cloud in clouds:
                self._block(cloud, file)

    def _block(self, cloud: PointCloud, file: Path) -> None:
        layout = Layout.of(cloud)
        if self._witnesses and layout != self._layout:
            raise FileFormatError(f"{file}: its fields change from one part of the file to the next")
        self._layout = layout
        self._witnesses.append(self._finish.witnesses_of(cloud))
        if sum(map(len, self._witnesses)) > _WITNESSES:
            self._witnesses = [self._finish.witnesses_of(stacked(self._witnesses))]
        points = np.asarray(cloud.points, np.float64)
        finite = finite_rows(points)
        points = points if finite.all() else points[finite]
        if len(points):
            self._cells.add(points)
            self._blocks.append((len(cloud), len(points), *_corners(points)))
        else:
            self._blocks.append((len(cloud), 0, np.full(3, np.inf), np.full(3, -np.inf)))

    def take_over(self, file: Path) -> None:
        found = self._found
        count = 0
        for points, finite, low, high in self._blocks:
            count += points
            found.finite += finite
            found.lowest, found.highest = np.minimum(found.lowest, low), np.maximum(found.highest, high)
        found.count += count
        found.cells.merge(self._cells)
        found.files.append(file)
        witnesses = self._finish.witnesses_of(stacked(self._witnesses))
        found.heads.append(FileHead(self._finish, witnesses, count))
        found.layouts.append(self._layout)


def _box_by_header(file: Path, options: ReadOptions) -> NDArray[np.float64] | None:
    # laspy takes a while to import.
    from surfsig.files.las_box import las_box

    box = las_box(file)
    return box if box is None or options.unit is None else box * metres_per(options.unit)


def _corners(points: NDArray[np.float64]) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    # Column by column, as in `finite_rows`.
    columns = points.T
    return np.array([column.min() for column in columns]), np.array([column.max() for column in columns])


def _after(progress: ProgressCallback | None, before: int, total: int) -> ProgressCallback | None:
    """Tell how far all files are read, by how far one is."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)


def _warn_once(caught: list[warnings.WarningMessage]) -> None:
    for text, category in dict.fromkeys((str(each.message), each.category) for each in caught):
        warnings.warn(text, category, stacklevel=3)


def blocks_again(
    survey: Survey, options: ReadOptions, progress: ProgressCallback | None = None
) -> Iterator[tuple[int, PointCloud]]:
    """Read all files once more: the number of each block's file, and the block."""
    sizes = [file.stat().st_size for file in survey.files]
    done = 0
    for number, (file, size) in enumerate(zip(survey.files, sizes, strict=True)):
        with warnings.catch_warnings():
            # They were given by the first look.
            warnings.simplefilter("ignore")
            with open_blocks(file, options, _after(progress, done, sum(sizes))) as (_, clouds):
                for cloud in clouds:
                    yield number, cloud
        done += size
