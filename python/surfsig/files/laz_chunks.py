"""The compressed points of LAZ and COPC: where their chunks are, and decoding them with lazrs.

lazrs believes a file: a size that is wrong makes it allocate gigabytes, panic, or end the whole process. So
every size is compared with the file before lazrs sees it.
"""

from __future__ import annotations

import contextlib
import itertools
import struct
from collections.abc import Callable, Iterator, Sequence
from itertools import pairwise
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from laspy import LasHeader
from laspy.copc import CopcInfoVlr
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import laz_child
from surfsig.files.las_counts import Held, agreed_count
from surfsig.progress import Progress

# Points are decoded in pieces of about so many bytes: several chunks, one for each thread.
PIECE_BYTES = 32 << 20
# A chunk larger than a piece is believed up to this ratio; real points reach 20.
MAX_RATIO = 1000

_COMPRESSOR_WITHOUT_CHUNKS = 1
# What lazrs decodes: compressors (by points, by points in chunks, by layers in chunks), and the versions of
# each type of item.
_COMPRESSORS = (1, 2, 3)
_OLD_VERSIONS, _LAYERED_VERSIONS = (1, 2), (3, 4)
_ITEM_VERSIONS = {
    0: ("extra bytes", _OLD_VERSIONS), 6: ("Point10", _OLD_VERSIONS), 7: ("GPSTime11", _OLD_VERSIONS),
    8: ("RGB12", _OLD_VERSIONS), 9: ("Wavepacket13", _OLD_VERSIONS), 10: ("Point14", _LAYERED_VERSIONS),
    11: ("RGB14", _LAYERED_VERSIONS), 12: ("RGBNIR14", _LAYERED_VERSIONS),
    13: ("Wavepacket14", _LAYERED_VERSIONS), 14: ("Byte14", _LAYERED_VERSIONS),
}  # fmt: skip
# Before the chunks stands where their table is.
_PLACE_BYTES = 8
_ITEMS_START, _ITEM_BYTES = 34, 6
_HIERARCHY_ENTRY = np.dtype(
    [("level", "<i4"), ("cell", "<i4", 3), ("offset", "<u8"), ("size", "<i4"), ("points", "<i4")]
)
# Layers that each item of the point formats from 6 on is compressed in; of Byte14 one for each byte.
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}
_BYTE14 = 14


class Chunk(NamedTuple):
    """Points that are compressed together: where they stand in the file, and how many they are."""

    offset: int
    size: int
    points: int


@contextlib.contextmanager
def one_line_errors(source: str) -> Iterator[None]:
    """Turn whatever laspy and lazrs raise for a broken file into a `FileFormatError`."""
    try:
        yield
    except (FileFormatError, OSError, MemoryError):
        raise
    except BaseException as error:
        # A panic in Rust arrives as a class of its own that is no `Exception`, like Ctrl-C.
        if not isinstance(error, Exception) and type(error).__name__ != "PanicException":
            raise
        text = " ".join(str(error).split())[:100]
        raise FileFormatError(f"{source}: the LAS file is cut off or broken ({text})") from None


def laz_chunks(
    file: BinaryIO, header: LasHeader, source: str, size: int, promised: Sequence[int] = ()
) -> list[Chunk]:
    """Find all chunks of a LAZ file of `size` bytes, in its order, and settle `header.point_count`.

    Where they tell how many points they hold, and the header promises another number (it may promise two),
    the chunks are right.

    Raises
    ------
    FileFormatError
        If they do not lie in the file, or do not hold the points that the header promises.

    Warns
    -----
    UserWarning
        If the header promises fewer points than the chunks hold, or two numbers.
    """
    import lazrs

    promised = promised or (header.point_count,)
    start = header.offset_to_point_data
    if not any(promised) and size - start <= _PLACE_BYTES:
        return []
    record = _laszip_record(header, source)
    if record[0] == _COMPRESSOR_WITHOUT_CHUNKS:
        held = Held(1, max(2, *promised))
        header.point_count = agreed_count(header, promised, held, source)
        return [Chunk(start, size - start, header.point_count)]
    table_start = _chunk_table_start(file, start, size, source)
    file.seek(table_start)
    version, count = struct.unpack("<II", file.read(8))
    if version:
        raise FileFormatError(
            f"{source}: the table of its LAZ chunks has version {version}, which cannot be read (only 0 can)"
        )
    # Every chunk begins with a whole point.
    if count > (table_start - start) // header.point_format.size:
        raise FileFormatError(f"{source}: cut off or broken: its table promises {count} chunks")
    file.seek(start)
    with one_line_errors(source):
        vlr = lazrs.LazVlr(record)
        table = lazrs.read_chunk_table(file, vlr) if count else []
    places = [start + _PLACE_BYTES, *(length for _, length in table)]
    places = list(itertools.accumulate(places))
    held = _held(file, header, table, places, table_start, variable=vlr.uses_variable_size_chunks())
    total = agreed_count(header, promised, held, source) if places[-1] <= table_start else max(promised)
    chunks, left = [], total
    for (points, length), place in zip(table, places, strict=False):
        # The last chunk's own number of points is not in a table of equal chunks.
        chunks.append(Chunk(place, length, min(points, left)))
        left -= chunks[-1].points
    if places[-1] > table_start or left:
        raise FileFormatError(
            f"{source}: cut off or broken: its header promises {total} points, its chunks hold "
            f"{total - left} in {places[-1] - start} bytes of {table_start - start}"
        )
    header.point_count = total
    return [chunk for chunk in chunks if chunk.points]


