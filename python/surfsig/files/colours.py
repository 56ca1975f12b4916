"""Colours: what their numbers mean follows from their type, by one rule for every format and library.

====================================  ===========================================================
type in the file                      field of the cloud
====================================  ===========================================================
whole numbers of 8 bits               uint8, as they are
whole numbers of 16 bits              uint16, as they are (in LAS uint8, if none is above 255)
other whole numbers                   uint8 if all are 0 to 255, uint16 if all are 0 to 65535
floating point, all from 0 to 1       uint8, 255 times the value
floating point, others                as they are
====================================  ===========================================================

Text has no types, so how numbers are written counts: those from 0 to 1 with a decimal point are floating
point, whole numbers are whole numbers.
"""

from __future__ import annotations

import warnings
from collections.abc import Collection, Mapping, Sequence
from typing import Any

import numpy as np
from numpy.typing import NDArray

CHANNELS = ("red", "green", "blue")
ALPHA = "alpha"

_NAMES = {
    prefix + letter: name
    for name in (*CHANNELS, ALPHA)
    for prefix, letter in (("", name), ("", name[0]), ("diffuse_", name))
}
# By how much rounding to float32 and back may bring a colour beyond 0 or 1.
_ROUNDING = 1e-6


def is_colour(name: str) -> bool:
    """Tell whether a field of this name may be a colour."""
    return name.lower() in _NAMES


def with_colours(
    fields: Mapping[str, NDArray[Any]],
    *,
    bytes_in_16_bits: bool = False,
    decimals: Collection[str] | None = None,
    source: str = "",
) -> dict[str, NDArray[Any]]:
    """Call colours red, green, blue and alpha, in the type that says what they mean.

    Parameters
    ----------
    fields
        By name; those called red or r or diffuse_red, in any case, and so on, are colours if all three are
        there, each once.
    bytes_in_16_bits
        Whether programs write colours of 8 bits into this format's 16 (LAS).
    decimals
        Of text: the columns whose numbers are written with a decimal point or an exponent. None where the
        file has types.
    source
        Of text: the file's name, for the warning.

    Warns
    -----
    UserWarning
        If colours in a text are 0 and 1 alone, written as whole numbers.
    """
    named = {name: _NAMES[name.lower()] for name in fields if name.lower() in _NAMES}
    parts = {channel: name for name, channel in named.items()}
    if len(parts) < len(named) or not parts.keys() >= set(CHANNELS):
        return dict(fields)
    groups: list[tuple[str, ...]] = [CHANNELS, (ALPHA,)] if ALPHA in parts else [CHANNELS]
    if decimals is not None and len(groups) > 1 and _is_one_scale([fields[name] for name in named]):
        groups = [(*CHANNELS, ALPHA)]
    converted: dict[str, NDArray[Any]] = {}
    for group in groups:
        names = [parts[channel] for channel in group]
        values = [fields[name] for name in names]
        if decimals is None:
            found = _of_type(values, bytes_in_16_bits)
        else:
            found = _of_text(values, any(name in decimals for name in names), source)
        if found is None:
            return dict(fields)
        converted.update(zip(names, found, strict=True))
    return {named.get(name, name): converted.get(name, values) for name, values in fields.items()}


def _is_one_scale(values: Sequence[NDArray[Any]]) -> bool:
    """Tell whether numbers of a text are all whole, or all at most 1: then alpha is on the colours' scale."""
    return all(_are_whole(part) for part in values) or _limits(values)[1] <= 1


def _of_type(values: Sequence[NDArray[Any]], bytes_in_16_bits: bool) -> Sequence[NDArray[Any]] | None:
    """Give the channels in the type that says what they mean; None if they are no colours."""
    if any(part.ndim != 1 for part in values):
        return None
    kinds = {part.dtype.newbyteorder("=") for part in values}
    if kinds == {np.dtype(np.uint8)} or (kinds == {np.dtype(np.uint16)} and not bytes_in_16_bits):
        return values
    if all(kind.kind in "iu" for kind in kinds):
        return _whole(values)
    if not all(kind.kind == "f" for kind in kinds):
        return None
    low, high = _limits(values)
    if not (low >= -_ROUNDING and high <= 1 + _ROUNDING):
        return None
    if any(np.isnan(part).any() for part in values):
        # uint8 knows no missing colour.
        return values
    return [np.round(255 * np.clip(part, 0, 1)).astype(np.uint8) for part in values]


def _of_text(values: Sequence[NDArray[Any]], decimal: bool, source: str) -> Sequence[NDArray[Any]] | None:
    """Do the same for numbers that were read as floating point, whatever they were in the text."""
    low, high = _limits(values)
    if not all(_are_whole(part) for part in values):
        return _of_type(values, bytes_in_16_bits=False)
    if decimal and low >= 0 and high <= 1:
        return _of_type(values, bytes_in_16_bits=False)
    if low >= 0 and high == 1:
        warnings.warn(
            f"{source}: its colours are 0 and 1 alone, written as whole numbers: taken as such, of 0 to 255",
            stacklevel=3,
        )
    if any(np.isnan(part).any() for part in values):
        return values if low >= 0 and high <= 255 else None
    return _whole(values)


def _whole(values: Sequence[NDArray[Any]]) -> Sequence[NDArray[Any]] | None:
    """Give whole numbers as uint8 or uint16, the smallest that holds all of them; None if none does."""
    low, high = _limits(values)
    for kind in (np.uint8, np.uint16):
        if low >= 0 and high <= np.iinfo(kind).max:
            return [part.astype(kind, copy=False) for part in values]
    return None


def _are_whole(values: NDArray[Any]) -> bool:
    return np.array_equal(values, np.floor(values), equal_nan=True)


def _limits(values: Sequence[NDArray[Any]]) -> tuple[float, float]:
    """Give the lowest and the highest number that is one; of none, 0 and 0."""
    filled = [part for part in values if part.size and not np.isnan(part).all()]
    if not filled:
        return 0.0, 0.0
    return float(min(np.nanmin(part) for part in filled)), float(max(np.nanmax(part) for part in filled))
