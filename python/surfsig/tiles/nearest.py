"""How far neighbours are in all of a cloud, by which a search for neighbours begins; as the core finds it."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig

if TYPE_CHECKING:
    from surfsig.tiles.task import TileSource

_DOUBLINGS = 60


def distances_in(source: TileSource, k: int) -> tuple[float, ...]:
    """Give the distance to the k-th nearest point from each of some places of a source, ascending."""
    facts = source.facts

    def points_in(box: NDArray[np.float64]) -> NDArray[np.float64]:
        return np.asarray(source.read_box(box).points, np.float64)

    volume = np.prod(np.sort(np.ptp(facts.bounds, axis=0))[1:]) if facts.finite else 0.0
    first = math.sqrt(max(float(volume), 0.0) * k / max(facts.finite, 1)) or 1.0
    return tuple(distances_to_nearest(facts.places, k, first, points_in, facts.bounds))


def distances_to_nearest(
    places: NDArray[np.float64],
    k: int,
    first: float,
    points_in: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    bounds: NDArray[np.float64],
) -> list[float]:
    """Give the distance from each of some places to its k-th nearest point, ascending.

    Parameters
    ----------
    places
        (m, 3).
    k
        Which of the nearest points, the place itself included.
    first
        Half the side of the box that is looked at first.
    points_in
        Reads the finite points (n, 3) in a box (2, 3).
    bounds
        (2, 3), the box of all points.
    """
    return sorted(_distance(place, k, first, points_in, bounds) for place in places)


def _distance(
    place: NDArray[np.float64],
    k: int,
    first: float,
    points_in: Callable[[NDArray[np.float64]], NDArray[np.float64]],
    bounds: NDArray[np.float64],
) -> float:
    side = first
    for _ in range(_DOUBLINGS):
        box = np.array([place - side, place + side])
        points = np.ascontiguousarray(points_in(box), np.float64)
        distance = _surfsig.distance_to_nearest(points, place.tolist(), k)
        is_all = bool((box[0] <= bounds[0]).all() and (box[1] >= bounds[1]).all())
        # Beyond the box may be a nearer one, unless it lies within.
        if is_all or (len(points) >= k and 0 < distance <= side):
            return distance
        side *= 2
    return 0.0
