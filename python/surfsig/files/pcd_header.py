"""The header of PCD files, in the dialects in which programs write it."""

from __future__ import annotations

import re
import warnings
from dataclasses import dataclass, field
from typing import BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError
from surfsig.files.columns import unique_name

MAGIC = re.compile(
    rb"(?:\xef\xbb\xbf)?(?:[ \t]*\r?\n)*(?:[ \t]*#[ \t]*\.PCD\b|"
    rb"(?:[ \t]*(?:#[^\n]*)?\r?\n)*[ \t]*(?:VERSION[ \t,]+v?\.?[0-9]|(?:FIELDS|COLUMNS)[ \t]))",
    re.IGNORECASE,
)
MAX_HEADER_BYTES = 1 << 20
# More numbers per point than any descriptor has; a broken header must not make us build a type of them.
MAX_NUMBERS = 1 << 16

NOTE = "# surfsig "
"""How a comment of this library begins; a key and its value follow."""
OWN_NOTES = ("origin", "viewpoint", "coordinate_system")
"""Keys that the reader looks for: what x, y and z are about, the viewpoint then, the coordinate system."""

# PCL keeps a colour in one number of any type, blue first.
PACKED_COLOURS = {
    "rgb": {"red": 2, "green": 1, "blue": 0},
    "rgba": {"red": 2, "green": 1, "blue": 0, "alpha": 3},
}
EXACT = ("x_double", "y_double", "z_double")
"""Fields with the coordinates as doubles, where x, y and z are floats for programs that read no others."""

_KEYS = ("VERSION", "FIELDS", "SIZE", "TYPE", "COUNT", "WIDTH", "HEIGHT", "VIEWPOINT", "POINTS", "DATA")
# PCD v.5 and before.
_OLD_KEYS = {"COLUMNS": "FIELDS"}
_KINDS = {"F": "f", "I": "i", "U": "u"}
_PADDING = "_"


@dataclass
class Header:
    """What stands before the data.

    Attributes
    ----------
    names, types, counts
        One entry per field: its name, NumPy's name of its type, and how many numbers a point has of it.
    height, width
        Of an organised cloud; height is 1 for any other.
    viewpoint
        Where the sensor stood, None if the header does not say.
    data
        ``ascii``, ``binary`` or ``binary_compressed``.
    lines
        Number of lines, DATA included.
    notes
        What this library wrote as comments.
    says_width
        There is a line WIDTH; without it the number of points is that of POINTS.
    """

    names: list[str]
    types: list[str]
    counts: list[int]
    height: int
    width: int
    viewpoint: NDArray[np.float64] | None
    data: str
    lines: int = 0
    notes: dict[str, str] = field(default_factory=dict)
    says_width: bool = True

    @property
    def points(self) -> int:
        """Number of points."""
        return self.height * self.width

    def parts(self) -> list[tuple[str, str, tuple[int, ...]]]:
        """Give each field as (key, type, shape); keys are unique where names (padding's `_`) are not."""
        return [
            (f"{i} {name}", "<" + kind, () if count == 1 else (count,))
            for i, (name, kind, count) in enumerate(zip(self.names, self.types, self.counts, strict=True))
        ]


def read_header(file: BinaryIO, source: str) -> Header:
    """Read the header of an open file, and leave the file where the data begin.

    Keywords and types may be in lower case and words separated by commas; COLUMNS stands for FIELDS. A field
    with a COUNT of 0 is left out: its points have no bytes of it. Without WIDTH and HEIGHT, POINTS counts the
    points.

    Raises
    ------
    FileFormatError
        If it makes no sense.

    Warns
    -----
    UserWarning
        If two fields have the same name, or VIEWPOINT has not seven numbers.
    """
    entries: dict[str, list[str]] = {}
    notes: dict[str, str] = {}
    lines = 0
    while "DATA" not in entries:
        raw = file.readline(MAX_HEADER_BYTES)
        lines += 1
        if not raw.endswith(b"\n") or file.tell() > MAX_HEADER_BYTES:
            raise FileFormatError(f"{source}: the PCD header does not end: the file is cut off or broken")
        text = raw.decode("utf-8-sig" if lines == 1 else "utf-8", errors="replace").strip()
        if text.startswith(NOTE):
            name, _, value = text[len(NOTE) :].partition(" ")
            notes[name] = value
        words = text.replace(",", " ").split()
        if not words or text.startswith("#"):
            continue
        key = _OLD_KEYS.get(words[0].upper(), words[0].upper())
        if key not in _KEYS or key in entries:
            raise FileFormatError(f"{source}: line {lines} of the PCD header makes no sense: {text[:60]!r}")
        entries[key] = words[1:]
    try:
        header = _header(entries, source)
    except KeyError as error:
        raise FileFormatError(f"{source}: the PCD header has no line {error.args[0]}") from None
    except (ValueError, IndexError, TypeError) as error:
        raise FileFormatError(f"{source}: the PCD header makes no sense: {error}") from None
    header.lines, header.notes = lines, notes
    return header


