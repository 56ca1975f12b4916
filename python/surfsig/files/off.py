"""OFF in ASCII: vertices, with colours (COFF) and normals (NOFF), and faces to spread samples over."""

from __future__ import annotations

import re
import warnings
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.colours import ALPHA, CHANNELS
from surfsig.files.columns import cloud_from_columns
from surfsig.files.encodings import decoded
from surfsig.files.lines import Block, line_blocks, parse, tokens_of, warn_unterminated
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

_WORD = r"(ST)?(C)?(N)?([4n]*)OFF"
# Some programs leave out the line end after the word, and so its first number follows.
MAGIC = re.compile((r"(?:\s|#[^\r\n]*[\r\n])*" + _WORD + r"(?=[\s#\d]|$)").encode())
# The word may be missing.
COUNTS_ALONE = re.compile(rb"\s*\d+[ \t]+\d+[ \t]+\d+[ \t]*[\r\n]")

_HEADER = re.compile(_WORD + r"\s*(.*)")
_NUMBER = re.compile(r"\d{1,12}", re.ASCII)
_DECIMAL = re.compile(r"[.eE]")
_NORMALS = ("nx", "ny", "nz")


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open OFF file.

    The vertices are those of the file, in its order, as float64, with nx, ny, nz where it is called NOFF and
    red, green, blue (and alpha) where it is called COFF; see `with_colours` for those of a text. With
    `samples`, that many points spread over the faces, with the faces' normals.

    Raises
    ------
    FileFormatError
        If it is binary, of other than three dimensions, cut off, or broken; the message names the line.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.

    Warns
    -----
    UserWarning
        If faces are left out, which have fewer than three corners or refer to vertices that are missing; if
        numbers of the vertices are left out, which no prefix of the word OFF announces.
    """
    parts = _Parts(source, keep_faces=samples is not None)
    for block in line_blocks(decoded(file), 1, progress):
        parts.add(block)
    table, names = parts.finished()
    points = np.ascontiguousarray(table[:, :3])
    mesh.check_vertices(points, source)
    if samples is not None:
        triangles = mesh.fans(*parts.faces(), len(points), source)
        return mesh.sampled(points, triangles, samples, source)
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T, strict=True))
    for name, values in zip(names, table.T[3:], strict=False):
        columns[name] = values.astype(np.float32) if name in _NORMALS else values
    return cloud_from_columns(columns, source=source, decimals=parts.decimals)


class _Parts:
    """What the file holds, gathered block by block: a word, counts, vertices, faces."""

    def __init__(self, source: str, *, keep_faces: bool) -> None:
        self.decimals: list[str] = []
        self._source = source
        self._keep_faces = keep_faces
        self._prefixes: tuple[str, ...] = ()
        self._counts: tuple[int, int] | None = None
        self._begun = False
        self._tables: list[NDArray[np.float64]] = []
        self._names: list[str] = []
        self._width = 0
        self._vertex_count = self._face_count = 0
        self._lengths: list[NDArray[np.int64]] = []
        self._corners: list[NDArray[np.int64]] = []

    def add(self, block: Block) -> None:
        """Take what some lines hold."""
        vertices = [""] * len(block.lines)
        faces: list[list[int]] = []
        for i, line in enumerate(block.lines):
            text = line.partition("#")[0].strip()
            if not text:
                continue
            if self._counts is None:
                self._take_header(text, block.first + i)
            elif self._vertex_count < self._counts[0]:
                self._vertex_count += 1
                if not self._width:
                    self._take_first(text, block.first + i)
                vertices[i] = text
                if block.unterminated and i == len(block.lines) - 1:
                    warn_unterminated(self._source, block.first + i)
            elif self._face_count < self._counts[1]:
                self._face_count += 1
                if self._keep_faces:
                    faces.append(_face(text))
        if self._width:
            self._tables.append(
                parse(vertices, np.float64, self._width, source=self._source, first=block.first)
            )
        if faces:
            self._lengths.append(np.array([len(face) for face in faces], np.int64))
            self._corners.append(np.array([corner for face in faces for corner in face], np.int64))

    def finished(self) -> tuple[NDArray[np.float64], list[str]]:
        """Give the vertices' numbers, and the names of those behind x, y and z.

        Raises
        ------
        FileFormatError
            If there are fewer than the counts promise.
        """
        if self._counts is None:
            raise FileFormatError(
                f"{self._source}: cut off: the OFF file does not say how many vertices it has"
            )
        if (self._vertex_count, self._face_count) != self._counts:
            raise FileFormatError(
                f"{self._source}: cut off: {self._counts[0]} vertices and {self._counts[1]} faces are "
                f"promised, {self._vertex_count} and {self._face_count} are there"
            )
        return np.concatenate([np.empty((0, max(self._width, 3))), *self._tables]), self._names

    def faces(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Give how many corners each face has, and all corners."""
        none = np.empty(0, np.int64)
        return np.concatenate([none, *self._lengths]), np.concatenate([none, *self._corners])

    def _take_header(self, text: str, line: int) -> None:
        found = None if self._begun else _HEADER.fullmatch(text)
        self._begun = True
        if found is not None:
            texture, colours, normals, dimensions, text = found.groups(default="")
            if dimensions:
                raise FileFormatError(f"{self._source}: an OFF file of other than three dimensions")
            if text.split()[:1] == ["BINARY"]:
                raise FileFormatError(f"{self._source}: a binary OFF file, which cannot be read (ASCII can)")
            self._prefixes = tuple(filter(None, (normals, colours, texture)))
            if not text:
                return
        counts = text.split()
        if len(counts) not in (2, 3) or not all(_NUMBER.fullmatch(count) for count in counts):
            raise FileFormatError(
                f"{self._source}: line {line}: {text[:40]!r} is not how many vertices, faces and edges there "
                "are"
            )
        self._counts = int(counts[0]), int(counts[1])

    def _take_first(self, text: str, line: int) -> None:
        """Find what the vertices' numbers are, by the first of them and the prefixes of the word OFF."""
        tokens = tokens_of(text, None)
        self._width = max(len(tokens), 3)
        names: list[str] = [*_NORMALS] if "N" in self._prefixes else []
        texture = ["s", "t"] if "ST" in self._prefixes else []
        left = self._width - 3 - len(names) - len(texture)
        if "C" in self._prefixes and left in (3, 4):
            names += [*CHANNELS, ALPHA][:left]
            left = 0
        if left < 0 or (left and self._prefixes):
            raise FileFormatError(
                f"{self._source}: line {line}: {len(tokens)} numbers of a vertex do not fit the file's "
                f"{''.join(reversed(self._prefixes))}OFF"
            )
        if left:
            warnings.warn(
                f"{self._source}: {left} numbers behind the coordinates of each vertex are left out: the "
                "word OFF has no prefix that says what they are",
                stacklevel=4,
            )
        self.decimals = [
            name for name, token in zip(names, tokens[3:], strict=False) if _DECIMAL.search(token)
        ]
        self._names = names


def _face(text: str) -> list[int]:
    """Give the corners of a face; none, which is no face, where the line makes no sense."""
    count, *tokens = text.split()
    if not _NUMBER.fullmatch(count) or len(tokens) < int(count):
        return []
    corners = tokens[: int(count)]
    return [int(corner) if _NUMBER.fullmatch(corner) else -1 for corner in corners]
