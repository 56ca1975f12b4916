"""Poses of a model that many places of a scene propose."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surfsig.field import FieldSignatures, match_fields
from surfsig.geometry import inverse

Array = NDArray[np.float64]

_NEAR = 0.5
"""Radii of a patch between the middles of poses that agree."""
_TURN = 0.35
"""Radians between them (20 degrees)."""
_SAME = 0.5
"""Of these distances, between two poses of which the less agreed one is left out."""


def proposed_poses(model: FieldSignatures, scene: FieldSignatures, most: int) -> Array:
    """Give poses T_scene_model, (k, 4, 4), the most agreed first.

    Each place of the scene proposes one, by the place of the model that it is most like. A pose counts the
    others near it, each by how alike the two places are; a place of the model that much of the scene is like
    counts less.

    Parameters
    ----------
    model, scene
        Signatures of places all over both, about the model's middle.
    most
        Poses that are given.
    """
    found = match_fields(scene, model, mutual=False)
    if not len(found):
        return np.empty((0, 4, 4))
    proposed = inverse(found.poses)
    middles = proposed[:, :3, 3]
    alike = np.maximum(1.0 - found.distances.astype(np.float64) ** 2 / 2.0, 0.0)
    alike /= np.bincount(found.target, minlength=len(model))[found.target]
    # A unit quaternion and its negative are one turn; two are half the angle between them apart.
    quaternions = Rotation.from_matrix(proposed[:, :3, :3]).as_quat()
    scaled = np.hstack([middles / (_NEAR * model.radius), quaternions / (0.5 * _TURN)])
    both = np.concatenate([scaled, scaled * ([1.0] * 3 + [-1.0] * 4)])
    tree = cKDTree(both)
    votes = np.zeros(len(scaled))
    pairs = cKDTree(scaled).sparse_distance_matrix(tree, 1.0, output_type="ndarray")
    # In an order of their own, so that sums are the same each time.
    pairs = pairs[np.lexsort((pairs["j"], pairs["i"]))]
    np.add.at(votes, pairs["i"], alike[pairs["j"] % len(scaled)] * (1.0 - pairs["v"] ** 2))
    order = np.argsort(-votes, kind="stable")
    start = np.searchsorted(pairs["i"], np.arange(len(scaled) + 1))
    free = np.ones(len(scaled), np.bool_)
    chosen = []
    for number in order:
        if not free[number]:
            continue
        around = pairs[start[number] : start[number + 1]]
        weights = alike[around["j"] % len(scaled)] * (1.0 - around["v"] ** 2)
        chosen.append(_mean_pose(middles, quaternions, around["j"], weights))
        free[around["j"][around["v"] < _SAME] % len(scaled)] = False
        if len(chosen) == most:
            break
    return np.array(chosen)


def _mean_pose(middles: Array, quaternions: Array, numbers: NDArray[np.int64], weights: Array) -> Array:
    """Average poses near each other; numbers beyond their count have the negative quaternion."""
    count = len(middles)
    sign = np.where(numbers < count, 1.0, -1.0)[:, None]
    which = numbers % count
    pose = np.eye(4)
    mean = (weights[:, None] * sign * quaternions[which]).sum(axis=0)
    pose[:3, :3] = Rotation.from_quat(mean).as_matrix()
    pose[:3, 3] = np.average(middles[which], axis=0, weights=weights)
    return pose
