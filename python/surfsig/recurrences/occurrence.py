"""One of the pieces that recur: its pose on the first one, and how sure that is."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.alignment.alternative import Alternative
from surfsig.alignment.free_directions import FreeDirection
from surfsig.digits import finite_or_none

Array = NDArray[np.float64]

MEASURES = ("scale", "scale_standard_error", "overlap", "explained", "free_space")
"""The attributes of an `Occurrence` that are numbers, and what the core calls them."""


@dataclass(frozen=True, eq=False, repr=False)
class Occurrence:
    """A piece that shows the same object as the first one of its group, and its pose.

    In the words of `register`, the first piece is the source and this one the target. A pose that was found
    by other pieces in between has survived what the pose of each on the one before has; what was measured is
    the worst of these.
    """

    piece: int
    """Its number."""
    T_member_first: Array
    """(4, 4): a point p of the first piece is at R p + t of this one; the identity for the first piece."""
    score: float
    """How well it agrees with the piece that its pose was found by, 0 to 1; 1 for the first piece."""
    free_directions: list[FreeDirection]
    """Motions, in this piece's scan, that what is seen of both pieces does not determine; rims do not
    count."""
    alternatives: list[Alternative]
    """Other poses T_member_first that explain as much of what both sensors saw, as of a box that looks the
    same after half a turn; those that differ by a free motion only are not among them."""
    scale: float
    """How many times as large as this piece the first one is, by a similarity transform fitted to the
    surface; NaN where what both have in common does not determine it. The pose itself is rigid."""
    scale_standard_error: float
    """Of `scale`."""
    overlap: float
    """Mean share of both pieces' points that lie on the other piece, 0 to 1."""
    explained: float
    """The same of those points by which the alternatives are judged."""
    free_space: float
    """The larger share of one piece's points, of those in sight of the other's sensor, where that looked
    through or would have seen something."""
    trusted: bool
    """Whether the pose is right, by what was seen: it was tried to be refuted, and was not. False where a
    direction is free or another pose is as good. That of the first piece is right by definition."""
    doubts: list[str]
    """Names of the tests that it has not survived: little_overlap, free_directions, free_space, ambiguous,
    mirrored, scale; empty where it is trusted."""
    reasons: list[str]
    """The same in words."""

    def __repr__(self) -> str:
        why = "; ".join(self.reasons)
        word = f"not trusted: {why}" if why else "trusted"
        return f"Occurrence(piece {self.piece}, score {self.score:.2f}, {word})"

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON.

        Returns
        -------
        piece, score, pose (T_member_first row by row), and the rest by the names of the attributes; None for
        what is not known.
        """
        return {
            "piece": self.piece,
            "score": self.score,
            "pose": self.T_member_first.tolist(),
            "free_directions": [direction.values() for direction in self.free_directions],
            "alternatives": [other.values() for other in self.alternatives],
            **{name: finite_or_none(getattr(self, name)) for name in MEASURES},
            "trusted": self.trusted,
            "doubts": self.doubts,
            "reasons": self.reasons,
        }
