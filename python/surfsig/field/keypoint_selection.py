"""`find_keypoints`: places that are worth matching."""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, progress_callback, thread_count, whole_number
from surfsig.defaults import KEYPOINTS
from surfsig.errors import InvalidInputError
from surfsig.field.signatures import FieldSignatures
from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud
from surfsig.progress import ProgressCallback
from surfsig.status import Status

_MOST = 2**32 - 1


def find_keypoints(
    cloud: PointCloud | ArrayLike,
    radius: float,
    *,
    count: int | None = None,
    spacing: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
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
    progress
        Called twice with the number of candidates done, some twenty times a second; their total is not known
        before.

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
    cloud = PointCloud.of(cloud)
    sensor, directions = orientation(cloud, viewpoint, normals, np.arange(len(cloud)))
    size = positive_length(radius, "radius")
    found: dict[str, NDArray[Any]] = _surfsig.field_keypoints(
        cloud.offsets,
        origin=cloud.origin.tolist(),
        radius=size,
        count=whole_number(KEYPOINTS if count is None else count, "count", _MOST),
        spacing=None if spacing is None else positive_length(spacing, "spacing"),
        viewpoint=None if sensor is None else sensor.tolist(),
        directions=directions,
        threads=thread_count(threads),
        progress=progress_callback(progress),
    )
    indices = found.pop("indices").astype(np.int64)
    return FieldSignatures(
        radius=size,
        oriented=sensor is not None or directions is not None,
        points=cloud.points[indices],
        indices=indices,
        phases=found.pop("phases").view(np.complex64).reshape(len(indices), 7, 8),
        status=np.full(len(indices), Status.OK, np.uint8),
        **found,
    )
