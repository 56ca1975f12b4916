"""How scans usually lie in the map, by which a pose is doubted, believed at once, or on probation."""

from __future__ import annotations

from collections import deque

import numpy as np

from surfsig.odometry.alignment import Alignment

_SCANS = 10
"""Scans that say what is usual."""
_DROP = 0.85
"""Of the usual overlap: below, a pose is doubted."""
_FULL = 0.93
"""Of the usual overlap: from here on, a pose that was searched is believed at once."""
_FEWEST = 0.4
"""Overlap that is usual before any is known."""
_THROUGH = 0.01
"""Share of the map's places that a scan may look through, more than scans usually do: what moved since."""
_UNEXPLAINED = 0.015
"""Share of a scan's places that keyframes should have seen and the map lacks, more than the most of late."""
_NONE = 0.02
"""Such a share that is as good as none."""
_NEW, _LEFT = 0.2, 0.05
"""Unexplained more than the most of late, and seen through more than usual, of a scan that lies where it was
expected: what is new before the sensor, and what has left."""


class Usual:
    """What the last scans that have a pose did; all shares depend on the sensor and the place."""

    def __init__(self) -> None:
        self._overlaps: deque[float] = deque(maxlen=_SCANS)
        self._seen_through: deque[float] = deque(maxlen=_SCANS)
        self._unexplained: deque[float] = deque(maxlen=_SCANS)

    def add(self, found: Alignment) -> None:
        """Take a scan that has a pose."""
        self._overlaps.append(found.overlap)
        self._seen_through.append(found.seen_through)
        self._unexplained.append(found.unexplained)

    def fits(self, found: Alignment) -> bool:
        """Tell whether a scan is held, lies on the map as scans do, and contradicts nothing."""
        return found.held and found.overlap >= _DROP * self._overlap() and not self.is_contradicted(found)

    def is_contradicted(self, found: Alignment) -> bool:
        """Tell whether scan and map cannot both be, by what either sensor must have seen."""
        unexplained = found.unexplained > self._most_unexplained() + _UNEXPLAINED
        return unexplained or found.seen_through > self._through() + _THROUGH

    def is_sure(self, found: Alignment) -> bool:
        """Tell whether a scan says alone that its pose is right: the map explains all of it."""
        full = found.overlap >= _FULL * self._overlap() and found.unexplained <= _NONE
        return found.held and full and not self.is_contradicted(found)

    def may_be_new(self, found: Alignment) -> bool:
        """Tell whether a new room, or something that moves, may be all that is unusual."""
        left = found.seen_through <= self._through() + _LEFT
        return found.held and left and found.unexplained <= self._most_unexplained() + _NEW

    def _overlap(self) -> float:
        return float(np.median(self._overlaps)) if self._overlaps else _FEWEST

    def _through(self) -> float:
        return float(np.median(self._seen_through)) if self._seen_through else 0.0

    def _most_unexplained(self) -> float:
        return max(self._unexplained, default=1.0)
