"""PLY: reads ASCII and both binary orders, writes binary little-endian."""

from __future__ import annotations

import os
import re
from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import (
    Chunks,
    cloud_from_columns,
    column_names,
    columns_of,
    exact_float32,
    filled_columns,
    scalar_columns,
)
from surfsig.files.lines import take_rows
from surfsig.files.ply_elements import Element, Property, element_blocks, skip_element
from surfsig.files.progress import Progress
from surfsig.files.rows import write_rows
from surfsig.point_cloud import PointCloud

MAGIC = re.compile(rb"ply[ \t]*\r?\n")
MAX_HEADER_BYTES = 1 << 20

_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}


@dataclass
class Header:
    """What stands before the data.

    Attributes
    ----------
    order
        ``<`` or ``>`` for binary data, empty for ASCII.
    elements
        In the order of the data.
    notes
        What this library wrote as comments ``surfsig KEY VALUE``.
    lines
        Number of lines, ``end_header`` included.
    """

    order: str | None = None
    elements: list[Element] = field(default_factory=list)
    notes: dict[str, str] = field(default_factory=dict)
    lines: int = 0


def read(file: BinaryIO, source: str, progress: Progress) -> PointCloud:
    """Read the vertices of an open PLY file; other elements and list properties are skipped.

    Raises
    ------
    FileFormatError
        If the header makes no sense, has no vertices, or promises more than the file holds.
    """
    header = _read_header(file, source)
    names = [element.name for element in header.elements]
    if "vertex" not in names:
        raise FileFormatError(f"{source}: a PLY file without vertices ({', '.join(names) or 'no element'})")
    position = names.index("vertex")
    before, vertex, after = (
        header.elements[:position],
        header.elements[position],
        header.elements[position + 1 :],
    )
    size = os.fstat(file.fileno()).st_size - file.tell()
    least = sum(element.least_bytes(ascii=not header.order) for element in header.elements)
    if least > size + 1:
        raise FileFormatError(
            f"{source}: cut off: its header promises {vertex.count} points and so at least {least} bytes "
            f"of data, {size} are there"
        )
    if header.order:
        for element in before:
            skip_element(file, element, source, progress)
        blocks = element_blocks(file, vertex, source, progress)
        columns = filled_columns(vertex.single_dtype(), vertex.count, blocks)
        for element in after:
            skip_element(file, element, source, progress)
    else:
        rows = take_rows(
            file,
            vertex.ascii_dtype(),
            vertex.count,
            source=source,
            first=header.lines + 1,
            progress=progress,
            skip=sum(element.count for element in before),
            after=sum(element.count for element in after),
            select=vertex.without_lists if vertex.has_lists else None,
        )
        columns = columns_of(rows)
    axes = {item.dtype for item in vertex.properties if item.name.lower() in ("x", "y", "z")}
    return cloud_from_columns(
        columns,
        source=source,
        viewpoint=_numbers(header.notes.get("viewpoint", ""), 3),
        grid=_grid(header.notes.get("grid", ""), vertex.count),
        declared_float32=not header.order and all(kind.endswith("f4") for kind in axes),
    )


def write(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write points and columns; (n, k) columns become k properties NAME_0, NAME_1, ..."""
    points = cloud.points
    scalars = scalar_columns(columns)
    axis = "f4" if points.dtype == np.float32 or exact_float32(points) else "f8"
    parts = [(axis, values) for values in points.T]
    parts += [(_stored_type(values), values) for values in scalars.values()]
    names, types = ["x", "y", "z", *scalars], [kind for kind, _ in parts]
    tail = None
    if chunks is not None:
        tail = (_stored_type(np.empty(0, chunks.dtype)), chunks)
        names += column_names(chunks.name, chunks.width)
        types += [tail[0]] * chunks.width
    header = ["ply", "format binary_little_endian 1.0"]
    told = dict(notes)
    if cloud.viewpoint is not None:
        told["viewpoint"] = " ".join(repr(float(value)) for value in cloud.viewpoint)
    if cloud.grid is not None:
        told["grid"] = f"{cloud.grid[0]} {cloud.grid[1]}"
    header += [f"comment surfsig {key} {' '.join(value.split())}" for key, value in told.items()]
    header += [f"element vertex {len(cloud)}"]
    header += [f"property {_NAMES[kind]} {name}" for name, kind in zip(names, types, strict=True)]
    file.write("\n".join([*header, "end_header\n"]).encode())
    write_rows(file, parts, tail, len(cloud), progress)


def _read_header(file: BinaryIO, source: str) -> Header:
    header = Header()
    while True:
        raw = file.readline(MAX_HEADER_BYTES)
        header.lines += 1
        if not raw.endswith(b"\n") or file.tell() > MAX_HEADER_BYTES:
            raise FileFormatError(f"{source}: the PLY header does not end: the file is cut off or broken")
        words = raw.decode("utf-8", errors="replace").split()
        if words[:1] == ["end_header"]:
            break
        try:
            _take_header_line(header, words)
        except (ValueError, IndexError, KeyError):
            text = " ".join(words)[:60]
            raise FileFormatError(
                f"{source}: line {header.lines} of the PLY header makes no sense: {text!r}"
            ) from None
    if header.order is None:
        raise FileFormatError(f"{source}: the PLY header does not name a format")
    for element in header.elements:
        names = [item.name for item in element.properties]
        if element.name == "vertex" and len(set(names)) < len(names):
            twice = next(name for name in names if names.count(name) > 1)
            raise FileFormatError(f"{source}: two properties of the vertices are called '{twice}'")
    return header


def _take_header_line(header: Header, words: list[str]) -> None:
    match words:
        case [] | ["ply"] | ["obj_info", *_]:
            pass
        case ["comment", "surfsig", key, *value]:
            header.notes[key] = " ".join(value)
        case ["comment", *_]:
            pass
        case ["format", name, _]:
            header.order = _ORDERS[name]
        case ["element", name, count] if int(count) >= 0:
            header.elements.append(Element(name, int(count), []))
        case ["property", "list", length, kind, name]:
            if _TYPES[length].startswith("f"):
                raise ValueError(length)
            order = header.order or ""
            header.elements[-1].properties.append(
                Property(name, order + _TYPES[kind], order + _TYPES[length])
            )
        case ["property", kind, name]:
            header.elements[-1].properties.append(Property(name, (header.order or "") + _TYPES[kind]))
        case _:
            raise ValueError(words)


def _stored_type(values: NDArray[Any]) -> str:
    """Choose PLY's type for a column; 64-bit whole numbers that do not fit 32 bits become double."""
    kind = values.dtype.kind
    if kind == "b":
        return "u1"
    if kind == "f":
        return "f4" if values.dtype.itemsize <= 4 else "f8"
    if values.dtype.itemsize <= 4:
        return f"{kind}{values.dtype.itemsize}"
    for name in ("i4", "u4"):
        limits = np.iinfo(name)
        if not values.size or (values.min() >= limits.min and values.max() <= limits.max):
            return name
    return "f8"


def _numbers(text: str, count: int) -> list[float] | None:
    try:
        values = [float(word) for word in text.split()]
    except ValueError:
        return None
    return values if len(values) == count and np.isfinite(values).all() else None


def _grid(text: str, count: int) -> tuple[int, int] | None:
    sides = _numbers(text, 2)
    if sides is None or sides[0] * sides[1] != count:
        return None
    return int(sides[0]), int(sides[1])
