"""STL: reads ASCII and binary meshes, whose triangles each repeat their three corners."""

from __future__ import annotations

import os
import re
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import filled_columns
from surfsig.files.lines import line_blocks, parse
from surfsig.files.opening import Opening
from surfsig.files.progress import Progress
from surfsig.files.rows import row_blocks
from surfsig.files.triangles import merged, normal_fields, sampled, vertex_normals
from surfsig.point_cloud import PointCloud

_ASCII = re.compile(rb"\s*solid\b[^\n]*\n\s*(facet|endsolid)\b", re.IGNORECASE)
# Any 80 bytes, then the number of triangles.
_HEADER_BYTES = 84
# A normal before the corners and two bytes of anything behind them are passed over.
_TRIANGLE = np.dtype({"names": ["corners"], "formats": [("<f4", (3, 3))], "offsets": [12], "itemsize": 50})
_KEYWORDS = ("solid", "facet", "outer", "vertex", "endloop", "endfacet", "endsolid")


def recognise(opening: Opening) -> bool:
    """Tell an ASCII file by its first lines, a binary one, which has no mark, by its size."""
    if opening.is_text:
        return _ASCII.match(opening.head) is not None
    count = _count(opening.head)
    return (bool(count) and opening.size == _size(count)) or opening.extension == ".stl"


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open STL file: its vertices, each once, or points spread over its surface.

    Vertices have the mean normals of their triangles as fields nx, ny, nz, points on the surface their own
    triangle's; the file's normals are not looked at, the order of the corners tells the side. Coordinates
    are float32 of a binary file, float64 of an ASCII one and of samples.

    Raises
    ------
    FileFormatError
        If it is cut off or broken.
    """
    opening = Opening.of(Path(source), file)
    corners = (_read_ascii if opening.is_text else _read_binary)(file, source, progress)
    vertices, faces = merged(corners)
    if samples is not None:
        return sampled(vertices, faces, samples, source)
    return PointCloud(vertices, fields=normal_fields(vertex_normals(vertices, faces)))


def _count(head: bytes) -> int:
    return int.from_bytes(head[_HEADER_BYTES - 4 : _HEADER_BYTES], "little")


def _size(count: int) -> int:
    return _HEADER_BYTES + count * _TRIANGLE.itemsize


def _read_binary(file: BinaryIO, source: str, progress: Progress) -> NDArray[Any]:
    size = os.fstat(file.fileno()).st_size
    count = _count(file.read(_HEADER_BYTES))
    if size < _size(count):
        raise FileFormatError(
            f"{source}: cut off: {count} triangles need {_size(count)} bytes, the file has {size}"
        )
    blocks = row_blocks(file, _TRIANGLE, count, source, progress)
    return filled_columns(_TRIANGLE, count, blocks)["corners"].reshape(-1, 3)


def _read_ascii(file: BinaryIO, source: str, progress: Progress) -> NDArray[Any]:
    blocks: list[NDArray[Any]] = [np.empty((0, 3))]
    facets = corners = 0
    inside = False
    for block in line_blocks(file, 1, progress):
        coordinates = [""] * len(block.lines)
        for i, line in enumerate(block.lines):
            keyword, *rest = line.lower().split(None, 1) or [""]
            match keyword:
                case "vertex":
                    coordinates[i] = rest[0] if rest else keyword
                    corners += 1
                case "facet":
                    facets += 1
                case "endfacet" if corners != 3 * facets:
                    raise FileFormatError(f"{source}: line {block.first + i}: a facet without three corners")
                case "solid" | "endsolid":
                    inside = keyword == "solid"
                case word if word and word not in _KEYWORDS:
                    raise FileFormatError(
                        f"{source}: line {block.first + i} of the STL file makes no sense: "
                        f"{line.strip()[:40]!r}"
                    )
        blocks.append(parse(coordinates, np.float64, 3, source=source, first=block.first))
    if inside or corners != 3 * facets:
        raise FileFormatError(f"{source}: cut off: its last solid does not end")
    return np.concatenate(blocks)
