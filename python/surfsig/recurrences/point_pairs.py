"""Poses that bring one piece onto another, proposed by pairs of oriented points that are alike.

Drost, Ulrich, Navab, Ilic: Model globally, match locally (CVPR 2010).
"""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

Array = NDArray[np.float64]


def pair_features(
    points: Array, normals: Array, first: NDArray[np.int64], second: NDArray[np.int64], length: float
) -> Array:
    """Give (m, 4): distance over `length`, angles of both normals to the connecting line, angle between them."""
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
    """Give the pairs' own axes as poses (m, 4, 4): z the first normal, x towards the second point."""
    z = normals[first]
    line = points[second] - points[first]
    x = line - np.einsum("ij,ij->i", line, z)[:, None] * z
    x /= np.maximum(np.linalg.norm(x, axis=1), np.finfo(float).tiny)[:, None]
    poses = np.tile(np.eye(4), (len(first), 1, 1))
    poses[:, :3, 0], poses[:, :3, 1], poses[:, :3, 2] = x, np.cross(z, x), z
    poses[:, :3, 3] = points[first]
    return poses


def all_pairs(points: Array, shortest: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Give all ordered pairs of points that are at least so far apart."""
    distance = np.linalg.norm(points[:, None] - points[None], axis=2)
    first, second = np.nonzero(distance >= shortest)
    return first, second


def proposed_poses(
    source: tuple[Array, Array],
    target: tuple[Array, Array],
    length: float,
    most: int,
    rng: np.random.Generator,
) -> Array:
    """Propose poses T_target_source, (at most `most`, 4, 4).

    Parameters
    ----------
    source, target
        Points (n, 3) and unit normals (n, 3); some hundred.
    length
        Distance that counts as much as a radian of angle.
    most
        How many poses.
    rng
        Chooses among the pairs.
    """
    ends = all_pairs(source[0], 2.0 * length)
    others = all_pairs(target[0], 2.0 * length)
    if not len(ends[0]) or not len(others[0]):
        return np.empty((0, 4, 4))
    per_pair = 4
    chosen = rng.choice(len(ends[0]), min(len(ends[0]), max(1, most // per_pair)), replace=False)
    first, second = ends[0][chosen], ends[1][chosen]
    tree = cKDTree(pair_features(*target, *others, length))
    wanted = pair_features(*source, first, second, length)
    near = min(16, len(others[0]))
    distance, match = tree.query(wanted, k=near, distance_upper_bound=0.35)
    distance, match = distance.reshape(len(first), -1), match.reshape(len(first), -1)
    # Among the alike ones some at random: the very nearest are often neighbours of each other.
    shuffled = rng.permuted(np.tile(np.arange(match.shape[1]), (len(match), 1)), axis=1)[:, :per_pair]
    match = np.take_along_axis(match, shuffled, axis=1)
    found = match < len(others[0])
    row = np.repeat(np.arange(len(first)), found.sum(axis=1))
    column = match[found]
    moving = frames_of(*source, first[row], second[row])
    still = frames_of(*target, others[0][column], others[1][column])
    return still @ _inverses(moving)


def _inverses(poses: Array) -> Array:
    result = np.tile(np.eye(4), (len(poses), 1, 1))
    turned = poses[:, :3, :3].swapaxes(1, 2)
    result[:, :3, :3] = turned
    result[:, :3, 3] = -np.einsum("nij,nj->ni", turned, poses[:, :3, 3])
    return result
