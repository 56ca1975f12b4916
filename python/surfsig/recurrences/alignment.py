"""Whether two pieces show the same object: a pose that agrees with what the sensor saw of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import from_rotation_vector, inverse, rotate, transform_points
from surfsig.recurrences.point_pairs import proposed_poses
from surfsig.recurrences.view import View

Array = NDArray[np.float64]

_PROPOSALS = 3000
_FEW, _SOME, _MANY = 60, 240, 600
"""Points of each piece that poses are judged by, from the first proposals to the last search."""
_ALL = 1 << 40
_TRIED, _KEPT = 48, 12
_MUTATIONS = 24
_ROTATION, _TRANSLATION = 0.15, 0.06
"""Of the first random changes: radians, and parts of the piece's extent; halved each round."""
_COARSE_ROUNDS, _FINE_ROUNDS = 4, 6
_FIT_STEPS = 5
_COARSE, _FINE = (4.0, 8.0), (15.0, 40.0)
"""What a contradicted and a missing place count, in confirmed ones: at first, when even the best poses are
not exact; and in the end, when hardly any is left on true ones."""
_PLANAR, _CURVED = 0.7, 0.1
"""What a match of one plane counts against a round one, as many objects have a flat face; and the spread of
confirmed normals (1 less the largest eigenvalue of their second moments) from which on it is round."""
_HOPELESS = 0.1
"""Scores after the coarse search below which no fine one made a match."""


@dataclass(frozen=True, eq=False)
class Alignment:
    """How well one piece lies on another.

    `confirmed`, `contradicted`, `astray` and `missing` are shares of points (see `Sight.judge`): of the
    source's as the target's sensor sees them, and the other way round, (2,).
    """

    pose: Array
    """T_target_source, (4, 4)."""
    confirmed: Array
    contradicted: Array
    astray: Array
    missing: Array
    score: float
    """1 where all is seen from both sides and agrees; 0 and below where nothing speaks for a match."""


