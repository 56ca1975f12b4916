"""The header and the records of LAS files: compared with the file and mended before laspy believes them."""

from __future__ import annotations

import io
import struct
import warnings
from collections.abc import Iterator, Sequence
from typing import BinaryIO, NamedTuple

import numpy as np
from laspy import LasHeader

from surfsig.coordinate_system import CoordinateSystem, GeoKeys
from surfsig.errors import FileFormatError
from surfsig.files.las_counts import LARGEST_HEADER, end_of_points, promised_counts
from surfsig.files.las_extra_bytes import describe_extra_bytes
from surfsig.files.laz_chunks import one_line_errors

USER_ID, RECORD_ID = "surfsig", 1
"""The record with what LAS has no place for."""

PROJECTION = b"LASF_Projection"
WKT, GEO_KEYS, GEO_DOUBLES, GEO_TEXT = 2112, 34735, 34736, 34737
"""The record of the coordinate system as WKT, and the three of GeoTIFF."""

EXTRA_BYTES = (b"LASF_Spec", 4)

# Records that laspy and we look at; of all others laspy would only stumble over the names.
_KEPT = ((b"laszip encoded", 22204), (b"copc", 1), (USER_ID.encode(), RECORD_ID))

_RECORD_HEAD = struct.Struct("<2x16sHH32x")
_LONG_RECORD_HEAD = struct.Struct("<2x16sHQ32x")
_HEADER_BYTES = {0: 227, 1: 227, 2: 227, 3: 235, 4: LARGEST_HEADER}
_SMALLEST_HEADER = 227
# A description of a coordinate system has some kilobytes.
_LONGEST_PROJECTION = 1 << 20
# Coordinates in any unit of length; beyond, they could become infinite or all the same.
_SMALLEST_SCALE, _LARGEST_SCALE, _LARGEST_OFFSET = 1e-30, 1e30, 1e200
_LARGEST_NUMBER = 2.0**31
# Steps of the stored numbers that float64 may round away at the offset: a thousand are no coordinates.
_COARSEST = 1000.0
_LAST_POINT_FORMAT = 10


class _Record(NamedTuple):
    user_id: bytes
    record_id: int
    place: int
    data: bytes


def read_header(
    file: BinaryIO, source: str, size: int
) -> tuple[LasHeader, tuple[int, ...], CoordinateSystem | None]:
    """Read the header and the records of an open file of `size` bytes.

    Returns
    -------
    The header as laspy has it, with the extra dimensions that the records describe; the numbers of points
    that it promises (new and legacy); and the coordinate system, None where there is none.

    Raises
    ------
    FileFormatError
        If it is cut off, or contradicts itself or the file in a way that has no single repair.
    """
    file.seek(0)
    head = file.read(LARGEST_HEADER)
    if len(head) < _SMALLEST_HEADER:
        raise FileFormatError(f"{source}: cut off: a LAS header has {_SMALLEST_HEADER} bytes or more")
    header_size, start, count = struct.unpack_from("<HII", head, 94)
    minor = head[25]
    if header_size < _HEADER_BYTES.get(minor, LARGEST_HEADER):
        raise FileFormatError(
            f"{source}: cut off or broken: Incoherent header size: {header_size} bytes for LAS 1.{minor}"
        )
    # The two highest bits say that the points are compressed.
    kind = head[104] & 0x3F
    if kind > _LAST_POINT_FORMAT:
        raise FileFormatError(
            f"{source}: its header names point format {kind}, of which LAS has none "
            f"(0 to {_LAST_POINT_FORMAT})"
        )
    head = head[:header_size]
    if header_size + count * _RECORD_HEAD.size > size:
        raise FileFormatError(_misplaced(source, count, start, size))
    promised = promised_counts(head)
    records = list(_records(file, header_size, count, size))
    end = records[-1].place + _RECORD_HEAD.size + len(records[-1].data) if records else header_size
    if len(records) < count:
        raise FileFormatError(_misplaced(source, count, start, size))
    start = _start_of_points(head, start, end, promised, source, size)
    file.seek(0)
    content = bytearray(file.read(start))
    struct.pack_into("<I", content, 96, start)
    for record in records:
        if (record.user_id, record.record_id) not in _KEPT:
            content[record.place + 2 : record.place + 18] = bytes(16)
    with one_line_errors(source):
        header = LasHeader.read_from(io.BytesIO(content))
    header.point_count = promised[0]
    described = [record.data for record in records if (record.user_id, record.record_id) == EXTRA_BYTES]
    with one_line_errors(source):
        describe_extra_bytes(header.point_format, described, source)
        # A description may be read and still make no type.
        header.point_format.dtype()
    return header, promised, _coordinate_system(file, header, records, size)


