"""From the surfaces of scans to what recurs: `recurrences`."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig.arguments import whole_number
from surfsig.curvature import extract
from surfsig.defaults import (
    RECURRENCE_CONFIDENCE,
    RECURRENCE_POINTS,
    RECURRENCE_SCORE,
    RECURRENCE_SEED,
)
from surfsig.errors import InvalidInputError
from surfsig.extraction import Extraction
from surfsig.flat_atom import flat_atom_length
from surfsig.point_cloud import PointCloud
from surfsig.recurrences.equal_surfaces import equal_surfaces
from surfsig.recurrences.free_directions import free_directions
from surfsig.recurrences.grouping import groups_of, ways_from_first
from surfsig.recurrences.matching import Pairs, matched_pairs, pose_between, scores_of
from surfsig.recurrences.pieces import pieces_of, point_spacing
from surfsig.recurrences.result import Piece, Recurrence, Recurrences
from surfsig.recurrences.view import View, view_of
from surfsig.surfaces import Surfaces

Array = NDArray[np.float64]

_NORMAL_BALL, _SIGNATURE_BALL = 3.0, 8.0
"""Point spacings: radii of the balls that normals and signatures come from. In a larger one noise counts
less, and more of a piece is near its rim."""
_SIGNATURES = 100
"""Per piece, at most."""
_PAIR_UNIT = 0.1
"""Of the pieces' median extent: the distance that counts as much as a radian."""
_ABOVE = 0.99
"""Share of a piece's points on one side of what carries it."""
_NEAR = 2.0
"""Extents of a piece from its middle within which what carries it has points."""
_NOISES, _SPACINGS = 3.0, 0.4
"""The tolerance of heights: standard deviations of the noise, or point spacings where that is more."""


def recurrences(
    found: Surfaces | Sequence[Surfaces],
    *,
    min_points: int = RECURRENCE_POINTS,
    progress: Callable[[int, int], object] | None = None,
) -> Recurrences:
    """Find what occurs more than once in a scan, or in several, without a model.

    Surfaces are grouped by kind and size. Pieces are what hangs together once the planes that carry several
    pieces are taken away. Two pieces match where they have signatures in common, and where there is a pose in
    which each is what the other's sensor saw: on its surface, or hidden, but not where the sensor saw
    through, nor where it would have seen something. So a half hidden piece matches a whole one. The result is
    always the same.

    Parameters
    ----------
    found
        What `surfsig.surfaces` found in a scan, or in several. Their clouds need a viewpoint (or one per
        value of the field ``scan``).
    min_points
        Fewest points of a piece.
    progress
        Called with the pairs of pieces that have been compared, and of all.

    Returns
    -------
    Recurrences
        Groups of pieces with poses, and groups of equal surfaces.

    Raises
    ------
    InvalidInputError
        If `found` is neither, `min_points` is no whole number, or a cloud with several pieces does not know
        its viewpoint.
    """
    scans = [found] if isinstance(found, Surfaces) else list(found)
    if not all(isinstance(scan, Surfaces) for scan in scans):
        raise InvalidInputError("found must be what surfsig.surfaces returns, or a list of such")
    fewest = whole_number(min_points, "min_points", 1 << 40)
    pieces: list[Piece] = []
    views: list[View] = []
    signatures: list[Array] = []
    smooth: list[tuple[Array, Array]] = []
    labels = [np.full(len(scan.cloud), -1, np.int32) for scan in scans]
    prepared = [_Scan(number, scan, fewest) for number, scan in enumerate(scans)]
    extents = [extent for scan in prepared for extent in scan.extents()]
    length = _PAIR_UNIT * float(np.median(extents)) if extents else 1.0
    several = len(extents) > 1
    for scan in prepared:
        for points in scan.pieces:
            labels[scan.number][points] = len(pieces)
            pieces.append(scan.described(points))
        if several:
            views += scan.views(length)
            described = scan.signatures()
            signatures += [rows for rows, _, _ in described]
            smooth += [(points + scan.cloud.origin, normals) for _, points, normals in described]
    pairs = matched_pairs(views, signatures, RECURRENCE_SEED, progress)
    scores = scores_of(pairs, len(pieces))
    middles = [
        view.middle + scans[piece.scan].cloud.origin for view, piece in zip(views, pieces, strict=False)
    ]
    groups = [
        _recurrence(members, smooth[members[0]], pairs, scores, middles)
        for members in groups_of(scores, RECURRENCE_SCORE)
        if len(members) > 1
    ]
    return Recurrences(groups, pieces, equal_surfaces(scans, RECURRENCE_CONFIDENCE), labels, scores)