def _held(
    file: BinaryIO,
    header: LasHeader,
    table: Sequence[tuple[int, int]],
    places: Sequence[int],
    table_start: int,
    *,
    variable: bool,
) -> Held:
    """Say how many points chunks hold; of equal ones, the last tells it itself from point format 6 on."""
    total = sum(points for points, _ in table)
    if not table or variable:
        return Held(total, total)
    points, length = table[-1]
    place, point_size = places[-2], header.point_format.size
    if header.point_format.id >= 6 and length >= point_size + 4 and place + length <= table_start:
        file.seek(place + point_size)
        (own,) = struct.unpack("<I", file.read(4))
        if 0 < own <= points:
            return Held(total - points + own, total - points + own)
    return Held(total - points + 1, total)


def copc_chunks(
    file: BinaryIO, header: LasHeader, box: NDArray[np.float64], source: str, size: int
) -> list[Chunk] | None:
    """Find the chunks of the octree's nodes that touch a box, as `copc_nodes` does."""
    nodes = copc_nodes(file, header, box, source, size)
    return None if nodes is None else [node.chunk for node in nodes]


class CopcNode(NamedTuple):
    """A node of the octree that has points: their chunk, and the middle of its cube."""

    chunk: Chunk
    middle: tuple[float, float, float]


@np.errstate(over="ignore", invalid="ignore")
def copc_nodes(
    file: BinaryIO, header: LasHeader, box: NDArray[np.float64], source: str, size: int
) -> list[CopcNode] | None:
    """Find the octree's nodes that touch a box and have points, in the file's order.

    Returns
    -------
    list of CopcNode or None
        None if the file is no COPC file, or its octree's cube does not enclose its points.

    Raises
    ------
    FileFormatError
        If the octree's pages or nodes do not lie in the file, or refer to themselves.
    """
    info = header.vlrs[0] if header.vlrs else None
    if not isinstance(info, CopcInfoVlr):
        return None
    # A coordinate may be rounded out of its node by half a step.
    margin = np.abs(header.scales)
    low = info.center - info.halfsize
    if not ((low - margin <= header.mins) & (low + 2 * info.halfsize + margin >= header.maxs)).all():
        return None
    _laszip_record(header, source)
    pages = [(int(info.hierarchy_root_offset), int(info.hierarchy_root_size))]
    nodes: list[CopcNode] = []
    seen = 0
    while pages:
        offset, length = pages.pop()
        seen += length
        if length < 0 or length % _HIERARCHY_ENTRY.itemsize or offset + length > size or seen > size:
            raise FileFormatError(f"{source}: the COPC octree is cut off or broken: a page of {length} bytes")
        file.seek(offset)
        entries = np.frombuffer(file.read(length), _HIERARCHY_ENTRY)
        entries = entries[entries["level"] >= 0]
        side = 2 * info.halfsize * 2.0 ** -entries["level"][:, None].astype(np.float64)
        corner = low + entries["cell"] * side
        touches = ((corner - margin <= box[1]) & (corner + side + margin >= box[0])).all(axis=1)
        for entry, middle in zip(entries[touches], (corner + side / 2)[touches].tolist(), strict=True):
            place, length, points = (int(entry[name]) for name in ("offset", "size", "points"))
            if points == -1:
                pages.append((place, length))
            elif points:
                nodes.append(CopcNode(Chunk(place, length, points), tuple(middle)))
    nodes.sort()
    chunks = [node.chunk for node in nodes]
    if (
        any(chunk.size < 0 or chunk.points < 0 for chunk in chunks)
        or any(first.offset + first.size > second.offset for first, second in pairwise(chunks))
        or (chunks and chunks[-1].offset + chunks[-1].size > size)
        or sum(chunk.points for chunk in chunks) > header.point_count
    ):
        raise FileFormatError(
            f"{source}: the COPC octree is cut off or broken: its nodes hold more than the file"
        )
    return nodes


