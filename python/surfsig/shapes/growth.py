"""A shape in a scan, grown from a place on it: all points that are near its surface and hang together."""

from __future__ import annotations

from functools import partial
from typing import NamedTuple

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.progress import Progress, ProgressCallback
from surfsig.shapes.known import NOTHING_KNOWN, Known
from surfsig.shapes.robust import MAX_PASSES, Array, fitted_to_inliers, near, rounding_of
from surfsig.shapes.surface import PARAMETERS, ShapeKind
from surfsig.threads import map_in_threads

Mask = NDArray[np.bool_]

_FEWEST = 32
"""Points that the smallest start has; each further one has twice as many."""

_DETERMINED = 0.1
"""Relative standard error of the radius up to which a start says what the shape is."""

_THIN = 0.1
"""Points whose distances from a surface are a larger part of its radius are a heap, and not that surface."""

_SAME = 0.5
"""Two starts lead to the same shape where they share this part of the points of both."""

_AGREEMENT = 2
"""Starts that must lead to the same shape for no further, larger ones to be tried."""

_HOLDS = 0.95
"""Part of a shape's points that must hang together; the rest may be strays."""

_BORDER_NEIGHBOURS = 16
"""Nearest points of the scan that tell whether a point is at the border of a shape, ..."""

_OTHERS = 3
"""... by how many of them may be no points of the shape. Points of what is beside it are near its surface at
the border, on one side of it: on simulated scans of balls on a table with noise of 1 % of the radius 0.7 %
of the shape's points were the table's, and 75 to 85 of 100 intervals held the radius; without the border 92
to 96 (tests/shapes/test_intervals_in_scans.py)."""

_ENOUGH = 0.5
"""Where less than this part of a shape is not at its border, it has no inside: all of it is fitted."""

_FINEST = 2.0**-20
"""Edge of the finest cells, in extents of the points."""


class Grown(NamedTuple):
    """A surface, and which points it was fitted to, (n,)."""

    surface: _surfsig.Primitive
    inliers: Mask


def grown(
    kind: ShapeKind,
    points: Array,
    place: Array,
    radius: float | None,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
    known: Known = NOTHING_KNOWN,
) -> Grown | None:
    """Fit a shape to the points around a place, then to all that are near its surface, until they stand.

    Without a radius, ever more of the nearest points are tried, until two starts lead to the same shape.
    Noise may look like a small shape, and what is beside the object like a large one: of the shapes found by
    then that one counts whose radius is known best; of planes the one that most starts lead to.

    Parameters
    ----------
    kind
        Which surface.
    points
        (n, 3), the scan.
    place
        (3,), on the surface or near it.
    radius
        Of the ball whose points are the start, or None.
    threads
        Of those at hand, up to `_AGREEMENT` are used: so many starts are needed anyway.
    progress
        Called with the number of starts done, and of all.
    known
        The axis that is kept, and the weights of all points.

    Returns
    -------
    Grown or None
        None where there is no such shape.
    """
    found: list[tuple[Grown, int]] = []
    starts = _starts(points, place, radius)
    done = Progress(progress, len(starts))
    for number in range(0, len(starts), _AGREEMENT):
        batch = starts[number : number + _AGREEMENT]
        shapes = map_in_threads(
            partial(_from_seeds, kind, points, known), batch, threads, lambda _done, _total: done.advance(1)
        )
        if any(_agreed(shape, found) for shape in shapes):
            break
    done.advance(len(starts))
    if not found:
        return None
    # Of equal ones the first, which is the smallest start's.
    best = min(found, key=lambda pair: (_relative_error(kind, pair[0], points), -pair[1]))
    return _without_border(kind, points, best[0], known)


def _without_border(kind: ShapeKind, points: Array, shape: Grown, known: Known) -> Grown:
    """Fit a shape again without its points beside others of the scan, some of which are taken for its own."""
    from scipy.spatial import KDTree

    members = np.flatnonzero(shape.inliers)
    count = min(_BORDER_NEIGHBOURS, len(points) - 1)
    if count < _BORDER_NEIGHBOURS or len(members) == len(points):
        return shape
    # The first neighbour is the point itself.
    neighbours = KDTree(points).query(points[members], list(range(2, count + 2)))[1]
    inside = members[(~shape.inliers[neighbours]).sum(axis=1) <= _OTHERS]
    if len(inside) < max(_ENOUGH * len(members), _FEWEST):
        return shape
    again = known.fit(kind, points, inside, shape.surface)
    if again is None:
        return shape
    chosen = np.zeros_like(shape.inliers)
    chosen[inside] = True
    return Grown(again, chosen)


