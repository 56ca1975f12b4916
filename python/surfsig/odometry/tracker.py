"""Scan after scan: predicted, put onto the map, and searched where that fails; lengths are in voxels."""

from __future__ import annotations

import math
from collections import deque
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.odometry.alignment import Alignment, Scan, align
from surfsig.odometry.keyframes import Keyframes
from surfsig.odometry.local_map import LocalMap
from surfsig.odometry.motion import adjoint, inverse, moved, turned_by
from surfsig.odometry.result import ScanStatus

Array = NDArray[np.float64]

_SIGMAS = 3.0
"""Deviations of earlier predictions within which a partner is looked for."""
_NARROWEST = 2.0
"""Voxels between partners, to begin with, at least."""
_START = 0.1
"""Of the median distance that scans see: deviation of a prediction before any is known."""
_STILL = 0.1
"""Voxels: a deviation below it says nothing about motion."""
_MOST, _BEYOND = 99.0, 1.2
"""Percent of a scan's places that the map must hold, and how much farther it goes."""
_DROP = 0.85
"""Of the usual overlap: below, a pose is doubted, and one that was searched not believed."""
_LEAST = 0.4
"""Overlap of a pose that is believed, at least; as much more than another's must be to take its place."""
_BETTER = 0.1
_THROUGH = 0.01
"""Share of the map's places that a scan may look through, more than scans usually do: what moved since."""
_USUAL = 10
"""Scans that say what overlap is usual."""
_MAPPED_MOVE, _MAPPED_TURN = 1.0, 0.03
"""Voxels and radians since the last scan that went into the map."""


@dataclass(frozen=True, eq=False)
class Step:
    """What became of a scan: T_map_scan and its covariance (NaN where lost)."""

    pose: Array
    covariance: Array
    status: ScanStatus
    overlap: float


class Tracker:
    """Keeps the map, the motion, and the keyframes."""

    def __init__(
        self, reach: float, patch: float, map_range: float | None, distance: float | None, threads: int
    ) -> None:
        self._reach, self._distance, self._threads = reach, distance, threads
        self._fixed_range, self._range = map_range, 0.0
        self._map = LocalMap(threads)
        self._keyframes = Keyframes(reach, patch, threads)
        self._mapped: dict[int, tuple[Array, Array]] = {}
        """Poses and covariances of the scans that are in the map."""
        self._last: Array = np.eye(4)
        self._motion: Array = np.eye(4)
        self._since = 1
        """Scans since the last one that has a pose."""
        self._squares, self._predictions = (_START * reach) ** 2, 1
        """Sum of the squared deviations of predictions, and their number."""
        self._overlaps: deque[float] = deque(maxlen=_USUAL)
        self._seen_through: deque[float] = deque(maxlen=_USUAL)
        self._last_mapped: Array | None = None
        self._number = 0

    def skip(self) -> None:
        """Pass over a scan that has nothing to say."""
        self._number += 1
        self._since += 1

    def follow(self, scan: Scan) -> Step:
        """Find the pose of the next scan."""
        farthest = float(np.percentile(np.linalg.norm(scan.points, axis=1), _MOST))
        self._range = self._fixed_range or max(self._range, _BEYOND * farthest)
        if not self._mapped:
            return self._took(scan, np.eye(4), np.zeros((6, 6)), ScanStatus.TRACKED, 1.0)
        prediction = self._last @ np.linalg.matrix_power(self._motion, self._since)
        found = align(scan, self._map, prediction, self._partner_distance())
        status = ScanStatus.TRACKED
        if self._is_doubtful(found):
            again = self._keyframes.find(scan, self._range, self._most_seen_through())
            if again is not None and self._is_believed(again[0], found):
                found, self._map = again
                status = ScanStatus.RELOCALISED
            elif found is not None and self._deviation(prediction, found) > self._partner_distance():
                # Neither where it was expected nor as it should lie.
                found = None
        if found is None or not found.held or found.overlap < _LEAST:
            self.skip()
            # Where the sensor went meanwhile, nobody knows.
            self._motion = np.eye(4)
            return Step(np.full((4, 4), np.nan), np.full((6, 6), np.nan), ScanStatus.LOST, 0.0)
        if status == ScanStatus.TRACKED:
            deviation = self._deviation(prediction, found)
            if deviation > _STILL:
                self._squares, self._predictions = self._squares + deviation**2, self._predictions + 1
        self._overlaps.append(found.overlap)
        self._seen_through.append(found.seen_through)
        return self._took(scan, found.pose, self._covariance(found), status, found.overlap)

    def _partner_distance(self) -> float:
        """Let partners be as far as predictions were wrong (as in KISS-ICP, Vizzo and others 2023)."""
        if self._distance is not None:
            return self._distance
        variance = self._squares / self._predictions
        return max(_NARROWEST, _SIGMAS * math.sqrt(variance * self._since))

    def _deviation(self, prediction: Array, found: Alignment) -> float:
        """Tell by how much a prediction was wrong, at the median distance."""
        off = inverse(prediction) @ found.pose
        turned = 2.0 * self._reach * math.sin(0.5 * turned_by(off))
        return turned + float(np.linalg.norm(off[:3, 3]))

    def _is_doubtful(self, found: Alignment | None) -> bool:
        if found is None or not found.held or found.overlap < _DROP * self._usual():
            return True
        return found.seen_through > self._most_seen_through()

    def _most_seen_through(self) -> float:
        usual = float(np.median(self._seen_through)) if self._seen_through else 0.0
        return usual + _THROUGH

    def _is_believed(self, again: Alignment, found: Alignment | None) -> bool:
        """Tell whether a pose that was searched may take the place of the one that was expected."""
        usual = again.overlap >= _DROP * self._usual()
        return usual and (found is None or again.overlap > found.overlap + _BETTER)

    def _usual(self) -> float:
        return float(np.median(self._overlaps)) if self._overlaps else _LEAST

    def _covariance(self, found: Alignment) -> Array:
        """Add the error of the map, which is that of the scans that it was made of."""
        result = found.covariance.copy()
        numbers, counts = np.unique(found.scans, return_counts=True)
        for number, share in zip(numbers, counts / counts.sum(), strict=True):
            pose, covariance = self._mapped[int(number)]
            carried = adjoint(inverse(found.pose) @ pose)
            result += share * (carried @ covariance @ carried.T)
        return result

    def _took(self, scan: Scan, pose: Array, covariance: Array, status: ScanStatus, overlap: float) -> Step:
        """Go on from a pose."""
        if status == ScanStatus.RELOCALISED:
            self._motion, self._last_mapped = np.eye(4), None
        elif self._since == 1:
            self._motion = inverse(self._last) @ pose
        if self._is_new(pose):
            self._map.add(moved(pose, scan.points), self._number)
            self._map.keep_within(pose[:3, 3], self._range)
            self._mapped[self._number] = pose, covariance
            self._keyframes.offer(scan, pose, self._number)
            self._last_mapped = pose
        self._last, self._since = pose, 1
        self._number += 1
        return Step(pose, covariance, status, overlap)

    def _is_new(self, pose: Array) -> bool:
        """Tell whether the sensor went on since the last scan of the map."""
        if self._last_mapped is None:
            return True
        since = inverse(self._last_mapped) @ pose
        return float(np.linalg.norm(since[:3, 3])) > _MAPPED_MOVE or turned_by(since) > _MAPPED_TURN