def decoded(
    file: BinaryIO, header: LasHeader, chunks: Sequence[Chunk], source: str, progress: Progress
) -> Iterator[NDArray[Any]]:
    """Decode chunks, several at a time and each in a thread of its own; give the points as records.

    Raises
    ------
    FileFormatError
        If a chunk is cut off or broken.
    """
    dtype = header.point_format.dtype()
    record = _laszip_record(header, source)
    layers = _layers(record, header)
    with _decoding(header) as decode:
        for piece in _pieces(chunks, dtype.itemsize):
            parts = []
            for chunk in piece:
                file.seek(chunk.offset)
                parts.append(file.read(chunk.size))
                _check_chunk(parts[-1], chunk, dtype.itemsize, layers, source)
            points = np.zeros(sum(chunk.points for chunk in piece) * dtype.itemsize, np.uint8)
            with one_line_errors(source):
                decode(parts, record, points, [(chunk.points, chunk.size) for chunk in piece])
            yield points.view(dtype)
            progress.advance(sum(chunk.size for chunk in piece))


@contextlib.contextmanager
def _decoding(header: LasHeader) -> Iterator[Callable[..., None]]:
    """Give what decodes chunks: for times that may overflow the stack, in a process of its own."""
    import lazrs

    kind = header.point_format
    if kind.id < 6 and "gps_time" in kind.dimension_names and laz_child.is_possible():
        with laz_child.decoder() as process:
            yield process.decode
    else:
        yield lambda parts, record, points, table: lazrs.decompress_points_with_chunk_table(
            b"".join(parts), record, points, table
        )


def _laszip_record(header: LasHeader, source: str) -> bytes:
    """Give the description of the compression, once it is that of the header's point format."""
    import lazrs

    kind = header.point_format
    with one_line_errors(source):
        found: bytes = header.vlrs[header.vlrs.index("LasZipVlr")].record_data
        _check_compressor(found, source)
        expected = lazrs.LazVlr.new_for_compression(kind.id, kind.num_extra_bytes).record_data()
    # Items are (type, size, version), and versions differ.
    items, usual = (
        [data[start : start + 4] for start in range(_ITEMS_START, len(data), _ITEM_BYTES)]
        for data in (found, expected)
    )
    if items != usual or len(found) != len(expected):
        raise FileFormatError(f"{source}: the LAZ compression is not that of point format {kind.id}")
    _check_versions(found, source)
    return found


def _check_compressor(record: bytes, source: str) -> None:
    compressor, _, major, minor, revision = struct.unpack_from("<HHBBH", record)
    if compressor not in _COMPRESSORS:
        raise FileFormatError(
            f"{source}: its points were compressed by LASzip {major}.{minor}.{revision} with compressor "
            f"{compressor}, which cannot be decoded (only {', '.join(map(str, _COMPRESSORS))} can)"
        )


def _check_versions(record: bytes, source: str) -> None:
    for start in range(_ITEMS_START, len(record), _ITEM_BYTES):
        item, _, version = struct.unpack_from("<HHH", record, start)
        name, known = _ITEM_VERSIONS[item]
        if version not in known:
            raise FileFormatError(
                f"{source}: its points were compressed with version {version} of {name}, which cannot be "
                f"decoded (only {' and '.join(map(str, known))} can)"
            )


def _chunk_table_start(file: BinaryIO, start: int, size: int, source: str) -> int:
    """Find the table: its place stands before the points, or at the file's end if it was streamed."""
    for place in (start, size - 8):
        if place + 8 <= size:
            file.seek(place)
            (found,) = struct.unpack("<q", file.read(8))
            if found > start:
                if found + 8 <= size:
                    return int(found)
                break
    raise FileFormatError(f"{source}: cut off: the table of its chunks is missing")


def _pieces(chunks: Sequence[Chunk], point_size: int) -> Iterator[list[Chunk]]:
    piece: list[Chunk] = []
    size = 0
    for chunk in chunks:
        piece.append(chunk)
        size += chunk.points * point_size
        if size >= PIECE_BYTES:
            yield piece
            piece, size = [], 0
    if piece:
        yield piece


def _layers(record: bytes, header: LasHeader) -> int:
    """Count the layers that a chunk is compressed in: none before point format 6."""
    if header.point_format.id < 6:
        return 0
    items = np.frombuffer(record[_ITEMS_START:], "<u2").reshape(-1, 3)
    return sum(int(size) if item == _BYTE14 else _LAYERS[int(item)] for item, size, _ in items)


def _check_chunk(data: bytes, chunk: Chunk, point_size: int, layers: int, source: str) -> None:
    """Compare what a chunk promises with what it holds."""
    promised = chunk.points * point_size
    whole = len(data) == chunk.size >= point_size and promised <= max(PIECE_BYTES, MAX_RATIO * chunk.size)
    if whole and layers:
        # A whole point, the number of points, each layer's size, the layers.
        before = point_size + 4 + 4 * layers
        sizes = np.frombuffer(data[point_size + 4 : before].ljust(4 * layers, b"\xff"), "<u4")
        whole = before + int(sizes.sum(dtype=np.uint64)) <= len(data)
    if not whole:
        raise FileFormatError(
            f"{source}: cut off or broken: a chunk promises {chunk.points} points in {chunk.size} bytes"
        )