def _agreed(shape: Grown | None, found: list[tuple[Grown, int]]) -> bool:
    """Count the start that led to a shape among those found; tell whether enough starts led to that shape."""
    if shape is None:
        return False
    for number, (other, votes) in enumerate(found):
        if _same(shape.inliers, other.inliers):
            # The larger start knows it better.
            found[number] = (shape, votes + 1)
            return votes + 1 == _AGREEMENT
    found.append((shape, 1))
    return False


def _starts(points: Array, place: Array, radius: float | None) -> list[NDArray[np.intp]]:
    distances = np.linalg.norm(points - place, axis=1)
    if radius is not None:
        return [np.flatnonzero(distances <= radius)]
    order = np.argsort(distances, kind="stable")
    counts = []
    count = _FEWEST
    while count < 2 * len(points):
        counts.append(count)
        count *= 2
    return [order[:count] for count in counts]


def _from_seeds(kind: ShapeKind, points: Array, known: Known, seeds: NDArray[np.intp]) -> Grown | None:
    start = fitted_to_inliers(kind, points[seeds], robust=True, known=known.of(seeds))
    if start is None:
        return None
    surface, kept = start
    chosen = np.zeros(len(points), np.bool_)
    chosen[seeds[kept]] = True
    if not _stands_out(surface, points[chosen]):
        return None
    shape = _spread(kind, surface, points, chosen, known)
    return shape if shape and _stands_out(shape.surface, points[shape.inliers]) else None


def _stands_out(surface: _surfsig.Primitive, points: Array) -> bool:
    """Tell whether points say how large the surface is, by the error that their number alone promises."""
    if np.isnan(surface.radius):
        return True
    rms = np.sqrt((surface.distances(points) ** 2).mean())
    error = surface.independent_error(points)
    return bool(error < _DETERMINED * surface.radius and rms < _THIN * surface.radius)


def _relative_error(kind: ShapeKind, shape: Grown, points: Array) -> float:
    """Give the relative standard error of the radius; 0 where there is none, infinity where it is unknown."""
    if np.isnan(shape.surface.radius):
        return 0.0
    row = PARAMETERS[kind].index("radius")
    variance = shape.surface.uncertainty(points[shape.inliers])[0][row, row]
    return float(np.sqrt(variance)) / shape.surface.radius if np.isfinite(variance) else np.inf


def _same(a: Mask, b: Mask) -> bool:
    return bool((a & b).sum() > _SAME * (a | b).sum())


def _spread(
    kind: ShapeKind, surface: _surfsig.Primitive, points: Array, chosen: Mask, known: Known
) -> Grown | None:
    """Take the points near the surface that hang together with those chosen, and fit it again, to the end."""
    # A few points may miss the gaps between a scanner's lines.
    cell = 2 * _longest_gap(points[chosen])
    rounding = rounding_of(points)
    for _ in range(MAX_PASSES):
        distances = surface.distances(points)
        candidates = np.flatnonzero(near(distances, distances[chosen], rounding))
        if not len(candidates):
            return None
        parts = _parts(points[candidates], cell)
        votes = np.bincount(parts[chosen[candidates]], minlength=parts.max() + 1)
        new = np.zeros_like(chosen)
        new[candidates[parts == votes.argmax()]] = True
        if np.array_equal(new, chosen):
            # The whole shape knows its gaps better than the start did: what is farther is something else.
            gap = _longest_gap(points[chosen])
            if gap >= cell:
                break
            cell = gap
            continue
        again = known.fit(kind, points, new, surface)
        if again is None:
            return None
        surface, chosen = again, new
    return Grown(surface, chosen)


def _longest_gap(points: Array) -> float:
    """Give an edge of cells at which the points just hang together, within a factor of 2."""
    cell = extent = float(np.ptp(points, axis=0).max())
    while cell > extent * _FINEST and np.bincount(_parts(points, 0.5 * cell)).max() >= _HOLDS * len(points):
        cell *= 0.5
    return cell


def _parts(points: Array, cell: float) -> NDArray[np.intp]:
    """Give each point the number of its part: points of the same cell, or of cells that touch, are of one."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components
    from scipy.spatial import KDTree

    offsets = points - points.min(axis=0)
    # So that the number of a cell fits into 64 bits.
    places = (offsets / max(cell, float(offsets.max()) * _FINEST)).astype(np.int64)
    keys = np.ravel_multi_index(tuple(places.T), tuple(places.max(axis=0) + 1))
    _, first, of_points = np.unique(keys, return_index=True, return_inverse=True)
    # Centers of cells that touch are at most sqrt(3) apart, of others at least 2.
    pairs = KDTree(places[first]).query_pairs(1.8, output_type="ndarray")
    ones = np.ones(len(pairs), np.int8)
    graph = coo_array((ones, (pairs[:, 0], pairs[:, 1])), shape=(len(first), len(first)))
    parts = connected_components(graph, directed=False)[1]
    return np.asarray(parts[of_points.reshape(-1)], np.intp)
