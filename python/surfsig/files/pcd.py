"""PCD: reads ASCII, binary and compressed data, organised or not."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import cloud_from_columns, filled_columns
from surfsig.files.lines import take_rows
from surfsig.files.progress import Progress
from surfsig.files.rows import row_blocks
from surfsig.point_cloud import PointCloud

MAGIC = re.compile(rb"(?:[ \t]*(?:#[^\n]*)?\r?\n)*(?:VERSION[ \t]+\.?0?\.?[0-9]|FIELDS[ \t])")
MAX_HEADER_BYTES = 1 << 20
# More numbers per point than any descriptor has; a broken header must not make us build a type of them.
MAX_NUMBERS = 1 << 16
# LZF's longest back reference makes 264 bytes of 3.
MAX_LZF_RATIO = 88

_KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
# PCL keeps a colour in one number of any type, blue first.
PACKED_COLOURS = {
    "rgb": {"red": 2, "green": 1, "blue": 0},
    "rgba": {"red": 2, "green": 1, "blue": 0, "alpha": 3},
}
_KINDS = {"F": "f", "I": "i", "U": "u"}


@dataclass
class Header:
    """What stands before the data.

    Attributes
    ----------
    names, types, counts
        One entry per field: its name, NumPy's name of its type, and how many numbers a point has of it.
    height, width
        Of an organised cloud; height is 1 for any other.
    viewpoint
        Where the sensor stood, None if the header does not say.
    data
        ``ascii``, ``binary`` or ``binary_compressed``.
    lines
        Number of lines, DATA included.
    """

    names: list[str]
    types: list[str]
    counts: list[int]
    height: int
    width: int
    viewpoint: list[float] | None
    data: str
    lines: int

    @property
    def points(self) -> int:
        """Number of points."""
        return self.height * self.width

    def parts(self) -> list[tuple[str, str, tuple[int, ...]]]:
        """Give each field as (key, type, shape); keys are unique where names (padding's `_`) are not."""
        return [
            (f"{i} {name}", "<" + kind, () if count == 1 else (count,))
            for i, (name, kind, count) in enumerate(zip(self.names, self.types, self.counts, strict=True))
        ]


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read an open PCD file; packed colours (`rgb`, `rgba`) are unpacked, padding (`_`) is skipped.

    Raises
    ------
    FileFormatError
        If the header makes no sense or promises more than the file holds.
    """
    header = _read_header(file, source)
    size = os.fstat(file.fileno()).st_size - file.tell()
    match header.data:
        case "ascii":
            columns = _named(_read_ascii(file, header, size, source, progress), header, source)
        case "binary":
            columns = _read_binary(file, header, size, source, progress)
        case _:
            columns = _named(_read_compressed(file, header, size, source, progress), header, source)
    axes = {
        kind for name, kind in zip(header.names, header.types, strict=True) if name.lower() in ("x", "y", "z")
    }
    return cloud_from_columns(
        columns,
        source=source,
        viewpoint=header.viewpoint,
        grid=(header.height, header.width) if header.height > 1 else None,
        declared_float32=header.data == "ascii" and axes == {"f4"},
    )


def _read_ascii(
    file: BinaryIO, header: Header, size: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    flat: list[tuple[str, str]] = []
    for (key, kind, _), name, count in zip(header.parts(), header.names, header.counts, strict=True):
        # The text of a coordinate may need more than the float32 that the header declares.
        stored = "f8" if name.lower() in ("x", "y", "z") else kind
        flat += [(f"{key} {i}", stored) for i in range(count)]
    _check_size(header.points * 2 * len(flat) - 1, size, header, source)
    rows = take_rows(
        file,
        np.dtype(flat),
        header.points,
        source=source,
        first=header.lines + 1,
        progress=progress,
    )
    columns = {}
    for key, _, shape in header.parts():
        parts = [rows[f"{key} {i}"] for i in range(shape[0] if shape else 1)]
        columns[key] = np.stack(parts, axis=1) if shape else parts[0]
    return columns


def _read_binary(
    file: BinaryIO, header: Header, size: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    whole = np.dtype(header.parts())
    _check_size(header.points * whole.itemsize, size, header, source)
    # The type of a row as the cloud's columns see it: each channel of a colour at its own byte, no padding.
    fields: Mapping[str, Any] = whole.fields or {}
    names, kinds, offsets = [], [], []
    for name, (key, channel) in _places(header, source).items():
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
    _check_size(packed + 8, size, header, source)
    if unpacked != needed or unpacked > packed * MAX_LZF_RATIO:
        raise FileFormatError(
            f"{source}: its header promises {header.points} points ({needed} bytes), "
            f"its compressed data {unpacked} bytes in {packed}"
        )
    if not needed:
        data: bytes | None = b""
    else:
        try:
            data = lzf.decompress(file.read(packed), unpacked)
        except ValueError:
            data = None
    progress.advance(packed)
    if data is None or len(data) != unpacked:
        raise FileFormatError(f"{source}: its compressed data are broken")
    columns, offset = {}, 0
    for key, kind, shape in header.parts():
        values = np.frombuffer(data, kind, header.points * (shape[0] if shape else 1), offset)
        offset += values.nbytes
        columns[key] = values.reshape(header.points, *shape)
    return columns


def _read_header(file: BinaryIO, source: str) -> Header:
    entries: dict[str, list[str]] = {}
    lines = 0
    while "DATA" not in entries:
        raw = file.readline(MAX_HEADER_BYTES)
        lines += 1
        if not raw.endswith(b"\n") or file.tell() > MAX_HEADER_BYTES:
            raise FileFormatError(f"{source}: the PCD header does not end: the file is cut off or broken")
        words = raw.decode("utf-8", errors="replace").split()
        if not words or words[0].startswith("#"):
            continue
        if words[0] not in _KEYS or words[0] in entries:
            text = " ".join(words)[:60]
            raise FileFormatError(f"{source}: line {lines} of the PCD header makes no sense: {text!r}")
        entries[words[0]] = words[1:]
    try:
        return _header(entries, lines)
    except KeyError as error:
        raise FileFormatError(f"{source}: the PCD header has no line {error.args[0]}") from None
    except (ValueError, IndexError, TypeError) as error:
        raise FileFormatError(f"{source}: the PCD header makes no sense: {error}") from None


def _header(entries: dict[str, list[str]], lines: int) -> Header:
    names = entries["FIELDS"]
    sizes = [int(word) for word in entries["SIZE"]]
    counts = [int(word) for word in entries.get("COUNT", ["1"] * len(names))]
    if not len(names) == len(sizes) == len(entries["TYPE"]) == len(counts):
        raise ValueError("FIELDS, SIZE, TYPE and COUNT differ in length")
    types = []
    for letter, size in zip(entries["TYPE"], sizes, strict=True):
        if letter not in _KINDS or size not in (1, 2, 4, 8) or (letter == "F" and size < 4):
            raise ValueError(f"there is no type {letter} of {size} bytes")
        types.append(f"{_KINDS[letter]}{size}")
    (width,), (height,) = ([int(word) for word in entries[key]] for key in ("WIDTH", "HEIGHT"))
    points = int(entries["POINTS"][0]) if "POINTS" in entries else width * height
    if min(width, height, points, *counts) < 0 or 0 in counts:
        raise ValueError("a negative number, or a COUNT of 0")
    if sum(counts) > MAX_NUMBERS:
        raise ValueError(f"{sum(counts)} numbers per point")
    if points != width * height:
        raise ValueError(f"POINTS {points} is not WIDTH {width} times HEIGHT {height}")
    viewpoint = None
    if "VIEWPOINT" in entries:
        # Position, then orientation as a quaternion; only the position matters here.
        numbers = [float(word) for word in entries["VIEWPOINT"]]
        if len(numbers) != 7:
            raise ValueError("VIEWPOINT needs seven numbers")
        viewpoint = numbers[:3] if np.isfinite(numbers[:3]).all() else None
    data = " ".join(entries["DATA"]).lower()
    if data not in ("ascii", "binary", "binary_compressed"):
        raise ValueError(f"DATA {data[:40]!r} is none of ascii, binary, binary_compressed")
    return Header(names, types, counts, height, width, viewpoint, data, lines)


def _check_size(needed: int, size: int, header: Header, source: str) -> None:
    if needed > size:
        raise FileFormatError(
            f"{source}: cut off: its header promises {header.points} points and so at least {needed} bytes "
            f"of data, {size} are there"
        )


def _places(header: Header, source: str) -> dict[str, tuple[str, int | None]]:
    """Say for each column of the cloud which field it is, and which byte of it if that is a packed colour."""
    places: dict[str, tuple[str, int | None]] = {}
    for key, kind, shape in header.parts():
        name = key.partition(" ")[2]
        if name == "_":
            continue
        if name in places:
            raise FileFormatError(f"{source}: two fields are called '{name}'")
        if name in PACKED_COLOURS and not shape and np.dtype(kind).itemsize == 4:
            places |= {colour: (key, byte) for colour, byte in PACKED_COLOURS[name].items()}
        else:
            places[name] = (key, None)
    return places


def _named(fields: dict[str, NDArray[Any]], header: Header, source: str) -> dict[str, NDArray[Any]]:
    """Give the cloud's columns of whole fields."""
    return {
        name: fields[key] if byte is None else _bytes(fields[key])[:, byte].copy()
        for name, (key, byte) in _places(header, source).items()
    }


def _bytes(values: NDArray[Any]) -> NDArray[np.uint8]:
    return np.ascontiguousarray(values).view(np.uint8).reshape(-1, values.dtype.itemsize)
