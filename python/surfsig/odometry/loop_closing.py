"""Loops that close: what a way around has drifted by is distributed over its scans.

A pose graph of all scans in a chain and of the loops, in which the errors of steps are a random walk.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig import geometry
from surfsig.alignment.pose_graph import PoseGraph

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_STANDING = 0.01
"""Part of the range by which the error of a scan grows that has not moved."""
_COVARIANCES = 64
"""Scans of a segment, at most, whose covariances are computed anew; those between are interpolated."""


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """A scan that lies on what an earlier one saw, after a way around."""

    scan: int
    """Its number."""
    earlier: int
    """That of the earlier one."""
    T_earlier_scan: Array
    """(4, 4)."""
    T_world_scan_before: Array
    """(4, 4), the scan's pose by the way around; its difference to that by the earlier scan is the drift."""


def closed(
    poses: Array,
    covariances: Array,
    segments: Integers,
    loops: Sequence[LoopClosure],
    reach: float,
    slides: NDArray[np.bool_] | None = None,
) -> tuple[Array, Array]:
    """Fit poses to the motions from scan to scan and to the loops.

    Parameters
    ----------
    poses
        (n, 4, 4), each in the world of its segment; NaN where there is none.
    covariances
        (n, 6, 6), of the twist of each pose, as they were known when the scans came.
    segments
        (n,), -1 where there is no pose.
    loops
        Of any segment.
    reach
        The length by which a rotation moves what is seen.
    slides
        (n,), whether the map leaves motions of a scan open; of none by default.

    Returns
    -------
    Poses (n, 4, 4) and covariances (n, 6, 6). The first pose of each segment stays, and so do segments
    without a loop.
    """
    poses, covariances = poses.copy(), covariances.copy()
    for segment in sorted({int(segments[loop.scan]) for loop in loops} - {-1}):
        nodes = np.flatnonzero(segments == segment)
        number = {int(scan): k for k, scan in enumerate(nodes)}
        own = [loop for loop in loops if loop.scan in number and loop.earlier in number]
        if own and len(nodes) > 1:
            chain = _Chain(poses[nodes], own, number, reach)
            poses[nodes] = chain.closed()
            slide = np.zeros(len(nodes), np.bool_) if slides is None else slides[nodes]
            covariances[nodes] = chain.covariances(poses[nodes], covariances[nodes], slide)
    return poses, covariances


