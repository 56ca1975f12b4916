"""Whether two pieces show the same object: a pose that agrees with what the sensor saw of both."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.recurrences.point_pairs import proposed_poses
from surfsig.recurrences.sight import Sight

Array = NDArray[np.float64]

_PROPOSALS = 2000
_COARSE_POINTS = 60
_KEPT = 8
_MUTATIONS = 32
_ROUNDS = 7
_PENALTY = 2.0


@dataclass(frozen=True, eq=False)
class View:
    """A piece as the alignment takes it: evenly thinned points and normals, fewer ones for pairs, its sight."""

    points: Array
    normals: Array
    pairs: tuple[Array, Array]
    sight: Sight
    extent: float


@dataclass(frozen=True, eq=False)
class Alignment:
    """How well one piece lies on another.

    `pose` is T_target_source (4, 4). `confirmed`, `contradicted` and `astray` are shares of points: of the
    source's points as the target's sensor sees them, and the other way round, (2,).
    """

    pose: Array
    confirmed: Array
    contradicted: Array
    astray: Array
    score: float


def align(source: View, target: View, tolerance: float, rng: np.random.Generator) -> Alignment | None:
    """Find the pose T_target_source that most of both pieces agree with; None if no pose is proposed."""
    length = max(source.extent, target.extent) / 10.0
    poses = proposed_poses(source.pairs, target.pairs, length, _PROPOSALS, rng)
    if not len(poses):
        return None
    few = _some(source, rng), _some(target, rng)
    score = _scores(poses, few, (source.sight, target.sight), tolerance * 2.0)
    poses, score = _best(poses, score, 4 * _KEPT)
    many = _some(source, rng, 4 * _COARSE_POINTS), _some(target, rng, 4 * _COARSE_POINTS)
    score = _scores(poses, many, (source.sight, target.sight), tolerance)
    poses, score = _best(poses, score, _KEPT)
    middle = target.points.mean(axis=0)
    for turn in range(_ROUNDS):
        step = 0.5**turn
        tried = _mutated(poses, middle, 0.15 * step, 0.06 * step * target.extent, rng)
        tried = np.concatenate([poses, tried])
        score = _scores(tried, many, (source.sight, target.sight), tolerance)
        poses, score = _best(tried, score, max(1, _KEPT >> (turn // 2)))
    return measured(poses[0], source, target, tolerance)


def measured(pose: Array, source: View, target: View, tolerance: float) -> Alignment:
    """Judge a pose T_target_source by all points of both pieces."""
    there = target.sight.judge(*_moved(pose[None], source.points, source.normals), tolerance)
    back = source.sight.judge(*_moved(_inverse(pose)[None], target.points, target.normals), tolerance)
    shares = np.array([[float(part.mean()) for part in side] for side in (there, back)])
    confirmed, contradicted, astray = shares.T
    return Alignment(pose, confirmed, contradicted, astray, float(_agreement(confirmed, contradicted, astray)))


def _agreement(confirmed: Array, contradicted: Array, astray: Array) -> Array:
    return np.asarray((confirmed - _PENALTY * contradicted - astray).sum(axis=0) / 2.0)


def _scores(
    poses: Array, points: tuple[tuple[Array, Array], tuple[Array, Array]], sights: tuple[Sight, Sight], tolerance: float
) -> Array:
    backwards = np.linalg.inv(poses)
    there = sights[1].judge(*_moved(poses, *points[0]), tolerance)
    back = sights[0].judge(*_moved(backwards, *points[1]), tolerance)
    parts = [np.stack([a.mean(axis=1), b.mean(axis=1)]) for a, b in zip(there, back, strict=True)]
    return _agreement(*parts)


def _moved(poses: Array, points: Array, normals: Array) -> tuple[Array, Array]:
    turned = poses[:, :3, :3].swapaxes(1, 2)
    return points @ turned + poses[:, None, :3, 3], normals @ turned


def _some(view: View, rng: np.random.Generator, most: int = _COARSE_POINTS) -> tuple[Array, Array]:
    rows = rng.choice(len(view.points), min(most, len(view.points)), replace=False)
    return view.points[rows], view.normals[rows]


def _best(poses: Array, score: Array, most: int) -> tuple[Array, Array]:
    order = np.argsort(-score, kind="stable")[:most]
    return poses[order], score[order]


def _mutated(poses: Array, middle: Array, angle: float, shift: float, rng: np.random.Generator) -> Array:
    """Turn about the target's middle and shift at random, `_MUTATIONS` times each."""
    count = len(poses) * _MUTATIONS
    vector = rng.normal(0.0, angle, (count, 3))
    size = np.linalg.norm(vector, axis=1)
    x, y, z = (vector / size[:, None]).T
    zero = np.zeros(count)
    cross = np.stack([zero, -z, y, z, zero, -x, -y, x, zero], axis=1).reshape(-1, 3, 3)
    turn = (
        np.eye(3)
        + np.sin(size)[:, None, None] * cross
        + (1 - np.cos(size))[:, None, None] * (cross @ cross)
    )
    motion = np.tile(np.eye(4), (count, 1, 1))
    motion[:, :3, :3] = turn
    motion[:, :3, 3] = middle - turn @ middle + rng.normal(0.0, shift, (count, 3))
    return np.asarray(motion @ np.repeat(poses, _MUTATIONS, axis=0))


def _inverse(pose: Array) -> Array:
    return np.linalg.inv(pose)
