"""The elements of a PLY file: where their numbers lie, lists of any length included."""

from __future__ import annotations

import os
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.progress import Progress
from surfsig.files.rows import BLOCK_BYTES, filled

# Rows that are looked at one by one before their numbers are taken.
VISITED_ROWS = 4096


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

    def single_dtype(self) -> np.dtype[Any]:
        """Give the type of a row's single numbers, side by side."""
        return np.dtype([(item.name, item.dtype) for item in self.properties if not item.length])

    def row_dtype(self, lengths: list[int]) -> np.dtype[Any]:
        """Give the type of a row whose lists have these lengths."""
        parts: list[tuple[Any, ...]] = []
        remaining = iter(lengths)
        for i, item in enumerate(self.properties):
            if item.length:
                parts += [(f"length {i}", item.length), (f"list {i}", item.dtype, (next(remaining),))]
            else:
                parts.append((item.name, item.dtype))
        return np.dtype(parts)


def skip_element(file: BinaryIO, element: Element, source: str, progress: Progress) -> None:
    """Pass over an element's data.

    Raises
    ------
    FileFormatError
        If they are not all there.
    """
    # The names of an element that nobody reads may be anything, the same twice included.
    numbered = [Property(f"{i}", item.dtype, item.length) for i, item in enumerate(element.properties)]
    for _ in element_blocks(file, Element(element.name, element.count, numbered), source, progress):
        pass


def element_blocks(
    file: BinaryIO, element: Element, source: str, progress: Progress
) -> Iterator[NDArray[Any]]:
    """Read an element block by block, as structured arrays with its single numbers among their fields.

    Rows whose lists all have the lengths of the first row's (a mesh of triangles) are read as they lie in the
    file; from the first block with others on, each row is visited. A block is valid until the next one.

    Raises
    ------
    FileFormatError
        If the data are not all there.
    """
    if not element.properties or not element.count:
        return
    lengths = _first_lengths(file, element, source)
    dtype = element.row_dtype(lengths)
    rows = max(1, BLOCK_BYTES // dtype.itemsize)
    buffer = np.empty(min(rows, element.count), dtype)
    for start in range(0, element.count, rows):
        block = buffer[: element.count - start]
        place = file.tell()
        whole = filled(file, block)
        if not whole and not lengths:
            raise _cut_off(source, element)
        if not whole or not _have_lengths(block, lengths):
            file.seek(place)
            yield from _visited(file, element, element.count - start, source, progress)
            return
        progress.advance(block.nbytes)
        yield block


def _first_lengths(file: BinaryIO, element: Element, source: str) -> list[int]:
    """Give the lengths of the first row's lists, and leave the file where it is."""
    place = file.tell()
    lengths = []
    for item in element.properties:
        size = np.dtype(item.dtype).itemsize
        if item.length:
            length = np.frombuffer(file.read(np.dtype(item.length).itemsize), np.uint8)
            lengths.append(_length(length, 0, item, element, source))
            size *= lengths[-1]
        file.seek(size, os.SEEK_CUR)
    if file.tell() > os.fstat(file.fileno()).st_size:
        raise _cut_off(source, element)
    file.seek(place)
    return lengths


def _have_lengths(block: NDArray[Any], lengths: list[int]) -> bool:
    names = [name for name in block.dtype.names or () if name.startswith("length ")]
    return all((block[name] == length).all() for name, length in zip(names, lengths, strict=True))


def _visited(
    file: BinaryIO, element: Element, count: int, source: str, progress: Progress
) -> Iterator[NDArray[Any]]:
    """Visit the last `count` rows of an element one by one, and leave the file at their end."""
    place = file.tell()
    buffer = np.frombuffer(file.read(), np.uint8)
    offset = 0
    for start in range(0, count, VISITED_ROWS):
        starts, end = _walk(buffer, offset, min(VISITED_ROWS, count - start), element, source)
        block = np.empty(len(starts), element.single_dtype())
        for i, item in enumerate(element.properties):
            if not item.length:
                kind = np.dtype(item.dtype)
                block[item.name] = buffer[starts[:, i, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
        progress.advance(end - offset)
        offset = end
        yield block
    file.seek(place + offset)


def _walk(
    buffer: NDArray[np.uint8], offset: int, count: int, element: Element, source: str
) -> tuple[NDArray[np.int64], int]:
    """Visit rows with lists of differing lengths: where each property begins, and where the rows end."""
    starts = np.empty((count, len(element.properties)), np.int64)
    for row in range(count):
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
