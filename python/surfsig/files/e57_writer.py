"""Writing E57: as many scans as the cloud has viewpoints, each with a pose that moves it there."""

from __future__ import annotations

import json
import uuid
import warnings
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.errors import InvalidInputError
from surfsig.files.columns import Chunks, aligned_blocks, column_names, exact_float32, scalar_columns
from surfsig.files.e57_names import EXTENSIONS, record_names
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

_BLOCK_ROWS = 1 << 16
_AXES = ("cartesianX", "cartesianY", "cartesianZ")
_INVALID = 2
# What other programs expect of flags and colours, whatever type they have here.
_LIMITS = (("is", 1), ("color", 255))
_LARGEST = np.iinfo(np.int64).max


class _Record(NamedTuple):
    """A value as the file declares it: name, type ("f4", "f8" or "i8"), limits of whole numbers."""

    name: str
    kind: str
    lowest: int = 0
    highest: int = 0


class _Scan(NamedTuple):
    """Points of one scan: which, and where its scanner stood."""

    rows: slice
    viewpoint: NDArray[np.float64] | None


def write(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write points with every column: under the standard's name if it has one, else as an extension.

    Coordinates are stored relative to the viewpoint, which becomes the scan's pose; as single where this
    changes none of them. Points that are not finite are marked invalid. A cloud with viewpoints whose points
    come scan by scan becomes as many scans. An (n, k) column becomes NAME_0, NAME_1, ...

    Raises
    ------
    InvalidInputError
        If there are too many columns, or whole numbers beyond 2^63 - 1.

    Warns
    -----
    UserWarning
        If the points of several scans are mixed: their viewpoints are then left out.
    """
    scans = _scans(cloud)
    values = dict(columns)
    if len(scans) > 1 and values.get("scan") is cloud.fields["scan"]:
        del values["scan"]
    if cloud.grid is not None and not {"row_index", "column_index"} & set(values):
        places = np.arange(len(cloud), dtype=np.int64)
        values = {"row_index": places // cloud.grid[1], "column_index": places % cloud.grid[1], **values}
    scalars = scalar_columns(values)
    wide = {} if chunks is None else dict.fromkeys(
        column_names(chunks.name, chunks.width), np.empty(0, chunks.dtype)
    )  # fmt: skip
    names = record_names({**scalars, **wide})
    kind = "f4" if all(_exact_float32(cloud, scan) for scan in scans) else "f8"
    records = [_Record(axis, kind) for axis in _AXES]
    finite = None if cloud.finite.all() else cloud.finite
    if finite is not None:
        records.append(_Record("cartesianInvalidState", "i8", 0, _INVALID))
    records += [_record(names[field], column) for field, column in {**scalars, **wide}.items()]
    kinds = [record.kind for record in records]
    pieces = _cut(aligned_blocks(chunks, len(cloud)), [scan.rows.stop for scan in scans])

    def blocks(scan: _Scan) -> Iterator[list[NDArray[Any]]]:
        done = scan.rows.start
        while done < scan.rows.stop:
            rows, block = next(pieces)
            arrays = [*_relative(cloud, rows, scan.viewpoint).T]
            if finite is not None:
                arrays.append(np.where(finite[rows], 0, _INVALID))
            arrays += [column[rows] for column in scalars.values()]
            arrays += [] if block is None else [*block.T]
            yield [np.ascontiguousarray(a, dtype=kind) for a, kind in zip(arrays, kinds, strict=True)]
            done = rows.stop
            progress.advance(rows.stop - rows.start)

    def described() -> Iterator[tuple[str, list[float] | None, Iterator[list[NDArray[Any]]]]]:
        for scan in scans:
            place = None if scan.viewpoint is None else scan.viewpoint.tolist()
            yield f"{{{uuid.uuid4()}}}", place, blocks(scan)
        # Whoever gives more rows than there are points is told when the blocks are asked for the next.
        next(pieces, None)

    _surfsig.write_e57(
        file,
        guid=f"{{{uuid.uuid4()}}}",
        # A ">" might end the section of the XML that holds the text.
        description=json.dumps(dict(notes)).replace(">", "\\u003e") if notes else None,
        extensions=list(EXTENSIONS),
        records=records,
        scans=described(),
    )


def _scans(cloud: PointCloud) -> list[_Scan]:
    everything = slice(0, len(cloud))
    if cloud.viewpoints is None:
        return [_Scan(everything, cloud.viewpoint)]
    numbers = cloud.fields["scan"]
    if (numbers[1:] < numbers[:-1]).any():
        warnings.warn("viewpoints are left out: the points of the scans are mixed", stacklevel=4)
        return [_Scan(everything, None)]
    ends = np.searchsorted(numbers, np.arange(len(cloud.viewpoints)), side="right").tolist()
    starts = [0, *ends[:-1]]
    return [
        _Scan(slice(start, end), viewpoint)
        for start, end, viewpoint in zip(starts, ends, cloud.viewpoints, strict=True)
    ]


def _relative(cloud: PointCloud, rows: slice, viewpoint: NDArray[np.float64] | None) -> NDArray[Any]:
    """Give (m, 3) points as seen from a viewpoint."""
    shift = cloud.origin if viewpoint is None else cloud.origin - viewpoint
    return shift + cloud.offsets[rows] if shift.any() else cloud.offsets[rows]


def _exact_float32(cloud: PointCloud, scan: _Scan) -> bool:
    start, end = scan.rows.start, scan.rows.stop
    parts = (slice(at, min(at + _BLOCK_ROWS, end)) for at in range(start, end, _BLOCK_ROWS))
    return all(exact_float32(_relative(cloud, rows, scan.viewpoint)) for rows in parts)


def _record(name: str, values: NDArray[Any]) -> _Record:
    if values.dtype.kind == "f":
        return _Record(name, "f4" if values.dtype.itemsize <= 4 else "f8")
    if values.dtype.kind == "b":
        return _Record(name, "i8", 0, 1)
    for prefix, highest in _LIMITS:
        if name.startswith(prefix) and len(values) and values.min() >= 0 and values.max() <= highest:
            return _Record(name, "i8", 0, highest)
    limits = np.iinfo(values.dtype)
    if limits.max > _LARGEST and len(values) and int(values.max()) > _LARGEST:
        raise InvalidInputError(f"'{name}' has whole numbers above {_LARGEST}, for which E57 has no type")
    return _Record(name, "i8", limits.min, min(limits.max, _LARGEST))


def _cut(
    blocks: Iterable[tuple[slice, NDArray[Any] | None]], ends: Sequence[int]
) -> Iterator[tuple[slice, NDArray[Any] | None]]:
    """Cut blocks of rows where a scan ends."""
    for rows, block in blocks:
        start = rows.start
        for end in sorted({end for end in ends if start < end < rows.stop} | {rows.stop}):
            part = None if block is None else block[start - rows.start : end - rows.start]
            yield slice(start, end), part
            start = end
