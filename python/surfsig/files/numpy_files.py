"""NPY and NPZ: NumPy's own files, read without pickle; NPZ is also written."""

from __future__ import annotations

import json
import math
import os
import warnings
import zipfile
import zlib
from collections.abc import Mapping, Sequence
from dataclasses import replace
from typing import IO, Any, BinaryIO

import numpy as np
from numpy.lib import format as npy
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import (
    TRIPLES,
    Chunks,
    aligned_blocks,
    blocks_of,
    cloud_from_columns,
    numeric_columns,
)
from surfsig.files.first_columns import FEW_ROWS, MANY_COLUMNS
from surfsig.files.options import LEFT_OUT, check_width
from surfsig.files.rows import filled
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

NPY_MAGIC = npy.MAGIC_PREFIX
ZIP_MAGIC = b"PK"
# Names in an NPZ file that are no field of the points.
RESERVED = ("points", "viewpoint", "grid", "origin", "notes", "coordinate_system")
# The most bytes that one byte of a deflated member makes.
MAX_DEFLATE_RATIO = 1032
# What a broken ZIP archive raises: RuntimeError if encrypted, NotImplementedError if compressed unusually.
_BROKEN = (ValueError, EOFError, OSError, zipfile.BadZipFile, zlib.error, NotImplementedError, RuntimeError)


def read_npy(
    file: BinaryIO, source: str, progress: Progress, columns: Sequence[str] | None = None
) -> PointCloud:
    """Read an open NPY file: an array (n, 3 or more), or a structured one (n,) with fields x, y, z.

    Raises
    ------
    FileFormatError
        If it is cut off or no such array.
    InvalidInputError
        If `columns` does not name each column, or the array names them itself.
    """
    size = os.fstat(file.fileno()).st_size
    array = _read_array(file, size, source, progress)
    return _cloud_from_array(array, source, columns)


