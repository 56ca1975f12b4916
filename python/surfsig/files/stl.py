"""STL, ASCII and binary: triangles without shared vertices."""

from __future__ import annotations

import os
import re
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.lines import line_blocks, parse
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

ASCII_MAGIC = re.compile(rb"\s*solid\b.*?\b(facet|endsolid)\b", re.IGNORECASE | re.DOTALL)

_HEADER_BYTES = 84
_FACET = np.dtype([("normal", "<f4", 3), ("corners", "<f4", (3, 3)), ("attribute", "<u2")])
_BLOCK_FACETS = 1 << 16
_WORD = re.compile(r"\s*(solid|facet|vertex|endfacet|endsolid)\b(.*)", re.IGNORECASE)


def is_whole_binary(head: bytes, size: int) -> bool:
    """Tell whether a file of `size` bytes holds as many facets as byte 80 says: binary STL has no magic."""
    count = _count(head)
    return count > 0 and size == _HEADER_BYTES + count * _FACET.itemsize


def read_ascii(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open ASCII STL file; see `read_binary`. Coordinates become float64.

    Raises
    ------
    FileFormatError
        If it is cut off or broken; the message names the line.
    """
    corners = [np.empty((0, 3))]
    words = {"solid": 0, "facet": 0, "vertex": 0, "endfacet": 0, "endsolid": 0}
    for block in line_blocks(file, 1, progress):
        vertices = []
        for line in block.lines:
            found = _WORD.match(line)
            if found is not None:
                word = found[1].lower()
                words[word] += 1
                if word == "vertex":
                    vertices.append(found[2])
                    continue
            # An empty line keeps the numbers of the others right.
            vertices.append("")
        corners.append(parse(vertices, np.float64, 3, source=source, first=block.first))
    facets, count = words["facet"], sum(map(len, corners))
    if words["endfacet"] != facets or not words["vertex"] == count == 3 * facets:
        raise FileFormatError(
            f"{source}: cut off or broken: {facets} facets begin, {words['endfacet']} end, and they have "
            f"{count} vertices"
        )
    if words["solid"] != words["endsolid"]:
        raise FileFormatError(
            f"{source}: cut off or broken: {words['solid']} solids begin, {words['endsolid']} end"
        )
    return _cloud(np.concatenate(corners), source, samples)


def read_binary(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open binary STL file.

    Equal corners become one vertex, whose fields nx, ny, nz are the mean of its faces' normals, weighted by
    their areas. With `samples`, that many points spread over the surface, with the normals of their faces.

    Raises
    ------
    FileFormatError
        If it is cut off or broken.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.
    """
    size = os.fstat(file.fileno()).st_size
    head = file.read(_HEADER_BYTES)
    progress.advance(len(head))
    if len(head) < _HEADER_BYTES:
        raise FileFormatError(f"{source}: cut off: a binary STL file has {_HEADER_BYTES} bytes or more")
    count = _count(head)
    if size != _HEADER_BYTES + count * _FACET.itemsize:
        raise FileFormatError(
            f"{source}: cut off or broken: its header promises {count} facets of {_FACET.itemsize} bytes, "
            f"the file has {size}"
        )
    corners = np.empty((count, 3, 3), np.float32)
    for start in range(0, count, _BLOCK_FACETS):
        rows = corners[start : start + _BLOCK_FACETS]
        data = file.read(len(rows) * _FACET.itemsize)
        rows[:] = np.frombuffer(data, _FACET)["corners"]
        progress.advance(len(data))
    return _cloud(corners.reshape(-1, 3), source, samples)


def _count(head: bytes) -> int:
    return int.from_bytes(head[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")


def _cloud(corners: NDArray[Any], source: str, samples: int | None) -> PointCloud:
    mesh.check_vertices(corners, source)
    vertices, triangles = mesh.merged(corners)
    if samples is not None:
        return mesh.sampled(vertices, triangles, samples, source)
    return mesh.with_normals(vertices, mesh.vertex_normals(vertices, triangles))
