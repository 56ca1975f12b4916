"""A sphere that is seen from more than one side, as a mesh: faces of a divided icosahedron with points."""

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from surfsig.shapes.geometry import Array, directions_of

Faces = NDArray[np.int64]

_EDGE = math.atan(2.0)
"""Angle between neighbouring corners of an icosahedron, in radians."""

_LARGEST_FREQUENCY = 64
"""Parts of an edge, at most: 40,000 corners."""


def sphere_with_points(points: Array, step: float) -> tuple[Array, Faces, float]:
    """Mesh the part of the unit sphere where points are.

    Parameters
    ----------
    points
        (n, 3), about the sphere's center.
    step
        About how far the corners are apart, in radians.

    Returns
    -------
    vertices, faces, share
        Unit vectors (v, 3), the nearest ones of points; (f, 3), counterclockwise from outside, where three
        neighbours are such; and the share of the points whose nearest one is in a face.
    """
    from scipy.spatial import KDTree

    vertices, faces = geodesic_sphere(min(_LARGEST_FREQUENCY, max(2, math.floor(_EDGE / step))))
    _, nearest = KDTree(vertices).query(directions_of(points))
    counts = np.bincount(nearest, minlength=len(vertices))
    kept = faces[(counts[faces] > 0).all(axis=1)]
    used, numbers = np.unique(kept, return_inverse=True)
    return vertices[used], numbers.reshape(-1, 3).astype(np.int64), float(counts[used].sum() / len(points))


def geodesic_sphere(frequency: int) -> tuple[Array, Faces]:
    """Divide each edge of an icosahedron, and move what is between its corners onto the unit sphere.

    Parameters
    ----------
    frequency
        Parts of an edge, 1 or more.

    Returns
    -------
    vertices, faces
        (10 f^2 + 2, 3) and (20 f^2, 3), counterclockwise from outside.
    """
    golden = 0.5 * (1.0 + math.sqrt(5.0))
    signs = np.array([[-1, -golden], [-1, golden], [1, -golden], [1, golden]])
    corners = np.concatenate([np.roll(np.insert(signs, 0, 0.0, axis=1), shift, axis=1) for shift in range(3)])
    apart = np.linalg.norm(corners[:, None] - corners[None], axis=2)
    neighbours = (apart > 0.0) & (apart < 2.1)
    faces = [
        (a, b, c) if np.linalg.det(corners[[a, b, c]]) > 0.0 else (a, c, b)
        for a in range(12)
        for b in range(a + 1, 12)
        for c in range(b + 1, 12)
        if neighbours[a, b] and neighbours[b, c] and neighbours[a, c]
    ]
    # Places within a triangle, by whole parts of the frequency; and the small triangles between them.
    position = {
        (i, j): n
        for n, (i, j) in enumerate((i, j) for i in range(frequency + 1) for j in range(frequency + 1 - i))
    }
    weights = np.array([(frequency - i - j, i, j) for i, j in position]) / frequency
    small = [
        [position[i, j], position[i + 1, j], position[i, j + 1]] for i, j in position if i + j < frequency
    ] + [
        [position[i + 1, j], position[i + 1, j + 1], position[i, j + 1]]
        for i, j in position
        if i + j < frequency - 1
    ]
    points = (weights @ corners[np.array(faces)]).reshape(-1, 3)
    numbers = (np.array(small) + len(weights) * np.arange(20)[:, None, None]).reshape(-1, 3)
    # What two triangles share is one vertex.
    _, first, merged = np.unique(np.round(points, 9), axis=0, return_index=True, return_inverse=True)
    return directions_of(points[first]), merged.reshape(-1)[numbers].astype(np.int64)


def halved(vertices: Array, faces: Faces) -> tuple[Array, Faces]:
    """Cut each triangle of a mesh on the unit sphere into four, at the middles of its sides."""
    sides = np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1)
    unique, numbers = np.unique(sides, axis=0, return_inverse=True)
    middles = directions_of(vertices[unique].sum(axis=1))
    a, b, c = faces.T
    ab, bc, ca = (len(vertices) + numbers.reshape(-1, 3)).T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    return np.concatenate([vertices, middles]), np.concatenate([np.stack(part, axis=1) for part in parts])
