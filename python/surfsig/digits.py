"""Numbers for people: as many digits as the standard error asks for, and no coordinate cut short."""

from __future__ import annotations

import math
from collections.abc import Iterable

import numpy as np
from numpy.typing import NDArray

DIGITS = 15
"""That float64 holds."""


def finite_or_none(value: float) -> float | None:
    """Give a number for JSON: None where it is not finite."""
    return value if math.isfinite(value) else None


def finite_rows(matrix: NDArray[np.float64]) -> list[list[float | None]]:
    """Give a matrix row by row, for JSON: None for what is not finite."""
    return [[finite_or_none(value) for value in row] for row in matrix.tolist()]


def decimals_of(value: float, error: float) -> int:
    """Give the decimals that show two digits of a standard error, and no more than float64 has of the value.

    Where the error is 0 or not known, all that float64 has.
    """
    before = math.floor(math.log10(abs(value))) + 1 if value and math.isfinite(value) else 1
    most = max(0, DIGITS - 1 - before)
    if not (math.isfinite(error) and error > 0.0):
        return most
    return min(max(0, 1 - math.floor(math.log10(error))), most)


def rounded(value: float, error: float) -> str:
    """Write a value with two digits of its standard error: 389000.12317 for an error of 0.00012."""
    if not (math.isfinite(error) and error > 0.0) or not math.isfinite(value):
        return f"{value:.{DIGITS - 1}g}"
    return f"{value:.{decimals_of(value, error)}f}"


def with_error(value: float, error: float) -> str:
    """Write a value and its standard error: 389000.12317 +- 0.00012."""
    return f"{rounded(value, error)} +- {error:.2g}"


def position_text(values: Iterable[float], separator: str = ", ") -> str:
    """Write coordinates with all digits that matter at UTM: those of a micrometre, or 7 of smaller ones."""
    numbers = [float(value) for value in values]
    largest = max((abs(value) for value in numbers if math.isfinite(value)), default=0.0)
    digits = max(7, min(DIGITS, math.floor(math.log10(largest)) + 7)) if largest > 0.0 else 7
    return separator.join(f"{value:.{digits}g}" for value in numbers)
