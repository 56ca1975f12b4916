"""The area of a surface that points cover: cells are counted on a map of it that keeps areas."""

from __future__ import annotations

import math

import numpy as np

from surfsig.geometry import axes_across
from surfsig.shapes.geometry import Array, Placement, directions_of, middle_direction

_POINTS = 20_000
"""Points that are looked at; of more, evenly chosen ones."""

_NEIGHBOURS = 32
"""A cell is as wide as it is far to so many neighbours: hardly any is then empty by chance."""

_LOOKED_AT = 500
"""Points whose distance to the last of these is looked at. Their median is then right within a hundredth;
the area depends on it at its border only."""

_FINEST = 2.0**-30
"""Width of the narrowest cells, in extents of the points: two such numbers of cells fit into 64 bits."""


def covered_area(placement: Placement, points: Array) -> float:
    """Estimate the area that points on a surface cover.

    Parameters
    ----------
    placement
        The surface.
    points
        (n, 3), about the surface's point of reference.

    Returns
    -------
    The area of the cells with points, of those at the border one half: so much of them is covered on average.
    """
    flat = unrolled(placement, points[:: math.ceil(len(points) / _POINTS)])
    side = cell_width(flat)
    # Cells have whole numbers, and points that are nearly all at one position tell no width of cells.
    if not side > _FINEST * float(np.ptp(flat, axis=0).max()):
        return math.nan
    # By half a cell the lowest points are inside of theirs, so that these are half covered, too.
    cells = np.floor((flat - flat.min(axis=0)) / side + 0.5).astype(np.int64)
    rows = cells[:, 0].max() + 3
    numbers = np.unique(cells[:, 0] + 1 + rows * (cells[:, 1] + 1))
    inner = np.ones(len(numbers), np.bool_)
    for step in (-1, 1, -rows, rows):
        inner &= np.isin(numbers + step, numbers)
    return side**2 * float(inner.sum() + 0.5 * (~inner).sum())


def cell_width(flat: Array) -> float:
    """Choose how wide cells are on a map, so that hardly any is empty by chance.

    Parameters
    ----------
    flat
        (n, 2), the points' places on the map.
    """
    from scipy.spatial import KDTree

    flat = flat[:: math.ceil(len(flat) / _POINTS)]
    some = flat[:: math.ceil(len(flat) / _LOOKED_AT)]
    reach, _ = KDTree(flat).query(some, [min(_NEIGHBOURS, max(4, len(flat) // 8))])
    return float(np.median(reach))


def unrolled(placement: Placement, points: Array) -> Array:
    """Give the points' places (n, 2) in a plane, on a map of the surface that keeps areas."""
    if placement.kind == "plane":
        return points @ np.column_stack(axes_across(placement.axis))
    if placement.kind == "sphere":
        return _lambert(placement.radius, points)
    turns = _cut(placement.turns(points))
    heights = placement.heights(points)
    if placement.kind == "cylinder":
        return np.column_stack([placement.radius * turns, heights])
    if placement.kind == "cone":
        sine, cosine = math.sin(placement.half_angle), math.cos(placement.half_angle)
        beside = placement.away(points) - placement.radius
        from_apex = np.abs(beside * sine + heights * cosine + placement.radius / sine)
        return np.column_stack([from_apex * np.cos(turns * sine), from_apex * np.sin(turns * sine)])
    tube = _cut(np.arctan2(heights, placement.away(points) - placement.major_radius))
    ratio = placement.radius / placement.major_radius
    return np.column_stack([placement.major_radius * turns, placement.radius * (tube + ratio * np.sin(tube))])


def _lambert(radius: float, points: Array) -> Array:
    """Map a sphere about the middle of its points (Lambert's azimuthal map)."""
    towards = directions_of(points)
    middle = middle_direction(towards)
    flat = towards @ np.column_stack(axes_across(middle))
    scale = np.sqrt(2 / np.maximum(1 + towards @ middle, 1e-9))
    mapped: Array = radius * flat * scale[:, None]
    return mapped


def _cut(turns: Array) -> Array:
    """Let angles run on from their widest gap."""
    order = np.sort(turns)
    gaps = np.diff(order, append=order[0] + 2 * math.pi)
    start = order[(gaps.argmax() + 1) % len(order)]
    continued: Array = start + (turns - start) % (2 * math.pi)
    return continued
