"""How many points a LAS file holds, where its header and its size may disagree."""

from __future__ import annotations

import struct
import warnings
from collections.abc import Sequence
from typing import NamedTuple

from laspy import LasHeader

from surfsig.errors import FileFormatError

LARGEST_HEADER = 375
"""Bytes of a header of LAS 1.4, all of which the functions here look at."""


class Held(NamedTuple):
    """How many points a file holds, whatever its header promises.

    Attributes
    ----------
    least, most
        The number lies between them; both are the same where it is known.
    whole
        Nothing else follows the points.
    """

    least: int
    most: int
    whole: bool = True


def promised_counts(head: bytes) -> tuple[int, ...]:
    """Give the numbers of points that a header promises: the new one before the legacy one, without zeros."""
    (legacy,) = struct.unpack_from("<I", head, 107)
    (new,) = struct.unpack_from("<Q", head, 247) if head[25] >= 4 and len(head) >= 255 else (0,)
    return tuple(dict.fromkeys(count for count in (new, legacy) if count)) or (0,)


def agreed_count(
    header: LasHeader, promised: Sequence[int], held: Held, source: str, *, room: int | None = None
) -> int:
    """Choose the number of points between what the header promises and what the file holds.

    Parameters
    ----------
    header
        For the numbers of points by return, which confirm a promise.
    promised
        As `promised_counts` gives them.
    held
        What the file holds.
    source
        The file's name, for messages.
    room
        A promise of so many is believed too: what follows the points may be misplaced.

    Returns
    -------
    The number; more than `held` only if the header promises nothing else.

    Warns
    -----
    UserWarning
        If the header promises another number, or two.
    """
    fitting = [count for count in promised if held.least <= count <= held.most]
    possible = [count for count in promised if count <= max(held.most, room or 0)]
    chosen = (fitting or possible or list(promised))[0]
    if len(promised) > 1:
        warnings.warn(
            f"{source}: its header promises {promised[0]} points in one place and {promised[1]} in another; "
            f"{chosen} were read",
            stacklevel=2,
        )
    by_return = int(header.number_of_points_by_return.sum())
    if chosen >= held.least:
        if held.least < held.most and chosen < by_return <= held.most:
            warnings.warn(
                f"{source}: its header promises {chosen} points, and {by_return} by their returns; {chosen} "
                "were read",
                stacklevel=2,
            )
        return chosen
    more = f"its header promises {chosen} points"
    if chosen == 0 and held.least != held.most:
        raise FileFormatError(f"{source}: {more}, but points follow, of which the number is not known")
    if chosen == 0 or (held.whole and by_return != chosen and held.least == held.most):
        rest = "" if held.whole else ", and what follows them is no whole point"
        warnings.warn(
            f"{source}: {more}, but it holds {held.most}; all of them were read{rest}", stacklevel=2
        )
        return held.most
    warnings.warn(
        f"{source}: {more}, and no more were read, but there are more data behind them: "
        f"room for {held.least - chosen} points or more",
        stacklevel=2,
    )
    return chosen


def end_of_points(head: bytes, start: int, size: int) -> int:
    """Say where the uncompressed points end at the latest: at the records or the waveforms behind them."""
    behind: list[int] = []
    if head[25] >= 3 and len(head) >= 235:
        behind += struct.unpack_from("<Q", head, 227)
    if head[25] >= 4 and len(head) >= 247:
        place, count = struct.unpack_from("<QI", head, 235)
        behind += [place] if count else []
    return min([size, *(place for place in behind if start < place)])
