"""How many points are where: counts of the occupied cells of a lattice, which double as they become many."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

MOST_CELLS = 1 << 18
"""Occupied cells beyond which they double: tiles are then cut to a part in a thousand, in some 10 MB."""

SAMPLED = 1 << 16
"""Points of a block that are looked at, at least, where it has as many: the others are taken to be where
these are, which moves a cut by less than a hundredth of a tile."""

_MOST_WAITING = 4 * MOST_CELLS
"""Cells of others that wait until they are added up at once: of each file there may be many."""

_CELLS_OF_FIRST = 1024
"""Cells along the longest side of the first points: cells only become larger."""

# Keys beyond are as good as the last: a lone outlier needs no cell of its own.
_FARTHEST = 2.0**40
# Large odd numbers, which spread keys over 64 bits; two cells that meet there count as one, which only moves
# a cut.
_MIX = np.array([0x9E3779B97F4A7C15, 0xC2B2AE3D27D4EB4F, 0x165667B19E3779F9], np.uint64)


class CellCounts:
    """Counts of points by cell, of a power of two in size, so that cells' sides are exact numbers.

    Attributes
    ----------
    exponent
        Cells are 2 ** exponent wide; None before there were two different places.
    """

    def __init__(self) -> None:
        self.exponent: int | None = None
        self._keys = np.empty((0, 3), np.int64)
        self._counts = np.empty(0, np.int64)
        # Exponents, keys and counts of others.
        self._waiting: list[tuple[int, NDArray[np.int64], NDArray[np.int64]]] = []
        # Points that came while all were in one place.
        self._place = np.zeros(3)
        self._there = 0

    def add(self, points: NDArray[np.floating]) -> None:
        """Count points (n, 3), all finite."""
        if not len(points):
            return
        if self.exponent is None:
            first = points[0] if not self._there else self._place
            side = float(np.abs(points - first).max())
            if side == 0:
                self._place, self._there = np.array(first, np.float64), self._there + len(points)
                return
            self.exponent = int(np.floor(np.log2(side / _CELLS_OF_FIRST)))
            if self._there:
                self._count(self._place[None], np.array([self._there]))
        # Some points stand for all where there are many.
        step = max(1, len(points) // SAMPLED)
        sampled = points[::step]
        counts = np.full(len(sampled), step, np.int64)
        counts[-1] = len(points) - step * (len(sampled) - 1)
        self._count(sampled, counts)

    def add_cells(self, middles: NDArray[np.float64], counts: NDArray[np.int64]) -> None:
        """Count so many points at each of some places (k, 3), as an index of a file tells them."""
        if self.exponent is None:
            side = float(np.ptp(middles, axis=0).max()) if len(middles) else 0.0
            self.exponent = int(np.floor(np.log2((side or 1.0) / _CELLS_OF_FIRST)))
        self._count(middles, counts)

    def _count(self, points: NDArray[np.floating], counts: NDArray[np.int64]) -> None:
        assert self.exponent is not None
        scaled = np.floor(np.ldexp(np.asarray(points, np.float64), -self.exponent))
        keys = np.clip(scaled, -_FARTHEST, _FARTHEST).astype(np.int64)
        self._keys, self._counts = _summed(
            np.concatenate([self._keys, keys]), np.concatenate([self._counts, counts])
        )
        self._double()

    def _double(self) -> None:
        while self.exponent is not None and len(self._counts) > MOST_CELLS:
            self.exponent += 1
            self._keys, self._counts = _summed(self._keys >> 1, self._counts)

    def merge(self, other: CellCounts) -> None:
        """Take over the counts of others."""
        if other.exponent is None:
            if other._there:
                self.add(np.repeat(other._place[None], other._there, axis=0))
            return
        if self.exponent is None:
            self.exponent = other.exponent
            if self._there:
                self._count(self._place[None], np.array([self._there]))
        self._waiting.append((other.exponent, other.keys, other.counts))
        if sum(len(counts) for _, _, counts in self._waiting) > _MOST_WAITING:
            self._add_waiting()

    def _add_waiting(self) -> None:
        if not self._waiting:
            return
        assert self.exponent is not None
        parts = [(self.exponent, self._keys, self._counts), *self._waiting]
        self._waiting = []
        # Smaller cells lie in larger ones; the largest of all are those of the sum.
        self.exponent = max(exponent for exponent, _, _ in parts)
        self._keys, self._counts = _summed(
            np.concatenate([keys >> (self.exponent - exponent) for exponent, keys, _ in parts]),
            np.concatenate([counts for _, _, counts in parts]),
        )
        self._double()

    def scale(self, factor: float) -> None:
        """Let each point count so many times."""
        self._add_waiting()
        self._counts = np.rint(self._counts * factor).astype(np.int64)

    @property
    def keys(self) -> NDArray[np.int64]:
        """The occupied cells (m, 3)."""
        self._add_waiting()
        return self._keys

    @property
    def counts(self) -> NDArray[np.int64]:
        """Points of each, (m,)."""
        self._add_waiting()
        return self._counts

    def places(self) -> NDArray[np.float64]:
        """Give the middle of each cell, (m, 3)."""
        keys = self.keys
        middles: NDArray[np.float64] = np.ldexp(keys + 0.5, self.exponent or 0)
        return middles

    @property
    def total(self) -> int:
        """Points that were counted."""
        return int(self.counts.sum()) + (self._there if self.exponent is None else 0)


def _summed(
    keys: NDArray[np.int64], counts: NDArray[np.int64]
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Add up the counts of equal keys."""
    with np.errstate(over="ignore"):
        mixed = (keys.astype(np.uint64) * _MIX).sum(axis=1, dtype=np.uint64)
    _, first, which = np.unique(mixed, return_index=True, return_inverse=True)
    sums = np.bincount(which.ravel(), weights=counts, minlength=len(first))
    return keys[first], sums.astype(np.int64)
