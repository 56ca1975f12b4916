"""Which side of a surface is which, where nobody knows where the sensor stood."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.sparse.csgraph import breadth_first_order, connected_components, minimum_spanning_tree
from scipy.spatial import cKDTree

from surfsig.curvature import extract
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_BALL = 2.5
"""Voxels: the radius from which normals are taken."""
_NEIGHBOURS = 10
_APART = 0.01
"""What a voxel of distance counts against a turn of the normal by a right angle."""


def one_sided_normals(cloud: PointCloud, voxel: float, threads: int | None) -> Array:
    """Give normals (n, 3) that are on one side of each piece of surface, which side is open.

    The side is handed on from neighbour to neighbour, where normals differ least first (Hoppe et al., Surface
    reconstruction from unorganized points, 1992).
    """
    found = extract(cloud, radius=_BALL * voxel, voxel=voxel, threads=threads)
    known = np.isfinite(found.normals).all(axis=1)
    places, normals = (rows[known].astype(np.float64) for rows in (found.points, found.normals))
    if len(places) <= _NEIGHBOURS:
        return np.tile([0.0, 0.0, 1.0], (len(cloud), 1))
    tree = cKDTree(places)
    distances, numbers = tree.query(places, k=_NEIGHBOURS + 1)
    first = np.repeat(np.arange(len(places)), _NEIGHBOURS)
    second, apart = numbers[:, 1:].ravel(), distances[:, 1:].ravel()
    turned = 1.0 - np.abs(np.einsum("ij,ij->i", normals[first], normals[second]))
    # No edge may weigh nothing: a sparse matrix would not have it.
    weights = turned + _APART * apart / voxel + 1e-6
    forest = minimum_spanning_tree(coo_array((weights, (first, second)), shape=(len(places),) * 2).tocsr())
    forest = forest + forest.T
    _, pieces = connected_components(forest, directed=False)
    roots = np.unique(pieces, return_index=True)[1]
    for root in roots:
        order, before = breadth_first_order(forest, root, directed=False)
        for place in order[1:]:
            if normals[place] @ normals[before[place]] < 0:
                normals[place] *= -1.0
    return np.asarray(normals[tree.query(cloud.offsets + cloud.origin)[1]])