class _Chain:
    """The scans of one segment, which have numbers 0, 1, ... in it, and their loops."""

    def __init__(self, poses: Array, loops: list[LoopClosure], number: dict[int, int], reach: float) -> None:
        self._poses = poses
        count = len(poses)
        arrived = poses.copy()
        for loop in loops:
            arrived[number[loop.scan]] = loop.T_world_scan_before
        self._loops = {number[loop.scan]: number[loop.earlier] for loop in loops}
        steps = geometry.inverse(poses[:-1]) @ arrived[1:]
        # A random walk: the variance of a step is as its length, and that of a loop the median of the steps'.
        # Rotations count by how far they move what is seen.
        moved = geometry.log_pose(steps)
        length = np.linalg.norm(moved[:, 3:], axis=1) + reach * np.linalg.norm(moved[:, :3], axis=1)
        variance = length + _STANDING * reach
        unit = np.array([1.0 / reach] * 3 + [1.0] * 3) ** 2
        self._of_steps = variance[:, None] * unit
        self._of_loop = float(np.median(variance)) * unit
        measured = np.concatenate([steps, [loop.T_earlier_scan for loop in loops]])
        of_edges = np.concatenate([self._of_steps, np.tile(self._of_loop, (len(loops), 1))])
        self._graph = PoseGraph(
            np.concatenate([np.arange(1, count), [number[loop.scan] for loop in loops]]),
            np.concatenate([np.arange(count - 1), [number[loop.earlier] for loop in loops]]),
            measured,
            np.eye(6) / of_edges[:, :, None],
            # About where the later scan is.
            measured[:, :3, 3],
            first=0,
            robust=None,
            reach=reach,
        )

    def closed(self) -> Array:
        """Give the poses that agree best with steps and loops."""
        return self._graph.fit(self._poses)

    def covariances(self, poses: Array, given: Array, slides: NDArray[np.bool_]) -> Array:
        """Give what the loops make of given covariances, (n, 6, 6).

        Each scan's covariance is that of the steps before it, and of those loops that it knows of. The others
        take the same share of it as they do of a random walk's covariance, of rotations and translations.
        What the way around left open is known after a loop: there it is the random walk's, as large as the
        given ones are to it.
        """
        came, unknown = self._when_it_came(given)
        result = self._factors(poses, came) * given
        is_finite = np.isfinite(given).all(axis=(1, 2))
        every = np.arange(len(poses))
        before, after = _variances(given), _variances(came)
        known = is_finite & (every < min(unknown, default=0)) & (after > 0.0).all(axis=1)
        if known.any():
            first = min(unknown)
            since = every[first:][np.logical_or.accumulate(slides[first:])]
            opened = every[~is_finite & (every >= first) & (every < min(since, default=len(poses)))]
            scale = np.repeat(np.sqrt(np.median(before[known] / after[known], axis=0)), 3)
            result[opened] = self._graph.covariances(poses, opened) * np.outer(scale, scale)
        return result

    def _factors(self, poses: Array, came: Array) -> Array:
        """Give the share of a random walk's covariances that all loops leave, as factors, (n, 6, 6)."""
        some = np.unique(np.linspace(0, len(poses) - 1, min(len(poses), _COVARIANCES)).astype(np.int64))
        deviations = []
        for covariances in (self._graph.covariances(poses, some), came[some]):
            deviations.append(np.sqrt(_variances(covariances)))
        after, before = deviations
        share = np.divide(after, before, out=np.ones_like(after), where=before > 0.0).clip(0.0, 1.0)
        every = np.arange(len(poses))
        root = np.column_stack([np.interp(every, some, share[:, part]) for part in (0, 0, 0, 1, 1, 1)])
        return np.asarray(root[:, :, None] * root[:, None, :])

    def _when_it_came(self, given: Array) -> tuple[Array, list[int]]:
        """Give the covariances of a random walk with the loops that given ones know of, (n, 6, 6).

        They know of those within one map. After a loop with an earlier map they are those of the way around:
        the scans of such loops come second.
        """
        unknown = []
        result = np.zeros((len(self._poses), 6, 6))
        for scan in range(1, len(result)):
            result[scan] = self._carried(result, scan - 1, scan, self._of_steps[scan - 1])
            if scan in self._loops:
                by_loop = self._carried(result, self._loops[scan], scan, self._of_loop)
                if _has_fallen(given[scan - 1 : scan + 1], np.array([result[scan], by_loop])):
                    result[scan] = by_loop
                else:
                    unknown.append(scan)
        return result, unknown

    def _carried(self, covariances: Array, start: int, end: int, change: Array) -> Array:
        """Give the covariance of a scan by that of another one and of the pose between, (6, 6)."""
        to_end = geometry.adjoint(geometry.inverse(self._poses[end]) @ self._poses[start])
        return np.asarray(to_end @ covariances[start] @ to_end.T + np.diag(change))


def _variances(covariances: Array) -> Array:
    """Give those of rotation and of translation, (n, 2)."""
    diagonal = np.einsum("nii->ni", covariances)
    return np.column_stack([diagonal[:, :3].sum(1), diagonal[:, 3:].sum(1)])


def _has_fallen(given: Array, expected: Array) -> bool:
    """Whether the second of two covariances is below the first by most of what is expected, (2, 6, 6)."""
    pairs = np.array([_variances(given), _variances(expected)])
    known = np.isfinite(pairs).all(axis=(0, 1)) & (pairs > 0.0).all(axis=(0, 1))
    ratios = np.log(pairs[:, 1] / np.where(known, pairs[:, 0], 1.0), where=known, out=np.zeros((2, 2)))
    return bool((ratios[0] < 0.5 * ratios[1]).any())
