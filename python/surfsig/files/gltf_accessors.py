"""The numbers of a glTF file: buffers, views into them, and accessors, which say what a view's bytes are."""

from __future__ import annotations

import base64
import binascii
import os
import re
import urllib.parse
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError

_COMPONENTS = {5120: "<i1", 5121: "<u1", 5122: "<i2", 5123: "<u2", 5125: "<u4", 5126: "<f4"}
_WIDTHS = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4}
_DATA_URI = re.compile(r"data:[^,]{0,200};base64,", re.IGNORECASE)
# Extensions that keep numbers in another form than the format's own.
_COMPRESSED_VIEWS = ("EXT_meshopt_compression", "KHR_meshopt_compression", "MESHOPT_compression")


class Accessors:
    """Reads the accessors of a document.

    Nothing is allocated that the file, with those it names, does not hold.

    Parameters
    ----------
    document
        The file's JSON.
    binary
        The buffer that a GLB file holds itself; None in a glTF file.
    source
        The file's path.
    """

    def __init__(self, document: Mapping[str, Any], binary: bytes | None, source: str) -> None:
        self._document = document
        self._binary = binary
        self._source = source
        self._buffers: dict[int, bytes] = {}

    def numbers(self, index: object, types: Sequence[str]) -> NDArray[Any]:
        """Give an accessor's numbers, (n,) or (n, k); normalised whole numbers stay what they are.

        Raises
        ------
        FileFormatError
            If there is no such accessor, it has another type than one of `types`, or its data are not there.
        """
        accessor = item(self._document, "accessors", index, self._source)
        kind, count = str(accessor.get("type")), whole(accessor, "count", self._source)
        if kind not in types or accessor.get("componentType") not in _COMPONENTS:
            raise FileFormatError(
                f"{self._source}: broken: accessor {index} is of the type {kind[:20]!r}, where "
                f"{' or '.join(types)} is expected"
            )
        dtype = np.dtype(_COMPONENTS[accessor["componentType"]])
        if "bufferView" in accessor:
            values = self._view(accessor, count, dtype, _WIDTHS[kind])
        elif "sparse" in accessor and count <= self.bytes_held(load=True):
            values = np.zeros((count, _WIDTHS[kind]), dtype)
        else:
            raise FileFormatError(f"{self._source}: broken: accessor {index} has no data")
        if "sparse" in accessor:
            values = self._replaced(values, accessor["sparse"])
        return values[:, 0] if kind == "SCALAR" else values

    def is_normalised(self, index: object) -> bool:
        """Tell whether an accessor's whole numbers stand for 0 to 1, or -1 to 1."""
        return item(self._document, "accessors", index, self._source).get("normalized") is True

    def bytes_held(self, *, load: bool = False) -> int:
        """Give the bytes of the buffers that are loaded so far, or of all."""
        buffers = self._document.get("buffers")
        for index in range(len(buffers) if load and isinstance(buffers, list) else 0):
            self._buffer(index)
        return sum(map(len, self._buffers.values()))

    def _view(
        self, accessor: Mapping[str, Any], count: int, dtype: np.dtype[Any], width: int
    ) -> NDArray[Any]:
        view = item(self._document, "bufferViews", accessor["bufferView"], self._source)
        compressed = next((name for name in _COMPRESSED_VIEWS if name in extensions(view)), None)
        if compressed is not None:
            raise FileFormatError(
                f"{self._source}: its data are compressed ({compressed}), which is not read"
            )
        data = self._buffer(view.get("buffer"))
        start = whole(view, "byteOffset", self._source, 0)
        length = whole(view, "byteLength", self._source)
        offset = whole(accessor, "byteOffset", self._source, 0)
        row = width * dtype.itemsize
        stride = whole(view, "byteStride", self._source, row) or row
        needed = offset + (count - 1) * stride + row if count else 0
        if start + length > len(data) or needed > length or stride < row:
            raise FileFormatError(
                f"{self._source}: cut off or broken: an accessor of {count} numbers needs {needed} bytes, "
                f"its view has {length} of a buffer of {len(data)}"
            )
        rows: NDArray[Any] = np.ndarray(
            (count, width), dtype, data, start + offset if count else 0, (stride, dtype.itemsize)
        )
        return rows

    def _replaced(self, values: NDArray[Any], sparse: object) -> NDArray[Any]:
        """Put other numbers in the places that a sparse accessor names."""
        if not isinstance(sparse, dict) or not all(
            isinstance(sparse.get(name), dict) for name in ("indices", "values")
        ):
            raise FileFormatError(f"{self._source}: broken: a sparse accessor without indices or values")
        count = whole(sparse, "count", self._source)
        component = sparse["indices"].get("componentType")
        if component not in (5121, 5123, 5125) or "bufferView" not in sparse["values"]:
            raise FileFormatError(f"{self._source}: broken: a sparse accessor's indices are no whole numbers")
        if "bufferView" not in sparse["indices"]:
            raise FileFormatError(f"{self._source}: broken: a sparse accessor without indices")
        places = self._view(sparse["indices"], count, np.dtype(_COMPONENTS[component]), 1)[:, 0]
        others = self._view(sparse["values"], count, values.dtype, values.shape[1])
        if count and places.max() >= len(values):
            raise FileFormatError(f"{self._source}: broken: a sparse accessor replaces what is not there")
        replaced = values.copy()
        replaced[places] = others
        return replaced

    def _buffer(self, index: object) -> bytes:
        buffer = item(self._document, "buffers", index, self._source)
        assert isinstance(index, int)
        if index not in self._buffers:
            self._buffers[index] = self._loaded(buffer, index)
        return self._buffers[index]

    def _loaded(self, buffer: Mapping[str, Any], index: int) -> bytes:
        uri = buffer.get("uri")
        if uri is None and index == 0 and self._binary is not None:
            return self._binary
        if not isinstance(uri, str):
            raise FileFormatError(f"{self._source}: broken: buffer {index} has no data")
        head = _DATA_URI.match(uri)
        if head is not None:
            try:
                return base64.b64decode(uri[head.end() :], validate=True)
            except (binascii.Error, ValueError):
                raise FileFormatError(f"{self._source}: broken: buffer {index} is not in base64") from None
        return self._beside(uri)

    def _beside(self, uri: str) -> bytes:
        """Read a file that lies beside the document, or in a folder beside it; no other is opened."""
        name = urllib.parse.unquote(uri)
        told = "".join(letter if letter.isprintable() else "?" for letter in name[:80])
        parts = Path(name).parts
        if (
            ":" in name
            or "\0" in name
            or "\\" in name
            or not parts
            or ".." in parts
            or Path(name).is_absolute()
        ):
            raise FileFormatError(f"{self._source}: its data are not beside it ({told!r})")
        path = Path(self._source).parent / name
        try:
            with path.open("rb") as file:
                return file.read(os.fstat(file.fileno()).st_size)
        except OSError as error:
            why = error.strerror or "cannot be opened"
            raise FileFormatError(f"{self._source}: its data {told!r}: {why}") from None


def item(document: Mapping[str, Any], name: str, index: object, source: str) -> dict[str, Any]:
    """Give an object of one of the document's lists; a `FileFormatError` says if there is none."""
    objects = document.get(name)
    if isinstance(objects, list) and isinstance(index, int) and 0 <= index < len(objects):
        found = objects[index]
        if isinstance(found, dict):
            return found
    raise FileFormatError(f"{source}: broken: there is no number {str(index)[:20]} among its {name}")


def whole(owner: Mapping[str, Any], name: str, source: str, default: int | None = None) -> int:
    """Give a whole number from 0 that an object has."""
    value = owner.get(name, default)
    if isinstance(value, int) and not isinstance(value, bool) and 0 <= value < 1 << 48:
        return value
    raise FileFormatError(f"{source}: broken: {name} is {str(value)[:20]!r}, not a whole number")


def extensions(owner: Mapping[str, Any]) -> Mapping[str, Any]:
    """Give an object's extensions."""
    found = owner.get("extensions")
    return found if isinstance(found, dict) else {}
