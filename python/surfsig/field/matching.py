"""Matches between two scans, each with a whole pose."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.field.signatures import FieldSignatures

_TURNS = 128
_BLOCK = 2048


@dataclass(frozen=True, eq=False, repr=False)
class FieldMatches:
    """Places of a source and of a target that look alike, the most alike first."""

    source: NDArray[np.int64]
    """Numbers of places of the source, (k,)."""
    target: NDArray[np.int64]
    """Numbers of places of the target, (k,)."""
    distances: NDArray[np.float32]
    """Between the two signatures, (k,): 0 to 2."""
    poses: NDArray[np.float64]
    """T_target_source by each match alone, (k, 4, 4): place on place, axis on axis, and turned about it by
    what the phases say."""

    def __len__(self) -> int:
        """Return the number of matches."""
        return len(self.source)

    def __repr__(self) -> str:
        """Say how many there are."""
        return f"FieldMatches({len(self)})"


def match_fields(source: FieldSignatures, target: FieldSignatures, *, mutual: bool = True) -> FieldMatches:
    """Find for each place of the source the most similar one of the target.

    Parameters
    ----------
    source, target
        From `extract_field_signatures` or `find_keypoints`, of the same radius. Places without a value take
        no part.
    mutual
        Whether only matches stay of which each place is the other's most similar.

    Returns
    -------
    FieldMatches
        Each with a pose; the most similar first.

    Raises
    ------
    InvalidInputError
        If the radii differ.
    """
    if source.radius != target.radius:
        raise InvalidInputError(
            f"signatures of different radii cannot be matched: {source.radius:g} and {target.radius:g}"
        )
    ours, theirs = np.flatnonzero(source.ok), np.flatnonzero(target.ok)
    if not (len(ours) and len(theirs)):
        nothing = np.zeros(0, np.int64)
        return FieldMatches(nothing, nothing, np.zeros(0, np.float32), np.zeros((0, 4, 4)))
    nearest, similarity = _most_similar(source.vectors[ours], target.vectors[theirs])
    kept = np.arange(len(ours))
    if mutual:
        back, _ = _most_similar(target.vectors[theirs], source.vectors[ours])
        kept = kept[back[nearest] == kept]
    kept = kept[np.argsort(-similarity[kept], kind="stable")]
    first, second = ours[kept], theirs[nearest[kept]]
    distances = np.sqrt(np.maximum(2.0 - 2.0 * similarity[kept], 0.0)).astype(np.float32)
    return FieldMatches(first, second, distances, _poses(source.take(first), target.take(second)))


def _most_similar(
    vectors: NDArray[np.float32], among: NDArray[np.float32]
) -> tuple[NDArray[np.int64], NDArray[np.float32]]:
    """Find the most similar vector, and the scalar product with it, block by block."""
    nearest, similarity = np.zeros(len(vectors), np.int64), np.zeros(len(vectors), np.float32)
    for start in range(0, len(vectors), _BLOCK):
        block = slice(start, start + _BLOCK)
        products = vectors[block] @ among.T
        nearest[block] = products.argmax(axis=1)
        similarity[block] = products.max(axis=1)
    return nearest, similarity


def _poses(source: FieldSignatures, target: FieldSignatures) -> NDArray[np.float64]:
    """T_target_source of pairs of places."""
    turn = turns(source.phases, target.phases)
    cosine, sine = np.cos(turn)[:, None], np.sin(turn)[:, None]
    ours, theirs = _axes(source), _axes(target)
    x, y, z = theirs[:, 0], theirs[:, 1], theirs[:, 2]
    turned = np.stack([cosine * x + sine * y, cosine * y - sine * x, z], axis=1)
    poses = np.tile(np.eye(4), (len(turn), 1, 1))
    poses[:, :3, :3] = np.einsum("nka,nkb->nab", turned, ours)
    moved = np.einsum("nab,nb->na", poses[:, :3, :3], source.points)
    poses[:, :3, 3] = target.points - moved
    return poses


def _axes(fields: FieldSignatures) -> NDArray[np.float64]:
    """Tangent, the vector square to both, and axis, (n, 3, 3) row by row."""
    axis, tangent = fields.axes.astype(np.float64), fields.tangents.astype(np.float64)
    axis /= np.linalg.norm(axis, axis=1, keepdims=True)
    tangent -= np.sum(axis * tangent, axis=1, keepdims=True) * axis
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    return np.stack([tangent, np.cross(axis, tangent), axis], axis=1)


def turns(source: NDArray[np.complex64], target: NDArray[np.complex64]) -> NDArray[np.float64]:
    """Angles (n,) by which sources, (n, 7, 8), must be turned to agree best with targets, in radians."""
    orders = np.arange(1, source.shape[1] + 1)
    agreement = np.sum(source.conj() * target, axis=2)
    angles = 2.0 * np.pi / _TURNS * np.arange(_TURNS)
    score = (agreement @ np.exp(-1j * np.outer(orders, angles))).real
    best = score.argmax(axis=1)
    rows = np.arange(len(best))
    before, peak, after = (score[rows, (best + step) % _TURNS] for step in (-1, 0, 1))
    # The vertex of the parabola through the best angle and its neighbours.
    bow = before - 2.0 * peak + after
    shift = 0.5 * (before - after) / np.where(bow == 0.0, 1.0, bow)
    return np.asarray(angles[best] + shift * (2.0 * np.pi / _TURNS))
