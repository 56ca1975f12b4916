"""Arguments of several functions, checked: each returns what it was given in the form that is worked with."""

from __future__ import annotations

import operator

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.errors import InvalidInputError
from surfsig.point_cloud import coordinate_array, plain_array

LENGTHS = (1e-18, 1e18)
"""What a radius or voxel may be: beyond, its square leaves float32."""


MOST_NEIGHBORS = 2**32 - 1
"""Points are numbered with 32 bits."""


def positive_length(value: float, what: str) -> float:
    """Check a length: finite, above 0, and within what float32 can square."""
    try:
        number = float(value)
    except (TypeError, ValueError, OverflowError):
        raise InvalidInputError(f"{what} must be a finite number, not {value!r:.40}") from None
    if not (np.isfinite(number) and number > 0):
        raise InvalidInputError(f"{what} must be a finite number above 0, not {number:g}")
    if not LENGTHS[0] <= number <= LENGTHS[1]:
        raise InvalidInputError(f"{what} must be from {LENGTHS[0]:g} to {LENGTHS[1]:g}, not {number:g}")
    return number


def whole_number(value: int, what: str, most: int) -> int:
    """Check a whole number from 1 to `most`."""
    try:
        number = operator.index(value)
    except TypeError:
        raise InvalidInputError(f"{what} must be a whole number, not {value!r:.40}") from None
    if not 1 <= number <= most:
        raise InvalidInputError(f"{what} must be 1 to {most}, not {number}")
    return number


def thread_count(threads: int | None) -> int | None:
    """Check a number of threads, 1 to 1024; None stays None and means all cores."""
    return None if threads is None else whole_number(threads, "threads", 1024)


def query_places(
    at: ArrayLike, count: int
) -> tuple[NDArray[np.uint32] | NDArray[np.float64], NDArray[np.int64] | None]:
    """Return what the core takes, and the points' numbers where they are points."""
    try:
        array = plain_array(at)
    except ValueError:
        raise InvalidInputError("at must be places (m, 3); its rows differ in length") from None
    if array.ndim == 2:
        return coordinate_array(array, "at").astype(np.float64), None
    indices = place_numbers(array, count).astype(np.int64)
    return indices.astype(np.uint32), indices


def place_numbers(at: ArrayLike | None, count: int) -> NDArray[np.int64]:
    """Return numbers of places from numbers, of which negative ones count from the end, or a mask."""
    if at is None:
        return np.arange(count)
    array = plain_array(at)
    if array.dtype == np.bool_:
        if array.shape != (count,):
            raise InvalidInputError(f"at: a mask must have the shape ({count},), not {array.shape}")
        return np.flatnonzero(array)
    if array.size == 0:
        return np.zeros(0, np.int64)
    if array.ndim != 1 or array.dtype.kind not in "iu":
        raise InvalidInputError(
            f"at must be whole numbers (m,), a mask, or places (m, 3), not {array.dtype} {array.shape}"
        )
    # Before unsigned numbers can wrap round.
    if array.dtype.kind == "u" and array.max() >= count:
        raise InvalidInputError(f"at: index {array.max()} is outside a cloud of {count} points")
    numbers = array.astype(np.int64)
    wrong = (numbers < -count) | (numbers >= count)
    if wrong.any():
        raise InvalidInputError(f"at: index {numbers[wrong][0]} is outside a cloud of {count} points")
    return np.where(numbers < 0, numbers + count, numbers)
