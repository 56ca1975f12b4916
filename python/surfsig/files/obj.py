"""OBJ: reads vertices, their colours and normals, and faces of any number of corners."""

from __future__ import annotations

import re
from array import array
from dataclasses import dataclass, field
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import with_colours
from surfsig.files.lines import Block, line_blocks, parse, warn_unterminated
from surfsig.files.opening import Opening
from surfsig.files.progress import Progress
from surfsig.files.triangles import normal_fields, sampled
from surfsig.point_cloud import PointCloud

_KEYWORDS = (
    "v", "vt", "vn", "vp", "f", "fo", "l", "p", "o", "g", "s", "mg", "usemtl", "mtllib", "maplib", "usemap",
    "shadow_obj", "trace_obj", "bevel", "c_interp", "d_interp", "lod", "deg", "bmat", "step", "cstype",
    "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con", "call", "csh", "ctech",
    "stech",
)  # fmt: skip
_BLANK = rb"(?:[ \t]*(?:#[^\n]*)?\r?\n)*[ \t]*"
_FIRST = re.compile(_BLANK + rb"(?:" + "|".join(_KEYWORDS).encode() + rb")[ \t]")
_COMMENTS = re.compile(_BLANK + rb"(?:#[^\n]*)?\Z")
_VERTEX = re.compile(rb"^[ \t]*v[ \t]+[-+.\d]", re.MULTILINE)
# Values of a `v` line: x y z, perhaps a weight, perhaps red green blue and alpha.
_COLOURS_OF = {3: 0, 4: 0, 6: 3, 7: 4}


def _integers() -> array[int]:
    return array("q")


@dataclass
class _Contents:
    """What was read so far; corners and normals of faces are numbered as in the file, from 1."""

    vertices: list[NDArray[np.float64]] = field(default_factory=list)
    normals: list[NDArray[np.float64]] = field(default_factory=list)
    width: int = 0
    vertex_count: int = 0
    normal_count: int = 0
    corners: array[int] = field(default_factory=_integers)
    corner_normals: array[int] = field(default_factory=_integers)
    face_sizes: array[int] = field(default_factory=_integers)
    face_lines: array[int] = field(default_factory=_integers)


def recognise(opening: Opening) -> bool:
    """Tell by the first statement, and a vertex near it; under its extension the one or comments will do."""
    if not opening.is_text:
        return False
    first = _FIRST.match(opening.head) is not None
    if opening.extension == ".obj":
        return first or _COMMENTS.match(opening.head) is not None
    return first and _VERTEX.search(opening.head) is not None


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open OBJ file: its vertices in their order, or points spread over its faces.

    Colours of vertices become red, green, blue (and alpha), and normals nx, ny, nz where there is one for
    each vertex. Points on the faces have their triangle's normal.

    Raises
    ------
    FileFormatError
        Naming the first line that makes no sense.
    """
    contents = _Contents()
    last: Block | None = None
    for last in line_blocks(file, 1, progress):
        _take(contents, last, source)
    if not contents.vertex_count:
        raise FileFormatError(f"{source}: holds no points")
    if last is not None and last.unterminated:
        warn_unterminated(source, last.first + len(last.lines) - 1)
    table = np.concatenate(contents.vertices)
    points = np.ascontiguousarray(table[:, :3])
    corners = _checked(contents, source)
    if samples is not None:
        return sampled(points, _triangles(corners, np.array(contents.face_sizes, np.intp)), samples, source)
    fields = _colours(table)
    if contents.normal_count == len(points) and (
        not contents.corner_normals or contents.corner_normals == contents.corners
    ):
        fields |= normal_fields(np.concatenate(contents.normals))
    return PointCloud(points, fields=fields)


def _take(contents: _Contents, block: Block, source: str) -> None:
    """Add a block of lines; the texts of vertices and of normals keep their places, for messages."""
    vertices = [""] * len(block.lines)
    normals = [""] * len(block.lines)
    for i, line in enumerate(block.lines):
        keyword, *rest = line.partition("#")[0].split(None, 1) or [""]
        match keyword:
            case "v":
                vertices[i] = rest[0] if rest else keyword
                contents.vertex_count += 1
                if not contents.width:
                    contents.width = len(vertices[i].split())
            case "vn":
                normals[i] = rest[0] if rest else keyword
                contents.normal_count += 1
            case "f":
                _take_face(contents, rest[0] if rest else "", block.first + i, source)
            case word if word and word not in _KEYWORDS:
                text = line.strip()[:40]
                raise FileFormatError(
                    f"{source}: line {block.first + i} of the OBJ file makes no sense: {text!r}"
                )
    width = contents.width if contents.width in _COLOURS_OF else 3
    contents.vertices.append(parse(vertices, np.float64, width, source=source, first=block.first))
    contents.normals.append(parse(normals, np.float64, 3, source=source, first=block.first))


def _take_face(contents: _Contents, text: str, number: int, source: str) -> None:
    """Add a face: each corner is VERTEX, VERTEX/TEXTURE, VERTEX//NORMAL or VERTEX/TEXTURE/NORMAL."""
    try:
        if "/" in text:
            parts = [token.split("/") for token in text.split()]
            corners = [int(part[0]) for part in parts]
            normals = [int(part[2]) for part in parts if len(part) > 2]
        else:
            corners, normals = [int(token) for token in text.split()], []
        contents.corners.extend(_absolute(corners, contents.vertex_count))
        contents.corner_normals.extend(_absolute(normals, contents.normal_count))
    except (ValueError, OverflowError):
        raise FileFormatError(f"{source}: line {number}: {text.strip()[:40]!r} is no face") from None
    if len(corners) < 3:
        raise FileFormatError(f"{source}: line {number}: a face needs three corners")
    contents.face_sizes.append(len(corners))
    contents.face_lines.append(number)


def _absolute(indices: list[int], count: int) -> list[int]:
    """Resolve negative numbers, which count back from the last one so far."""
    if min(indices, default=0) >= 0:
        return indices
    return [index if index >= 0 else count + 1 + index for index in indices]


def _checked(contents: _Contents, source: str) -> NDArray[np.intp]:
    """Give the corners numbered from 0; raise where a face has one that the file does not hold."""
    corners = np.array(contents.corners, np.intp) - 1
    bad = np.flatnonzero((corners < 0) | (corners >= contents.vertex_count))
    if len(bad):
        ends = np.cumsum(contents.face_sizes)
        line = contents.face_lines[int(np.searchsorted(ends, bad[0], side="right"))]
        raise FileFormatError(
            f"{source}: line {line}: a face has the corner {contents.corners[bad[0]]}, "
            f"the file {contents.vertex_count} vertices"
        )
    return corners


def _triangles(corners: NDArray[np.intp], sizes: NDArray[np.intp]) -> NDArray[np.intp]:
    """Cut faces into fans of triangles around their first corners."""
    starts = np.cumsum(sizes) - sizes
    first = np.repeat(starts, sizes - 2)
    step = np.arange(len(first)) - np.repeat(np.cumsum(sizes - 2) - (sizes - 2), sizes - 2)
    return np.stack([corners[first], corners[first + step + 1], corners[first + step + 2]], axis=1)


def _colours(table: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Give the colours behind the coordinates, which are 0 to 1, or 0 to 255, as bytes where they fit."""
    count = _COLOURS_OF[table.shape[1]]
    colours = table[:, table.shape[1] - count :].T
    if count and ((colours >= 0) & (colours <= 1)).all():
        colours = np.round(colours * 255)
    return with_colours(dict(zip(("red", "green", "blue", "alpha"), colours.copy(), strict=False)))
