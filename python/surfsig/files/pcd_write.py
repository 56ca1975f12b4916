"""PCD: writes binary data, with colours packed as PCL and Open3D have them."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.files.columns import (
    PCL_NORMALS,
    Chunks,
    blocks_of,
    exact_float32,
    header_word,
    unique_name,
)
from surfsig.files.pcd_header import EXACT, NOTE, OWN_NOTES, PACKED_COLOURS
from surfsig.files.rows import write_rows
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

# `rgb` and `rgba` mean packed colours to every reader, and `_` means padding.
RESERVED = ("x", "y", "z", *EXACT, *PACKED_COLOURS, "_")

# The most by which float may move a point, as a share of the cloud's extent: a hundredth of the distance
# between the points of a scan of a million.
_ROUNDING = 1e-5


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
    """Write points and columns; (n, k) columns are fields with a COUNT of k.

    x, y and z are always floats: PCL's point types and Open3D's `read_point_cloud` take no others, and leave
    every point at 0. Coordinates that float would change stand once more as doubles, in `x_double`, ..., for
    this library and for those who look; where float would move points by more than `_ROUNDING`, x, y and z
    are about an origin, which a comment says.

    Warns
    -----
    UserWarning
        If x, y and z are written about an origin.
    """
    points = cloud.points
    # A note that the reader would take for one of those below is called otherwise.
    notes = {f"note_{key}" if key in OWN_NOTES else key: value for key, value in notes.items()}
    origin, exact = np.zeros(3), exact_float32(points)
    if not exact:
        origin = _origin(cloud)
    if origin.any():
        told = ", ".join(f"{number:.12g}" for number in origin)
        warnings.warn(
            f"x, y and z are written about the origin {told}, because most readers of PCD take floats only, "
            "which are too coarse so far from 0; surfsig adds it again, other programs do not",
            stacklevel=4,
        )
        notes["origin"] = _words(origin)
        if cloud.viewpoint is not None:
            notes["viewpoint"] = _words(cloud.viewpoint)
    if cloud.coordinate_system is not None:
        notes["coordinate_system"] = cloud.coordinate_system.to_text()
    near = points
    if not exact:
        with np.errstate(over="ignore", invalid="ignore"):
            near = (points - origin).astype(np.float32)
    fields = {name: Field("f4", 1, [("f4", values)]) for name, values in zip("xyz", near.T, strict=True)}
    if not exact:
        fields |= {
            name: Field("f8", 1, [("f8", values)]) for name, values in zip(EXACT, points.T, strict=True)
        }
    fields |= _fields(columns, reserved=() if chunks is None else (header_word(chunks.name),))
    parts = [part for field in fields.values() for part in field.parts]
    tail = None
    if chunks is not None:
        tail = (_stored_type(np.dtype(chunks.dtype)), chunks)
        fields[header_word(chunks.name)] = Field(tail[0], chunks.width, [])
    file.write("\n".join([*_header(cloud, fields, notes, origin), ""]).encode())
    write_rows(file, parts, tail, len(cloud), progress)


def _origin(cloud: PointCloud) -> NDArray[np.float64]:
    """Choose about what x, y and z are written: 0, or round numbers in the middle of points far from it."""
    points = cloud.points[cloud.finite]
    if not len(points):
        return np.zeros(3)
    low, high = points.min(axis=0), points.max(axis=0)
    with np.errstate(over="ignore", invalid="ignore"):
        extent = float((high - low).max())
        moved = max(float(np.abs(part.astype(np.float32) - part).max()) for part in blocks_of(points))
        # Points that are all in one place have no distances that float could spoil.
        if not extent or moved <= _ROUNDING * extent or not np.isfinite([extent, moved]).all():
            return np.zeros(3)
    step = 10.0 ** np.floor(np.log10(extent))
    origin: NDArray[np.float64] = np.rint((low + high) / 2 / step) * step + 0.0
    return origin


def _words(numbers: NDArray[Any]) -> str:
    return " ".join(repr(float(number)) for number in numbers)


def _header(
    cloud: PointCloud, fields: Mapping[str, Field], notes: Mapping[str, str], origin: NDArray[np.float64]
) -> list[str]:
    height, width = cloud.grid or (1, len(cloud))
    lines = ["# .PCD v0.7 - Point Cloud Data file format", "VERSION 0.7"]
    lines += [f"{NOTE}{key} {' '.join(value.split())}" for key, value in notes.items()]
    lines += [f"FIELDS {' '.join(fields)}"]
    lines += [f"SIZE {' '.join(field.type[1] for field in fields.values())}"]
    lines += [f"TYPE {' '.join(field.type[0].upper() for field in fields.values())}"]
    lines += [f"COUNT {' '.join(str(field.count) for field in fields.values())}"]
    lines += [f"WIDTH {width}", f"HEIGHT {height}"]
    # Where nobody said from where the points were seen, no line says so either.
    if cloud.viewpoint is not None:
        lines += [f"VIEWPOINT {_words(cloud.viewpoint - origin)} 1 0 0 0"]
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
