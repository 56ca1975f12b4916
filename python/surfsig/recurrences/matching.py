"""Which pieces match which: all pairs, first by signatures, then by geometry."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import inverse
from surfsig.progress import ProgressCallback
from surfsig.recurrences.alignment import Alignment, align, measured, refined
from surfsig.recurrences.grouping import ways_from_first
from surfsig.recurrences.main_surface import may_be_equal
from surfsig.recurrences.view import View
from surfsig.surfaces import Surface
from surfsig.threads import map_in_threads

Array = NDArray[np.float64]

_ALIKE = 0.7
"""Share of a piece's signatures that the other must have too, of the piece where it is larger."""
_EQUAL = 0.99
"""zeta (eq. 12) of signatures that count as the same; stricter than the paper's "optimal", as here they need
not be similar but equal, size included."""
_DOUBTFUL = 0.5
"""Scores below which a pose through a third piece is tried, too."""
_DETOURS = 3
_WORTHWHILE = 0.25
"""Scores from which on an alignment is good for a detour."""
_AGAINST = -0.15
"""Scores below which a chained pose speaks against a match."""
_MAJORITY = 0.6
"""Share of chained poses that must not."""

Pairs = dict[tuple[int, int], Alignment]
"""Alignments of the pairs (source, target), source < target, that match at all."""


def matched_pairs(
    views: Sequence[View],
    signatures: Sequence[Array],
    mains: Sequence[Surface | None],
    seed: int,
    threads: int | None,
    progress: ProgressCallback | None,
) -> Pairs:
    """Align all pairs of pieces whose signatures are similar.

    Parameters
    ----------
    views
        The pieces.
    signatures
        Of each some signatures, (k, 243).
    mains
        Of each the surface that most of it is.
    seed
        Of the searches.
    threads
        How many work; None for one for each core.
    progress
        Called with the pairs done, and of all.
    """
    numbers = [(i, j) for j in range(len(views)) for i in range(j)]

    def matched(pair: tuple[int, int]) -> Alignment | None:
        i, j = pair
        if not may_be_equal(mains[i], mains[j]) or common_share(signatures[i], signatures[j]) < _ALIKE:
            return None
        return align(views[i], views[j], np.random.default_rng([seed, i, j]))

    # Each pair has its own generator: the result does not depend on the number of threads.
    aligned = map_in_threads(matched, numbers, threads, progress)
    pairs: Pairs = {pair: found for pair, found in zip(numbers, aligned, strict=True) if found is not None}
    _take_detours(pairs, views, mains, seed)
    return pairs


def common_share(a: Array, b: Array) -> float:
    """Give the larger one of the shares of two sets of signatures that have an equal one in the other.

    A piece that is half hidden has fewer signatures than a
    whole one; all that it has should be among those of the other.
    """
    if not len(a) or not len(b):
        return 1.0
    unit_a, unit_b = (rows / np.linalg.norm(rows, axis=1, keepdims=True) for rows in (a, b))
    equal = np.abs(unit_a @ unit_b.T) >= _EQUAL
    return float(max(equal.any(axis=1).mean(), equal.any(axis=0).mean()))


def pose_between(pairs: Pairs, source: int, target: int) -> Array:
    """Give the pose T_target_source of a pair in either order."""
    if (source, target) in pairs:
        return pairs[source, target].pose
    return inverse(pairs[target, source].pose)


def scores_of(pairs: Pairs, count: int) -> Array:
    """Give the scores as a symmetric matrix, 0 where nothing matches."""
    scores = np.zeros((count, count))
    for (i, j), found in pairs.items():
        scores[i, j] = scores[j, i] = max(found.score, 0.0)
    return scores


def agreement_of(
    pairs: Pairs, views: Sequence[View]
) -> Callable[[list[int], list[int], tuple[int, int]], bool]:
    """Give what tells whether the members of two groups agree with a match between them (see `groups_of`).

    The poses between members are chained over the match. Most of them must not speak against it: a pose
    that is seen to be wrong is, far more often than not, one between objects that differ.
    """

    def agree(first: list[int], second: list[int], match: tuple[int, int]) -> bool:
        i, j = match
        between = pose_between(pairs, i, j)
        scores = scores_of(pairs, len(views))
        onward = poses_from(j, second, pairs, scores)
        back = poses_from(i, first, pairs, scores)
        found = [
            max(
                measured(onward[b] @ between @ inverse(back[a]), views[a], views[b]).score,
                scores[a, b],
            )
            for a in first
            for b in second
        ]
        return float(np.mean(np.asarray(found) >= _AGAINST)) >= _MAJORITY

    return agree


def poses_from(start: int, members: list[int], pairs: Pairs, scores: Array) -> dict[int, Array]:
    """Chain the poses T_member_start of a group over its best matches."""
    poses = {start: np.eye(4)}
    order = [start, *(member for member in members if member != start)]
    for known, new in ways_from_first(order, scores):
        poses[new] = pose_between(pairs, known, new) @ poses[known]
    return poses


def _take_detours(pairs: Pairs, views: Sequence[View], mains: Sequence[Surface | None], seed: int) -> None:
    """Try, for doubtful pairs, the poses through third pieces that match both well."""
    scores = scores_of(pairs, len(views))
    for j in range(len(views)):
        for i in range(j):
            if scores[i, j] >= _DOUBTFUL or not may_be_equal(mains[i], mains[j]):
                continue
            both = np.minimum(scores[i], scores[j])
            via = [k for k in np.argsort(-both, kind="stable")[:_DETOURS] if both[k] >= _WORTHWHILE]
            if via:
                poses = np.stack([pose_between(pairs, k, j) @ pose_between(pairs, i, k) for k in via])
                found = refined(poses, views[i], views[j], np.random.default_rng([seed, i, j, 1]))
                if found.score > scores[i, j]:
                    pairs[i, j] = found
