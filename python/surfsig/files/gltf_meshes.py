"""The meshes of a glTF file: their parts (primitives), put where the scene shows them, and joined."""

from __future__ import annotations

import warnings
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files import mesh
from surfsig.files.colours import ALPHA, CHANNELS
from surfsig.files.gltf_accessors import Accessors, extensions, item

DRACO = "KHR_draco_mesh_compression"

# Many nodes may show one mesh: vertices and triangles in all, at most, per byte of the file. Beyond, it is no
# scene.
_MOST_PER_BYTE = 16
_TRIANGLES, _STRIP, _FAN = 4, 5, 6
_VECTORS = ("VEC3",)
_COLOURS = ("VEC3", "VEC4")


@dataclass
class _Part:
    """Vertices that belong together.

    Attributes
    ----------
    points
        (n, 3) float32.
    normals
        (n, 3); None where there are none.
    colours
        (n, 3 or 4), uint8 or uint16, or floating point from 0 to 1; None where there are none.
    triangles
        (t, 3), each number a vertex; empty where they are not asked for.
    """

    points: NDArray[Any]
    normals: NDArray[Any] | None
    colours: NDArray[Any] | None
    triangles: NDArray[np.int64]


class Meshes:
    """Joins meshes.

    Parameters
    ----------
    document, accessors
        The file's JSON, and its numbers.
    source
        The file's name, for messages.
    size
        Its bytes.
    with_triangles
        Whether triangles are asked for.
    """

    def __init__(
        self,
        document: Mapping[str, Any],
        accessors: Accessors,
        source: str,
        size: int,
        *,
        with_triangles: bool,
    ) -> None:
        self._document = document
        self._accessors = accessors
        self._source = source
        self._size = size
        self._with_triangles = with_triangles
        self._read: dict[object, list[_Part]] = {}
        self._parts: list[_Part] = []
        self._has_skin = False
        self._numbers = 0

    def add(self, number: object, matrix: NDArray[np.float64], *, has_skin: bool) -> None:
        """Add a mesh, moved by a transformation (4, 4)."""
        item(self._document, "meshes", number, self._source)
        if number not in self._read:
            self._read[number] = self._parts_of(number)
        self._has_skin = self._has_skin or has_skin
        for part in self._read[number]:
            self._count(len(part.points) + len(part.triangles))
            self._parts.append(_moved(part, matrix))

    def joined(self) -> tuple[NDArray[Any], dict[str, NDArray[Any]]]:
        """Give all vertices (n, 3), and their normals and colours as columns.

        Raises
        ------
        FileFormatError
            If there are none.

        Warns
        -----
        UserWarning
            If only some parts have normals or colours, or a skeleton moves some.
        """
        if not self._parts:
            raise FileFormatError(f"{self._source}: its scene shows no mesh")
        if self._has_skin:
            warnings.warn(
                f"{self._source}: a mesh moves with a skeleton, which is not applied: it is as it was made",
                stacklevel=3,
            )
        columns: dict[str, NDArray[Any]] = {}
        normals = self._of_all("normals", [part.normals for part in self._parts])
        if normals is not None:
            columns.update(zip(("nx", "ny", "nz"), normals.astype(np.float32).T, strict=True))
        colours = self._of_all("colours", [part.colours for part in self._parts])
        if colours is not None:
            columns.update(zip((*CHANNELS, ALPHA), colours.T, strict=False))
        return np.concatenate([part.points for part in self._parts]), columns

    def triangles(self) -> NDArray[np.intp]:
        """Give all triangles (t, 3) of the joined vertices.

        Warns
        -----
        UserWarning
            If some are left out, which refer to vertices that are missing.
        """
        start = 0
        found = [np.empty((0, 3), np.int64)]
        for part in self._parts:
            known = (part.triangles < len(part.points)).all(axis=1, keepdims=True)
            found.append(np.where(known, part.triangles + start, -1))
            start += len(part.points)
        corners = np.concatenate(found)
        return mesh.fans(np.full(len(corners), 3), corners.ravel(), start, self._source)

    def _parts_of(self, number: object) -> list[_Part]:
        """Read a mesh; parts that share their vertices become one."""
        primitives = item(self._document, "meshes", number, self._source).get("primitives")
        parts: dict[tuple[str, ...], _Part] = {}
        triangles: dict[tuple[str, ...], list[NDArray[np.int64]]] = {}
        for primitive in primitives if isinstance(primitives, list) else []:
            attributes = primitive.get("attributes") if isinstance(primitive, dict) else None
            if not isinstance(attributes, dict) or "POSITION" not in attributes:
                raise FileFormatError(f"{self._source}: broken: a mesh's part has no positions")
            key = tuple(repr(attributes.get(name)) for name in ("POSITION", "NORMAL", "COLOR_0"))
            if key not in parts:
                self._refuse_draco(primitive, attributes["POSITION"])
                parts[key] = self._vertices(attributes)
                self._count(len(parts[key].points))
                triangles[key] = [parts[key].triangles]
            if self._with_triangles:
                found = self._triangles(primitive, len(parts[key].points))
                self._count(len(found))
                triangles[key].append(found)
        for key, part in parts.items():
            part.triangles = np.concatenate(triangles[key])
        return list(parts.values())

    def _count(self, more: int) -> None:
        """Bound the memory by the size of the files, whatever the document repeats."""
        self._numbers += more
        if self._numbers > _MOST_PER_BYTE * (self._size + self._accessors.bytes_held()):
            raise FileFormatError(f"{self._source}: repeats its meshes too often ({self._numbers} vertices)")

    def _refuse_draco(self, primitive: Mapping[str, Any], position: object) -> None:
        accessor = item(self._document, "accessors", position, self._source)
        if DRACO in extensions(primitive) and "bufferView" not in accessor:
            raise FileFormatError(f"{self._source}: its meshes are compressed with Draco, which is not read")

    def _vertices(self, attributes: Mapping[str, Any]) -> _Part:
        points = self._decimal(attributes["POSITION"])
        normals = self._decimal(attributes["NORMAL"]) if "NORMAL" in attributes else None
        colours = (
            self._accessors.numbers(attributes["COLOR_0"], _COLOURS) if "COLOR_0" in attributes else None
        )
        for values in (normals, colours):
            if values is not None and len(values) != len(points):
                raise FileFormatError(
                    f"{self._source}: broken: {len(points)} positions have {len(values)} normals or colours"
                )
        return _Part(points, normals, colours, np.empty((0, 3), np.int64))

    def _decimal(self, index: object) -> NDArray[Any]:
        """Give vectors as float32; whole numbers may stand for parts of 1."""
        values = self._accessors.numbers(index, _VECTORS)
        if values.dtype.kind == "f" or not self._accessors.is_normalised(index):
            return values.astype(np.float32)
        return np.maximum(values / np.iinfo(values.dtype).max, -1).astype(np.float32)

    def _triangles(self, primitive: Mapping[str, Any], count: int) -> NDArray[np.int64]:
        """Give the triangles of a part; none of points and lines."""
        mode = primitive.get("mode", _TRIANGLES)
        if mode not in (_TRIANGLES, _STRIP, _FAN):
            return np.empty((0, 3), np.int64)
        if "indices" in primitive:
            corners = self._accessors.numbers(primitive["indices"], ("SCALAR",))
            if corners.dtype.kind != "u":
                raise FileFormatError(f"{self._source}: broken: indices that are no whole numbers from 0")
            corners = corners.astype(np.int64)
        else:
            corners = np.arange(count)
        if mode == _TRIANGLES:
            return corners[: len(corners) // 3 * 3].reshape(-1, 3)
        along = np.arange(max(len(corners) - 2, 0))
        if mode == _FAN:
            return corners[np.stack([along + 1, along + 2, np.zeros_like(along)], axis=1)]
        # Every other triangle of a strip is turned, so that all have the same side up.
        odd = along % 2
        return corners[np.stack([along, along + 1 + odd, along + 2 - odd], axis=1)]

    def _of_all(self, what: str, values: list[NDArray[Any] | None]) -> NDArray[Any] | None:
        """Join what every part has; colours of several types, or with and without alpha, become alike."""
        there = [part for part in values if part is not None]
        if len(there) < len(values):
            if there:
                warnings.warn(
                    f"{self._source}: {what} are left out: {len(there)} of {len(values)} parts have them",
                    stacklevel=4,
                )
            return None
        width = min(part.shape[1] for part in there)
        if len({part.dtype for part in there}) > 1:
            there = [
                part if part.dtype.kind == "f" else (part / np.iinfo(part.dtype).max).astype(np.float32)
                for part in there
            ]
        return np.concatenate([part[:, :width] for part in there])


def _moved(part: _Part, matrix: NDArray[np.float64]) -> _Part:
    """Give a part where its node puts it."""
    if np.array_equal(matrix, np.eye(4)):
        return part
    linear = matrix[:3, :3]
    with np.errstate(over="ignore", invalid="ignore", divide="ignore"):
        points = part.points @ linear.T + matrix[:3, 3]
        normals, triangles = part.normals, part.triangles
        turned = np.linalg.det(linear)
        if turned < 0:
            triangles = triangles[:, ::-1]
        if normals is not None:
            # The transposed matrix of cofactors, which is the inverse but for a factor, exists always.
            cofactors = np.stack(
                [
                    np.cross(linear[1], linear[2]),
                    np.cross(linear[2], linear[0]),
                    np.cross(linear[0], linear[1]),
                ]
            )
            normals = normals @ (cofactors if turned >= 0 else -cofactors).T
            lengths = np.linalg.norm(normals, axis=1, keepdims=True)
            normals = np.where(lengths > 0, normals / lengths, 0)
    return _Part(points, normals, part.colours, triangles)