def align(source: View, target: View, rng: np.random.Generator) -> Alignment | None:
    """Find the pose T_target_source that both pieces agree with most; None where that is hopeless."""
    poses = proposed_poses(source.pairs, target.pairs, _PROPOSALS, rng)
    if not len(poses):
        return None
    views = (source, target)
    poses, _ = _best(poses, _scores(poses, views, _FEW, 2.0, _COARSE), _TRIED)
    poses, score = _best(poses, _scores(poses, views, _SOME, 1.0, _COARSE), _KEPT)
    for number in range(_COARSE_ROUNDS):
        poses = _mutated(poses, target, 0.5**number, rng)
        poses, score = _best(poses, _scores(poses, views, _SOME, 1.0, _COARSE), _KEPT)
    if score[0] < _HOPELESS:
        return None
    fitted = [_fitted(pose, views, _MANY) for pose in poses[: _KEPT // 2]]
    return refined(np.concatenate([poses, fitted]), source, target, rng)


def refined(poses: Array, source: View, target: View, rng: np.random.Generator) -> Alignment:
    """Search around good poses T_target_source, (k, 4, 4), for the one that both pieces agree with most."""
    views = (source, target)
    for number in range(_FINE_ROUNDS):
        scores = _scores(poses, views, _MANY, 1.0, _FINE)
        poses, _ = _best(poses, scores, max(1, _KEPT >> (1 + number // 2)))
        poses = _mutated(poses, target, 0.5 ** (_COARSE_ROUNDS - 2 + number), rng)
    poses, _ = _best(poses, _scores(poses, views, _MANY, 1.0, _FINE), 1)
    fitted = _fitted(poses[0], views, _ALL)
    return max((measured(pose, source, target) for pose in (poses[0], fitted)), key=lambda found: found.score)


def measured(pose: Array, source: View, target: View) -> Alignment:
    """Judge a pose T_target_source by all points of both pieces."""
    shares = _shares(pose[None], (source, target), _ALL, 1.0)[..., 0]
    confirmed, contradicted, astray, missing = shares
    score = float(_agreement(shares, _FINE)) * _weight(pose, source, target)
    return Alignment(pose, confirmed, contradicted, astray, missing, score)


def _shares(poses: Array, views: tuple[View, View], most: int, looseness: float) -> Array:
    """Give the shares (4, 2, poses) of confirmed, contradicted, astray and missing points, there and back."""
    source, target = views
    sides = [
        still.image.judge(moves, moving.surface, most, looseness * still.tolerance)
        for moves, moving, still in ((poses, source, target), (inverse(poses), target, source))
    ]
    return np.moveaxis(np.asarray(sides, np.float64), 2, 0)


def _agreement(shares: Array, penalties: tuple[float, float]) -> Array:
    confirmed, contradicted, astray, missing = shares
    wrong = penalties[0] * contradicted + penalties[1] * missing + astray
    return np.asarray((confirmed - wrong).mean(axis=0))


def _scores(
    poses: Array, views: tuple[View, View], most: int, looseness: float, penalties: tuple[float, float]
) -> Array:
    return _agreement(_shares(poses, views, most, looseness), penalties)


def _weight(pose: Array, source: View, target: View) -> float:
    """Give what the confirmed part of a match counts: less where it is one plane."""
    _, _, normals = target.image.correspondences(pose, source.surface, _ALL, target.tolerance)
    if not len(normals):
        return 0.0
    spread = 1.0 - float(np.linalg.eigvalsh(normals.T @ normals / len(normals))[-1])
    return _PLANAR + (1.0 - _PLANAR) * min(spread / _CURVED, 1.0)


def _best(poses: Array, score: Array, most: int) -> tuple[Array, Array]:
    order = np.argsort(-score, kind="stable")[:most]
    return poses[order], score[order]


def _mutated(poses: Array, target: View, step: float, rng: np.random.Generator) -> Array:
    """Give the poses, and each rotated about the target's middle and translated at random."""
    count = len(poses) * _MUTATIONS
    rotation_vectors = rng.normal(0.0, _ROTATION * step, (count, 3))
    translations = rng.normal(0.0, _TRANSLATION * step * target.extent, (count, 3))
    changes = from_rotation_vector(rotation_vectors, translations)
    return np.concatenate([poses, changes @ np.repeat(poses, _MUTATIONS, axis=0)])


def _fitted(pose: Array, views: tuple[View, View], most: int) -> Array:
    """Refine a pose by point-to-plane least squares over the confirmed points, there and back.

    The correspondences are those of the depth images. Where the points leave a direction free (along a
    cylinder, in a plane), the least change is taken, none in that direction.
    """
    source, target = views
    for _ in range(_FIT_STEPS):
        kept, foot, normal = target.image.correspondences(pose, source.surface, most, target.tolerance)
        moved = transform_points(pose, source.points[kept])
        rows = [_row(moved / target.extent, normal)]
        residuals = [np.einsum("ij,ij->i", moved - foot, normal)]
        back = inverse(pose)
        kept, foot, normal = source.image.correspondences(back, target.surface, most, source.tolerance)
        normal = rotate(pose, normal)
        # The target's point stays and the source's surface moves: the opposite sign.
        rows.append(_row(target.points[kept] / target.extent, normal))
        residuals.append(np.einsum("ij,ij->i", transform_points(pose, foot) - target.points[kept], normal))
        design, residual = np.concatenate(rows), np.concatenate(residuals)
        if len(design) < 6:
            break
        values, vectors = np.linalg.eigh(design.T @ design)
        inverted = np.where(values > _FREE**2 * values[-1], 1.0 / np.maximum(values, 1e-300), 0.0)
        change = -vectors @ (inverted * (vectors.T @ (design.T @ residual)))
        pose = from_rotation_vector(change[:3] / target.extent, change[3:]) @ pose
    return pose


_FREE = 0.03
"""Of the largest singular value; directions below it are left alone."""


def _row(points: Array, normals: Array) -> Array:
    """Give the change of residuals for a small twist, (n, 6)."""
    return np.hstack([np.cross(points, normals), normals])
