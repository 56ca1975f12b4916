"""LAS, LAZ and COPC, through laspy: reads all point formats, a COPC file no further than a box asks for."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
from laspy import LasHeader, PackedPointRecord
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.colours import with_colours
from surfsig.files.columns import blocks_of
from surfsig.files.las_counts import LARGEST_HEADER, Held, agreed_count, end_of_points
from surfsig.files.las_header import RECORD_ID, USER_ID, check_coordinates, read_header
from surfsig.files.laz_chunks import (
    PIECE_BYTES,
    Chunk,
    CopcNode,
    copc_chunks,
    copc_nodes,
    decoded,
    laz_chunks,
    one_line_errors,
)
from surfsig.files.options import inside
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# Few enough that a block of records stays in the processor's cache while it is taken apart.
_BLOCK_POINTS = 1 << 13
# No field has this name.
_COORDINATES = ""


def read(
    file: BinaryIO, source: str, progress: Progress, box: NDArray[np.float64] | None = None
) -> PointCloud:
    """Read an open LAS, LAZ or COPC file, all of it or the points in a box.

    The cloud's origin is the offset in the file's header, and its offsets are the stored whole numbers times
    the header's scale, so that `PointCloud.points` is what laspy gives, to the last bit. Every dimension of
    the point format becomes a field, extra bytes included, those with a scale as float64. Colours are uint16
    as stored, or uint8 if none is above 255. Of a file that surfsig wrote, dimensions that it left empty
    are no fields. The coordinate system is that of the records, before or behind the points.

    At its peak it needs the memory of the cloud (50 bytes per point in point format 7, and 6 more if colours
    become uint8), and about 80 MB for the points being decoded; with a box, that of the points in it. Columns
    grow as points are decoded, whatever the header promises.

    Raises
    ------
    FileFormatError
        If the file is cut off or broken.

    Warns
    -----
    UserWarning
        If the header contradicts the file in its number of points, where they start or their extra bytes.
    """
    opened = OpenLas(file, source, progress, box)
    columns = _Columns(opened.header.point_count)
    for block in opened.columns():
        columns.append(block)
    cloud = opened.cloud(columns.finished())
    with one_line_errors(source):
        fields = {
            name: values
            for name, values in cloud.fields.items()
            if name not in opened.defaults or not (values == opened.defaults[name]).all()
        }
        grid = opened.told.get("grid") if box is None else None
        return replace(
            cloud, fields=with_colours(fields, bytes_in_16_bits=True), grid=tuple(grid) if grid else None
        )


class OpenLas:
    """An open LAS, LAZ or COPC file: what its header says, and its points block by block.

    Parameters
    ----------
    file, source, progress, box
        As `read` takes them.

    Attributes
    ----------
    header
        As laspy has it.
    told
        What this library's writer told beside the points.
    defaults
        Of a file that surfsig wrote: the dimensions that are no fields where all points have this value.

    Raises
    ------
    FileFormatError
        If the file is cut off or broken.
    """

    def __init__(
        self, file: BinaryIO, source: str, progress: Progress, box: NDArray[np.float64] | None = None
    ) -> None:
        self._file, self._source, self._progress, self._box = file, source, progress, box
        self._size = os.fstat(file.fileno()).st_size
        self.header, promised, self._coordinate_system = read_header(file, source, self._size)
        self._chunks = _chunks(file, self.header, promised, box, source, self._size)
        if self.header.point_count:
            check_coordinates(self.header, source)
        with one_line_errors(source):
            self.told = _told(self.header)
            names = self.header.point_format.standard_dimension_names
            filled = self.told.get("dimensions", names)
            self.defaults = {name: _default(name) for name in names if name not in filled}

    def columns(self) -> Iterator[dict[str, NDArray[Any]]]:
        """Give the points block by block, the first one without any: offsets (n, 3), and fields by name."""
        header, origin = self.header, np.array(self.header.offsets)
        for block in _blocks(self._file, header, self._chunks, self._source, self._progress):
            offsets = np.column_stack([block[axis] * header.scales[i] for i, axis in enumerate("XYZ")])
            if self._box is not None:
                chosen = inside(offsets, origin, self._box)
                block, offsets = block[chosen], offsets[chosen]
            with one_line_errors(self._source):
                yield {_COORDINATES: offsets, **_fields(block, header)}
        self._progress.advance(self._size)

    def nodes(self) -> list[CopcNode] | None:
        """Give the nodes of the octree with their chunks, which are then all of the file's; else None."""
        everywhere = np.array([[-np.inf] * 3, [np.inf] * 3])
        found = copc_nodes(self._file, self.header, everywhere, self._source, self._size)
        whole = found is not None and [node.chunk for node in found] == self._chunks
        return found if whole else None

    def only(self, chunks: list[Chunk]) -> None:
        """Give no points but those of some chunks from now on."""
        self._chunks = chunks

    def only_beginnings(self, share: int) -> bool:
        """Give of each chunk no more than one part in `share` from now on; tell whether there are chunks."""
        self.only([Chunk(place, size, -(-points // share)) for place, size, points in self._chunks])
        return bool(self._chunks)

    def cloud(self, columns: dict[str, NDArray[Any]]) -> PointCloud:
        """Make a cloud of columns, with all dimensions, and colours as they are stored."""
        fields = dict(columns)
        offsets = fields.pop(_COORDINATES)
        with one_line_errors(self._source):
            return PointCloud(
                offsets,
                np.array(self.header.offsets),
                self.told.get("viewpoint"),
                fields,
                coordinate_system=self._coordinate_system,
            )

    def clouds(self, points: int) -> Iterator[PointCloud]:
        """Give the points in clouds of so many, or a few more, as `cloud` makes them."""
        blocks, count = [], 0
        for block in self.columns():
            blocks.append(block)
            count += len(block[_COORDINATES])
            if count >= points:
                yield self.cloud(_stacked(blocks))
                blocks, count = [{name: values[:0] for name, values in block.items()}], 0
        yield self.cloud(_stacked(blocks))


def _stacked(blocks: list[dict[str, NDArray[Any]]]) -> dict[str, NDArray[Any]]:
    return {name: np.concatenate([block[name] for block in blocks]) for name in blocks[0]}


class _Columns:
    """Columns that grow as their rows come, to at most twice what they hold."""

    def __init__(self, limit: int) -> None:
        self._limit = limit
        self._arrays: dict[str, NDArray[Any]] = {}
        self._count = self._room = 0

    def append(self, columns: Mapping[str, NDArray[Any]]) -> None:
        stop = self._count + len(next(iter(columns.values())))
        if stop > self._room:
            self._resize(max(stop, min(self._limit, 2 * stop)))
        for name, values in columns.items():
            if name not in self._arrays:
                self._arrays[name] = np.empty((self._room, *values.shape[1:]), values.dtype)
            self._arrays[name][self._count : stop] = values
        self._count = stop

    def finished(self) -> dict[str, NDArray[Any]]:
        self._resize(self._count)
        return self._arrays

    def _resize(self, room: int) -> None:
        self._room = room
        for array in self._arrays.values():
            # In place: the system moves large blocks without a copy.
            array.resize((room, *array.shape[1:]), refcheck=False)


def _chunks(
    file: BinaryIO,
    header: LasHeader,
    promised: tuple[int, ...],
    box: NDArray[np.float64] | None,
    source: str,
    size: int,
) -> list[Chunk]:
    """Find the compressed points, with a box perhaps only those near it, and settle how many there are."""
    if header.are_points_compressed:
        near = copc_chunks(file, header, box, source, size) if box is not None and any(promised) else None
        return laz_chunks(file, header, source, size, promised) if near is None else near
    start, point_size = header.offset_to_point_data, header.point_format.size
    file.seek(0)
    length = end_of_points(file.read(LARGEST_HEADER), start, size) - start
    held = Held(length // point_size, length // point_size, whole=length % point_size == 0)
    count = agreed_count(header, promised, held, source, room=(size - start) // point_size)
    if start + count * point_size > size:
        raise FileFormatError(
            f"{source}: cut off: its header promises {count} points of {point_size} bytes, "
            f"the file has {size}"
        )
    header.point_count = count
    return []


def _blocks(
    file: BinaryIO, header: LasHeader, chunks: list[Chunk], source: str, progress: Progress
) -> Iterator[NDArray[Any]]:
    """Give the points block by block, as laspy's records."""
    # A file without points has fields.
    yield np.empty(0, header.point_format.dtype())
    if header.are_points_compressed:
        pieces = decoded(file, header, chunks, source, progress) if chunks else iter(())
    else:
        pieces = _uncompressed(file, header, progress)
    for records in pieces:
        yield from blocks_of(records, _BLOCK_POINTS)


def _uncompressed(file: BinaryIO, header: LasHeader, progress: Progress) -> Iterator[NDArray[Any]]:
    dtype = header.point_format.dtype()
    file.seek(header.offset_to_point_data)
    step = max(1, PIECE_BYTES // dtype.itemsize)
    for first in range(0, header.point_count, step):
        data = file.read(min(step, header.point_count - first) * dtype.itemsize)
        yield np.frombuffer(data, dtype)
        progress.advance(len(data))


def _fields(block: NDArray[Any], header: LasHeader) -> dict[str, NDArray[Any]]:
    kind = header.point_format
    record = PackedPointRecord(block, kind)
    fields = {name: np.asarray(record[name]) for name in kind.standard_dimension_names if name not in "XYZ"}
    for dimension in kind.extra_dimensions:
        values = block[dimension.name]
        if dimension.is_scaled:
            # What a program left unset may have any scale.
            with np.errstate(over="ignore", invalid="ignore"):
                values = values * dimension.scales + dimension.offsets
        fields[dimension.name] = values
    return fields


def _told(header: LasHeader) -> dict[str, Any]:
    """Find what this library's writer told beside the points."""
    for record in header.vlrs:
        if record.user_id == USER_ID and record.record_id == RECORD_ID:
            told: dict[str, Any] = json.loads(record.record_data_bytes())
            return told
    return {}


def _default(name: str) -> int:
    """Give what every point without it has of a dimension of the point format."""
    return 1 if name in ("return_number", "number_of_returns") else 0
