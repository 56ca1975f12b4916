"""From the surfaces of scans to what recurs: `find_recurrences`."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import PieceView, RecurrenceSettings
from surfsig.alignment.free_directions import free_directions
from surfsig.arguments import progress_callback, thread_count, whole_number
from surfsig.defaults import (
    RECURRENCE_CONFIDENCE,
    RECURRENCE_POINTS,
    RECURRENCE_SCORE,
)
from surfsig.errors import InvalidInputError
from surfsig.progress import ProgressCallback
from surfsig.recurrences.equal_surfaces import equal_surfaces
from surfsig.recurrences.examination import examined_members
from surfsig.recurrences.grouping import groups_of
from surfsig.recurrences.main_surface import main_surface
from surfsig.recurrences.matching import PieceMatcher, scores_of
from surfsig.recurrences.result import Piece, Recurrence, Recurrences
from surfsig.recurrences.scan import ScanPieces
from surfsig.surfaces import Surfaces

Array = NDArray[np.float64]

_PAIR_UNIT = 0.1
"""Of the pieces' median extent: the distance that counts as much as a radian."""


def find_recurrences(
    found: Surfaces | Sequence[Surfaces],
    *,
    min_points: int = RECURRENCE_POINTS,
    settings: RecurrenceSettings | None = None,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Recurrences:
    """Find what occurs more than once in a scan, or in several, without a model.

    Surfaces are grouped by kind and size. Pieces are what hangs together once the planes that carry several
    pieces are taken away. Two pieces match where they have signatures in common, and where there is a pose in
    which each is what the other's sensor saw: on its surface, or hidden, but not where the sensor saw
    through, nor where it would have seen something, nor beneath what it stands on. So a half hidden piece
    matches a whole one. Shadows on the planes tell whether points had to be seen from a second viewpoint,
    as by the camera of a triangulation scanner. The result is always the same.

    Each piece's pose on the first one of its group is then tried to be refuted, by the tests of `register`:
    motions that are free, other poses that explain as much, points in free space, another size or hand. What
    has survived is `trusted`; of a ball or a box no pose is, and `reasons` says so.

    Parameters
    ----------
    found
        What `find_surfaces` found in a scan, or in several. Their clouds should have a viewpoint (or one
        per value of the field ``scan``); without, shadows tell the direction it was in, with a warning.
    min_points
        Fewest points of a piece.
    settings
        For experts; `RecurrenceSettings` describes what may be changed.
    threads
        Number of threads; by default the largest number that the scans' surfaces were found with, which is
        all cores where none was asked for. The result is the same.
    progress
        Called with the number of pairs of pieces that have been aligned, and of all that are to be, some
        twenty times a second.

    Returns
    -------
    Recurrences
        Groups of pieces with poses, and groups of equal surfaces.

    Raises
    ------
    InvalidInputError
        If `found` is neither, `min_points` is no whole number, or a cloud with several pieces does not know
        its viewpoint, and has no shadows that tell.
    """
    scans = [found] if isinstance(found, Surfaces) else list(found)
    if not all(isinstance(scan, Surfaces) for scan in scans):
        raise InvalidInputError("found must be what surfsig.find_surfaces returns, or a list of such")
    fewest = whole_number(min_points, "min_points", 1 << 40)
    tell = progress_callback(progress)
    workers = thread_count(threads) or max((scan.threads or 0 for scan in scans), default=0) or None
    pieces: list[Piece] = []
    views: list[PieceView] = []
    signatures: list[Array] = []
    smooth: list[tuple[Array, Array]] = []
    labels = [np.full(len(scan.cloud), -1, np.int32) for scan in scans]
    prepared = [ScanPieces(number, scan, fewest, workers) for number, scan in enumerate(scans)]
    extents = [extent for scan in prepared for extent in scan.extents()]
    pair_unit = _PAIR_UNIT * float(np.median(extents)) if extents else 1.0
    several = len(extents) > 1
    for scan in prepared:
        for points in scan.pieces:
            labels[scan.number][points] = len(pieces)
            pieces.append(scan.described(points))
        if several:
            views += scan.views(pair_unit, settings)
            described = scan.signatures()
            signatures += [rows for rows, _, _ in described]
            smooth += [(points + scan.cloud.origin, normals) for _, points, normals in described]
    mains = [main_surface(piece, scans[piece.scan]) for piece in pieces]
    matcher = PieceMatcher(views, signatures, mains, settings=settings, threads=workers)
    pairs = matcher.matched_pairs(tell)
    scores = scores_of(pairs, len(pieces))
    members = [
        members
        for members in groups_of(scores, RECURRENCE_SCORE, matcher.agreement_with(pairs))
        if len(members) > 1
    ]
    origins = [scans[piece.scan].cloud.origin for piece in pieces[: len(views)]]
    examined = examined_members(members, pairs, scores, views, origins, settings=settings, threads=workers)
    groups = [
        Recurrence(occurrences, free_directions(*smooth[occurrences[0].piece])) for occurrences in examined
    ]
    return Recurrences(groups, pieces, equal_surfaces(scans, RECURRENCE_CONFIDENCE), labels, scores)