def read_npz(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open NPZ file.

    The coordinates are the array ``points`` (n, 3 or more), or x, y and z, or the only array of the file;
    other numeric arrays with n rows become fields. ``viewpoint`` (3,), ``grid`` (2,), ``origin`` (3,) and
    ``coordinate_system`` (a text) mean what `PointCloud` says.

    Raises
    ------
    FileFormatError
        If it is cut off, not NumPy's, or has no coordinates.
    """
    arrays: dict[str, NDArray[Any]] = {}
    size = os.fstat(file.fileno()).st_size
    try:
        with zipfile.ZipFile(file) as archive:
            for info in archive.infolist():
                name = info.filename.removesuffix(".npy")
                if name == info.filename:
                    raise FileFormatError(
                        f"{source}: a ZIP archive, but not of NumPy's arrays (it holds {name[:40]!r})"
                    )
                with archive.open(info) as member:
                    most = _most_bytes(info, size)
                    stored = info.compress_type == zipfile.ZIP_STORED
                    told = progress if stored else None
                    arrays[name] = _read_array(member, most, f"{source}: {name}", told)
                if not stored:
                    progress.advance(info.compress_size)
    except FileFormatError:
        raise
    except _BROKEN as error:
        raise FileFormatError(
            f"{source}: the NPZ archive is cut off or broken ({_one_line(error)})"
        ) from None
    notes = {name: arrays.pop(name, None) for name in RESERVED[1:]}
    if "points" not in arrays and len(arrays) == 1:
        arrays = {"points": next(iter(arrays.values()))}
    if "points" in arrays:
        both = next((name for name in arrays if name.lower() in ("x", "y", "z")), None)
        if both is not None:
            raise FileFormatError(f"{source}: both 'points' and '{both}' may be the coordinates")
        main = _cloud_from_array(arrays.pop("points"), source)
        columns: dict[str, NDArray[Any]] = {axis: main.offsets[:, i] for i, axis in enumerate("xyz")}
        columns.update(main.fields)
        count = len(main)
    else:
        columns, count = _main_arrays(arrays, source)
    for name, values in arrays.items():
        if values.dtype.kind in "fiub" and values.ndim in (1, 2) and len(values) == count:
            columns[name] = values
        else:
            warnings.warn(
                f"{source}: left out the array '{name}' ({values.dtype}, shape {values.shape})", stacklevel=2
            )
    try:
        cloud = cloud_from_columns(
            columns, source=source, viewpoint=notes["viewpoint"], grid=_grid(notes["grid"])
        )
        if notes["coordinate_system"] is not None:
            system = CoordinateSystem.from_text(str(notes["coordinate_system"]))
            cloud = replace(cloud, coordinate_system=system)
        return cloud if notes["origin"] is None else replace(cloud, origin=notes["origin"])
    except (InvalidInputError, TypeError, ValueError) as error:
        raise FileFormatError(f"{source}: {error}") from None


def _main_arrays(arrays: dict[str, NDArray[Any]], source: str) -> tuple[dict[str, NDArray[Any]], int]:
    """Take the coordinates out of arrays of which none is called points; also how many points there are."""
    axes = {name.lower(): name for name in reversed(list(arrays)) if name.lower() in ("x", "y", "z")}
    if len(axes) == len("xyz"):
        columns = {axis: arrays.pop(axes[axis]).ravel() for axis in "xyz"}
        if len({len(values) for values in columns.values()}) > 1:
            raise FileFormatError(f"{source}: x, y and z differ in length")
        return columns, len(columns["x"])
    triples = [name for name in arrays if name.lower() in TRIPLES and arrays[name].shape[1:] == (3,)]
    if len(triples) != 1:
        raise FileFormatError(
            f"{source}: no array 'points', and not x, y, z (it holds {', '.join(arrays) or 'none'})"
        )
    points = arrays.pop(triples[0])
    return {"points": points}, len(points)


def write_npz(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write points and columns, each as an array of its own, uncompressed, so that it can be mapped."""
    arrays: dict[str, NDArray[Any]] = {"points": cloud.points, **columns}
    if cloud.viewpoint is not None:
        arrays["viewpoint"] = cloud.viewpoint
    if cloud.grid is not None:
        arrays["grid"] = np.array(cloud.grid)
    if cloud.coordinate_system is not None:
        arrays["coordinate_system"] = np.array(cloud.coordinate_system.to_text())
    if notes:
        arrays["notes"] = np.array(json.dumps(dict(notes)))
    with zipfile.ZipFile(file, "w", zipfile.ZIP_STORED, allowZip64=True) as archive:
        if chunks is not None:
            with _member(archive, chunks.name) as member:
                _write_header(member, (len(cloud), chunks.width), np.dtype(chunks.dtype))
                for rows, chunk in aligned_blocks(chunks, len(cloud)):
                    if chunk is not None:
                        member.write(chunk.tobytes())
                    progress.advance(rows.stop - rows.start)
        else:
            progress.advance(len(cloud))
        for name, array in arrays.items():
            with _member(archive, name) as member:
                _write_header(member, array.shape, array.dtype)
                for block in blocks_of(array) if array.ndim else [array]:
                    member.write(np.ascontiguousarray(block).tobytes())


def _member(archive: zipfile.ZipFile, name: str) -> IO[bytes]:
    # A fixed date: the same points give the same file.
    info = zipfile.ZipInfo(name.replace("/", "_").replace("\\", "_") + ".npy", (1980, 1, 1, 0, 0, 0))
    info.external_attr = 0o644 << 16
    return archive.open(info, "w", force_zip64=True)


def _write_header(member: IO[bytes], shape: tuple[int, ...], dtype: np.dtype[Any]) -> None:
    npy.write_array_header_1_0(
        member, {"descr": npy.dtype_to_descr(dtype), "fortran_order": False, "shape": shape}
    )


def _most_bytes(info: zipfile.ZipInfo, size: int) -> int:
    """Give the most bytes that a member of an archive of `size` bytes can have, whatever its entry says."""
    return min(info.file_size, min(info.compress_size, size) * MAX_DEFLATE_RATIO)


def _read_array(file: IO[bytes], size: int, source: str, progress: Progress | None) -> NDArray[Any]:
    """Read one array whose file has `size` bytes; nothing is allocated that the file does not hold."""
    shape, fortran_order, dtype = _read_header(file, source)
    if dtype.hasobject:
        raise FileFormatError(f"{source}: holds Python objects, not numbers")
    needed = math.prod(shape) * dtype.itemsize
    if min(shape, default=0) < 0 or needed > size:
        raise FileFormatError(
            f"{source}: cut off: its header promises an array of the shape {shape} ({needed} bytes), "
            f"the file has {size}"
        )
    if not dtype.itemsize:
        raise FileFormatError(f"{source}: points must be real numbers, not {dtype}")
    array = np.empty(math.prod(shape), dtype)
    try:
        whole = filled(file, array, progress)
        # One byte more, to have a ZIP member's checksum compared.
        file.read(1)
    except _BROKEN as error:
        raise FileFormatError(f"{source}: cut off or broken ({_one_line(error)})") from None
    if not whole:
        raise FileFormatError(f"{source}: cut off: {needed} bytes of data are promised, fewer are there")
    return array.reshape(shape, order="F" if fortran_order else "C")


def _read_header(file: IO[bytes], source: str) -> tuple[tuple[int, ...], bool, np.dtype[Any]]:
    readers = {(1, 0): npy.read_array_header_1_0, (2, 0): npy.read_array_header_2_0}
    try:
        version = npy.read_magic(file)
        if version in readers:
            return readers[version](file)
    # The header is a Python literal: a broken one raises whatever Python's tokeniser or parser may raise.
    except Exception as error:
        raise FileFormatError(f"{source}: cut off or broken ({_one_line(error)})") from None
    raise FileFormatError(f"{source}: NPY version {version[0]}.{version[1]} is not supported")


def _one_line(error: Exception) -> str:
    return " ".join(str(error).split())[:100]


def _cloud_from_array(array: NDArray[Any], source: str, columns: Sequence[str] | None = None) -> PointCloud:
    if array.dtype.names:
        if columns is not None:
            raise InvalidInputError(f"{source}: its columns have names, for which 'columns' means nothing")
        if array.ndim != 1:
            raise FileFormatError(
                f"{source}: a structured array must have one axis, not the shape {array.shape}"
            )
        return cloud_from_columns(numeric_columns(array, source), source=source)
    if array.dtype.kind not in "fiu":
        raise FileFormatError(f"{source}: points must be real numbers, not {array.dtype}")
    if array.ndim != 2 or array.shape[1] < 3:
        raise FileFormatError(f"{source}: points must have the shape (n, 3) or wider, not {array.shape}")
    if columns is None and len(array) < FEW_ROWS and array.shape[1] > MANY_COLUMNS:
        raise FileFormatError(
            f"{source}: {len(array)} rows of {array.shape[1]} numbers without names are hardly points: is "
            "the array transposed? points must have the shape (n, 3) or wider"
        )
    names = columns or ["x", "y", "z", *(f"column_{i + 1}" for i in range(3, array.shape[1]))]
    check_width(names, array.shape[1], source)
    return cloud_from_columns(
        {name: array[:, i] for i, name in enumerate(names) if name not in LEFT_OUT}, source=source
    )


def _grid(values: NDArray[Any] | None) -> tuple[int, int] | None:
    if values is None:
        return None
    if values.shape != (2,) or values.dtype.kind not in "iu":
        raise InvalidInputError("grid must be two whole numbers, its rows and its columns")
    return int(values[0]), int(values[1])
