"""Places on a surface: how far points are from it, where along it, and how far round."""

from __future__ import annotations

import contextlib
import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import axes_across

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Placement:
    """A surface whose point of reference is 0."""

    kind: str
    axis: Array
    radius: float
    major_radius: float
    half_angle: float

    def heights(self, points: Array) -> Array:
        """Give places along the axis; NaN for a sphere."""
        return points @ self.axis

    def away(self, points: Array) -> Array:
        """Give distances from the axis."""
        away: Array = np.linalg.norm(points - np.outer(self.heights(points), self.axis), axis=1)
        return away

    def foot(self, point: Array) -> Array:
        """Give the place on a plane that is nearest to a point."""
        foot: Array = point - (point @ self.axis) * self.axis
        return foot

    def distances(self, points: Array) -> Array:
        """Give signed distances from the surface; of a curve those in space, without a sign."""
        if self.kind == "plane":
            return self.heights(points)
        if self.kind == "sphere":
            length: Array = np.linalg.norm(points, axis=1)
            return length - self.radius
        away, heights = self.away(points), self.heights(points)
        if self.kind == "cylinder":
            return away - self.radius
        if self.kind == "line":
            return away
        if self.kind == "circle":
            return np.hypot(away - self.radius, heights)
        if self.kind == "cone":
            sine, cosine = math.sin(self.half_angle), math.cos(self.half_angle)
            return (away - self.radius) * cosine - heights * sine
        return np.hypot(away - self.major_radius, heights) - self.radius

    def form_error(self, points: Array) -> float:
        """Measure distances peak to valley; of a circle those from its axis; of a line twice the largest."""
        if self.kind == "line":
            return 2 * float(self.away(points).max())
        return float(np.ptp(self.away(points) if self.kind == "circle" else self.distances(points)))

    def turns(self, points: Array) -> Array:
        """Give angles about the axis."""
        first, second = axes_across(self.axis)
        return np.arctan2(points @ second, points @ first)


def covered_arc(placement: Placement, points: Array) -> float:
    """Measure how far points go round: about the axis, or of a sphere as seen from its center."""
    if placement.kind in ("plane", "line"):
        return math.nan
    if placement.kind == "sphere":
        towards = directions_of(points)
        return 2 * float(np.arccos(np.clip(towards @ middle_direction(towards), -1, 1)).max())
    turns = np.sort(placement.turns(points))
    return 2 * math.pi - float(np.diff(turns, append=turns[0] + 2 * math.pi).max())


def directions_of(points: Array) -> Array:
    """Give unit vectors (n, 3) from 0 to points; 0 for a point that is there."""
    lengths = np.linalg.norm(points, axis=1, keepdims=True)
    return np.asarray(points / np.where(lengths > 0.0, lengths, 1.0))


def middle_direction(towards: Array) -> Array:
    """Give the mean of directions; that of the first where they cancel out."""
    mean = towards.mean(axis=0)
    length = float(np.linalg.norm(mean))
    middle: Array = mean / length if length > 1e-6 else towards[0]
    return middle


def in_plane(placement: Placement, points: Array) -> tuple[float, float]:
    """Measure the sides of the smallest rectangle around points in a plane, the longer first.

    One of its sides is along the convex hull; of points that are nearly on a line, along that line.
    """
    from scipy.spatial import QhullError

    flat = points @ np.column_stack(axes_across(placement.axis))
    try:
        hull = _hull(flat)
    except QhullError:
        _, _, directions = np.linalg.svd(flat - flat.mean(axis=0), full_matrices=False)
        longer, shorter = np.ptp(flat @ directions.T, axis=0).tolist()
        return longer, shorter
    edges = np.diff(hull, axis=0, append=hull[:1])
    edges /= np.linalg.norm(edges, axis=1, keepdims=True)
    along = np.ptp(hull @ edges.T, axis=0)
    beside = np.ptp(hull @ np.column_stack([-edges[:, 1], edges[:, 0]]).T, axis=0)
    best = (along * beside).argmin()
    sides = sorted((float(along[best]), float(beside[best])), reverse=True)
    return sides[0], sides[1]


def _hull(flat: Array) -> Array:
    """Give the corners of the convex hull of points (n, 2); a `QhullError` where they are on a line."""
    from scipy.spatial import ConvexHull

    some = _near_hull(flat)
    hull: Array = some[ConvexHull(some).vertices]
    return hull


_OUTLINE = 2000
"""Points of an outline that are evenly chosen, and angles at which it has a point."""


def outline(placement: Placement, points: Array) -> Array:
    """Give a few points on or near a surface that extend as far as all (n, 3) do: along it, and round it."""
    from scipy.spatial import QhullError

    if placement.kind == "plane":
        across = np.column_stack(axes_across(placement.axis))
        with contextlib.suppress(QhullError):
            return _hull(points @ across) @ across.T
    chosen = np.arange(0, len(points), math.ceil(len(points) / _OUTLINE))
    if placement.kind not in ("plane", "sphere"):
        heights = placement.heights(points)
        bins = ((placement.turns(points) + math.pi) * (_OUTLINE / (2 * math.pi))).astype(np.int64)
        _, of_bins = np.unique(bins, return_index=True)
        chosen = np.union1d(of_bins, [heights.argmin(), heights.argmax()])
    return points[chosen]


_DIRECTIONS = 8
"""In which the farthest points make a polygon: of points that fill a square it holds nine in ten of them."""

_CORNERS_OF = 10_000
"""Points of which these are the farthest."""


def _near_hull(flat: Array) -> Array:
    """Leave out points (n, 2) inside the polygon of the farthest of some: none of them is of the hull."""
    some = flat[:: math.ceil(len(flat) / _CORNERS_OF)]
    angles = 2 * math.pi / _DIRECTIONS * np.arange(_DIRECTIONS)
    corners = some[(some @ np.stack([np.cos(angles), np.sin(angles)])).argmax(axis=0)]
    sides = np.roll(corners, -1, axis=0) - corners
    # For rounding.
    margin = 1e-9 * np.abs(sides).max() ** 2
    x, y = np.ascontiguousarray((flat - corners[0]).T)
    inside = np.full(len(flat), bool(sides.any()))
    for (corner_x, corner_y), (side_x, side_y) in zip(corners - corners[0], sides, strict=True):
        # A corner that is there twice has no side.
        if side_x or side_y:
            inside &= side_y * x - side_x * y < side_y * corner_x - side_x * corner_y - margin
    left: Array = flat[~inside]
    return left
