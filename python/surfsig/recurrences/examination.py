"""How sure the poses of a group's pieces on its first one are."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import PieceView, RecurrenceSettings, examine_poses
from surfsig.alignment.alternative import Alternative
from surfsig.alignment.free_directions import FreeDirection, free_direction
from surfsig.geometry import rotate
from surfsig.recurrences.grouping import best_match_tree
from surfsig.recurrences.matching import Pairs, pose_between
from surfsig.recurrences.occurrence import MEASURES, Occurrence

Array = NDArray[np.float64]


def examined_members(
    groups: Sequence[list[int]],
    pairs: Pairs,
    scores: Array,
    views: Sequence[PieceView],
    origins: Sequence[Array],
    *,
    settings: RecurrenceSettings | None,
    threads: int | None,
) -> list[list[Occurrence]]:
    """Chain the poses of each group from its first member over the best matches, and try to refute them.

    Parameters
    ----------
    groups
        Numbers of pieces, each group's first one first.
    pairs
        Their alignments.
    scores
        (pieces, pieces), how well each two agree.
    views
        The pieces.
    origins
        Of each the origin of its scan, (3,).
    settings, threads
        As in `find_recurrences`.
    """
    links = [edge for members in groups for edge in best_match_tree(members, scores)]
    poses = [(link, pose_between(pairs, *link)) for link in links]
    examined = examine_poses(views, poses, settings=settings, threads=threads)
    centers = [np.asarray(view.center) + origin for view, origin in zip(views, origins, strict=True)]
    first_of = {member: members[0] for members in groups for member in members}
    found = {}
    for (before, piece), told in zip(links, examined, strict=True):
        first, score = centers[first_of[piece]], float(scores[before, piece])
        found[piece] = _occurrence(piece, score, told, first, centers[piece])
    return [[_first(members[0]), *(found[member] for member in members[1:])] for members in groups]


def _first(piece: int) -> Occurrence:
    """Give what is known of a group's first piece, which defines the poses of the others."""
    return Occurrence(
        piece=piece,
        T_member_first=np.eye(4),
        score=1.0,
        free_directions=[],
        alternatives=[],
        scale=1.0,
        scale_standard_error=0.0,
        overlap=1.0,
        explained=1.0,
        free_space=0.0,
        trusted=True,
        doubts=[],
        reasons=[],
    )


def _occurrence(piece: int, score: float, told: dict[str, Any], first: Array, center: Array) -> Occurrence:
    """Make an occurrence of what the core says about the centres of both pieces."""
    return Occurrence(
        piece=piece,
        T_member_first=_in_scans(told["T_target_source"], first, center),
        score=score,
        free_directions=[_moved(free_direction(*direction), center) for direction in told["free_directions"]],
        alternatives=[
            Alternative(_in_scans(np.array(pose), first, center), explained, free_space)
            for pose, explained, free_space in told["alternatives"]
        ],
        **{name: told[name] for name in MEASURES},
        trusted=not told["doubts"],
        doubts=told["doubts"],
        reasons=told["reasons"],
    )


def _in_scans(pose: Array, first: Array, center: Array) -> Array:
    """Give a pose between pieces about their centres in true coordinates."""
    moved = pose.copy()
    moved[:3, 3] += center - rotate(pose, first)
    return moved


def _moved(direction: FreeDirection, by: Array) -> FreeDirection:
    return replace(direction, point=direction.point + by)
