"""The pose that most matches agree with."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from surfsig.field import FieldMatches, FieldSignatures
from surfsig.odometry.motion import moved

Array = NDArray[np.float64]

_NEAR = 0.25
"""Radii of a patch between a moved place and its partner within which a match agrees with a pose."""
_ALONG = 0.8
"""Cosine between their axes."""
_ROUNDS = 5


def agreed_pose(matches: FieldMatches, source: FieldSignatures, target: FieldSignatures) -> tuple[Array, int]:
    """Give the pose T_target_source that most matches agree with, and how many do.

    Each match proposes its own; the best is fitted again to the places of those that agree.
    """
    ours, theirs = source.take(matches.source), target.take(matches.target)
    places, partners = ours.points.astype(np.float64), theirs.points.astype(np.float64)

    def agree(pose: Array) -> NDArray[np.bool_]:
        apart = np.linalg.norm(moved(pose, places) - partners, axis=1)
        along = np.einsum("ij,ij->i", ours.axes @ pose[:3, :3].T, theirs.axes)
        return np.asarray((apart < _NEAR * source.radius) & (along > _ALONG))

    if not len(matches):
        return np.eye(4), 0
    votes = [int(agree(pose).sum()) for pose in matches.poses]
    best = matches.poses[int(np.argmax(votes))]
    agreeing = agree(best)
    for _ in range(_ROUNDS):
        if agreeing.sum() < 3:
            break
        first, second = places[agreeing].mean(axis=0), partners[agreeing].mean(axis=0)
        rotation, _ = Rotation.align_vectors(partners[agreeing] - second, places[agreeing] - first)
        pose = np.eye(4)
        pose[:3, :3] = rotation.as_matrix()
        pose[:3, 3] = second - pose[:3, :3] @ first
        now = agree(pose)
        if now.sum() < agreeing.sum():
            break
        best, agreeing = pose, now
    return best, int(agreeing.sum())
