"""PCD: reads ASCII, binary and compressed data, organised or not."""

from __future__ import annotations

import os
import warnings
from collections.abc import Mapping
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import cloud_from_columns, filled_columns, unique_name
from surfsig.files.pcd_ascii import read_ascii
from surfsig.files.pcd_header import EXACT, PACKED_COLOURS, Header, check_size, is_packed_colour, read_header
from surfsig.files.rows import row_blocks
from surfsig.point_cloud import PointCloud, position_array
from surfsig.progress import Progress

# LZF's longest back reference makes 264 bytes of 3.
MAX_LZF_RATIO = 88


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open PCD file; packed colours (`rgb`, `rgba`) are unpacked, padding (`_`) is skipped.

    A colour in a field of type F is the bits of its float, as PCL has it; in text, whole numbers without an
    exponent are the packed colour itself. Coordinates that this library wrote about an origin, or a second
    time as doubles, are given as they were.

    Raises
    ------
    FileFormatError
        If the header makes no sense or promises more than the file holds.

    Warns
    -----
    UserWarning
        If a number does not fit the type that the header declares, or a colour may be another.
    """
    header = read_header(file, source)
    size = os.fstat(file.fileno()).st_size - file.tell()
    match header.data:
        case "ascii":
            columns = _named(read_ascii(file, header, size, source, progress), header)
        case "binary":
            columns = _read_binary(file, header, size, source, progress)
        case _:
            columns = _named(_read_compressed(file, header, size, source, progress), header)
    axes = {
        kind for name, kind in zip(header.names, header.types, strict=True) if name.lower() in ("x", "y", "z")
    }
    origin = _numbers(header.notes.get("origin"), source)
    viewpoint = header.viewpoint
    if origin is not None:
        told = _numbers(header.notes.get("viewpoint"), source)
        viewpoint = told if told is not None or viewpoint is None else origin + viewpoint
    exact = _with_exact(columns, origin, source)
    cloud = cloud_from_columns(
        exact or columns,
        source=source,
        viewpoint=viewpoint,
        grid=(header.height, header.width) if header.height > 1 else None,
        declared_float32=header.data == "ascii" and axes == {"f4"},
    )
    if origin is not None and not exact:
        cloud = replace(cloud, origin=origin)
    system = CoordinateSystem.from_text(header.notes.get("coordinate_system", ""))
    return cloud if system is None else replace(cloud, coordinate_system=system)


def _with_exact(
    columns: dict[str, NDArray[Any]], origin: NDArray[np.float64] | None, source: str
) -> dict[str, NDArray[Any]] | None:
    """Put the coordinates that stand beside x, y and z as doubles in their place.

    Returns
    -------
    dict or None
        None if there are none, or another program has changed x, y and z since.
    """
    if not all(name in columns for name in (*"xyz", *EXACT)):
        return None
    for i, (axis, name) in enumerate(zip("xyz", EXACT, strict=True)):
        shift = 0.0 if origin is None else origin[i]
        with np.errstate(over="ignore", invalid="ignore"):
            near = (columns[name] - shift).astype(np.float32)
        if columns[name].dtype != np.float64 or not np.array_equal(near, columns[axis], equal_nan=True):
            warnings.warn(
                f"{source}: x, y and z are not those that {', '.join(EXACT)} say as doubles: another program "
                "has changed them; x, y and z were read",
                stacklevel=3,
            )
            return None
    kept = {name: values for name, values in columns.items() if name not in EXACT}
    return kept | {axis: columns[name] for axis, name in zip("xyz", EXACT, strict=True)}


def _numbers(text: str | None, source: str) -> NDArray[np.float64] | None:
    """Give the three numbers of a comment of this library; None if there is none."""
    if text is None:
        return None
    try:
        return position_array([float(word) for word in text.split()], "the comment")
    except (ValueError, InvalidInputError):
        raise FileFormatError(f"{source}: a comment of its header is broken: {text[:40]!r}") from None


def _read_binary(
    file: BinaryIO, header: Header, size: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    whole = np.dtype(header.parts())
    check_size(header.points * whole.itemsize, size, header, source)
    # The type of a row as the cloud's columns see it: each channel of a colour at its own byte, no padding.
    fields: Mapping[str, Any] = whole.fields or {}
    names, kinds, offsets = [], [], []
    for name, (key, channel) in _places(header).items():
        kind, offset = fields[key][:2]
        names.append(name)
        kinds.append(kind if channel is None else np.dtype("u1"))
        offsets.append(offset + (channel or 0))
    dtype = np.dtype({"names": names, "formats": kinds, "offsets": offsets, "itemsize": whole.itemsize})
    blocks = row_blocks(file, dtype, header.points, source, progress)
    return filled_columns(dtype, header.points, blocks)


def _read_compressed(
    file: BinaryIO, header: Header, size: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    import lzf

    needed = header.points * np.dtype(header.parts()).itemsize
    if size < 8:
        raise FileFormatError(f"{source}: cut off: the sizes of its compressed data are missing")
    packed, unpacked = (int(value) for value in np.frombuffer(file.read(8), "<u4"))
    check_size(packed + 8, size, header, source)
    if unpacked != needed or unpacked > packed * MAX_LZF_RATIO:
        raise FileFormatError(
            f"{source}: its header promises {header.points} points ({needed} bytes), "
            f"its compressed data {unpacked} bytes in {packed}"
        )
    if not needed:
        data: bytes | None = b""
    else:
        try:
            data = lzf.decompress(stored := file.read(packed), unpacked)
        except ValueError:
            # pypcd stores what compression would not make smaller as it is.
            data = stored if packed == unpacked else None
    progress.advance(packed)
    if data is None or len(data) != unpacked:
        raise FileFormatError(f"{source}: its compressed data are broken")
    columns, offset = {}, 0
    for key, kind, shape in header.parts():
        values = np.frombuffer(data, kind, header.points * (shape[0] if shape else 1), offset)
        offset += values.nbytes
        columns[key] = values.reshape(header.points, *shape)
    return columns


def _places(header: Header) -> dict[str, tuple[str, int | None]]:
    """Say for each column of the cloud which field it is, and which byte of it if that is a packed colour."""
    places: dict[str, tuple[str, int | None]] = {}
    for key, kind, shape in header.parts():
        name = key.partition(" ")[2]
        if name == "_":
            continue
        if is_packed_colour(name, kind, shape):
            for colour, byte in PACKED_COLOURS[name].items():
                places[unique_name(colour, {*places, *header.names})] = (key, byte)
        else:
            places[name] = (key, None)
    return places


def _named(fields: dict[str, NDArray[Any]], header: Header) -> dict[str, NDArray[Any]]:
    """Give the cloud's columns of whole fields."""
    return {
        name: fields[key] if byte is None else _bytes(fields[key])[:, byte].copy()
        for name, (key, byte) in _places(header).items()
    }


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.dtype.itemsize)
