"""`find_keypoints`: places that are worth matching."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from surfsig import _surfsig
from surfsig.arguments import positive_length, thread_count, whole_number
from surfsig.defaults import KEYPOINT_CANDIDATES, KEYPOINTS
from surfsig.errors import InvalidInputError
from surfsig.field.signatures import FieldSignatures, extract_field_signatures
from surfsig.point_cloud import PointCloud

_MOST = 2**32 - 1
_NEIGHBOURS = 64


def find_keypoints(
    cloud: PointCloud | ArrayLike,
    radius: float,
    *,
    count: int | None = None,
    spacing: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    threads: int | None = None,
) -> FieldSignatures:
    """Choose places that are distinctive, and spread over the scan.

    Candidates are one point of each voxel of an eighth of the radius. A place is the more distinctive, the
    less its signature is like those of the places most like it, of which all within a radius of it do not
    count; patches cut off by the scan's rim count for less. Flat places are taken last.

    Parameters
    ----------
    cloud, radius, viewpoint, normals, threads
        As in `extract_field_signatures`.
    count
        How many, at most; 1,000 by default. Of the most distinctive third of the candidates (of more where
        that is too few) those stay whose distance to the next one that is more distinctive is largest
        (adaptive non-maximal suppression), so that they are spread.
    spacing
        In place of `count`: the smallest distance between two of them, in the cloud's own unit. All
        candidates are taken, the most distinctive first, that are as far from those before.

    Returns
    -------
    FieldSignatures
        Of the keypoints, the best first.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    """
    if count is not None and spacing is not None:
        raise InvalidInputError("count and spacing exclude each other")
    size = positive_length(radius, "radius")
    apart = None if spacing is None else positive_length(spacing, "spacing")
    most = whole_number(KEYPOINTS if count is None else count, "count", _MOST)
    voxel = size / KEYPOINT_CANDIDATES if apart is None else min(apart, size / KEYPOINT_CANDIDATES)
    found = extract_field_signatures(
        cloud, size, voxel=voxel, viewpoint=viewpoint, normals=normals, threads=threads
    )
    found = found.take(found.ok)
    if not len(found):
        return found
    places = found.points - found.points.mean(axis=0)
    order = np.argsort(-_distinctiveness(found, places, threads), kind="stable")
    if apart is not None:
        return found.take(order[_apart(places[order], apart)])
    order = order[: max(most, len(order) // 3)]
    return found.take(order[_spread(places[order])[:most]])


def _distinctiveness(
    found: FieldSignatures, places: NDArray[np.floating], threads: int | None
) -> NDArray[np.float64]:
    """Distance to the signatures most like each, times the share of a full patch that is there, (m,)."""
    unlike = _surfsig.field_distinctiveness(
        found.vectors, places.astype(np.float64), radius=found.radius, threads=thread_count(threads)
    )
    full = np.median(found.count)
    return np.asarray(unlike * np.minimum(found.count / full, 1.0))


def _spread(places: NDArray[np.floating]) -> NDArray[np.int64]:
    """Order places, given the most distinctive first, by the distance to the nearest one before."""
    tree = cKDTree(places)
    before = np.full(len(places), np.inf)
    left, neighbours = np.arange(1, len(places)), _NEIGHBOURS
    while len(left):
        neighbours = min(neighbours, len(places))
        distance, number = tree.query(places[left], k=neighbours)
        earlier = np.where(number < left[:, None], distance, np.inf)
        before[left] = earlier.min(axis=1)
        left = left[np.isinf(before[left])]
        neighbours *= 4
    return np.argsort(-before, kind="stable")


def _apart(places: NDArray[np.floating], spacing: float) -> NDArray[np.int64]:
    """Numbers of places that are as far from all taken before."""
    tree = cKDTree(places)
    free = np.ones(len(places), np.bool_)
    chosen = []
    for place in range(len(places)):
        if free[place]:
            chosen.append(place)
            free[tree.query_ball_point(places[place], spacing)] = False
    return np.array(chosen, np.int64)
