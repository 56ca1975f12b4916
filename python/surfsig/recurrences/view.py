"""A piece as alignments take it: thinned points with normals, their pairs, and what the sensor saw."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig._surfsig import DepthImage, SurfacePlaces, voxel_representatives
from surfsig.recurrences.point_pairs import PointPairs

Array = NDArray[np.float64]

_PAIR_POINTS = 5.0
"""Of the piece's extent, the inverse spacing of the points that are paired."""
_THINNING = 1.5
"""Point spacings between the thinned points."""
_MARGIN = 0.6
"""Of the piece's extent, seen around it."""


@dataclass(frozen=True, eq=False)
class View:
    """A piece of a scan, seen from one side; coordinates are from its middle."""

    points: Array
    """(n, 3), evenly thinned, in the order of a fixed shuffle: the first ones are spread over all of it."""
    normals: Array
    """(n, 3), unit, towards the sensor."""
    surface: SurfacePlaces
    """Both."""
    pairs: PointPairs
    image: DepthImage
    """What the sensor saw of the piece and around it."""
    middle: Array
    """In the scan."""
    extent: float
    """Largest distance from the middle."""
    tolerance: float
    """Distance within which a point is on a surface."""


def view_of(
    piece: NDArray[np.int64],
    points: Array,
    normals: Array,
    *,
    viewpoint: Array,
    second: Array | None,
    supports: Sequence[tuple[Array, Array]],
    spacing: float,
    length: float,
    tolerance: float,
) -> View:
    """Prepare a piece of a scan.

    Parameters
    ----------
    piece
        The numbers of its points.
    points, normals
        (n, 3), of the scan.
    viewpoint, second
        Where the sensor stood, and from where else points had to be seen to be measured.
    supports
        Planes that carry pieces: a place and the unit normal of each.
    spacing
        Between points.
    length
        The unit of the distances of pairs.
    tolerance
        Distance within which a point is on a surface.
    """
    middle = points[piece].mean(axis=0)
    extent = float(np.linalg.norm(points[piece] - middle, axis=1).max())
    few, many = (_thinned(piece, points, voxel) for voxel in (extent / _PAIR_POINTS, _THINNING * spacing))
    many = np.random.default_rng(len(piece)).permutation(many)
    reach = extent * (1.0 + _MARGIN)
    around = np.flatnonzero(((points - middle) ** 2).sum(axis=1) <= (2.0 * reach) ** 2)

    def surface(rows: NDArray[np.int64]) -> SurfacePlaces:
        return SurfacePlaces((points[rows] - middle).astype(np.float32), normals[rows].astype(np.float32))

    floors = np.array([(place - middle, normal) for place, normal in supports], np.float32).reshape(-1, 2, 3)
    image = DepthImage(
        surface(around),
        np.isin(around, piece),
        viewpoint=(viewpoint - middle).tolist(),
        spacing=spacing,
        reach=reach,
        floors=SurfacePlaces(*(np.ascontiguousarray(part) for part in floors.swapaxes(0, 1))),
        second=None if second is None else (second - middle).tolist(),
    )
    pairs = PointPairs.of(points[few] - middle, normals[few], length)
    return View(points[many] - middle, normals[many], surface(many), pairs, image, middle, extent, tolerance)


def _thinned(piece: NDArray[np.int64], points: Array, voxel: float) -> NDArray[np.int64]:
    chosen = voxel_representatives(np.ascontiguousarray(points[piece]), origin=(0.0, 0.0, 0.0), voxel=voxel)
    return piece[chosen]
