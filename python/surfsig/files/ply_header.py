"""The header of a PLY file, as strict programs write it and as others do."""

from __future__ import annotations

import re
import warnings
from collections.abc import Iterator
from dataclasses import dataclass
from typing import BinaryIO

import numpy as np

from surfsig.errors import FileFormatError
from surfsig.files.ply_elements import Element, Property

MAGIC = re.compile(rb"(?:\xef\xbb\xbf)?ply[ \t]*[\r\n]", re.IGNORECASE)
MAX_HEADER_BYTES = 1 << 20

_BYTE_ORDER_MARK = b"\xef\xbb\xbf"
_TYPES = {
    **dict.fromkeys(("char", "int8", "int8_t", "schar"), "i1"),
    **dict.fromkeys(("uchar", "uint8", "uint8_t"), "u1"),
    **dict.fromkeys(("short", "int16", "int16_t"), "i2"),
    **dict.fromkeys(("ushort", "uint16", "uint16_t"), "u2"),
    **dict.fromkeys(("int", "int32", "int32_t"), "i4"),
    **dict.fromkeys(("uint", "uint32", "uint32_t"), "u4"),
    **dict.fromkeys(("int64", "int64_t", "longlong", "long"), "i8"),
    **dict.fromkeys(("uint64", "uint64_t", "ulonglong", "ulong"), "u8"),
    **dict.fromkeys(("float", "float32", "float32_t"), "f4"),
    **dict.fromkeys(("double", "float64", "float64_t"), "f8"),
}
# What C calls long has 8 bytes, but 4 on Windows.
_SHORT_LONGS = {"long": "i4", "ulong": "u4"}
_ORDERS = {"ascii": "", "binary_little_endian": "<", "binary_big_endian": ">"}
_VERTEX = "vertex"


@dataclass
class Header:
    """What stands before the data.

    Attributes
    ----------
    order
        ``<`` or ``>`` for binary data, empty for ASCII.
    elements
        In the order of the data.
    notes
        What this library wrote as comments ``surfsig KEY VALUE``.
    lines
        Number of lines, ``end_header`` included.
    """

    order: str
    elements: list[Element]
    notes: dict[str, str]
    lines: int

    def vertex(self, source: str) -> int:
        """Tell which element holds the points: that called vertex, or else the only one with x, y, z.

        Raises
        ------
        FileFormatError
            If there is none.

        Warns
        -----
        UserWarning
            If it has another name, or there are several.
        """
        names = [element.name.lower() for element in self.elements]
        found = [i for i, name in enumerate(names) if name == _VERTEX]
        if not found:
            found = [i for i, element in enumerate(self.elements) if element.has_coordinates]
            if len(found) != 1:
                told = ", ".join(names)[:60] or "no element"
                raise FileFormatError(f"{source}: a PLY file without vertices ({told})")
            name = self.elements[found[0]].name[:40]
            warnings.warn(f"{source}: its points are called '{name}', not 'vertex'", stacklevel=3)
        if len(found) > 1:
            warnings.warn(
                f"{source}: {len(found)} elements are called 'vertex'; only the first is read", stacklevel=3
            )
        return found[0]


@dataclass
class _Declared:
    """An element as its lines declare it: of each property its name, type, and type of a list's length."""

    name: str
    count: int
    properties: list[tuple[str, str, str]]


def read_header(file: BinaryIO, source: str, size: int) -> Header:
    """Read the header of an open PLY file of `size` bytes, and leave it at the data.

    Raises
    ------
    FileFormatError
        Naming the line that makes no sense.
    """
    form: str | None = None
    declared: list[_Declared] = []
    notes: dict[str, str] = {}
    lines = 0
    for words in _lines(file, source):
        lines += 1
        keyword = words[0].lower() if words else ""
        if keyword == "end_header":
            break
        if keyword == "comment" and words[1:2] == ["surfsig"] and len(words) > 2:
            notes[words[2]] = " ".join(words[3:])
        if keyword in ("", "ply", "comment", "obj_info"):
            continue
        try:
            form = _take_line(words, declared) or form
        except (ValueError, IndexError, KeyError):
            text = " ".join(words)[:60]
            raise FileFormatError(
                f"{source}: line {lines} of the PLY header makes no sense: {text!r}"
            ) from None
    if form is None:
        raise FileFormatError(f"{source}: the PLY header does not name a format")
    order = _ORDERS[form]
    elements = [_element(element, order, _TYPES) for element in declared]
    kinds = {kind for element in declared for _, kind, _ in element.properties}
    if order and kinds & _SHORT_LONGS.keys():
        short = [_element(element, order, {**_TYPES, **_SHORT_LONGS}) for element in declared]
        # Only the size of the file tells; lists have any.
        if not any(element.has_lists for element in elements) and _bytes(short) == size - file.tell():
            elements = short
    return Header(order, elements, notes, lines)


def _lines(file: BinaryIO, source: str) -> Iterator[list[str]]:
    """Give the words of each line; the first line's end is the end of all.

    Only so is it known where binary data begin, which may begin with a byte that looks like a line end.
    """
    if file.read(len(_BYTE_ORDER_MARK)) != _BYTE_ORDER_MARK:
        file.seek(0)
    begin = file.tell()
    head = file.read(MAX_HEADER_BYTES)
    end = b"\r" if b"\r" in head and b"\n" not in head[: head.index(b"\r") + 2] else b"\n"
    offset = 0
    while (stop := head.find(end, offset)) >= 0:
        line, offset = head[offset:stop], stop + 1
        # What is beyond the last line of the header stays to be read.
        file.seek(begin + offset)
        yield line.decode("utf-8", errors="replace").split()
    raise FileFormatError(f"{source}: the PLY header does not end: the file is cut off or broken")


def _take_line(words: list[str], declared: list[_Declared]) -> str | None:
    """Take a line that declares something; give the format if it does so.

    Names keep their case; the format's own words may have any. A name of several words is joined.
    """
    match [words[0].lower(), *words[1:]]:
        case ["format", name, *_]:
            form = name.lower()
            if form not in _ORDERS:
                raise ValueError(name)
            return form
        case ["element", name, count] if int(count) >= 0:
            declared.append(_Declared(name, int(count), []))
        case ["property", kind, length, values, *name] if kind.lower() == "list" and name:
            declared[-1].properties.append(("_".join(name), _type(values), _type(length)))
        case ["property", kind, *name] if name:
            declared[-1].properties.append(("_".join(name), _type(kind), ""))
        case _:
            raise ValueError(words)
    return None


def _type(word: str) -> str:
    name = word.lower()
    if name not in _TYPES:
        raise KeyError(name)
    return name


def _element(declared: _Declared, order: str, types: dict[str, str]) -> Element:
    properties = [
        Property(name, order + types[kind], order + types[length] if length else "")
        for name, kind, length in declared.properties
    ]
    return Element(declared.name, declared.count, properties)


def _bytes(elements: list[Element]) -> int:
    """Give the bytes of elements without lists."""
    return sum(
        element.count * sum(np.dtype(item.dtype).itemsize for item in element.properties)
        for element in elements
    )
