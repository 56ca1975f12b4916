"""The pose that most matches agree with: each of them has a whole one to offer."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.field import FieldMatches, FieldSignatures
from surfsig.geometry import fit_transform, rotate, transform_points

Array = NDArray[np.float64]

_NEAR = 0.25
"""Radii of a patch between a moved place and its partner within which a match agrees with a pose."""
_ALONG = 0.8
"""Cosine between their axes."""
_PROPOSALS = 1000
"""Matches whose poses are tried, the most alike first."""
_ROUNDS = 10


@dataclass(frozen=True, eq=False)
class Pairs:
    """Places of a source and a target that look alike, and the poses that each proposes."""

    source: Array
    target: Array
    """(k, 3) places."""
    source_axes: Array
    target_axes: Array
    """(k, 3) unit."""
    poses: Array
    """(k, 4, 4), T_target_source."""
    distances: NDArray[np.float32]
    radius: float

    def __len__(self) -> int:
        """Return the number of pairs."""
        return len(self.source)

    @classmethod
    def of(cls, matches: FieldMatches, source: FieldSignatures, target: FieldSignatures) -> Pairs:
        """Take the matches of signatures."""
        ours, theirs = source.take(matches.source), target.take(matches.target)
        return cls(
            ours.points.astype(np.float64),
            theirs.points.astype(np.float64),
            ours.axes.astype(np.float64),
            theirs.axes.astype(np.float64),
            matches.poses,
            matches.distances,
            source.radius,
        )

    @classmethod
    def joined(cls, parts: list[Pairs]) -> Pairs:
        """Put pairs of the same two scans together, the most alike first."""
        distances = np.concatenate([part.distances for part in parts])
        order = np.argsort(distances, kind="stable")

        def column(name: str) -> Array:
            return np.concatenate([getattr(part, name) for part in parts])[order]

        return cls(
            column("source"),
            column("target"),
            column("source_axes"),
            column("target_axes"),
            column("poses"),
            distances[order],
            parts[0].radius,
        )

    def agreeing(self, pose: Array) -> NDArray[np.bool_]:
        """Tell which pairs agree with a pose, (k,)."""
        gap = np.linalg.norm(transform_points(pose, self.source) - self.target, axis=1)
        along = np.einsum("ij,ij->i", rotate(pose, self.source_axes), self.target_axes)
        return np.asarray((gap < _NEAR * self.radius) & (along > _ALONG))


def agreed_pose(pairs: Pairs) -> Array:
    """Give the pose T_target_source that most pairs agree with.

    Every pair proposes its own; the best is fitted again to the places that agree, until these stay the same.
    """
    best, highest = np.eye(4), -1.0
    for pose in pairs.poses[:_PROPOSALS]:
        gap = np.linalg.norm(transform_points(pose, pairs.source) - pairs.target, axis=1)
        along = np.einsum("ij,ij->i", rotate(pose, pairs.source_axes), pairs.target_axes)
        # A near partner counts more than one at the limit.
        closeness = np.maximum(1.0 - (gap / (_NEAR * pairs.radius)) ** 2, 0.0)
        score = float(closeness[along > _ALONG].sum())
        if score > highest:
            best, highest = pose, score
    agree = pairs.agreeing(best)
    for _ in range(_ROUNDS):
        if agree.sum() < 3:
            break
        pose = fit_transform(pairs.source[agree], pairs.target[agree])
        now = pairs.agreeing(pose)
        if now.sum() < agree.sum():
            break
        best, same, agree = pose, bool((now == agree).all()), now
        if same:
            break
    return best
