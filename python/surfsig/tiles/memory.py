"""How much memory there is, and how many points of a tile fit into it."""

from __future__ import annotations

import contextlib
import ctypes
import os
import re
import sys
from pathlib import Path

from surfsig.errors import InvalidInputError

SHARE = 0.5
"""Share of the machine's free memory that is used where nobody says how much."""

LARGE_SHARE = 0.25
"""Share of the machine's memory beyond which an input is worked on in tiles: files may be compressed, and an
extraction needs more than the cloud."""

BASE_BYTES = 240_000_000
"""What a process needs beside its tile: Python, the libraries, blocks of LAZ that are decoded and written.
scripts/measure_tile_memory.py measured 162 MB; up to 75 more were seen with 64 files and twelve tiles one
after the other."""

LEAST_BYTES = 600_000_000
"""Memory below which nothing is begun: while files are binned, blocks of half a million points and rows that
wait for their tiles' files take up to 510 MB, whatever the tiles are."""

POINT_BYTES = 200
"""What a point of a tile needs beside twice its row: the index, the columns of the extraction, and what the
writer holds. scripts/measure_tile_memory.py measured 104 to 110 with one tile, robust or not; of two with 2.5
million points each, one after the other, the peak was 875 MB, which asks for 190."""

SURFACE_POINT_BYTES = 300
"""The same where surfaces are found: neighbours, normals, labels. The script measured 244, with half
a million and with a million points."""

WHOLE_BYTES = 190
"""What a point needs, its extraction and its file included, where all points are in memory at once."""

FEWEST_POINTS = 20_000
"""Points of a tile, at least: with fewer, most of what is read would be halo."""

MOST_POINTS = 50_000_000
"""Points of a tile, at most: more tiles can be shared among workers, and a lost one costs less."""

_UNITS = {"": 1, "k": 1e3, "m": 1e6, "g": 1e9, "t": 1e12, "ki": 2**10, "mi": 2**20, "gi": 2**30, "ti": 2**40}
_SIZE = re.compile(r"\s*([0-9.]+)\s*([kmgt]i?)?b?\s*", re.IGNORECASE)


def memory_bytes(memory: int | float | str | None) -> int:
    """Give bytes of a number, or of words such as "4GB" or "1.5 GiB"; of None a share of what is free.

    Raises
    ------
    InvalidInputError
        If it is none of these, or too little for one tile.
    """
    if memory is None:
        return int(SHARE * free_bytes())
    if isinstance(memory, str):
        found = _SIZE.fullmatch(memory)
        try:
            size = float(found[1]) * _UNITS[(found[2] or "").lower()] if found else -1.0
        except ValueError:
            size = -1.0
    else:
        size = float(memory)
    if not 0 < size < 2**60:
        raise InvalidInputError(f"memory must be a size such as '4GB', not {memory!r:.40}")
    if size < LEAST_BYTES:
        raise InvalidInputError(f"memory must be at least {LEAST_BYTES // 1_000_000} MB, not {memory!r:.40}")
    return int(size)


def points_per_tile(memory: int, row_bytes: int, point_bytes: int = POINT_BYTES) -> int:
    """Give the points of a tile that one process with so many bytes can work on.

    Parameters
    ----------
    memory
        Of the process.
    row_bytes
        Of a row in the store.
    point_bytes
        What a point needs beside its rows.
    """
    room = memory - BASE_BYTES
    return int(min(max(room / (point_bytes + 2 * row_bytes), FEWEST_POINTS), MOST_POINTS))


def total_bytes() -> int:
    """Give the bytes of the machine's memory, or of the control group that this process is in."""
    try:
        total = os.sysconf("SC_PAGE_SIZE") * os.sysconf("SC_PHYS_PAGES")
    except (AttributeError, ValueError, OSError):
        # Windows does not say without a library; a small machine is assumed.
        return 8 << 30
    return min(total, _limit_of_group() or total)


def free_bytes() -> int:
    """Give the bytes that programs can still have."""
    try:
        text = Path("/proc/meminfo").read_text()
        found = re.search(r"^MemAvailable:\s*(\d+) kB", text, re.MULTILINE)
    except OSError:
        found = None
    free = int(found[1]) << 10 if found else total_bytes() // 2
    return min(free, total_bytes())


def resident_bytes() -> int:
    """Give the bytes of memory that this process has; 0 where the system does not say."""
    try:
        pages = int(Path("/proc/self/statm").read_text().split()[1])
    except (OSError, ValueError, IndexError):
        return 0
    return pages * os.sysconf("SC_PAGE_SIZE")


def release_memory() -> None:
    """Give memory that is free within this process back to the system, where its C library can (glibc).

    Arrays of tiles come and go in several sizes; what lies between them would be kept, and add up from tile
    to tile.
    """
    if sys.platform != "linux":
        return
    with contextlib.suppress(AttributeError, OSError):
        ctypes.CDLL(None).malloc_trim(0)


def _limit_of_group() -> int | None:
    """Give the limit of a container (control groups, version 2)."""
    try:
        text = Path("/sys/fs/cgroup/memory.max").read_text().strip()
    except OSError:
        return None
    return int(text) if text.isdecimal() else None
