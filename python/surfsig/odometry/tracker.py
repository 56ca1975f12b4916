"""Scan after scan: predicted, put onto the map, and searched where that fails; lengths are in voxels."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import adjoint, inverse, rotation_angle, transform_points
from surfsig.odometry.alignment import Alignment, Scan, align
from surfsig.odometry.keyframes import Keyframes
from surfsig.odometry.local_map import LocalMap
from surfsig.odometry.result import ScanStatus
from surfsig.odometry.usual import Usual

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
_LEAST = 0.4
"""Overlap of a pose that is believed, at least; as much more than another's must be to take its place."""
_BETTER = 0.1
_FOUND_AGAIN, _REAPPEARED = 3, 2
"""Scans that must agree on the way through a known part of the map where none is sure alone: in one that was
searched, and where the sensor was last seen."""
_COASTING = 5
"""Lost scans during which the sensor is looked for where its motion would have brought it."""
_MAPPED_MOVE, _MAPPED_TURN = 1.0, 0.03
"""Voxels and radians since the last scan that went into the map."""


@dataclass(frozen=True, eq=False)
class Step:
    """What became of a scan: T_map_scan and its covariance."""

    number: int
    """Of the scan, from 0."""
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
        self._usual = Usual()
        self._is_lost = False
        self._trial: list[Step] = []
        """Scans whose way through a part of the map must prove right."""
        self._last_mapped: Array | None = None
        self._number = 0

    def skip(self) -> None:
        """Pass over a scan that has nothing to say."""
        self._number += 1
        self._since += 1

    def follow(self, scan: Scan) -> list[Step]:
        """Find the pose of the next scan; none if it is lost, and more where it proves those before right."""
        farthest = float(np.percentile(np.linalg.norm(scan.points, axis=1), _MOST))
        self._range = self._fixed_range or max(self._range, _BEYOND * farthest)
        if not self._mapped:
            first = Step(self._number, np.eye(4), np.zeros((6, 6)), ScanStatus.TRACKED, 1.0)
            return self._took(scan, first)
        prediction = self._last @ np.linalg.matrix_power(self._motion, self._since)
        found = self._aligned(scan, prediction)
        status = ScanStatus.TRACKED
        if found is None or not self._usual.fits(found):
            again = self._keyframes.find(scan, self._range, self._usual.fits)
            if again is not None and self._is_better(again[0], found):
                found, self._map = again
                status = ScanStatus.RELOCALISED
                self._trial.clear()
            elif found is not None and not self._is_expected(found, prediction):
                found = None
        if found is None or not found.held or found.overlap < _LEAST:
            self.skip()
            self._trial.clear()
            self._is_lost = True
            if self._since > _COASTING:
                # Where the sensor went meanwhile, nobody knows.
                self._motion = np.eye(4)
            return []
        step = Step(self._number, found.pose, self._covariance(found), status, found.overlap)
        was_expected = status == ScanStatus.TRACKED and not self._is_lost
        if self._is_on_trial(step, found):
            return []
        if was_expected:
            deviation = self._deviation(prediction, found)
            if deviation > _STILL:
                self._squares, self._predictions = self._squares + deviation**2, self._predictions + 1
        self._usual.add(found)
        return self._took(scan, step)

    def _partner_distance(self) -> float:
        """Let partners be as far as predictions were wrong (as in KISS-ICP, Vizzo and others 2023)."""
        if self._distance is not None:
            return self._distance
        variance = self._squares / self._predictions
        return max(_NARROWEST, _SIGMAS * math.sqrt(variance * self._since))

    def _deviation(self, prediction: Array, found: Alignment) -> float:
        """Tell by how much a prediction was wrong."""
        return self._at_reach(inverse(prediction) @ found.pose)

    def _at_reach(self, off: Array) -> float:
        """Give how far a motion carries what is at the median distance, at most."""
        turned = 2.0 * self._reach * math.sin(0.5 * rotation_angle(off))
        return turned + float(np.linalg.norm(off[:3, 3]))

    def _aligned(self, scan: Scan, prediction: Array) -> Alignment | None:
        known = self._keyframes.should_know
        return align(scan, self._map, prediction, self._partner_distance(), known)

    def _is_better(self, again: Alignment, found: Alignment | None) -> bool:
        """Tell whether a pose that was searched takes the place of the doubted one."""
        if found is None or not found.held:
            return True
        if self._at_reach(inverse(found.pose) @ again.pose) <= _NARROWEST:
            return False
        return again.overlap > found.overlap + _BETTER or self._usual.is_contradicted(found)

    def _is_expected(self, found: Alignment, prediction: Array) -> bool:
        """Tell whether a doubted pose may be kept: it is near where the sensor was bound for.

        Long after the sensor was lost, nothing is expected.
        """
        near = self._deviation(prediction, found) <= self._partner_distance()
        coasting = not self._is_lost or self._since <= _COASTING
        return near and coasting and self._usual.may_be_new(found)

    def _is_on_trial(self, step: Step, found: Alignment) -> bool:
        """Keep back the way into a known part of the map, until it is sure or has gone on for some scans.

        Places that look alike from one place differ a little farther on.
        """
        if step.status == ScanStatus.TRACKED and not self._is_lost:
            return False
        self._trial.append(step)
        searched = self._trial[0].status == ScanStatus.RELOCALISED
        enough = len(self._trial) >= (_FOUND_AGAIN if searched else _REAPPEARED)
        self._is_lost = not enough and not self._usual.is_sure(found)
        if self._is_lost:
            self._go_on(step)
        return self._is_lost

    def _covariance(self, found: Alignment) -> Array:
        """Add the error of the map, which is that of the scans that it was made of."""
        result = found.covariance.copy()
        numbers, counts = np.unique(found.scans, return_counts=True)
        for number, share in zip(numbers, counts / counts.sum(), strict=True):
            pose, covariance = self._mapped[int(number)]
            carried = adjoint(inverse(found.pose) @ pose)
            result += share * (carried @ covariance @ carried.T)
        return result

    def _took(self, scan: Scan, step: Step) -> list[Step]:
        """Put a scan into the map, and give its step with those that were kept back."""
        steps, self._trial = self._trial or [step], []
        if steps[0].status == ScanStatus.RELOCALISED:
            self._last_mapped = None
        pose = step.pose
        if self._is_new(pose):
            self._map.add(transform_points(pose, scan.points), self._number)
            self._map.keep_within(pose[:3, 3], self._range)
            self._mapped[self._number] = pose, step.covariance
            self._keyframes.offer(scan, pose, self._number)
            self._last_mapped = pose
        self._go_on(step)
        return steps

    def _go_on(self, step: Step) -> None:
        """Expect the next scan from here, with the motion since the last one."""
        if step.status == ScanStatus.RELOCALISED:
            self._motion = np.eye(4)
        elif self._since == 1:
            self._motion = inverse(self._last) @ step.pose
        self._last, self._since = step.pose, 1
        self._number += 1

    def _is_new(self, pose: Array) -> bool:
        """Tell whether the sensor went on since the last scan of the map."""
        if self._last_mapped is None:
            return True
        since = inverse(self._last_mapped) @ pose
        return float(np.linalg.norm(since[:3, 3])) > _MAPPED_MOVE or rotation_angle(since) > _MAPPED_TURN
