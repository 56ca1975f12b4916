"""Arguments of several functions, checked: each returns what it was given in the form that is worked with."""

from __future__ import annotations

import operator

import numpy as np

from surfsig.errors import InvalidInputError
from surfsig.progress import ProgressCallback

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


def progress_callback(progress: ProgressCallback | None) -> ProgressCallback | None:
    """Check what is called with how far work has come; None stays None."""
    if progress is not None and not callable(progress):
        raise InvalidInputError(f"progress must be a function of (done, total), not {progress!r:.40}")
    return progress
