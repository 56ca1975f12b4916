"""The data of ASCII PCD files: numbers as the text has them, where the header declares other types."""

from __future__ import annotations

import re
import warnings
from typing import Any, BinaryIO

import numpy as np
from numpy.typing import NDArray

from surfsig.files.lines import take_rows
from surfsig.files.pcd_header import Header, check_size, is_packed_colour
from surfsig.progress import Progress

# So much text shows how a file writes its colours.
_SAMPLE_BYTES = 1 << 16
_WHOLE = re.compile(rb"[-+]?\d+|[-+]?nan.*", re.IGNORECASE)


def read_ascii(
    file: BinaryIO, header: Header, size: int, source: str, progress: Progress
) -> dict[str, NDArray[Any]]:
    """Read the rows of an open file; each field is given under its key, in its type.

    A whole number that does not fit the declared type is kept: an unsigned colour declared I, or a label.

    Raises
    ------
    FileFormatError
        If the file is cut off, or a line does not hold the numbers of a point.

    Warns
    -----
    UserWarning
        If numbers do not fit the declared type, or colours that are declared F are whole numbers.
    """
    flat: list[tuple[str, str]] = []
    for (key, kind, _), name, count in zip(header.parts(), header.names, header.counts, strict=True):
        flat += [(f"{key} {i}", _parsed_type(name, kind)) for i in range(count)]
    check_size(header.points * 2 * len(flat) - 1, size, header, source)
    start = file.tell()
    sample = file.read(_SAMPLE_BYTES).splitlines()[: header.points]
    file.seek(start)
    rows = take_rows(
        file,
        np.dtype(flat),
        header.points,
        source=source,
        first=header.lines + 1,
        progress=progress,
    )
    columns = {}
    place = 0
    for (key, kind, shape), name in zip(header.parts(), header.names, strict=True):
        parts = [rows[f"{key} {i}"] for i in range(shape[0] if shape else 1)]
        values = np.stack(parts, axis=1) if shape else parts[0]
        if is_packed_colour(name, kind, shape):
            whole = _is_whole(sample, place)
            columns[key] = _colours(values, kind, f"{source}: the field '{name}'", whole=whole)
        else:
            columns[key] = _as_declared(values, name, kind, source)
        place += len(parts)
    return columns


def _parsed_type(name: str, kind: str) -> str:
    """Say as what a number is parsed: wide enough for what the text may hold, whatever is declared."""
    if np.dtype(kind).kind in "iu":
        return "u8" if np.dtype(kind) == np.uint64 else "i8"
    # The text of a coordinate, or of a colour, may need more than the float32 that the header declares.
    return "f8" if name.lower() in ("x", "y", "z") or is_packed_colour(name, kind, ()) else kind


def _as_declared(values: NDArray[Any], name: str, kind: str, source: str) -> NDArray[Any]:
    declared = np.dtype(kind)
    if values.dtype.kind == "f" or declared.itemsize == values.dtype.itemsize:
        return values
    limits = np.iinfo(declared)
    if not values.size or (values.min() >= limits.min and values.max() <= limits.max):
        return values.astype(declared)
    warnings.warn(
        f"{source}: the field '{name}' is declared {declared.name}, but holds numbers from {values.min()} to "
        f"{values.max()}; they were read as they are",
        stacklevel=4,
    )
    return values


def _colours(values: NDArray[Any], kind: str, where: str, *, whole: bool) -> NDArray[Any]:
    """Give packed colours as 4 bytes each."""
    if np.dtype(kind).kind in "iu":
        return _low_bytes(values)
    shown = values[np.isfinite(values)]
    # The float of a colour is tiny, or huge and negative: its highest byte, alpha, is 0 or 255.
    if len(shown) and (shown == np.floor(shown)).all() and (np.abs(shown) >= 1).any():
        if whole and (np.abs(shown) < 2.0**32).all():
            warnings.warn(
                f"{where} is declared F, but its colours are whole numbers; they were read as packed colours",
                stacklevel=4,
            )
            return _low_bytes(np.where(np.isfinite(values), values, 0).astype(np.int64))
        warnings.warn(
            f"{where} holds colours that look like rounded whole numbers; they were read as PCL reads them, "
            "as the bits of a float, and may be wrong",
            stacklevel=4,
        )
    with np.errstate(over="ignore"):
        return values.astype(np.float32)


def _low_bytes(values: NDArray[Any]) -> NDArray[np.uint32]:
    return (values & 0xFFFFFFFF).astype(np.uint32)


def _is_whole(lines: list[bytes], place: int) -> bool:
    """Tell whether all numbers of a column are written without point and exponent."""
    # The last line of a sample may be cut off.
    rows = [line.split() for line in lines[:-1] or lines]
    return all(_WHOLE.fullmatch(words[place]) is not None for words in rows if len(words) > place)
