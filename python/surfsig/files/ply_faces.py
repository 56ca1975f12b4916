"""The faces of a PLY mesh, which count only where points are to be spread over them."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from surfsig.errors import InvalidInputError
from surfsig.files.lines import line_blocks
from surfsig.files.ply_elements import Element, Lists, written_length
from surfsig.progress import Progress

_CORNERS = ("vertex_indices", "vertex_index")


@dataclass
class Faces:
    """The faces' corners, and where they stand.

    Attributes
    ----------
    position
        Which of the file's elements the faces are.
    lists
        The corners of each face.
    """

    position: int
    lists: Lists

    @classmethod
    def among(cls, elements: Sequence[Element], vertex: int, source: str) -> Faces:
        """Find the faces among the elements, of which number `vertex` holds the points.

        Raises
        ------
        InvalidInputError
            If there are none.
        """
        for position, element in enumerate(elements):
            if position == vertex or element.count == 0 or element.name.lower() == "tristrips":
                continue
            places = [i for i, item in enumerate(element.properties) if item.length]
            named = [i for i in places if element.properties[i].name.lower() in _CORNERS]
            if named or (places and element.name.lower() in ("face", "faces")):
                return cls(position, Lists((named or places)[0]))
        strips = any(element.name.lower() == "tristrips" for element in elements)
        kind = "strips of triangles, but no faces" if strips else "no faces"
        raise InvalidInputError(f"{source}: has {kind}, over which samples could be spread")

    def take_lines(self, file: BinaryIO, elements: Sequence[Element]) -> None:
        """Take the corners from ASCII data, whose first line is next in the file."""
        skip = sum(element.count for element in elements[: self.position])
        faces = elements[self.position]
        for lines in _rows(file, skip, skip + faces.count):
            corners = [self._corners(line, faces) for line in lines]
            self.lists.take(
                np.array([len(face) for face in corners], np.int64),
                np.array([corner for face in corners for corner in face], np.float64),
            )

    def _corners(self, line: str, faces: Element) -> list[float]:
        """Give the corners of one face; none, which is no face, where the line makes no sense."""
        tokens = line.split()
        begin = 0
        for place, item in enumerate(faces.properties):
            length = 1
            if item.length:
                length = written_length(tokens[begin]) if begin < len(tokens) else 0
                begin += 1
            if place == self.lists.place:
                try:
                    return [float(token) for token in tokens[begin : begin + length]]
                except ValueError:
                    return []
            begin += length
        return []


def _rows(file: BinaryIO, start: int, stop: int) -> Iterator[list[str]]:
    """Give lines block by block, from number `start` to before `stop`, of those that are not empty."""
    seen = 0
    for block in line_blocks(file, 1, Progress(None, 0)):
        filled = [line for line in block.lines if line.strip()]
        lines = filled[max(start - seen, 0) : max(stop - seen, 0)]
        seen += len(filled)
        if lines:
            yield lines
        if seen >= stop:
            return
