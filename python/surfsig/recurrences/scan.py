"""A scan with its pieces, prepared for comparison."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import PieceView, RecurrenceSettings
from surfsig.curvature import extract
from surfsig.errors import InvalidInputError
from surfsig.extraction import Extraction
from surfsig.flat_atom import flat_atom_length
from surfsig.recurrences.pieces import pieces_of
from surfsig.recurrences.result import Piece
from surfsig.recurrences.sensor_position import SensorPosition
from surfsig.recurrences.shadows import Region, places_without_points
from surfsig.spacing import point_spacing
from surfsig.surfaces import Surfaces

Array = NDArray[np.float64]

_NORMAL_BALL, _SIGNATURE_BALL = 3.0, 8.0
"""Point spacings: radii of the balls that normals and signatures come from. In a larger one noise counts
less, and more of a piece is near its rim."""
_SIGNATURES = 100
"""Per piece, at most."""
_ABOVE = 0.99
"""Share of a piece's points on one side of what carries it."""
_NEAR = 2.0
"""Extents of a piece from its middle within which what carries it has points."""
_LOOKED_AT, _AROUND = 8, 2.5
"""Pieces whose shadows are looked at, and how far around them, in their extents."""
_NOISES, _SPACINGS = 3.0, 0.4
"""Tolerance of distances from a surface: standard deviations of the noise, or point spacings where more."""


class ScanPieces:
    """A scan with its pieces; coordinates are those of its offsets."""

    def __init__(self, number: int, found: Surfaces, fewest: int, threads: int | None) -> None:
        self.number, self.found, self.cloud = number, found, found.cloud
        self._threads = threads
        self.numbers = np.flatnonzero(self.cloud.finite)
        self.points = self.cloud.offsets[self.numbers].astype(np.float64)
        self.spacing = 0.0
        self.pieces: list[NDArray[np.int64]] = []
        self.rows: list[NDArray[np.int64]] = []
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
            self.rows = parts
            self.pieces = [self.numbers[part] for part in parts]

    def extents(self) -> list[float]:
        """Give the largest distance of each piece's points from their mean."""
        return [self._ball(rows)[1] for rows in self.rows]

    def described(self, piece: NDArray[np.int64]) -> Piece:
        """Say which surfaces a piece has, and where it is."""
        on_surface = self.found.labels[piece]
        surfaces = np.unique(on_surface[on_surface >= 0]).tolist()
        center = self.cloud.offsets[piece].mean(axis=0, dtype=np.float64) + self.cloud.origin
        return Piece(self.number, piece, surfaces, center)

    def views(self, pair_unit: float, settings: RecurrenceSettings | None) -> list[PieceView]:
        """Prepare the pieces for alignment; `pair_unit` is that of the distances of pairs of points."""
        if not self.pieces:
            return []
        sensor = SensorPosition(self.cloud, self._regions(), self.spacing)
        guessed = None if sensor.viewpoint is None else sensor.viewpoint + self.cloud.origin
        around = extract(
            self.cloud, radius=_NORMAL_BALL * self.spacing, viewpoint=guessed, threads=self._threads
        )
        normals = around.normals[self.numbers].astype(np.float64)
        known = np.asarray(np.isfinite(normals).all(axis=1))
        normals[~known] = (0.0, 0.0, 1.0)
        tolerance = max(_NOISES * self._noise(around), _SPACINGS * self.spacing)
        views = []
        for piece, all_rows in zip(self.pieces, self.rows, strict=True):
            rows = all_rows[known[all_rows]] if known[all_rows].any() else all_rows
            viewpoint = sensor.viewpoint_of(piece)
            views.append(
                PieceView(
                    self.points,
                    normals,
                    rows,
                    viewpoint=viewpoint.tolist(),
                    second_viewpoint=None
                    if sensor.to_second is None
                    else (viewpoint + sensor.to_second).tolist(),
                    support_planes=[
                        (place.tolist(), normal.tolist()) for _, place, normal in self._beneath(rows)
                    ],
                    spacing=self.spacing,
                    tolerance=tolerance,
                    pair_unit=pair_unit,
                    settings=settings,
                )
            )
        return views

    def signatures(self) -> list[tuple[Array, Array, Array]]:
        """Give of each piece some signatures, (k, 243), and their places and normals, (k, 3)."""
        if not self.pieces:
            return []
        at = np.concatenate(self.pieces)
        around = extract(self.cloud, radius=_SIGNATURE_BALL * self.spacing, at=at, threads=self._threads)
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

    def _beneath(self, rows: NDArray[np.int64]) -> list[tuple[NDArray[np.int64], Array, Array]]:
        """Give the supports near a piece that it is on one side of, each with its normal to that side."""
        middle, extent = self._ball(rows)
        found = []
        for members, place, normal in self.supports:
            distance = (self.points[rows] - place) @ normal
            side = 1.0 if np.median(distance) > 0.0 else -1.0
            near = np.linalg.norm(self.points[members] - middle, axis=1).min() <= _NEAR * extent
            if near and (side * distance > -0.5 * self.spacing).mean() >= _ABOVE:
                found.append((members, place, side * normal))
        return found

    def _regions(self) -> list[Region]:
        """Give what is around some pieces, and where nothing was measured of what carries them."""
        found = []
        for number in range(0, len(self.rows), 1 + (len(self.rows) - 1) // _LOOKED_AT):
            for members, _, normal in self._beneath(self.rows[number])[:1]:
                middle, extent = self._ball(self.rows[number])
                near = np.linalg.norm(self.points - middle, axis=1) <= _AROUND * extent
                points, own = self.points[near], self.points[members[near[members]]]
                empty = places_without_points(own, self.spacing)
                found.append(Region(self.pieces[number], points, empty, normal))
        return found

    def _ball(self, rows: NDArray[np.int64]) -> tuple[Array, float]:
        middle = self.points[rows].mean(axis=0)
        return middle, float(np.linalg.norm(self.points[rows] - middle, axis=1).max())

    def _noise(self, around: Extraction) -> float:
        known = [surface.deviation for surface in self.found.surfaces]
        return float(np.median(known)) if known else float(np.nanmedian(around.noise))