class _Scan:
    """A scan with its pieces; coordinates are those of its offsets."""

    def __init__(self, number: int, found: Surfaces, fewest: int) -> None:
        self.number, self.found, self.cloud = number, found, found.cloud
        self.numbers = np.flatnonzero(self.cloud.finite)
        self.points = self.cloud.offsets[self.numbers].astype(np.float64)
        self.spacing = 0.0
        self.pieces: list[NDArray[np.int64]] = []
        self.supports: list[tuple[NDArray[np.int64], Array, Array]] = []
        if len(self.numbers) > max(fewest, 2):
            self.spacing = point_spacing(self.points)
            own = found.labels[self.numbers]
            planes = [
                (np.flatnonzero(own == i), surface.point - self.cloud.origin, surface.axis, surface.deviation)
                for i, surface in enumerate(found.surfaces)
                if surface.kind == "plane"
            ]
            parts, supports = pieces_of(self.points, planes, self.spacing, fewest)
            self.supports = [planes[number][:3] for number in supports]
            self.pieces = [self.numbers[part] for part in parts]

    def extents(self) -> list[float]:
        """Give the largest distance of each piece's points from their mean."""
        offsets = (self.cloud.offsets[piece].astype(np.float64) for piece in self.pieces)
        return [float(np.linalg.norm(part - part.mean(axis=0), axis=1).max()) for part in offsets]

    def described(self, piece: NDArray[np.int64]) -> Piece:
        """Say which surfaces a piece has, and where it is."""
        on_surface = self.found.labels[piece]
        surfaces = np.unique(on_surface[on_surface >= 0]).tolist()
        center = self.cloud.offsets[piece].mean(axis=0, dtype=np.float64) + self.cloud.origin
        return Piece(self.number, piece, surfaces, center)

    def views(self, length: float) -> list[View]:
        """Prepare the pieces for alignment."""
        if not self.pieces:
            return []
        around = extract(self.cloud, radius=_NORMAL_BALL * self.spacing)
        normals = around.normals[self.numbers].astype(np.float64)
        known = np.asarray(np.isfinite(normals).all(axis=1))
        normals[~known] = (0.0, 0.0, 1.0)
        tolerance = max(_NOISES * self._noise(around), _SPACINGS * self.spacing)
        row_of = np.full(len(self.cloud), -1, np.int64)
        row_of[self.numbers] = np.arange(len(self.numbers))
        views = []
        for piece in self.pieces:
            rows = row_of[piece]
            good = rows[known[rows]]
            rows = good if len(good) else rows
            views.append(
                view_of(
                    rows,
                    self.points,
                    normals,
                    eye=self._eye(piece),
                    second=self._second(piece),
                    supports=self._beneath(rows, tolerance),
                    spacing=self.spacing,
                    length=length,
                    tolerance=tolerance,
                )
            )
        return views

    def signatures(self) -> list[tuple[Array, Array, Array]]:
        """Give of each piece some signatures, (k, 243), and their places and normals, (k, 3)."""
        if not self.pieces:
            return []
        at = np.concatenate(self.pieces)
        around = extract(self.cloud, radius=_SIGNATURE_BALL * self.spacing, at=at)
        result, start = [], 0
        try:
            flat = flat_atom_length(around)
        except InvalidInputError:
            # No place has a curvature: nothing is known of any piece, and geometry decides.
            return [(np.empty((0, 243)), np.empty((0, 3)), np.empty((0, 3))) for _ in self.pieces]
        for piece in self.pieces:
            rows = np.arange(start, start + len(piece))
            start += len(piece)
            good = np.random.default_rng(len(piece)).permutation(rows[np.asarray(around.ok)[rows]])[
                :_SIGNATURES
            ]
            w = around.signatures(good, flat_atom=flat).astype(np.float64)
            finite = np.isfinite(w).all(axis=1)
            places, normals = (
                rows[good[finite]].astype(np.float64) for rows in (self.cloud.offsets[at], around.normals)
            )
            result.append((w[finite], places, normals))
        return result

    def _beneath(self, rows: NDArray[np.int64], tolerance: float) -> list[tuple[Array, Array]]:
        """Give the supports that a piece is on one side of, as place and normal to that side.
        """
        middle = self.points[rows].mean(axis=0)
        extent = np.linalg.norm(self.points[rows] - middle, axis=1).max()
        found = []
        for members, place, normal in self.supports:
            height = (self.points[rows] - place) @ normal
            side = 1.0 if np.median(height) > 0.0 else -1.0
            near = np.linalg.norm(self.points[members] - middle, axis=1).min() <= _NEAR * extent
            if near and (side * height > -tolerance).mean() >= _ABOVE:
                found.append((place, side * normal))
        return found

    def _second(self, piece):
        import os
        if os.environ.get("SECOND"):
            return self._eye(piece) + np.array([0, -.4, .186])
        return None

    def _noise(self, around: Extraction) -> float:
        known = [surface.deviation for surface in self.found.surfaces]
        return float(np.median(known)) if known else float(np.nanmedian(around.noise))

    def _eye(self, piece: NDArray[np.int64]) -> Array:
        """Give where the piece was seen from: in a sweep, from the mean of its points' viewpoints."""
        cloud: PointCloud = self.cloud
        if cloud.viewpoints is not None:
            return np.asarray(cloud.viewpoints[cloud.fields["scan"][piece]].mean(axis=0) - cloud.origin)
        if cloud.viewpoint is None:
            raise InvalidInputError(
                "recurrences need to know where the sensor stood: set the cloud's viewpoint"
            )
        return np.asarray(cloud.viewpoint - cloud.origin)


def _recurrence(
    members: list[int],
    smooth: tuple[Array, Array],
    pairs: Pairs,
    scores: Array,
    middles: Sequence[Array],
) -> Recurrence:
    """Chain the poses of a group from its first member over the best matches.

    `smooth` are places and normals of the first member, from balls in which noise counts little; `middles` are
    where the coordinates of each piece start.
    """
    pose = {members[0]: np.eye(4)}
    score = {members[0]: 1.0}
    for start, end in ways_from_first(members, scores):
        pose[end] = pose_between(pairs, start, end) @ pose[start]
        score[end] = float(scores[start, end])
    for member in members:
        pose[member][:3, 3] += middles[member] - pose[member][:3, :3] @ middles[members[0]]
    free = free_directions(*smooth)
    return Recurrence(
        members,
        np.stack([pose[member] for member in members]),
        np.array([score[member] for member in members]),
        free,
    )
