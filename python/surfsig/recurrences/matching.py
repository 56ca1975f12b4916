"""Which pieces match which: all pairs, first by signatures, then by poses that the core searches."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import PieceView, RecurrenceSettings, align_pieces, judge_poses, refine_poses
from surfsig.geometry import inverse
from surfsig.progress import ProgressCallback
from surfsig.recurrences.grouping import best_match_tree
from surfsig.recurrences.main_surface import may_be_equal
from surfsig.surfaces import Surface

Array = NDArray[np.float64]

_COMMON_SHARE = 0.7
"""Share of a piece's signatures that the other must have too, of the piece where it is larger."""
_EQUAL = 0.99
"""zeta (eq. 12) of signatures that count as the same; stricter than the paper's "optimal", as here they need
not be similar but equal, size included."""
_DOUBTFUL = 0.5
"""Scores below which a pose through a third piece is tried, too."""
_THIRD_PIECES = 3
"""Third pieces that are tried for a pair, at most."""
_WORTHWHILE = 0.25
"""Scores from which on an alignment is good enough for a pose through a third piece."""
_AGAINST = -0.15
"""Scores below which a chained pose speaks against a match."""
_MAJORITY = 0.6
"""Share of chained poses that must not."""


class Alignment(NamedTuple):
    """How well one piece lies on another."""

    pose: Array
    """T_target_source, (4, 4), about the centres of both pieces."""
    score: float
    """1 where all is seen from both sides and agrees; 0 and below where nothing speaks for a match."""


Pairs = dict[tuple[int, int], Alignment]
"""Alignments of the pairs (source, target), source < target, that match at all."""


class PieceMatcher:
    """Pieces that are aligned with each other, and how.

    Parameters
    ----------
    views
        The pieces.
    signatures
        Of each some signatures, (k, 243).
    mains
        Of each the surface that most of it is.
    settings
        Of the core's search; None for its defaults.
    threads
        How many work; None for one for each core.
    """

    def __init__(
        self,
        views: Sequence[PieceView],
        signatures: Sequence[Array],
        mains: Sequence[Surface | None],
        *,
        settings: RecurrenceSettings | None,
        threads: int | None,
    ) -> None:
        self._views, self._signatures, self._mains = views, signatures, mains
        self._settings, self._threads = settings, threads

    def matched_pairs(self, progress: ProgressCallback | None) -> Pairs:
        """Align all pairs of pieces whose signatures are similar.

        Parameters
        ----------
        progress
            Called with the pairs done, and of all that are aligned.
        """
        shares = common_shares(self._signatures)
        numbers = [
            (i, j)
            for j in range(len(self._views))
            for i in range(j)
            if may_be_equal(self._mains[i], self._mains[j]) and shares[i, j] >= _COMMON_SHARE
        ]
        aligned = align_pieces(
            self._views, numbers, settings=self._settings, threads=self._threads, progress=progress
        )
        pairs = {
            pair: Alignment(*found) for pair, found in zip(numbers, aligned, strict=True) if found is not None
        }
        return pairs | self._through_third_pieces(pairs)

    def _through_third_pieces(self, pairs: Pairs) -> Pairs:
        """Give better alignments of doubtful pairs, by poses through third pieces that match both well."""
        count = len(self._views)
        scores = scores_of(pairs, count)
        chained: list[tuple[tuple[int, int], list[Array]]] = []
        for i, j in np.argwhere(np.triu(scores < _DOUBTFUL, 1)).tolist():
            if not may_be_equal(self._mains[i], self._mains[j]):
                continue
            both = np.minimum(scores[i], scores[j])
            best = np.argsort(-both, kind="stable")[:_THIRD_PIECES]
            poses = [
                pose_between(pairs, int(k), j) @ pose_between(pairs, i, int(k))
                for k in best
                if both[k] >= _WORTHWHILE
            ]
            if poses:
                chained.append(((i, j), poses))
        refined = refine_poses(self._views, chained, settings=self._settings, threads=self._threads)
        return {
            pair: Alignment(*found)
            for (pair, _), found in zip(chained, refined, strict=True)
            if found is not None and found[1] > scores[pair]
        }

    def agreement_with(self, pairs: Pairs) -> Callable[[list[int], list[int], tuple[int, int]], bool]:
        """Give what tells whether members of two groups agree with a match between them (see `groups_of`).

        The poses between members are chained over the match. Most of them must not speak against it: a pose
        that is seen to be wrong is, far more often than not, one between objects that differ.
        """
        scores = scores_of(pairs, len(self._views))

        def agree(first: list[int], second: list[int], match: tuple[int, int]) -> bool:
            i, j = match
            between = pose_between(pairs, i, j)
            onward = poses_from(j, second, pairs, scores)
            back = {member: inverse(pose) for member, pose in poses_from(i, first, pairs, scores).items()}
            chained = [((a, b), onward[b] @ between @ back[a]) for a in first for b in second]
            judged = judge_poses(self._views, chained, settings=self._settings, threads=self._threads)
            found = [max(score, scores[pair]) for (pair, _), score in zip(chained, judged, strict=True)]
            return float(np.mean(np.asarray(found) >= _AGAINST)) >= _MAJORITY

        return agree


def common_shares(signatures: Sequence[Array]) -> Array:
    """Compare sets of signatures: of each two, how much of the one is in the other.

    A piece that is half hidden has fewer signatures than a whole one; all that it has should be among those
    of the other.

    Parameters
    ----------
    signatures
        (k, 243) of each piece.

    Returns
    -------
    (n, n), symmetric: the larger one of the shares of two sets that have an equal one in the other, 1 where
    either is empty.
    """
    count = len(signatures)
    shares = np.ones((count, count))
    if not count:
        return shares
    # Signatures come in single precision.
    unit = [(rows / np.linalg.norm(rows, axis=1, keepdims=True)).astype(np.float32) for rows in signatures]
    ends = np.cumsum([len(rows) for rows in unit])
    stacked = np.concatenate(unit)
    for j in range(count):
        equal = np.abs(stacked[: ends[j]] @ unit[j].T) >= _EQUAL
        for i in range(j):
            part = equal[ends[i] - len(unit[i]) : ends[i]]
            if part.size:
                of_both = max(part.any(axis=1).mean(), part.any(axis=0).mean())
                shares[i, j] = shares[j, i] = of_both
    return shares


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


def poses_from(start: int, members: list[int], pairs: Pairs, scores: Array) -> dict[int, Array]:
    """Chain the poses T_member_start of a group over its best matches."""
    poses = {start: np.eye(4)}
    order = [start, *(member for member in members if member != start)]
    for known, new in best_match_tree(order, scores):
        poses[new] = pose_between(pairs, known, new) @ poses[known]
    return poses
