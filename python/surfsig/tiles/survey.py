"""Two looks at all points: where they are, by which tiles are cut; and what they say, while they are binned.

The first look decodes the beginning of each chunk of a LAZ file only, and the second one everything.
"""

from __future__ import annotations

import warnings
from collections.abc import Iterator, Sequence
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

FIRST_SHARE = 8
"""Of each chunk of a LAZ file, the first look decodes one part in so many: enough to see where points are."""

_SAMPLED_POINTS = 256
"""Sample points beyond which those of blocks are thinned to those of the file."""


@dataclass(frozen=True)
class Unreadable:
    """A file that cannot be read: why, and the box (2, 3) of its points by its header."""

    path: Path
    error: str
    box: NDArray[np.float64]


@dataclass
class Survey:
    """What the looks at all points found.

    Attributes
    ----------
    files, layouts
        Those that can be read, and the type of each one's rows.
    heads
        What is known of each file after the second look.
    unreadable
        Those that cannot.
    cells
        Where the points are.
    count, finite
        All points, and those whose coordinates are finite.
    lowest, highest
        (3,) of the finite coordinates, after the second look.
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


def surveyed(
    source: Source,
    progress: ProgressCallback | None = None,
    unreadable: Sequence[Unreadable] = (),
    share: int = 1,
) -> Survey:
    """Look at the points for the first time.

    Parameters
    ----------
    source
        The files.
    progress
        Called with the bytes looked at so far and the size of all files.
    unreadable
        Files that are left out.
    share
        Of LAZ files, one part in so many of each chunk is looked at.

    Raises
    ------
    OSError, FileFormatError
        If no file can be read, or one cannot of which nothing says where its points are.

    Warns
    -----
    UserWarning
        As `surfsig.read`, once for each warning.
    """
    found = Survey(unreadable=list(unreadable))
    sizes = [file.stat().st_size for file in source.files]
    left_out = {one.path for one in unreadable}
    done = 0
    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        for file, size in zip(source.files, sizes, strict=True):
            try:
                if file not in left_out:
                    _look_first(file, source.options, found, share, _after(progress, done, sum(sizes)))
            except (OSError, FileFormatError) as error:
                found.unreadable.append(unreadable_file(file, source, error))
            done += size
            if progress is not None:
                progress(done, sum(sizes))
    if not unreadable:
        _warn_once(caught)
    if not found.files:
        raise FileFormatError(found.unreadable[0].error)
    return found


def unreadable_file(file: Path, source: Source, error: Exception) -> Unreadable:
    """Say where the points of an unreadable file are; raise the error where nobody knows, or it is alone."""
    # laspy takes a while to import.
    from surfsig.files.las_box import las_box

    box, unit = las_box(file), source.options.unit
    if box is None or len(source.files) == 1:
        raise error
    return Unreadable(file, str(error), box if unit is None else box * metres_per(unit))


def _look_first(
    file: Path, options: ReadOptions, found: Survey, share: int, progress: ProgressCallback | None
) -> None:
    cells, layout = CellCounts(), None
    looked = finite = 0
    with open_blocks(file, options, progress, share=share) as opened:
        for cloud in opened.clouds:
            if layout not in (None, Layout.of(cloud)):
                raise FileFormatError(f"{file}: its fields change from one part of the file to the next")
            layout = Layout.of(cloud)
            points = np.asarray(cloud.points, np.float64)
            is_finite = finite_rows(points)
            cells.add(points if is_finite.all() else points[is_finite])
            looked += len(points)
            finite += int(is_finite.sum())
    assert layout is not None
    if opened.count is not None and looked:
        # Of LAZ, whose coordinates are whole numbers and so finite.
        cells.scale(opened.count / looked)
        looked = finite = opened.count
    found.cells.merge(cells)
    found.files.append(file)
    found.layouts.append(layout)
    found.count += looked
    found.finite += finite


class SecondLook:
    """What the second look finds in one file.

    Parameters
    ----------
    finish
        What makes its blocks what `surfsig.read` gives.
    """

    def __init__(self, finish: Finish) -> None:
        self._finish = finish
        self._sample: list[PointCloud] = []
        self._count = 0
        self._lowest, self._highest = np.full(3, np.inf), np.full(3, -np.inf)

    def add(self, cloud: PointCloud, points: NDArray[np.float64]) -> None:
        """Look at a block, and its true coordinates."""
        self._sample.append(self._finish.sample_of(cloud))
        if sum(map(len, self._sample)) > _SAMPLED_POINTS:
            self._sample = [self._finish.sample_of(stacked(self._sample))]
        self._count += len(cloud)
        finite = finite_rows(points)
        points = points if finite.all() else points[finite]
        if len(points):
            # Column by column, as in `finite_rows`.
            columns = points.T
            self._lowest = np.minimum(self._lowest, [column.min() for column in columns])
            self._highest = np.maximum(self._highest, [column.max() for column in columns])

    def take_over(self, found: Survey) -> None:
        """Add what was found to that of the files before."""
        found.lowest = np.minimum(found.lowest, self._lowest)
        found.highest = np.maximum(found.highest, self._highest)
        sample = self._finish.sample_of(stacked(self._sample))
        found.heads.append(FileHead(self._finish, sample, self._count))


class LostFileError(Exception):
    """A file cannot be read that the first look took for whole: the file, and why."""


def blocks_again(
    survey: Survey, options: ReadOptions, progress: ProgressCallback | None = None
) -> Iterator[tuple[int, Finish, PointCloud]]:
    """Read all files: the number of each block's file, what finishes the block, and the block.

    Raises
    ------
    LostFileError
        If one cannot be read.
    """
    sizes = [file.stat().st_size for file in survey.files]
    done = 0
    for number, (file, size) in enumerate(zip(survey.files, sizes, strict=True)):
        try:
            with warnings.catch_warnings():
                # They were given by the first look.
                warnings.simplefilter("ignore")
                with open_blocks(file, options, _after(progress, done, sum(sizes))) as opened:
                    for cloud in opened.clouds:
                        yield number, opened.finish, cloud
        except (OSError, FileFormatError) as error:
            raise LostFileError(file, error) from error
        done += size


def warn_of_differences(survey: Survey) -> None:
    """Warn, as `surfsig.read`, of fields and viewpoints that not all files have."""
    if len(survey.heads) > 1:
        nobody = np.arange(0)
        clouds = [head.finish.cloud(head.sample.at(nobody), head.sample) for head in survey.heads]
        joined(clouds, f"{survey.files[0]} and {len(survey.files) - 1} more")


def _after(progress: ProgressCallback | None, before: int, total: int) -> ProgressCallback | None:
    """Tell how far all files are read, by how far one is."""
    if progress is None:
        return None
    return lambda done, _: progress(before + done, total)


def _warn_once(caught: list[warnings.WarningMessage]) -> None:
    for text, category in dict.fromkeys((str(each.message), each.category) for each in caught):
        warnings.warn(text, category, stacklevel=3)
