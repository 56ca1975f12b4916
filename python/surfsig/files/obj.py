"""Wavefront OBJ: vertices, with colours and normals where each has one, and faces to spread samples over."""

from __future__ import annotations

import re
from itertools import pairwise
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.columns import cloud_from_columns
from surfsig.files.lines import Block, fault, line_blocks, parse, tokens_of, warn_unterminated
from surfsig.files.progress import Progress
from surfsig.point_cloud import PointCloud

_WORDS = (
    "v", "vn", "vt", "vp", "f", "fo", "l", "p", "o", "g", "s", "mg", "mtllib", "usemtl", "maplib", "usemap",
    "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj", "ctech", "stech", "cstype", "deg",
    "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con", "call",
    "csh",
)  # fmt: skip
_LINE = rb"[ \t]*(?:(?:" + "|".join(_WORDS).encode() + rb")(?:[ \t][^\r\n]*)?|#[^\r\n]*)?"
_VERTEX = rb"[ \t]*v(?:[ \t]+[-+.\deE]+){3,}[ \t]*"
# Whole lines of OBJ's words, of which one is a vertex.
MAGIC = re.compile(rb"(?:\xef\xbb\xbf)?(?:" + _LINE + rb"[\r\n])*?" + _VERTEX + rb"(?:[\r\n]|$)")

# Python's own limit on digits would raise an error of another kind.
_NUMBER = re.compile(r"[-+]?\d{1,18}", re.ASCII)
_COLOURS = ("red", "green", "blue")


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open OBJ file.

    The vertices are those of the file, in its order, as float64. Three numbers after a vertex's coordinates
    are its colour: uint8 where all are whole numbers from 0 to 255, or 255 times those where they are 0 to 1.
    Normals (nx, ny, nz) come from the file if there is one per vertex and the faces use it so. With
    `samples`, that many points spread over the faces, with the faces' normals. Materials, textures, lines and
    free-form surfaces are not read.

    Raises
    ------
    FileFormatError
        If a line is broken or a face refers to a vertex that is missing; the message names the line.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.
    """
    parts = _Parts(source)
    if file.read(3) != b"\xef\xbb\xbf":
        file.seek(0)
    for block in line_blocks(file, 1, progress):
        parts.add(block)
        if block.unterminated:
            warn_unterminated(source, block.first + len(block.lines) - 1)
    vertices, triangles = parts.finished()
    mesh.check_vertices(vertices[:, :3], source)
    if samples is not None:
        return mesh.sampled(vertices[:, :3], triangles, samples, source)
    columns: dict[str, NDArray[Any]] = {axis: vertices[:, i] for i, axis in enumerate("xyz")}
    columns.update(_colours(vertices[:, 3:]))
    normals = parts.normals()
    if normals is not None:
        columns.update(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
    return cloud_from_columns(columns, source=source)


class _Parts:
    """The parts of the file that count, gathered block by block."""

    def __init__(self, source: str) -> None:
        self._source = source
        self._width = 0
        self._vertices: list[NDArray[np.float64]] = []
        self._normals: list[NDArray[np.float64]] = []
        self._triangles: list[NDArray[np.intp]] = []
        self._count = self._normal_count = 0
        self._highest, self._highest_line = -1, 0
        self._normals_alike = True
        self._continued = ""

    def add(self, block: Block) -> None:
        """Take the vertices, normals and faces of some lines."""
        rows: dict[str, list[str]] = {"v": [""] * len(block.lines), "vn": [""] * len(block.lines)}
        triangles: list[int] = []
        for number, line in enumerate(block.lines):
            if self._continued:
                line, self._continued = self._continued + line, ""
            if line.endswith("\\"):
                self._continued = line[:-1] + " "
                continue
            word, _, rest = line.strip().replace("\t", " ").partition(" ")
            if word == "v":
                self._count += 1
                rows[word][number] = rest
            elif word == "vn":
                self._normal_count += 1
                rows[word][number] = rest
            elif word == "f":
                triangles += self._face(rest, block.first + number)
            elif word and not word.startswith("#") and word not in _WORDS:
                raise FileFormatError(
                    f"{self._source}: line {block.first + number} is none of OBJ's: {line.strip()[:40]!r}"
                )
        if triangles:
            self._triangles.append(np.array(triangles, np.intp).reshape(-1, 3))
        self._add_numbers(rows["v"], block.first)
        self._normals.append(
            parse(rows["vn"], np.float64, 3, source=self._source, first=block.first, comments=True)
        )

    def finished(self) -> tuple[NDArray[np.float64], NDArray[np.intp]]:
        """Give the vertices (n, 3 or more) and triangles (t, 3)."""
        if self._highest >= self._count:
            raise FileFormatError(
                f"{self._source}: line {self._highest_line}: a face refers to vertex {self._highest + 1}, "
                f"there are {self._count}"
            )
        if sum(map(len, self._vertices)) != self._count or not self._count:
            raise FileFormatError(f"{self._source}: has no vertices, or some without numbers")
        return np.concatenate(self._vertices), np.concatenate([np.empty((0, 3), np.intp), *self._triangles])

    def normals(self) -> NDArray[np.float64] | None:
        """Give the vertices' normals, if each vertex has just one."""
        normals = np.concatenate(self._normals)
        return normals if self._normals_alike and len(normals) == self._count else None

    def _add_numbers(self, lines: list[str], first: int) -> None:
        if not any(lines):
            return
        if not self._width:
            self._width = len(tokens_of(next(filter(None, lines)), None))
            if self._width < 3:
                number = next(i for i, line in enumerate(lines) if line)
                found = fault(lines[number], 3, None, comments=True)
                raise FileFormatError(
                    f"{self._source}: line {first + number}: {found[0] if found else 'no coordinates'}"
                )
        self._vertices.append(
            parse(lines, np.float64, self._width, source=self._source, first=first, comments=True)
        )

    def _face(self, text: str, line: int) -> list[int]:
        """Cut a face into triangles that share its first corner."""
        corners = []
        # Not `tokens_of`, to which "//" begins a comment.
        for corner in text.partition("#")[0].split():
            numbers = corner.split("/")
            vertex = self._index(numbers[0], self._count, line)
            if vertex > self._highest:
                self._highest, self._highest_line = vertex, line
            if len(numbers) > 2 and numbers[2]:
                normal = self._index(numbers[2], self._normal_count, line)
                self._normals_alike = self._normals_alike and normal == vertex
            corners.append(vertex)
        if len(corners) < 3:
            raise FileFormatError(f"{self._source}: line {line}: a face with {len(corners)} corners")
        fan = pairwise(corners[1:])
        return [index for second, third in fan for index in (corners[0], second, third)]

    def _index(self, text: str, count: int, line: int) -> int:
        """Turn a number from 1, or one that counts back from the last one so far, into one from 0."""
        if _NUMBER.fullmatch(text) is None:
            raise FileFormatError(f"{self._source}: line {line}: {text[:40]!r} is no number of a vertex")
        number = int(text)
        index = number - 1 if number > 0 else count + number
        if number == 0 or index < 0:
            raise FileFormatError(
                f"{self._source}: line {line}: a face refers to vertex {number}, {count} are before it"
            )
        return index


def _colours(values: NDArray[np.float64]) -> dict[str, NDArray[Any]]:
    """Name what stands behind the coordinates: a colour, or else one weight, which is left out."""
    if values.shape[1] < 3:
        return {}
    colours = values[:, :3]
    if ((colours >= 0) & (colours <= 1)).all():
        colours = np.round(255 * colours).astype(np.uint8)
    return dict(zip(_COLOURS, colours.T, strict=True))
