"""LAS, LAZ and COPC, through laspy: reads all point formats, a COPC file no further than a box asks for."""

from __future__ import annotations

import json
import os
from collections.abc import Iterator, Mapping
from typing import Any, BinaryIO

import numpy as np
from laspy import LasHeader, PackedPointRecord
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.colours import with_colours
from surfsig.files.columns import blocks_of
from surfsig.files.las_counts import LARGEST_HEADER, Held, agreed_count, end_of_points
from surfsig.files.las_header import RECORD_ID, USER_ID, check_coordinates, read_header
from surfsig.files.laz_chunks import PIECE_BYTES, Chunk, copc_chunks, decoded, laz_chunks, one_line_errors
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
    size = os.fstat(file.fileno()).st_size
    header, promised, coordinate_system = read_header(file, source, size)
    chunks = _chunks(file, header, promised, box, source, size)
    if header.point_count:
        check_coordinates(header, source)
    origin = np.array(header.offsets)
    columns = _Columns(header.point_count)
    for block in _blocks(file, header, chunks, source, progress):
        offsets = np.column_stack([block[axis] * header.scales[i] for i, axis in enumerate("XYZ")])
        if box is not None:
            chosen = inside(offsets, origin, box)
            block, offsets = block[chosen], offsets[chosen]
        with one_line_errors(source):
            columns.append({_COORDINATES: offsets, **_fields(block, header)})
    progress.advance(size)
    fields = columns.finished()
    offsets = fields.pop(_COORDINATES)
    with one_line_errors(source):
        told = _told(header)
        if "dimensions" in told:
            fields = {
                name: values
                for name, values in fields.items()
                if name in told["dimensions"] or not _is_empty_dimension(name, values, header)
            }
        grid = told.get("grid") if box is None else None
        return PointCloud(
            offsets,
            origin,
            told.get("viewpoint"),
            with_colours(fields, bytes_in_16_bits=True),
            tuple(grid) if grid else None,
            coordinate_system=coordinate_system,
        )


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


def _is_empty_dimension(name: str, values: NDArray[Any], header: LasHeader) -> bool:
    """Tell whether a dimension of the point format holds only what every point without it has."""
    usual = 1 if name in ("return_number", "number_of_returns") else 0
    return name in header.point_format.standard_dimension_names and bool((values == usual).all())
