"""The elements of a PLY file: where their numbers lie, lists of any length included."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import columns_of


@dataclass
class Property:
    """One property of an element.

    Attributes
    ----------
    name
        As in the header.
    dtype
        NumPy's name of its type, with the byte order.
    length
        The type of a list's length; empty for a single number.
    """

    name: str
    dtype: str
    length: str = ""


@dataclass
class Element:
    """An element of the header: how many there are, and of what each consists."""

    name: str
    count: int
    properties: list[Property]

    @property
    def has_lists(self) -> bool:
        """Whether rows may differ in size."""
        return any(item.length for item in self.properties)

    def least_bytes(self, *, ascii: bool) -> int:
        """Give the fewest bytes that the data can have: every list empty, every number one digit."""
        if ascii:
            return self.count * max(2 * len(self.properties), 1)
        return self.count * sum(np.dtype(item.length or item.dtype).itemsize for item in self.properties)

    def ascii_dtype(self) -> np.dtype[Any]:
        """Give the type of a row of single numbers, with coordinates as float64: their text may need it."""
        return np.dtype(
            [
                (item.name, "f8" if item.name.lower() in ("x", "y", "z") else item.dtype)
                for item in self.properties
                if not item.length
            ]
        )

    def without_lists(self, line: str) -> str:
        """Take the single numbers from a line of ASCII data."""
        tokens = iter(line.split())
        kept = []
        for item in self.properties:
            token = next(tokens, "")
            if not item.length:
                kept.append(token)
            elif token.isdigit():
                for _ in range(int(token)):
                    if next(tokens, None) is None:
                        break
        return " ".join(kept)

    def row_dtype(self, lengths: list[int]) -> np.dtype[Any]:
        """Give the type of a row whose lists have these lengths."""
        parts: list[tuple[Any, ...]] = []
        remaining = iter(lengths)
        for i, item in enumerate(self.properties):
            if item.length:
                parts += [(f"length {i}", item.length), (f"list {i}", item.dtype, (next(remaining),))]
            else:
                parts.append((f"value {i}", item.dtype))
        return np.dtype(parts)


def skip_element(buffer: NDArray[np.uint8], offset: int, element: Element, source: str) -> int:
    """Give the offset of what follows an element's data.

    Raises
    ------
    FileFormatError
        If the data are not all there.
    """
    rows = _uniform_rows(buffer, offset, element, source)
    if rows is not None:
        return offset + int(rows.nbytes)
    _, end = _walk(buffer, offset, element, source)
    return end


def vertex_rows(
    buffer: NDArray[np.uint8], offset: int, element: Element, source: str
) -> tuple[dict[str, NDArray[Any]], int]:
    """Give an element's single numbers as columns by name, and the offset of what follows.

    Raises
    ------
    FileFormatError
        If the data are not all there.
    """
    rows = _uniform_rows(buffer, offset, element, source)
    single = [(i, item) for i, item in enumerate(element.properties) if not item.length]
    if rows is not None:
        columns = columns_of(rows[[f"value {i}" for i, _ in single]])
        return {item.name: columns[f"value {i}"] for i, item in single}, offset + int(rows.nbytes)
    starts, end = _walk(buffer, offset, element, source)
    columns = {}
    for i, item in single:
        kind = np.dtype(item.dtype)
        places = starts[:, i, None] + np.arange(kind.itemsize)
        columns[item.name] = buffer[places].view(kind)[:, 0]
    return columns, end


def _uniform_rows(
    buffer: NDArray[np.uint8], offset: int, element: Element, source: str
) -> NDArray[Any] | None:
    """View all rows at once if their lists have the lengths of the first row's (a mesh of triangles)."""
    if not element.properties or not element.count:
        return np.empty(0, element.row_dtype([0] * len(element.properties)))
    lengths = []
    if element.has_lists:
        place = offset
        for item in element.properties:
            if item.length:
                lengths.append(_length(buffer, place, item, element, source))
                place += np.dtype(item.length).itemsize + lengths[-1] * np.dtype(item.dtype).itemsize
            else:
                place += np.dtype(item.dtype).itemsize
        if place > buffer.size:
            raise _cut_off(source, element)
    dtype = element.row_dtype(lengths)
    end = offset + element.count * dtype.itemsize
    if end > buffer.size:
        if lengths:
            return None
        raise _cut_off(source, element)
    rows = buffer[offset:end].view(dtype)
    for name, length in zip(
        (name for name in dtype.names or () if name.startswith("length")), lengths, strict=True
    ):
        if (rows[name] != length).any():
            return None
    return rows


def _walk(
    buffer: NDArray[np.uint8], offset: int, element: Element, source: str
) -> tuple[NDArray[np.int64], int]:
    """Visit every row of an element with lists of differing lengths: where each property begins."""
    starts = np.empty((element.count, len(element.properties)), np.int64)
    for row in range(element.count):
        for i, item in enumerate(element.properties):
            starts[row, i] = offset
            if item.length:
                length = _length(buffer, offset, item, element, source)
                offset += np.dtype(item.length).itemsize + length * np.dtype(item.dtype).itemsize
            else:
                offset += np.dtype(item.dtype).itemsize
        if offset > buffer.size:
            raise _cut_off(source, element)
    return starts, offset


def _length(buffer: NDArray[np.uint8], offset: int, item: Property, element: Element, source: str) -> int:
    kind = np.dtype(item.length)
    if offset + kind.itemsize > buffer.size:
        raise _cut_off(source, element)
    length = int(buffer[offset : offset + kind.itemsize].view(kind)[0])
    if length < 0:
        raise FileFormatError(f"{source}: a list '{item.name}' has the length {length}")
    return length


def _cut_off(source: str, element: Element) -> FileFormatError:
    return FileFormatError(
        f"{source}: cut off: its header promises {element.count} of '{element.name}', the file ends before"
    )
