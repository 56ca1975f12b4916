"""When scans were taken, by the names of their files."""

from __future__ import annotations

import itertools
import re
from collections.abc import Sequence

_NUMBER = re.compile(r"\d+(\.\d*)?")
"""A name that is nothing but a number."""

_CLOCK = re.compile(r"(?:\D|.*\D)?(\d{9,11})[._-](\d{1,9})")
"""A name that ends in seconds and nanoseconds, as ROS programs write them: cloud_SEC_NSEC, SEC.NSEC."""

_WHOLE_CLOCK = re.compile(r"(?:\D|.*\D)?(\d{10}|\d{13}|\d{16}|\d{19})")
"""A name that ends in one number of a clock: seconds, or milli-, micro- or nanoseconds."""

_SECONDS_DIGITS = 10
"""Digits of a clock's time in seconds; with 3, 6 and 9 more it counts milli-, micro- and nanoseconds."""


def times_of_names(names: Sequence[str]) -> list[float] | None:
    """Give the times, in seconds, that the names of files say, without their suffixes.

    Parameters
    ----------
    names
        Of all scans, in their order.

    Returns
    -------
    list of float or None
        None where not all names say one in the same way, or the times do not grow.
    """
    for read in (_numbers, _clocks, _whole_clocks):
        times = read(names)
        if times is not None and all(after > before for before, after in itertools.pairwise(times)):
            return times
    return None


def _numbers(names: Sequence[str]) -> list[float] | None:
    if not all(_NUMBER.fullmatch(name) for name in names):
        return None
    return _counted(names) if all(name.isdecimal() for name in names) else [float(name) for name in names]


def _clocks(names: Sequence[str]) -> list[float] | None:
    """Read seconds and nanoseconds, of which some programs leave out leading zeros."""
    found = [_CLOCK.fullmatch(name) for name in names]
    return [int(match[1]) + 1e-9 * int(match[2]) for match in found if match] if all(found) else None


def _whole_clocks(names: Sequence[str]) -> list[float] | None:
    found = [_WHOLE_CLOCK.fullmatch(name) for name in names]
    return _counted([match[1] for match in found if match]) if all(found) else None


def _counted(numbers: Sequence[str]) -> list[float]:
    """Turn whole numbers of one unit into seconds."""
    digits = len(str(max(int(number) for number in numbers)))
    unit = 1000 ** max(0, round((digits - _SECONDS_DIGITS) / 3))
    return [int(number) / unit for number in numbers]
