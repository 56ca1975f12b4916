"""Wavefront OBJ: vertices, with colours and normals where each has one, and faces to spread samples over."""

from __future__ import annotations

import re
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.columns import cloud_from_columns
from surfsig.files.encodings import decoded
from surfsig.files.lines import Block, line_blocks, parse, warn_unterminated
from surfsig.files.obj_vertices import COLOURS, Vertices
from surfsig.point_cloud import PointCloud
from surfsig.progress import Progress

_WORDS = (
    "v", "vn", "vt", "vp", "f", "fo", "l", "p", "o", "g", "s", "mg", "mtllib", "usemtl", "maplib", "usemap",
    "bevel", "c_interp", "d_interp", "lod", "shadow_obj", "trace_obj", "ctech", "stech", "cstype", "deg",
    "bmat", "step", "curv", "curv2", "surf", "parm", "trim", "hole", "scrv", "sp", "end", "con", "call",
    "csh",
)  # fmt: skip
_LINE = rb"[ \t]*(?:(?:" + "|".join(_WORDS).encode() + rb")(?:[ \t][^\r\n]*)?|#[^\r\n]*)?"
_VERTEX = rb"[ \t]*v(?:[ \t]+[-+.\deE]+){3,}[ \t]*"
# Whole lines of OBJ's words, of which one is a vertex.
MAGIC = re.compile(rb"(?:" + _LINE + rb"[\r\n])*?" + _VERTEX + rb"(?:[\r\n]|$)")

# Python's own limit on digits would raise an error of another kind.
_NUMBER = re.compile(r"[-+]?\d{1,18}", re.ASCII)
# A vertex that is not there, and one that is in no file.
_MISSING = -1
_NO_COUNT = 1 << 62


def read(file: BinaryIO, source: str, progress: Progress, samples: int | None = None) -> PointCloud:
    """Read an open OBJ file.

    The vertices are those of the file, in its order, as float64. Three numbers after a vertex's coordinates
    are its colour, from 0 to 1 or whole numbers to 255; `Vertices` says what other numbers are. Normals (nx,
    ny, nz) come from the file if there is one per vertex and the faces use it so. With `samples`, that many
    points spread over the faces, with the faces' normals. Materials, textures, lines and free-form surfaces
    are not read.

    Raises
    ------
    FileFormatError
        If a line is broken; the message names it.
    InvalidInputError
        If `samples` is no positive whole number, or there is no surface to spread them over.

    Warns
    -----
    UserWarning
        If faces are left out, because they have fewer than three corners or refer to vertices that are
        missing; if only some vertices have colours, or numbers behind the coordinates are left out.
    """
    parts = _Parts(source, keep_faces=samples is not None)
    for block in line_blocks(decoded(file), 1, progress):
        parts.add(block)
        if block.unterminated:
            warn_unterminated(source, block.first + len(block.lines) - 1)
    points, columns = parts.vertices.finished(parts.vertex_count)
    mesh.check_vertices(points, source)
    if samples is not None:
        triangles = mesh.fans(*parts.faces(), len(points), source)
        return mesh.sampled(points, triangles, samples, source)
    mesh.warn_left_out(parts.bad_faces(len(points)), parts.face_count, source)
    columns = {**dict(zip("xyz", points.T, strict=True)), **columns}
    normals = parts.normals(len(points))
    if normals is not None:
        columns.update(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
    return cloud_from_columns(columns, source=source, decimals=COLOURS)


class _Parts:
    """The parts of the file that count, gathered block by block."""

    def __init__(self, source: str, *, keep_faces: bool) -> None:
        self.vertices = Vertices(source)
        self.vertex_count = self.face_count = 0
        self._source = source
        self._keep_faces = keep_faces
        self._normals: list[NDArray[np.float64]] = []
        self._lengths: list[NDArray[np.int64]] = []
        self._corners: list[NDArray[np.int64]] = []
        # Of each face: its highest vertex, or that of none if it is bad whatever comes.
        self._highest: list[NDArray[np.int64]] = []
        self._normal_count = 0
        self._normals_alike = True
        self._continued = ""

    def add(self, block: Block) -> None:
        """Take the vertices, normals and faces of some lines."""
        rows: dict[str, list[str]] = {"v": [""] * len(block.lines), "vn": [""] * len(block.lines)}
        faces: list[list[int]] = []
        for number, line in enumerate(block.lines):
            if self._continued:
                line, self._continued = self._continued + line, ""
            if line.endswith("\\"):
                self._continued = line[:-1] + " "
                continue
            word, _, rest = line.strip().replace("\t", " ").partition(" ")
            if word == "v":
                self.vertex_count += 1
                rows[word][number] = rest
            elif word == "vn":
                self._normal_count += 1
                rows[word][number] = rest
            elif word == "f":
                faces.append(self._face(rest))
            elif word and not word.startswith("#") and word not in _WORDS:
                raise FileFormatError(
                    f"{self._source}: line {block.first + number} is none of OBJ's: {line.strip()[:40]!r}"
                )
        self.vertices.add(rows["v"], block.first)
        self._normals.append(
            parse(rows["vn"], np.float64, 3, source=self._source, first=block.first, comments=True)
        )
        self._add_faces(faces)

    def faces(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Give how many corners each face has, and all corners, as vertices from 0."""
        none = np.empty(0, np.int64)
        return np.concatenate([none, *self._lengths]), np.concatenate([none, *self._corners])

    def bad_faces(self, count: int) -> NDArray[np.intp]:
        """Give the numbers of the faces that are none among so many vertices."""
        return np.flatnonzero(np.concatenate([np.empty(0, np.int64), *self._highest]) >= count)

    def normals(self, count: int) -> NDArray[np.float64] | None:
        """Give the vertices' normals, if each of so many vertices has just one."""
        normals = np.concatenate(self._normals)
        return normals if self._normals_alike and len(normals) == count else None

    def _add_faces(self, faces: list[list[int]]) -> None:
        self.face_count += len(faces)
        if self._keep_faces:
            self._lengths.append(np.array([len(face) for face in faces], np.int64))
            self._corners.append(np.array([corner for face in faces for corner in face], np.int64))
        else:
            highest = (_NO_COUNT if len(face) < 3 or _MISSING in face else max(face) for face in faces)
            self._highest.append(np.fromiter(highest, np.int64, len(faces)))

    def _face(self, text: str) -> list[int]:
        """Give the corners of a face, as vertices from 0."""
        corners = []
        # Not `tokens_of`, to which "//" begins a comment.
        for corner in text.partition("#")[0].split():
            numbers = corner.split("/")
            vertex = _index(numbers[0], self.vertex_count)
            if len(numbers) > 2 and numbers[2] and self._normals_alike:
                self._normals_alike = _index(numbers[2], self._normal_count) == vertex
            corners.append(vertex)
        return corners


def _index(text: str, count: int) -> int:
    """Turn a number from 1, or one that counts back from the last one so far, into one from 0."""
    if _NUMBER.fullmatch(text) is None:
        return _MISSING
    number = int(text)
    return number - 1 if number > 0 else max(count + number, _MISSING) if number else _MISSING
