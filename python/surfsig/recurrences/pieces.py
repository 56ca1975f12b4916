"""The pieces of a scan: what hangs together once the planes that carry it are taken away."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import scipy
from numpy.typing import NDArray

Array = NDArray[np.float64]

_LINK = 3.0
"""Point spacings between neighbours that hang together."""
_CARRIED = 3
"""Pieces that a support carries at least; the faces of one object seldom have more than two beside them."""
_THICKNESS = 4.0
"""Standard deviations about a support within which points are its own."""


def pieces_of(
    points: Array,
    planes: Sequence[tuple[NDArray[np.int64], Array, Array, float]],
    spacing: float,
    fewest: int,
) -> tuple[list[NDArray[np.int64]], list[int]]:
    """Cut a scan into pieces.

    Parameters
    ----------
    points
        (n, 3), finite.
    planes
        Of each plane found: its points' numbers, a place on it, its unit normal, and its noise.
    spacing
        Between points.
    fewest
        Points of a piece; smaller ones are dropped.

    Returns
    -------
    The points' numbers of each piece, ascending, by their first ones; and the numbers of the planes that are
    supports, the largest first.
    """
    links = scipy.spatial.cKDTree(points).query_pairs(_LINK * spacing, output_type="ndarray")
    support = np.zeros(len(points), np.bool_)
    supports = []
    for number in sorted(range(len(planes)), key=lambda number: -_extent(points[planes[number][0]])):
        members, place, normal, noise = planes[number]
        if _carries(points, members, support, links, fewest):
            supports.append(number)
            reach = max(_THICKNESS * noise, 0.5 * spacing)
            # Edges of the plane's own growth, and points that objects touch it with.
            support[members] = True
            support |= np.abs((points - place) @ normal) <= reach
    free = np.flatnonzero(~support)
    return _connected(len(points), free, links, fewest), supports


def _extent(points: Array) -> float:
    return float(np.linalg.norm(np.ptp(points, axis=0)))


def _carries(
    points: Array,
    members: NDArray[np.int64],
    support: NDArray[np.bool_],
    links: NDArray[np.int64],
    fewest: int,
) -> bool:
    """Tell whether several much smaller pieces are above a plane, and not far from it."""
    without = ~support
    without[members] = False
    middle, extent = points[members].mean(axis=0), _extent(points[members])
    normal = np.linalg.svd(points[members[:: 1 + len(members) // 1000]] - middle)[2][2]
    carried = 0
    for piece in _connected(len(points), np.flatnonzero(without), links, fewest):
        size = _extent(points[piece])
        offset = points[piece].mean(axis=0) - middle
        height = abs(float(offset @ normal))
        carried += size <= extent / 2.0 and height <= size and float(np.linalg.norm(offset)) <= extent / 2.0
    return carried >= _CARRIED


def _connected(
    count: int, chosen: NDArray[np.int64], links: NDArray[np.int64], fewest: int
) -> list[NDArray[np.int64]]:
    """Give the connected parts of the chosen points with at least so many points."""
    number = np.full(count, -1, np.int64)
    number[chosen] = np.arange(len(chosen))
    ends = number[links]
    ends = ends[(ends >= 0).all(axis=1)]
    graph = scipy.sparse.coo_array(
        (np.ones(len(ends), np.bool_), (ends[:, 0], ends[:, 1])), shape=(len(chosen),) * 2
    )
    _, label = scipy.sparse.csgraph.connected_components(graph, directed=False)
    sizes = np.bincount(label, minlength=1)
    order = np.argsort(label, kind="stable")
    parts = np.split(chosen[order], np.cumsum(sizes)[:-1]) if len(chosen) else []
    kept = [np.sort(part) for part in parts if len(part) >= fewest]
    return sorted(kept, key=lambda part: int(part[0]))
