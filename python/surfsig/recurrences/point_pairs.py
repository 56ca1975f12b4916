"""Poses that bring one piece onto another, proposed by pairs of similar oriented points.

Drost, Ulrich, Navab, Ilic: Model globally, match locally (CVPR 2010).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from surfsig.geometry import inverse

Array = NDArray[np.float64]

_NEAREST = 16
_SIMILAR = 4
_ALONG = 1e-3
"""Radians between the line from point to point and the first normal, below which a pair has no axes."""
_TOLERANCE = 0.35
"""Of features: radians, or parts of the unit of length."""


def pair_features(
    points: Array, normals: Array, first: NDArray[np.int64], second: NDArray[np.int64], length: float
) -> Array:
    """Give (m, 4): distance over `length`, both normals' angles to the line, the angle between them."""
    line = points[second] - points[first]
    distance = np.linalg.norm(line, axis=1)
    line /= distance[:, None]
    angles = [
        np.arccos(np.clip(np.einsum("ij,ij->i", a, b), -1.0, 1.0))
        for a, b in (
            (normals[first], line),
            (normals[second], line),
            (normals[first], normals[second]),
        )
    ]
    return np.column_stack([distance / length, *angles])


def frames_of(points: Array, normals: Array, first: NDArray[np.int64], second: NDArray[np.int64]) -> Array:
    """Give the pairs' own axes as poses (m, 4, 4): z the first normal, x towards the second point.

    No line between the points may be along the first normal.
    """
    z = normals[first] / np.linalg.norm(normals[first], axis=1, keepdims=True)
    line = points[second] - points[first]
    x = line - np.einsum("ij,ij->i", line, z)[:, None] * z
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    poses = np.tile(np.eye(4), (len(first), 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(z, x), z
    poses[:, :3, 3] = points[first]
    return poses


def all_pairs(points: Array, shortest: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give all ordered pairs of points that are at least so far apart."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    first, second = np.nonzero(distance >= shortest)
    return first, second


@dataclass(frozen=True, eq=False)
class PointPairs:
    """All pairs of some oriented points that are not too near, with a search tree of their features."""

    points: Array
    normals: Array
    first: NDArray[np.int64]
    second: NDArray[np.int64]
    features: Array
    tree: cKDTree

    @classmethod
    def of(cls, points: Array, normals: Array, length: float) -> PointPairs:
        """Pair points (n, 3), some hundred; `length` counts as much as a radian of angle."""
        first, second = all_pairs(points, 2.0 * length)
        features = pair_features(points, normals, first, second, length)
        return cls(points, normals, first, second, features, cKDTree(features))


def proposed_poses(source: PointPairs, target: PointPairs, most: int, rng: np.random.Generator) -> Array:
    """Propose poses T_target_source, (at most `most`, 4, 4), of pairs that `rng` chooses."""
    if not len(source.first) or not len(target.first):
        return np.empty((0, 4, 4))
    chosen = rng.choice(len(source.first), min(len(source.first), max(1, most // _SIMILAR)), replace=False)
    _, match = target.tree.query(source.features[chosen], k=_NEAREST, distance_upper_bound=_TOLERANCE)
    # Of the similar ones some at random: the very nearest are often neighbours of each other.
    match = rng.permuted(match, axis=1)[:, :_SIMILAR]
    found = match < len(target.first)
    row = chosen[np.nonzero(found)[0]]
    column = match[found]
    across = np.minimum(np.sin(source.features[row, 1]), np.sin(target.features[column, 1])) > _ALONG
    row, column = row[across], column[across]
    moving = frames_of(source.points, source.normals, source.first[row], source.second[row])
    still = frames_of(target.points, target.normals, target.first[column], target.second[column])
    return still @ inverse(moving)
