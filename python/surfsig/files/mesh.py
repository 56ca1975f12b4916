"""From the triangles of a mesh to a point cloud: its vertices, or points spread over its surface."""

from __future__ import annotations

import operator
import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.defaults import SAMPLING_SEED
from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.columns import blocks_of
from surfsig.point_cloud import PointCloud

# Far beyond any unit of length; float32 holds it, and float64 the square of an area of such sides.
_ABSURD = 1e30


def check_vertices(vertices: NDArray[Any], source: str) -> None:
    """Make sure that areas can be computed from these coordinates; a `FileFormatError` says if not."""
    for block in blocks_of(vertices):
        if not (np.abs(block) < _ABSURD).all():
            raise FileFormatError(f"{source}: broken: a vertex is no number, or beyond {_ABSURD:g}")


def with_normals(points: NDArray[Any], normals: NDArray[Any]) -> PointCloud:
    """Make a cloud of points with normals (n, 3), which become the fields nx, ny, nz (float32)."""
    fields = dict(zip(("nx", "ny", "nz"), normals.astype(np.float32).T.copy(), strict=True))
    return PointCloud(points, fields=fields)


def fans(lengths: NDArray[np.int64], corners: NDArray[np.int64], count: int, source: str) -> NDArray[np.intp]:
    """Cut faces into triangles that share their face's first corner.

    Parameters
    ----------
    lengths
        (f,), how many corners each face has.
    corners
        Their vertices, from 0, face by face.
    count
        How many vertices there are.
    source
        The file's name, for the warning.

    Returns
    -------
    numpy.ndarray
        (t, 3).

    Warns
    -----
    UserWarning
        If faces are left out, which have fewer than three corners or refer to vertices that are missing.
    """
    ends = np.cumsum(lengths)
    missing = np.flatnonzero((corners < 0) | (corners >= count))
    whole = lengths >= 3
    whole[np.searchsorted(ends, missing, side="right")] = False
    warn_left_out(np.flatnonzero(~whole), len(lengths), source)
    sizes = lengths[whole] - 2
    # Of each triangle: where its face begins, and the how manieth of it it is.
    begins = np.repeat((ends - lengths)[whole], sizes)
    along = np.arange(len(begins)) - np.repeat(np.cumsum(sizes) - sizes, sizes)
    places = begins + along
    return np.stack([corners[begins], corners[places + 1], corners[places + 2]], axis=1).astype(np.intp)


def warn_left_out(faces: NDArray[np.intp], count: int, source: str) -> None:
    """Say that faces are left out, if any are: `faces` has their numbers from 0."""
    if len(faces):
        warnings.warn(
            f"{source}: {len(faces)} of {count} faces are left out, the first of which is number "
            f"{faces[0] + 1}: they have fewer than three corners, or refer to vertices that are missing",
            stacklevel=3,
        )


def merged(corners: NDArray[Any]) -> tuple[NDArray[Any], NDArray[np.intp]]:
    """Find the vertices of triangles that were stored without shared ones.

    Parameters
    ----------
    corners
        (3 t, 3), the corners triangle by triangle.

    Returns
    -------
    vertices
        (n, 3), each once, in the order in which they come first.
    triangles
        (t, 3) indices into the vertices.
    """
    # Adding 0 turns -0 into 0, so that equal numbers have equal bytes.
    rows = np.ascontiguousarray(corners + corners.dtype.type(0))
    keys = rows.view(np.dtype((np.void, rows.dtype.itemsize * 3))).ravel()
    _, first, inverse = np.unique(keys, return_index=True, return_inverse=True)
    order = np.argsort(first)
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return corners[first[order]], rank[inverse].reshape(-1, 3)


def vertex_normals(vertices: NDArray[Any], triangles: NDArray[np.intp]) -> NDArray[np.float64]:
    """Give the mean of the normals of the triangles at each vertex, weighted by their areas.

    Returns
    -------
    numpy.ndarray
        (n, 3) of length 1; zeros where the triangles have no area, or cancel out.
    """
    sums = np.zeros((len(vertices), 3))
    for block in blocks_of(triangles):
        crosses = _crosses(vertices, block)
        for axis in range(3):
            weights = np.repeat(crosses[:, axis], 3)
            np.add.at(sums[:, axis], block.ravel(), weights)
    return _unit(sums)


def sampled(vertices: NDArray[Any], triangles: NDArray[np.intp], samples: int, source: str) -> PointCloud:
    """Spread points evenly over triangles, the same ones each time.

    Each part of the surface gets its share by area: the points are drawn one from each of `samples` equal
    pieces of it. A point has the normal of its triangle.

    Parameters
    ----------
    vertices
        (n, 3).
    triangles
        (t, 3) indices into them.
    samples
        How many points.
    source
        The file's name, for messages.

    Raises
    ------
    InvalidInputError
        If `samples` is not a positive whole number, or there is no surface.
    """
    try:
        count = operator.index(samples)
    except TypeError:
        count = 0
    if count < 1:
        raise InvalidInputError(f"samples must be a positive whole number, not {samples!r:.40}")
    ends = np.cumsum(
        np.concatenate(
            [np.zeros(0), *(_lengths(_crosses(vertices, block)) for block in blocks_of(triangles))]
        )
    )
    if not len(ends) or not ends[-1] > 0:
        raise InvalidInputError(f"{source}: has no faces with an area, over which samples could be spread")
    points = np.empty((count, 3), vertices.dtype)
    normals = np.empty((count, 3), np.float32)
    rng = np.random.default_rng(SAMPLING_SEED)
    for rows in blocks_of(np.arange(count)):
        places = (rows + rng.random(len(rows))) * (ends[-1] / count)
        # Rounding may bring the last place to the very end, or a place to a triangle without area.
        chosen = triangles[np.searchsorted(ends, np.minimum(places, np.nextafter(ends[-1], 0)), side="right")]
        along = rng.random((2, len(rows), 1))
        # The half of the parallelogram that is no triangle, turned onto the other.
        along = np.where(along.sum(axis=0) > 1, 1 - along, along)
        start, *others = (vertices[chosen[:, corner]].astype(np.float64) for corner in range(3))
        points[rows] = start + sum(part * (other - start) for part, other in zip(along, others, strict=True))
        normals[rows] = _unit(_crosses(vertices, chosen))
    return with_normals(points, normals)


def _crosses(vertices: NDArray[Any], triangles: NDArray[np.intp]) -> NDArray[np.float64]:
    """Give the normals of triangles with the length of twice their areas."""
    a, b, c = (vertices[triangles[:, corner]].astype(np.float64) for corner in range(3))
    return np.cross(b - a, c - a)


def _lengths(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths: NDArray[np.float64] = np.linalg.norm(vectors, axis=1)
    return lengths


def _unit(vectors: NDArray[np.float64]) -> NDArray[np.float64]:
    lengths = _lengths(vectors)
    lengths[lengths == 0] = 1
    return vectors / lengths[:, None]
