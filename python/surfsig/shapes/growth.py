"""A shape in a scan, grown from a place on it: all points that are near its surface and hang together."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from surfsig.shapes.orthogonal import MAX_PASSES, near, refined, settled
from surfsig.shapes.surface import Array, Surface

_FEWEST = 32
"""Points that the smallest start has; each further one has twice as many."""

_DETERMINED = 0.1
"""Relative standard error of the radius from which on a start says what the shape is."""


def grown(
    kind: type[Surface], points: Array, place: Array, radius: float | None
) -> tuple[Surface, NDArray[np.bool_]] | None:
    """Fit a shape to the points around a place, then to all that are near its surface, until they stand.

    Parameters
    ----------
    kind
        Which surface.
    points
        (n, 3), the scan.
    place
        (3,), on the surface or near it.
    radius
        Of the ball whose points are the start; None tries ever more of the nearest ones until they determine
        the shape.

    Returns
    -------
    The surface, and which points it was fitted to, (n,); None where there is none.
    """
    for seeds in _starts(points, place, radius):
        start = settled(kind, points[seeds], robust=True)
        if start is None or (radius is None and not _determined(start[0], points[seeds[start[1]]])):
            continue
        chosen = np.zeros(len(points), np.bool_)
        chosen[seeds[start[1]]] = True
        found = _spread(start[0], points, chosen)
        if found is not None:
            return found
    return None


def _starts(points: Array, place: Array, radius: float | None) -> Iterator[NDArray[np.intp]]:
    distances = np.linalg.norm(points - place, axis=1)
    if radius is not None:
        yield np.flatnonzero(distances <= radius)
        return
    order = np.argsort(distances, kind="stable")
    count = _FEWEST
    while count < 2 * len(points):
        yield order[:count]
        count *= 2


def _determined(surface: Surface, points: Array) -> bool:
    """Tell whether points say how large the surface is, by the error that their number alone promises."""
    if np.isnan(surface.radius):
        return True
    residuals = surface.distances(points)
    normal = surface.jacobian(points, np.zeros(surface.unknowns))
    variance = residuals @ residuals / (len(points) - surface.unknowns)
    inverse = np.linalg.pinv(normal.T @ normal)
    return bool(np.sqrt(variance * inverse[-1, -1]) < _DETERMINED * surface.radius)


def _spread(
    surface: Surface, points: Array, chosen: NDArray[np.bool_]
) -> tuple[Surface, NDArray[np.bool_]] | None:
    cell = _longest_gap(points[chosen])
    for _ in range(MAX_PASSES):
        distances = surface.distances(points)
        candidates = np.flatnonzero(near(distances, distances[chosen]))
        if not len(candidates):
            return None
        parts = _parts(points[candidates], cell)
        votes = np.bincount(parts[chosen[candidates]], minlength=parts.max() + 1)
        new = np.zeros_like(chosen)
        new[candidates[parts == votes.argmax()]] = True
        if np.array_equal(new, chosen):
            return surface, chosen
        again = refined(surface, points[new])
        if again is None:
            return None
        surface, chosen = again, new
    return surface, chosen


def _longest_gap(points: Array) -> float:
    """Give an edge of cells at which nine tenths of the points hang together, within a factor of 2."""
    cell = float(np.ptp(points, axis=0).max()) or 1.0
    while np.bincount(_parts(points, 0.5 * cell)).max() >= 0.9 * len(points):
        cell *= 0.5
    return cell


def _parts(points: Array, cell: float) -> NDArray[np.intp]:
    """Number the parts of a cloud that hang together: points of the same cell, or of cells that touch."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    cells, of_points = np.unique(np.floor(points / cell).astype(np.int64), axis=0, return_inverse=True)
    # Centers of cells that touch are at most sqrt(3) apart, of others at least 2.
    pairs = KDTree(cells).query_pairs(1.8, output_type="ndarray")
    ones = np.ones(len(pairs), np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(cells), len(cells)))
    parts = connected_components(graph, directed=False)[1]
    return np.asarray(parts[of_points.reshape(-1)], np.intp)