def _header(entries: dict[str, list[str]], source: str) -> Header:
    names = entries["FIELDS"]
    data = " ".join(entries["DATA"]).lower()
    if data not in ("ascii", "binary", "binary_compressed"):
        raise ValueError(f"DATA {data[:40]!r} is none of ascii, binary, binary_compressed")
    if data == "ascii":
        # Text says what it is without them.
        entries = {"SIZE": ["4"] * len(names), "TYPE": ["F"] * len(names), **entries}
    sizes = [int(word) for word in entries["SIZE"]]
    counts = [int(word) for word in entries.get("COUNT", ["1"] * len(names))]
    if not len(names) == len(sizes) == len(entries["TYPE"]) == len(counts):
        raise ValueError("FIELDS, SIZE, TYPE and COUNT differ in length")
    types = []
    for letter, size in zip((word.upper() for word in entries["TYPE"]), sizes, strict=True):
        if letter not in _KINDS or size not in (1, 2, 4, 8) or (letter == "F" and size < 4):
            raise ValueError(f"there is no type {letter} of {size} bytes")
        types.append(f"{_KINDS[letter]}{size}")
    if min(counts, default=0) < 0:
        raise ValueError("a negative COUNT")
    if sum(counts) > MAX_NUMBERS:
        raise ValueError(f"{sum(counts)} numbers per point")
    height, width = _grid(entries)
    there = [i for i, count in enumerate(counts) if count]
    return Header(
        _unique([names[i] for i in there], source),
        [types[i] for i in there],
        [counts[i] for i in there],
        height,
        width,
        _viewpoint(entries.get("VIEWPOINT"), source),
        data,
        says_width="WIDTH" in entries,
    )


def _grid(entries: dict[str, list[str]]) -> tuple[int, int]:
    """Give height and width of the cloud, one of which, or the number of points, may not be said.

    A WIDTH or HEIGHT of 0 beside points says nothing, as in PCL.
    """
    said: dict[str, int] = {}
    for key in ("POINTS", "WIDTH", "HEIGHT"):
        if key in entries:
            (word,) = entries[key]
            number = int(word)
            if number < 0:
                raise ValueError(f"a negative {key}")
            if number or not said.get("POINTS"):
                said[key] = number
    if "WIDTH" not in said and "POINTS" not in said:
        raise KeyError("WIDTH")
    height = said.get("HEIGHT", 1)
    width = said.get("WIDTH", said.get("POINTS", 0) // max(1, height))
    if "WIDTH" in said and "HEIGHT" not in said and width:
        height = said.get("POINTS", width) // width
    points = said.get("POINTS", width * height)
    if points != width * height:
        raise ValueError(f"POINTS {points} is not WIDTH {width} times HEIGHT {height}")
    return height, width


def _unique(names: list[str], source: str) -> list[str]:
    """Give a field that has another's name one of its own."""
    unique: list[str] = []
    taken = set(names)
    for name in names:
        if name in unique and name != _PADDING:
            other = unique_name(name, taken)
            taken.add(other)
            warnings.warn(
                f"{source}: two fields are called '{name}'; the second is the field '{other}'", stacklevel=6
            )
            name = other
        unique.append(name)
    return unique


def _viewpoint(words: list[str] | None, source: str) -> NDArray[np.float64] | None:
    """Give the position: three numbers, before an orientation as a quaternion, which does not matter here."""
    if words is None:
        return None
    numbers = [float(word) for word in words]
    if len(numbers) != 7:
        told = "its first three were taken for the position" if len(numbers) >= 3 else "it is left out"
        warnings.warn(f"{source}: VIEWPOINT has {len(numbers)} numbers, not seven; {told}", stacklevel=6)
    position = np.array(numbers[:3])
    return position if len(position) == 3 and bool(np.isfinite(position).all()) else None


def check_size(needed: int, size: int, header: Header, source: str) -> None:
    """Refuse a file of `size` bytes of data that should have so many more."""
    if needed > size:
        counted = "" if header.says_width else " (it has no line WIDTH)"
        raise FileFormatError(
            f"{source}: cut off: its header promises {header.points} points{counted} and so at least "
            f"{needed} bytes of data, {size} are there"
        )


def is_packed_colour(name: str, kind: str, shape: tuple[int, ...]) -> bool:
    """Tell whether a field holds red, green and blue in the bytes of one number."""
    return name in PACKED_COLOURS and not shape and np.dtype(kind).itemsize == 4
