"""PCD: writes binary data, with colours packed as PCL and Open3D have them."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.files.columns import PCL_NORMALS, Chunks, exact_float32, header_word, unique_name
from surfsig.files.progress import Progress
from surfsig.files.rows import write_rows
from surfsig.point_cloud import PointCloud

# `rgb` and `rgba` mean packed colours to every reader, and `_` means padding.
RESERVED = ("x", "y", "z", "rgb", "rgba", "_")


@dataclass(frozen=True)
class Field:
    """One field of the header.

    Attributes
    ----------
    type
        As NumPy says it: ``f4``, ``u1``, ...
    count
        Numbers per point.
    parts
        Types and values of what a row holds of it; several for a packed colour.
    """

    type: str
    count: int
    parts: list[tuple[str, NDArray[Any]]]


def write(
    file: BinaryIO,
    cloud: PointCloud,
    columns: Mapping[str, NDArray[Any]],
    chunks: Chunks | None,
    notes: Mapping[str, str],
    progress: Progress,
) -> None:
    """Write points and columns; (n, k) columns are fields with a COUNT of k."""
    points = cloud.points
    axis = "f4" if exact_float32(points) else "f8"
    fields = {name: Field(axis, 1, [(axis, values)]) for name, values in zip("xyz", points.T, strict=True)}
    fields |= _fields(columns, reserved=() if chunks is None else (header_word(chunks.name),))
    parts = [part for field in fields.values() for part in field.parts]
    tail = None
    if chunks is not None:
        tail = (_stored_type(np.dtype(chunks.dtype)), chunks)
        fields[header_word(chunks.name)] = Field(tail[0], chunks.width, [])
    file.write("\n".join([*_header(cloud, fields, notes), ""]).encode())
    write_rows(file, parts, tail, len(cloud), progress)


def _header(cloud: PointCloud, fields: Mapping[str, Field], notes: Mapping[str, str]) -> list[str]:
    height, width = cloud.grid or (1, len(cloud))
    lines = ["# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7"]
    lines += [f"# surfsig {key} {' '.join(value.split())}" for key, value in notes.items()]
    lines += [f"FIELDS {' '.join(fields)}"]
    lines += [f"SIZE {' '.join(field.type[1] for field in fields.values())}"]
    lines += [f"TYPE {' '.join(field.type[0].upper() for field in fields.values())}"]
    lines += [f"COUNT {' '.join(str(field.count) for field in fields.values())}"]
    lines += [f"WIDTH {width}", f"HEIGHT {height}"]
    # Where nobody said from where the points were seen, no line says so either.
    if cloud.viewpoint is not None:
        lines += [f"VIEWPOINT {' '.join(repr(float(value)) for value in cloud.viewpoint)} 1 0 0 0"]
    return [*lines, f"POINTS {len(cloud)}", "DATA binary"]


def _fields(columns: Mapping[str, NDArray[Any]], reserved: tuple[str, ...]) -> dict[str, Field]:
    """Name the fields of the columns; packed colours stand where red stood, normals have PCL's names."""
    colour = _packed_colour(columns)
    packed = () if colour is None else ("red", "green", "blue", "alpha")
    there = all(name in columns and columns[name].ndim == 1 for name in PCL_NORMALS.values())
    normals = {name: word for word, name in PCL_NORMALS.items()} if there else {}
    fields: dict[str, Field] = {}
    for name, values in columns.items():
        if colour is not None and name == "red":
            fields["rgb" if colour.type == "f4" else "rgba"] = colour
        if name in packed or values.shape[1:] == (0,):
            continue
        kind = _stored_type(values.dtype)
        count = values.shape[1] if values.ndim == 2 else 1
        word = unique_name(header_word(normals.get(name, name)), {*fields, *reserved, *RESERVED})
        fields[word] = Field(kind, count, [(kind, values)])
    return fields


def _packed_colour(columns: Mapping[str, NDArray[Any]]) -> Field | None:
    """Give the colours as 4 bytes, blue first; None if there are none, or of another type than uint8."""
    names = [name for name in ("blue", "green", "red", "alpha") if name in columns]
    if names[:3] != ["blue", "green", "red"]:
        return None
    if any(columns[name].ndim != 1 or columns[name].dtype != np.uint8 for name in names):
        return None
    parts = [("u1", columns[name]) for name in names]
    if len(parts) == 4:
        return Field("u4", 1, parts)
    # PCL calls the integer 0x00RRGGBB a float, bit for bit.
    return Field("f4", 1, [*parts, ("u1", np.broadcast_to(np.uint8(0), parts[0][1].shape))])


def _stored_type(dtype: np.dtype[Any]) -> str:
    if dtype.kind == "b":
        return "u1"
    if dtype.kind == "f":
        return "f4" if dtype.itemsize <= 4 else "f8"
    return f"{dtype.kind}{dtype.itemsize}"
