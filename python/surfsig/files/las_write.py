"""Writing LAS and LAZ, through laspy: version 1.4, point formats 6 to 8, further columns as extra bytes."""

from __future__ import annotations

import datetime
import json
import warnings
from collections.abc import Mapping
from typing import Any, BinaryIO

import laspy
import numpy as np
from laspy.point.dims import DimensionInfo, DimensionKind
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import InvalidInputError
from surfsig.files.columns import Chunks, aligned_blocks, blocks_of, column_names, scalar_columns
from surfsig.files.las_header import (
    GEO_DOUBLES,
    GEO_KEYS,
    GEO_TEXT,
    PROJECTION,
    RECORD_ID,
    USER_ID,
    WKT,
)
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# Coordinates are whole numbers of 1e-3 to 1e-9 units.
_DECIMALS = range(3, 10)
_LARGEST = 2**31 - 1
_NAME_BYTES = 32
# All that fit in the record that describes them.
_MAX_EXTRA = 341
_MAX_RECORD_BYTES = 2**16 - 1
_ALIASES = {"b": "u1", "f2": "f4", "f16": "f8"}


def write_las(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write an uncompressed LAS file; see `write_laz`."""
    _write(file, cloud, columns, chunks, notes, progress, compressed=False)


def write_laz(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write a LAZ file.

    Coordinates become whole numbers of a step: the coarsest of 1e-3, 1e-4, ... 1e-9 that all of them are
    multiples of, as those of most LAS files are; otherwise the finest with which they fit 32 bits, and each
    moves by half a step at most. A column goes to the dimension of LAS with its name if its values fit there
    (whole numbers in range), any other becomes extra bytes; (n, k) columns become NAME_0, NAME_1, ...; names
    are cut to 32 bytes. Viewpoint, grid and notes stand in a record of user id "surfsig". The coordinate
    system is written as WKT; GeoTIFF keys are turned into it where pyproj is installed and knows them, and
    otherwise stay what they are. A COPC file is not written: LAZ is.

    Raises
    ------
    InvalidInputError
        If the cloud is wider than 4,294 km (in metres), or has more than 341 columns that LAS does not know.

    Warns
    -----
    UserWarning
        If points that are not finite are left out: LAS cannot hold them. If the coordinate system is not
        written as WKT, or not at all.
    """
    _write(file, cloud, columns, chunks, notes, progress, compressed=True)


def _write(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
    *,
    compressed: bool,
) -> None:
    finite = cloud.finite
    left_out = len(cloud) - int(np.count_nonzero(finite))
    if left_out:
        warnings.warn(
            f"{left_out} points that are not finite are left out: LAS cannot hold them", stacklevel=4
        )
    offset, decimals = _steps(cloud, finite)
    scalars = scalar_columns(columns)
    header = laspy.LasHeader(version="1.4", point_format=_point_format(scalars))
    kind = header.point_format
    known = {
        dimension.name: scalars[dimension.name]
        for dimension in kind.standard_dimensions
        if dimension.name in scalars and _fits(scalars[dimension.name], dimension)
    }
    others = {name: values for name, values in scalars.items() if name not in known}
    types = {name: values.dtype for name, values in others.items()}
    if chunks is not None:
        types.update(dict.fromkeys(column_names(chunks.name, chunks.width), np.dtype(chunks.dtype)))
    if len(types) > _MAX_EXTRA:
        raise InvalidInputError(f"LAS holds at most {_MAX_EXTRA} further columns, not {len(types)}")
    taken = {*(kind.dtype().names or ()), *kind.dimension_names}
    extra = {name: _short_name(name, taken) for name in types}
    header.add_extra_dims([laspy.ExtraBytesParams(extra[name], _stored(types[name])) for name in types])
    for record in header.vlrs.get("ExtraBytesVlr"):
        for described in record.extra_bytes_structs:
            # laspy would look at the first point of each block only.
            described.options &= ~(described.MIN_BIT_MASK | described.MAX_BIT_MASK)
    header.scales, header.offsets = np.full(3, 10.0**-decimals), offset
    # The bit says that the coordinate system is WKT, as the standard wants it for these point formats.
    header.global_encoding.wkt = True
    header.generating_software = "surfsig"
    # A fixed date: the same points give the same file.
    header.creation_date = datetime.date(1980, 1, 1)
    told: dict[str, Any] = {"notes": dict(notes), "dimensions": list(known)}
    if cloud.viewpoint is not None:
        told["viewpoint"] = cloud.viewpoint.tolist()
    if cloud.grid is not None and not left_out:
        told["grid"] = list(cloud.grid)
    text = json.dumps(told).encode()
    if len(text) > _MAX_RECORD_BYTES:
        raise InvalidInputError(f"the notes are too long for LAS ({len(text)} bytes)")
    header.vlrs.append(laspy.VLR(USER_ID, RECORD_ID, "what LAS has no place for", text))
    if cloud.coordinate_system is not None:
        _add_coordinate_system(header, cloud.coordinate_system)

    kept_error = _KeepsError(file)
    try:
        writer = laspy.LasWriter(
            kept_error,
            header,
            do_compress=compressed,
            laz_backend=laspy.LazBackend.LazrsParallel,
            closefd=False,
        )
        for rows, block in aligned_blocks(chunks, len(cloud)):
            chosen = finite[rows]
            record = laspy.PackedPointRecord.zeros(int(np.count_nonzero(chosen)), kind)
            whole = np.rint((cloud.offsets[rows][chosen] + (cloud.origin - offset)) * 10.0**decimals)
            for i, axis in enumerate("XYZ"):
                record.array[axis] = whole[:, i]
            for name in ("return_number", "number_of_returns"):
                if name not in known:
                    record[name][:] = np.ones(len(record), np.uint8)
            for name, values in known.items():
                record[name][:] = values[rows][chosen]
            for name, values in others.items():
                record.array[extra[name]] = values[rows][chosen]
            if block is not None and chunks is not None:
                for name, values in zip(column_names(chunks.name, chunks.width), block.T, strict=True):
                    record.array[extra[name]] = values[chosen]
            writer.write_points(record)
            progress.advance(rows.stop - rows.start)
        writer.close()
    except Exception as error:
        raise kept_error.error or error from None


def _add_coordinate_system(header: laspy.LasHeader, system: CoordinateSystem) -> None:
    """Add the records of a coordinate system: WKT, or GeoTIFF keys that cannot be turned into it."""
    user_id, wkt, keys = PROJECTION.decode(), system.to_wkt(), system.geo_keys
    if wkt is not None:
        records = {WKT: wkt.encode() + b"\0"}
    elif keys is not None:
        warnings.warn(
            "the coordinate system is written as GeoTIFF keys, as it was read, although LAS 1.4 wants WKT: "
            "pyproj, which turns one into the other (pip install 'surfsig[crs]'), is missing or does not "
            "know it",
            stacklevel=5,
        )
        header.global_encoding.wkt = False
        records = {GEO_KEYS: keys.directory, GEO_DOUBLES: keys.doubles, GEO_TEXT: keys.text}
    else:
        records = {}
    if any(len(data) > _MAX_RECORD_BYTES for data in records.values()):
        warnings.warn("the coordinate system is left out: it is too long for LAS", stacklevel=5)
        return
    header.vlrs.extend(
        laspy.VLR(user_id, number, "coordinate system", data) for number, data in records.items() if data
    )


class _KeepsError:
    """A file that remembers why it could not be written to: lazrs forgets it."""

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self.error: OSError | None = None

    def write(self, data: Any) -> int:
        try:
            return self._file.write(data)
        except OSError as error:
            self.error = error
            raise

    def __getattr__(self, name: str) -> Any:
        return getattr(self._file, name)


def _steps(cloud: PointCloud, finite: NDArray[np.bool_]) -> tuple[NDArray[np.float64], int]:
    """Choose the offset of the stored whole numbers, and the decimals of their step."""
    if not finite.any():
        return np.zeros(3), _DECIMALS[0]
    shown = finite[:, None]
    low = cloud.offsets.min(axis=0, where=shown, initial=np.inf).astype(np.float64)
    high = cloud.offsets.max(axis=0, where=shown, initial=-np.inf).astype(np.float64)
    middle = np.rint(cloud.origin + (low + high) / 2)
    finest = None
    # With the offset of the file that the points came from, they stay what they are to the last bit.
    for offset in (cloud.origin, middle):
        shift = cloud.origin - offset
        reach = float(np.maximum(np.abs(low + shift), np.abs(high + shift)).max())
        fitting = [decimals for decimals in _DECIMALS if reach * 10.0**decimals <= _LARGEST]
        for decimals in fitting:
            if _on_steps(cloud, finite, shift, decimals):
                return offset, decimals
        finest = fitting[-1] if fitting else None
    if finest is None:
        raise InvalidInputError(
            f"the points are {np.ptp([low, high], axis=0).max():.3g} wide, "
            f"LAS holds at most {2e-3 * _LARGEST:.3g} in steps of 0.001"
        )
    return middle, finest


def _on_steps(
    cloud: PointCloud, finite: NDArray[np.bool_], shift: NDArray[np.float64], decimals: int
) -> bool:
    """Tell whether all coordinates are multiples of a step, but for what float64 rounded off."""
    for points, shown in zip(blocks_of(cloud.offsets), blocks_of(finite), strict=True):
        near = points[shown].astype(np.float64)
        steps = (near + shift) * 10.0**decimals
        rounding = 2.0**-50 * 10.0**decimals * (np.abs(near) + np.abs(shift))
        if not (np.abs(steps - np.rint(steps)) <= rounding).all():
            return False
    return True


def _point_format(scalars: Mapping[str, NDArray[Any]]) -> int:
    """Choose 6, 7 with colours, or 8 with near infrared as well."""
    largest = laspy.PointFormat(8)

    def fit(*names: str) -> bool:
        return all(name in scalars and _fits(scalars[name], largest[name]) for name in names)

    if not fit("red", "green", "blue"):
        return 6
    return 8 if fit("nir") else 7


def _fits(values: NDArray[Any], dimension: DimensionInfo) -> bool:
    """Tell whether a dimension of LAS holds these values as they are."""
    if dimension.kind == DimensionKind.FloatingPoint:
        return bool(np.can_cast(values.dtype, np.float64, "safe"))
    if values.dtype.kind == "f" and not all((part == np.floor(part)).all() for part in blocks_of(values)):
        return False
    return not values.size or bool(values.min() >= dimension.min and values.max() <= dimension.max)


def _stored(dtype: np.dtype[Any]) -> str:
    kind = dtype.kind if dtype.kind == "b" else f"{dtype.kind}{dtype.itemsize}"
    return _ALIASES.get(kind, kind)


def _short_name(name: str, taken: set[str]) -> str:
    """Cut a name to what LAS holds, other than all those taken, and take it."""
    short, number = "", 1
    while not short or short in taken:
        end = "" if number == 1 else f"_{number}"
        short = name.replace("\0", "_").encode()[: _NAME_BYTES - len(end)].decode(errors="ignore") + end
        number += 1
    taken.add(short)
    return short
