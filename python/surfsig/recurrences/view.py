"""A piece as alignments take it: thinned points with normals, their pairs, and what the sensor saw."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import voxel_representatives
from surfsig.recurrences.point_pairs import PointPairs
from surfsig.recurrences.sight import Sight

Array = NDArray[np.float64]

_PAIR_POINTS = 5.0
"""Of the piece's extent, the inverse spacing of the points that are paired."""
_THINNING = 1.5
"""Point spacings between the thinned points."""


@dataclass(frozen=True, eq=False)
class View:
    """A piece of a scan, seen from one side."""

    points: Array
    """(n, 3), evenly thinned, in the order of a fixed shuffle."""
    normals: Array
    """(n, 3), unit, towards the sensor."""
    pairs: PointPairs
    sight: Sight
    middle: Array
    extent: float
    """Largest distance from the middle."""
    tolerance: float
    """Height within which a point is on a surface."""

    def sample(self, most: int) -> View:
        """Give the same with at most so many points, spread over all of the piece."""
        return replace(self, points=self.points[:most], normals=self.normals[:most])


def view_of(
    piece: NDArray[np.int64],
    points: Array,
    normals: Array,
    sight: Sight,
    spacing: float,
    length: float,
    tolerance: float,
) -> View:
    """Prepare the piece with these point numbers; `length` is the unit of its pairs' distances."""
    middle = points[piece].mean(axis=0)
    extent = float(np.linalg.norm(points[piece] - middle, axis=1).max())
    few, many = (_thinned(piece, points, voxel) for voxel in (extent / _PAIR_POINTS, _THINNING * spacing))
    many = np.random.default_rng(len(piece)).permutation(many)
    pairs = PointPairs.of(points[few], normals[few], length)
    return View(points[many], normals[many], pairs, sight, middle, extent, tolerance)


def _thinned(piece: NDArray[np.int64], points: Array, voxel: float) -> NDArray[np.int64]:
    chosen = voxel_representatives(np.ascontiguousarray(points[piece]), origin=(0.0, 0.0, 0.0), voxel=voxel)
    return piece[chosen]