def check_coordinates(header: LasHeader, source: str) -> None:
    """Refuse a scale or an offset with which the coordinates would be nothing, infinite or all the same."""
    scales, offsets = np.abs(header.scales), np.abs(header.offsets)
    if not ((scales < _LARGEST_SCALE).all() and (offsets < _LARGEST_OFFSET).all()):
        raise FileFormatError(f"{source}: the scale or offset in its header makes no sense")
    for axis, scale, offset in zip("xyz", scales, offsets, strict=True):
        if scale < _SMALLEST_SCALE or offset + scale * _LARGEST_NUMBER == offset:
            raise FileFormatError(
                f"{source}: the scale of {axis} in its header is {scale:g}, so that all points would have "
                f"the same {axis}: the header is broken"
            )
        if np.spacing(offset) > _COARSEST * scale:
            raise FileFormatError(
                f"{source}: the offset of {axis} in its header is {offset:g}, beside which steps of "
                f"{scale:g} are lost: the header is broken"
            )


def _misplaced(source: str, count: int, start: int, size: int) -> str:
    return (
        f"{source}: cut off or broken: its header promises {count} records and points from byte "
        f"{start} on, the file has {size} bytes"
    )


def _records(file: BinaryIO, place: int, count: int, size: int) -> Iterator[_Record]:
    """Give the records that follow the header, as far as they lie in the file."""
    for _ in range(count):
        file.seek(place)
        head = file.read(_RECORD_HEAD.size)
        if len(head) < _RECORD_HEAD.size:
            return
        user_id, record_id, length = _RECORD_HEAD.unpack(head)
        if place + _RECORD_HEAD.size + length > size:
            return
        yield _Record(user_id.partition(b"\0")[0], record_id, place, file.read(length))
        place += _RECORD_HEAD.size + length


def _start_of_points(
    head: bytes, start: int, end: int, promised: Sequence[int], source: str, size: int
) -> int:
    """Say where the points start: after the records, if the header's place cannot be and that one fits."""
    if start > size:
        raise FileFormatError(_misplaced(source, struct.unpack_from("<I", head, 100)[0], start, size))
    compressed, (point_size,) = head[104] >= 128, struct.unpack_from("<H", head, 105)
    fits = {place for place in (start, end) if _filled(head, place, point_size, promised, size)}
    if not compressed and fits == {end} and start != end:
        warnings.warn(
            f"{source}: its header says that the points start at byte {start}; they were read from byte "
            f"{end}, where its records end and just that many points follow",
            stacklevel=3,
        )
        return end
    if start < end:
        raise FileFormatError(
            f"{source}: broken: its header says that the points start at byte {start}, its records end at "
            f"byte {end}"
        )
    return start


def _filled(head: bytes, start: int, point_size: int, promised: Sequence[int], size: int) -> bool:
    """Tell whether just the promised points lie between a place and what follows them."""
    length = end_of_points(head, start, size) - start
    return any(count and count * point_size == length for count in promised)


def _coordinate_system(
    file: BinaryIO, header: LasHeader, records: Sequence[_Record], size: int
) -> CoordinateSystem | None:
    """Take the coordinate system from the records: the kind that the header names, or else the other."""
    found: dict[int, bytes] = {}
    for record in (*records, *_records_behind(file, header, size)):
        if record.user_id == PROJECTION:
            found.setdefault(record.record_id, record.data)
    text = found.get(WKT, b"").partition(b"\0")[0].decode("utf-8", errors="replace").strip()
    keys = GeoKeys(found.get(GEO_KEYS, b""), found.get(GEO_DOUBLES, b""), found.get(GEO_TEXT, b""))
    if text and (header.global_encoding.wkt or keys.is_empty):
        system = CoordinateSystem.from_wkt(text)
        if system.name is not None or keys.is_empty:
            return system
    return None if keys.is_empty else CoordinateSystem.from_geo_keys(keys)


def _records_behind(file: BinaryIO, header: LasHeader, size: int) -> Iterator[_Record]:
    """Give the records of coordinate systems that follow the points, as far as they lie in the file."""
    place, count = header.start_of_first_evlr, header.number_of_evlrs
    while count and place + _LONG_RECORD_HEAD.size <= size:
        file.seek(place)
        user_id, record_id, length = _LONG_RECORD_HEAD.unpack(file.read(_LONG_RECORD_HEAD.size))
        user_id = user_id.partition(b"\0")[0]
        if place + _LONG_RECORD_HEAD.size + length > size:
            return
        if user_id == PROJECTION and length <= _LONGEST_PROJECTION:
            yield _Record(user_id, record_id, place, file.read(length))
        place += _LONG_RECORD_HEAD.size + length
        count -= 1
