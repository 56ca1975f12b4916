"""Reading a file block by block, in bounded memory, with what only the whole file tells of its points.

LAS, LAZ, binary PLY and text come in blocks; any other file in one. What only all points of a file tell
together is the type of its colours, and which dimensions of LAS are empty. A few of its points say the same
as all of them do: those with the lowest and the highest value, and those with a value that is no whole
number, or none.
"""

from __future__ import annotations

import contextlib
import os
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import formats
from surfsig.files.colours import is_colour, with_colours
from surfsig.files.options import box_array, check_unit, cropped, in_metres, metres_per
from surfsig.files.read_file import ReadOptions, read_file
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress, ProgressCallback

BLOCK_POINTS = 1 << 19
"""Points of a block of LAS, or a few more: some 50 MB, which is small beside a tile."""

_OF_LAS = ("LAS", "LAZ")


@dataclass(frozen=True)
class Finish:
    """What makes blocks of a file's points what reading the whole file makes of them.

    Attributes
    ----------
    colours
        Whether colours are still as they are stored.
    bytes_in_16_bits, decimals
        What `with_colours` takes.
    defaults
        Fields that are left out where all points of the file have this value.
    """

    colours: bool = False
    bytes_in_16_bits: bool = False
    decimals: tuple[str, ...] | None = None
    defaults: Mapping[str, int] = field(default_factory=dict)

    def cloud(self, cloud: PointCloud, sample: PointCloud, source: str = "") -> PointCloud:
        """Finish some points of a file.

        Parameters
        ----------
        cloud
            The points.
        sample
            What `sample_of` gives of all points of the file.
        source
            The file's name, for warnings.

        Returns
        -------
        PointCloud
            The points, and the sample behind them.
        """
        fields = {
            name: np.concatenate([values, sample.fields[name]])
            for name, values in cloud.fields.items()
            if not (name in self.defaults and (sample.fields[name] == self.defaults[name]).all())
        }
        if self.colours:
            fields = with_colours(
                fields, bytes_in_16_bits=self.bytes_in_16_bits, decimals=self.decimals, source=source
            )
        offsets = np.concatenate([cloud.offsets, sample.offsets])
        return replace(sample, offsets=offsets, fields=fields, grid=None)

    def sample_of(self, cloud: PointCloud) -> PointCloud:
        """Give a few points that say of their file's fields what all of these points say."""
        if not len(cloud):
            return replace(cloud, grid=None)
        chosen = {0}
        for name, values in cloud.fields.items():
            if name in self.defaults:
                chosen.add(int(np.argmax(values != self.defaults[name])))
            if self.colours and is_colour(name) and values.ndim == 1:
                chosen |= {int(np.argmin(values)), int(np.argmax(values))}
                if values.dtype.kind == "f":
                    # The two above are where values are missing, if any are.
                    filled = np.where(np.isnan(values), values[~np.isnan(values)][:1].sum(), values)
                    chosen |= {int(np.argmin(filled)), int(np.argmax(filled))}
                    chosen.add(int(np.argmax(filled != np.floor(filled))))
        return cloud.at(sorted(chosen))


@dataclass(frozen=True)
class OpenBlocks:
    """A file that is read block by block.

    Attributes
    ----------
    finish
        What finishes the blocks.
    clouds
        The blocks: at least one, in the order of the file's points.
    count
        How many points the file has, where the blocks have only a share of them; else None.
    """

    finish: Finish
    clouds: Iterator[PointCloud]
    count: int | None = None


@contextlib.contextmanager
def open_blocks(
    path: Path, options: ReadOptions, progress: ProgressCallback | None = None, *, share: int = 1
) -> Iterator[OpenBlocks]:
    """Open a file to be read block by block.

    Parameters
    ----------
    path
        The file.
    options
        What `surfsig.read` may be asked for; a box and a unit are applied to each block.
    progress
        Called with the bytes read so far and the size of the file.
    share
        Of LAZ files, one part in so many of each chunk's points is enough.

    Yields
    ------
    OpenBlocks

    Raises
    ------
    OSError, FileFormatError, InvalidInputError
        As `surfsig.read`, when the file is opened or when the iterator comes to the fault.
    """
    with path.open("rb") as file:
        size = os.fstat(file.fileno()).st_size
        kind, _ = formats.of_content(path, file.read(formats.HEAD_BYTES), size)
        file.seek(0)
        found = _opened(file, kind.name, str(path), options, Progress(progress, size), share)
        if found is None:
            yield OpenBlocks(Finish(), iter([read_file(path, options, progress)]))
        else:
            yield replace(found, clouds=_with_options(found.clouds, options, str(path)))


def _opened(
    file: BinaryIO, kind: str, source: str, options: ReadOptions, progress: Progress, share: int
) -> OpenBlocks | None:
    """Open a file whose format comes in blocks; None for any other, and where an option speaks against it."""
    asked = options.of_formats()
    if kind in _OF_LAS and not asked:
        from surfsig.files.las import OpenLas

        box = None if options.box is None else box_array(options.box)
        las = OpenLas(file, source, progress, box)
        finish = Finish(colours=True, bytes_in_16_bits=True, defaults=las.defaults)
        # In a box nobody knows how many points there are before all are looked at.
        is_shared = share > 1 and box is None and las.only_beginnings(share)
        return OpenBlocks(finish, las.clouds(BLOCK_POINTS), las.header.point_count if is_shared else None)
    if kind == "PLY" and not asked:
        from surfsig.files.ply import clouds

        found = clouds(file, source, progress)
        return None if found is None else OpenBlocks(Finish(colours=True), found)
    if kind == "text" and asked.keys() <= {"columns"}:
        from surfsig.files import text

        opened = text.clouds(file, source, progress, unit=options.unit, **asked)
        if opened is None:
            return None
        layout, blocks = opened
        decimals = None if layout.decimals is None else tuple(sorted(layout.decimals))
        return OpenBlocks(Finish(colours=True, decimals=decimals), blocks)
    return None


def _with_options(clouds: Iterator[PointCloud], options: ReadOptions, source: str) -> Iterator[PointCloud]:
    corners = None if options.box is None else box_array(options.box)
    metres = None if options.unit is None else metres_per(options.unit)
    try:
        for number, cloud in enumerate(clouds):
            if number == 0:
                check_unit(cloud.coordinate_system, options.unit, source)
            part = cloud if corners is None else cropped(cloud, corners)
            yield part if metres is None else in_metres(part, metres)
    except MemoryError as error:
        raise FileFormatError(f"{source}: {error or 'too large for the memory'}") from error


def stacked(clouds: Sequence[PointCloud]) -> PointCloud:
    """Join blocks of one file, which have the same fields."""
    if len(clouds) == 1:
        return clouds[0]
    fields: dict[str, NDArray[Any]] = {
        name: np.concatenate([cloud.fields[name] for cloud in clouds]) for name in clouds[0].fields
    }
    return replace(
        clouds[0], offsets=np.concatenate([cloud.offsets for cloud in clouds]), fields=fields, grid=None
    )
