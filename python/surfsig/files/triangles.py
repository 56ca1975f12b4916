"""Triangles of a mesh: normals of its vertices, and points spread over its surface."""

from __future__ import annotations

import operator
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.point_cloud import PointCloud

_SEED = 0


def merged(corners: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """Merge corners at the very same place.

    Parameters
    ----------
    corners
        (3 m, 3) coordinates, three rows for each triangle.

    Returns
    -------
    vertices
        (n, 3) places, in the order in which they first come.
    faces
        (m, 3) numbers of vertices.
    """
    if not len(corners):
        return corners, np.empty((0, 3), np.intp)
    order = np.lexsort(corners.T)
    ordered = corners[order]
    new = np.ones(len(corners), np.bool_)
    new[1:] = (ordered[1:] != ordered[:-1]).any(axis=1)
    # The sort is stable: the first of each group is the first in the file.
    first = order[new]
    rank = np.empty(len(first), np.intp)
    rank[np.argsort(first)] = np.arange(len(first))
    faces = np.empty(len(corners), np.intp)
    faces[order] = rank[np.cumsum(new) - 1]
    return corners[np.sort(first)], faces.reshape(-1, 3)


def vertex_normals(vertices: NDArray[Any], faces: NDArray[np.intp]) -> NDArray[np.float32]:
    """Average the normals of the triangles around each vertex, weighted by area.

    Returns
    -------
    numpy.ndarray
        (n, 3), to the side from which the corners run counterclockwise; NaN where no triangle has an area.
    """
    _, _, crosses = _edges(vertices, faces)
    sums = [
        np.bincount(faces.ravel(), np.repeat(crosses[:, axis], 3), minlength=len(vertices))
        for axis in range(3)
    ]
    return _units(np.stack(sums, axis=1))


def sampled(vertices: NDArray[Any], faces: NDArray[np.intp], samples: int, source: str) -> PointCloud:
    """Spread points evenly over the triangles, always the same ones.

    The surface is cut into as many parts of equal area as there are points, along the order of the
    triangles, and one point is drawn from each.

    Returns
    -------
    PointCloud
        float64 coordinates, with the triangles' normals as fields nx, ny, nz.

    Raises
    ------
    FileFormatError
        If the triangles have no area.
    InvalidInputError
        If `samples` is no whole number above 0.
    """
    try:
        count = operator.index(samples)
    except TypeError:
        count = 0
    if count < 1:
        raise InvalidInputError(f"{source}: samples must be a whole number, 1 or more")
    corner, edges, crosses = _edges(vertices, faces)
    with np.errstate(over="ignore", invalid="ignore"):
        areas = np.sqrt((crosses**2).sum(axis=1))
        area = np.cumsum(np.where(np.isfinite(areas), areas, 0))
    if not len(area) or not 0 < area[-1] < np.inf:
        raise FileFormatError(f"{source}: no surface to take samples of: its triangles have no area")
    rng = np.random.default_rng(_SEED)
    places = (np.arange(count) + rng.random(count)) * (area[-1] / count)
    # Rounding may carry the last place to the very end: it belongs to the last triangle that has an area.
    last = int(np.searchsorted(area, area[-1]))
    chosen = np.searchsorted(area, places, side="right").clip(max=last)
    a, b = rng.random((2, count))
    beyond = a + b > 1
    a[beyond], b[beyond] = 1 - a[beyond], 1 - b[beyond]
    points = corner[chosen] + a[:, None] * edges[0][chosen] + b[:, None] * edges[1][chosen]
    return PointCloud(points, fields=normal_fields(_units(crosses)[chosen]))


def normal_fields(normals: NDArray[Any]) -> dict[str, NDArray[Any]]:
    """Name the columns of normals (n, 3) as fields."""
    return dict(zip(("nx", "ny", "nz"), np.ascontiguousarray(normals.T), strict=True))


def _edges(
    vertices: NDArray[Any], faces: NDArray[np.intp]
) -> tuple[NDArray[np.float64], tuple[NDArray[np.float64], NDArray[np.float64]], NDArray[np.float64]]:
    """Give each triangle's first corner, the two edges from it, and their cross product."""
    with np.errstate(over="ignore", invalid="ignore"):
        first, second, third = (vertices[faces[:, i]].astype(np.float64) for i in range(3))
        edges = second - first, third - first
        return first, edges, np.cross(*edges)


def _units(vectors: NDArray[np.float64]) -> NDArray[np.float32]:
    with np.errstate(over="ignore", invalid="ignore"):
        lengths = np.sqrt((vectors**2).sum(axis=1, keepdims=True))
        units: NDArray[np.float32] = (vectors / lengths).astype(np.float32)
    return units
