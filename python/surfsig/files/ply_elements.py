"""The elements of a PLY file: where their numbers lie, lists of any length included."""

from __future__ import annotations

import os
import sys
from collections import Counter, deque
from collections.abc import Iterator
from dataclasses import dataclass, field
from itertools import islice
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.rows import BLOCK_BYTES, filled
from surfsig.progress import Progress

# Rows that are looked at one by one before their numbers are taken.
VISITED_ROWS = 4096
# Digits that any length has fewer of.
_LONGEST_NUMBER = 19


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

    @property
    def has_coordinates(self) -> bool:
        """Whether x, y and z are among its single numbers."""
        return {*"xyz"} <= {item.name.lower() for item in self.properties if not item.length}

    def rename_twice(self) -> dict[str, str]:
        """Rename properties whose name is taken, x to x_2; give the file's name of each by the new one."""
        taken = {item.name for item in self.properties}
        seen: Counter[str] = Counter()
        renamed: dict[str, str] = {}
        for item in self.properties:
            name = item.name
            seen[name] += 1
            if seen[name] == 1:
                continue
            while item.name in taken:
                item.name = f"{name}_{seen[name]}"
                seen[name] += item.name in taken
            taken.add(item.name)
            renamed[item.name] = name
        return renamed

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
            else:
                deque(islice(tokens, written_length(token)), maxlen=0)
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


def written_length(token: str) -> int:
    """Give the length of a list in ASCII data, which some programs write as 3.0; 0 if it is none."""
    if token.isdecimal() and len(token) < _LONGEST_NUMBER:
        return int(token)
    try:
        length = float(token)
    except ValueError:
        return 0
    return int(length) if length.is_integer() and 0 <= length <= sys.maxsize else 0


@dataclass
class Lists:
    """The lists of one property, all one after the other.

    Attributes
    ----------
    place
        Which of the element's properties it is.
    lengths, values
        In parts, in the order of the rows.
    """

    place: int
    lengths: list[NDArray[np.int64]] = field(default_factory=list)
    values: list[NDArray[np.int64]] = field(default_factory=list)

    def take(self, lengths: NDArray[Any], values: NDArray[Any]) -> None:
        """Add the lists of some rows; numbers that are no whole ones become negative."""
        with np.errstate(invalid="ignore"):
            self.lengths.append(lengths.astype(np.int64))
            self.values.append(values.astype(np.int64))

    def joined(self) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Give all lengths and all values."""
        none = np.empty(0, np.int64)
        return np.concatenate([none, *self.lengths]), np.concatenate([none, *self.values])


def skip_element(
    file: BinaryIO, element: Element, source: str, progress: Progress, *, lists: Lists | None = None
) -> None:
    """Pass over an element's data, but for one property's lists.

    Raises
    ------
    FileFormatError
        If they are not all there.
    """
    # The names of an element that nobody reads may be anything, the same twice included.
    numbered = [Property(f"{i}", item.dtype, item.length) for i, item in enumerate(element.properties)]
    for _ in element_blocks(
        file, Element(element.name, element.count, numbered), source, progress, lists=lists
    ):
        pass


def element_blocks(
    file: BinaryIO, element: Element, source: str, progress: Progress, *, lists: Lists | None = None
) -> Iterator[NDArray[Any]]:
    """Read an element block by block, as structured arrays with its single numbers among their fields.

    Rows whose lists all have the lengths of the first row's (a mesh of triangles) are read as they lie in the
    file; from the first block with others on, each row is visited. A block is valid until the next one.
    `lists` takes those of its property.

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
            yield from _visited(file, element, element.count - start, source, progress, lists)
            return
        progress.advance(block.nbytes)
        if lists is not None:
            values = block[f"list {lists.place}"]
            lists.take(np.full(len(block), values.shape[1]), values.ravel())
        yield block


def _first_lengths(file: BinaryIO, element: Element, source: str) -> list[int]:
    """Give the lengths of the first row's lists, and leave the file where it is."""
    place = file.tell()
    size = os.fstat(file.fileno()).st_size
    lengths = []
    for item in element.properties:
        width = np.dtype(item.dtype).itemsize
        if item.length:
            length = np.frombuffer(file.read(np.dtype(item.length).itemsize), np.uint8)
            lengths.append(_length(length, 0, item, element, source, size))
            width *= lengths[-1]
        file.seek(width, os.SEEK_CUR)
    if file.tell() > size:
        raise _cut_off(source, element)
    file.seek(place)
    return lengths


def _have_lengths(block: NDArray[Any], lengths: list[int]) -> bool:
    names = [name for name in block.dtype.names or () if name.startswith("length ")]
    return all((block[name] == length).all() for name, length in zip(names, lengths, strict=True))


def _visited(
    file: BinaryIO, element: Element, count: int, source: str, progress: Progress, lists: Lists | None
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
                block[item.name] = _gathered(buffer, starts[:, i], item.dtype)
        if lists is not None:
            item, begins = element.properties[lists.place], starts[:, lists.place]
            lengths = _gathered(buffer, begins, item.length).astype(np.int64)
            # Of each value: its place in its list, from which that in the file follows.
            along = np.arange(lengths.sum()) - np.repeat(np.cumsum(lengths) - lengths, lengths)
            first = np.repeat(begins + np.dtype(item.length).itemsize, lengths)
            lists.take(lengths, _gathered(buffer, first + along * np.dtype(item.dtype).itemsize, item.dtype))
        progress.advance(end - offset)
        offset = end
        yield block
    file.seek(place + offset)


def _gathered(buffer: NDArray[np.uint8], starts: NDArray[np.int64], dtype: str) -> NDArray[Any]:
    """Take the numbers that begin at these bytes."""
    kind = np.dtype(dtype)
    numbers: NDArray[Any] = buffer[starts[:, None] + np.arange(kind.itemsize)].view(kind)[:, 0]
    return numbers


def _walk(
    buffer: NDArray[np.uint8], offset: int, count: int, element: Element, source: str
) -> tuple[NDArray[np.int64], int]:
    """Visit rows with lists of differing lengths: where each property begins, and where the rows end."""
    starts = np.empty((count, len(element.properties)), np.int64)
    for row in range(count):
        for i, item in enumerate(element.properties):
            starts[row, i] = offset
            if item.length:
                length = _length(buffer, offset, item, element, source, buffer.size)
                offset += np.dtype(item.length).itemsize + length * np.dtype(item.dtype).itemsize
            else:
                offset += np.dtype(item.dtype).itemsize
        if offset > buffer.size:
            raise _cut_off(source, element)
    return starts, offset


def _length(
    buffer: NDArray[np.uint8], offset: int, item: Property, element: Element, source: str, most: int
) -> int:
    """Read a list's length, of at most what a file of `most` bytes holds."""
    kind = np.dtype(item.length)
    if offset + kind.itemsize > buffer.size:
        raise _cut_off(source, element)
    length = buffer[offset : offset + kind.itemsize].view(kind)[0]
    # Some programs declare lengths as float or double.
    if not (length >= 0 and length == np.floor(length)):
        raise FileFormatError(f"{source}: a list '{item.name[:40]}' has the length {length}")
    if length > most:
        raise _cut_off(source, element)
    return int(length)


def _cut_off(source: str, element: Element) -> FileFormatError:
    return FileFormatError(
        f"{source}: cut off: its header promises {element.count} of '{element.name[:40]}', the file ends "
        "before"
    )
