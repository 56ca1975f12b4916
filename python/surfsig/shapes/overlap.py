"""Which part of two planes lies opposite: the overlap of the convex hulls of their points."""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np

from surfsig.errors import InvalidInputError
from surfsig.geometry import axes_across
from surfsig.shapes.geometry import Array

if TYPE_CHECKING:
    from surfsig.point_cloud import PointCloud
    from surfsig.shapes.surface import Surface


def member_points(surface: Surface, cloud: PointCloud) -> Array:
    """Give the points of a surface, (m, 3), less its center.

    Raises
    ------
    InvalidInputError
        If the cloud has not so many points: it is another one.
    """
    if surface.count and surface.members[-1] >= len(cloud):
        raise InvalidInputError(
            f"the surface has point {surface.members[-1]}, but the cloud only {len(cloud)} points: "
            "give the cloud that it was fitted to"
        )
    return cloud.offsets[surface.members].astype(np.float64) + (cloud.origin - surface.center)


def overlap_of_planes(first: Surface, second: Surface, cloud: PointCloud) -> Array:
    """Give the corners of the part of two nearly parallel planes that lies opposite.

    Parameters
    ----------
    first, second
        The planes.
    cloud
        What they were fitted to.

    Returns
    -------
    (k, 3), less the first one's center and on it, in order; those of the hull of both where nothing lies
    opposite.
    """
    axes = np.column_stack(axes_across(first.axis))
    offset = (second.center - first.center) @ axes
    flat = [member_points(first, cloud) @ axes, member_points(second, cloud) @ axes + offset]
    common = _clipped(_hull(flat[0]), _hull(flat[1]))
    return (common if len(common) > 2 else _hull(np.concatenate(flat))) @ axes.T


def centroid(corners: Array, normal: Array) -> Array:
    """Give the centroid (3,) of a flat convex polygon's area, of its corners (k, 3) in order."""
    if len(corners) < 3:
        return np.asarray(corners.mean(axis=0))
    sides = corners[1:] - corners[0]
    areas = np.cross(sides[:-1], sides[1:]) @ normal
    return np.asarray(corners[0] + areas @ (sides[:-1] + sides[1:]) / (3.0 * areas.sum()))


def _hull(flat: Array) -> Array:
    """Give the corners of the convex hull, counterclockwise; the points' ends where they are on a line."""
    from scipy.spatial import ConvexHull, QhullError

    try:
        return np.asarray(flat[ConvexHull(flat).vertices])
    except QhullError:
        order = np.lexsort(flat.T)
        return flat[order[[0, -1]]]


def _clipped(polygon: Array, window: Array) -> Array:
    """Cut a convex polygon by another, both counterclockwise (Sutherland and Hodgman 1974)."""
    for start, end in zip(window, np.roll(window, -1, axis=0), strict=True):
        along = end - start
        inward = np.array([-along[1], along[0]])
        heights = (polygon - start) @ inward
        kept = []
        for number, corner in enumerate(polygon):
            before = heights[number - 1]
            if (before < 0.0) != (heights[number] < 0.0):
                share = before / (before - heights[number])
                kept.append(polygon[number - 1] + share * (corner - polygon[number - 1]))
            if heights[number] >= 0.0:
                kept.append(corner)
        polygon = np.array(kept).reshape(-1, 2)
        if len(polygon) < 3:
            break
    return polygon
