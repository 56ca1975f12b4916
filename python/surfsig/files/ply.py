"""PLY: reads ASCII and both binary orders, writes binary little-endian."""

from __future__ import annotations

import itertools
import os
import warnings
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import replace
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.coordinate_system import CoordinateSystem
from surfsig.errors import FileFormatError
from surfsig.files import mesh
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
from surfsig.files.ply_elements import Element, element_blocks, skip_element
from surfsig.files.ply_faces import Faces
from surfsig.files.ply_header import read_header
from surfsig.files.rows import write_rows
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

_NAMES = {
    "i1": "char", "u1": "uchar", "i2": "short", "u2": "ushort", "i4": "int", "u4": "uint", "f4": "float",
    "f8": "double",
}  # fmt: skip
# Beyond it, double does not hold every whole number.
_DOUBLE_HOLDS = 2**53


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read the vertices of an open PLY file; other elements and list properties are skipped.

    Of two properties with one name, the second is numbered (x_2), or left out if it is the same. With
    `samples`, that many points spread over the faces, with the faces' normals.

    Raises
    ------
    FileFormatError
        If the header makes no sense, has no vertices, or promises more than the file holds.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.

    Warns
    -----
    UserWarning
        If a name occurs twice, the vertices have another name, or faces are left out.
    """
    header = read_header(file, source, os.fstat(file.fileno()).st_size)
    position = header.vertex(source)
    vertex = header.elements[position]
    twice = vertex.rename_twice()
    faces = None if samples is None else Faces.among(header.elements, position, source)
    size = os.fstat(file.fileno()).st_size - file.tell()
    least = sum(element.least_bytes(ascii=not header.order) for element in header.elements)
    if least > size + 1:
        raise FileFormatError(
            f"{source}: cut off: its header promises {vertex.count} points and so at least {least} bytes "
            f"of data, {size} are there"
        )
    if header.order:
        for number, element in enumerate(header.elements):
            if number == position:
                blocks = element_blocks(file, vertex, source, progress)
                columns = filled_columns(vertex.single_dtype(), vertex.count, blocks)
            else:
                lists = faces.lists if faces is not None and number == faces.position else None
                skip_element(file, element, source, progress, lists=lists)
    else:
        counts = [element.count for element in header.elements]
        start = file.tell()
        rows = take_rows(
            file,
            vertex.ascii_dtype(),
            vertex.count,
            source=source,
            first=header.lines + 1,
            progress=progress,
            skip=sum(counts[:position]),
            after=sum(counts[position + 1 :]),
            select=vertex.without_lists if vertex.has_lists else None,
        )
        columns = columns_of(rows)
        if faces is not None:
            file.seek(start)
            faces.take_lines(file, header.elements)
    axes = {item.dtype for item in vertex.properties if item.name.lower() in ("x", "y", "z")}
    cloud = cloud_from_columns(
        _without_equal(columns, twice, source),
        source=source,
        viewpoint=_numbers(header.notes.get("viewpoint", ""), 3),
        grid=_grid(header.notes.get("grid", ""), vertex.count),
        declared_float32=not header.order and all(kind.endswith("f4") for kind in axes),
    )
    cloud.coordinate_system = CoordinateSystem.from_text(header.notes.get("coordinate_system", ""))
    if samples is None or faces is None:
        return cloud
    mesh.check_vertices(cloud.offsets, source)
    triangles = mesh.fans(*faces.lists.joined(), len(cloud), source)
    return mesh.sampled(cloud.offsets, triangles, samples, source)


def clouds(file: BinaryIO, source: str, progress: Progress) -> Iterator[PointCloud] | None:
    """Give an open file's vertices block by block, with colours as they are stored, and without faces.

    Returns
    -------
    Iterator of PointCloud or None
        None where the file must be read as one: ASCII, and properties of the same name.

    Raises
    ------
    FileFormatError
        As `read`.
    """
    header = read_header(file, source, os.fstat(file.fileno()).st_size)
    position = header.vertex(source)
    vertex = header.elements[position]
    if not header.order or vertex.rename_twice():
        return None
    return _clouds(file, header.elements, position, header.notes, source, progress)


def _clouds(
    file: BinaryIO,
    elements: Sequence[Element],
    position: int,
    notes: Mapping[str, str],
    source: str,
    progress: Progress,
) -> Iterator[PointCloud]:
    for element in elements[:position]:
        skip_element(file, element, source, progress)
    dtype = elements[position].single_dtype()
    for block in itertools.chain(
        [np.empty(0, dtype)], element_blocks(file, elements[position], source, progress)
    ):
        yield replace(
            cloud_from_columns(
                filled_columns(dtype, len(block), [block]),
                source=source,
                viewpoint=_numbers(notes.get("viewpoint", ""), 3),
                typed_colours=False,
            ),
            coordinate_system=CoordinateSystem.from_text(notes.get("coordinate_system", "")),
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
    if cloud.coordinate_system is not None:
        told["coordinate_system"] = cloud.coordinate_system.to_text()
    if cloud.grid is not None:
        told["grid"] = f"{cloud.grid[0]} {cloud.grid[1]}"
    header += [f"comment surfsig {key} {' '.join(value.split())}" for key, value in told.items()]
    header += [f"element vertex {len(cloud)}"]
    header += [f"property {_NAMES[kind]} {name}" for name, kind in zip(names, types, strict=True)]
    file.write("\n".join([*header, "end_header\n"]).encode())
    write_rows(file, parts, tail, len(cloud), progress)


def _without_equal(
    columns: dict[str, NDArray[Any]], twice: Mapping[str, str], source: str
) -> dict[str, NDArray[Any]]:
    """Leave out what stands in the file twice; `twice` has the names of second columns, and the file's."""
    equal = {name for name, first in twice.items() if _same(columns, name, first)}
    different = [name for name in twice if name in columns and name not in equal]
    if different:
        told = ", ".join(f"'{twice[name][:40]}'" for name in different[:3])
        warnings.warn(
            f"{source}: several properties of the vertices are called {told}; of each, the first keeps its "
            f"name, the next is '{different[0][:40]}'",
            stacklevel=3,
        )
    return {name: values for name, values in columns.items() if name not in equal}


def _same(columns: Mapping[str, NDArray[Any]], name: str, first: str) -> bool:
    if name not in columns or first not in columns:
        return False
    floating = {columns[name].dtype.kind, columns[first].dtype.kind} <= {"f"}
    return np.array_equal(columns[name], columns[first], equal_nan=floating)


def _stored_type(values: NDArray[Any]) -> str:
    """Choose PLY's type for a column; 64-bit whole numbers that do not fit 32 bits become double.

    There are no 64-bit whole numbers that every program reads.

    Warns
    -----
    UserWarning
        If double rounds them.
    """
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
    if int(values.max()) > _DOUBLE_HOLDS or int(values.min()) < -_DOUBLE_HOLDS:
        warnings.warn("PLY has no whole numbers of 64 bits: some are rounded to double", stacklevel=4)
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
