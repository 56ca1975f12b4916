"""From points to curvature: `extract`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import (
    MOST_NEIGHBORS,
    positive_length,
    query_places,
    thread_count,
    whole_number,
)
from surfsig.defaults import AXES, FIT, Axes, Fit
from surfsig.errors import InvalidInputError
from surfsig.extraction import Extraction
from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud


def extract(
    cloud: PointCloud | ArrayLike,
    radius: float | None = None,
    *,
    neighbors: int | None = None,
    axes: Axes = AXES,
    fit: Fit = FIT,
    at: ArrayLike | None = None,
    voxel: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Extraction:
    """Extract curvature from the points around each place: eq. (5), and from it k1, k2, K and H.

    Parameters
    ----------
    cloud
        A `PointCloud`, an array (n, 3) of numbers, or any other that `PointCloud.of` takes (Open3D, pandas,
        ...). Points that are not finite belong to no ball.
    radius
        Radius of the ball around each place, in the cloud's own unit; half the side D of the paper's
        patch. Finite and above 0. May be left out where `neighbors` is given.
    neighbors
        That many nearest points, the place itself included where it is a point of the cloud; together
        with `radius` at most that many of the points within it (a hybrid search).
    axes
        "surface": the paraboloid's height runs along its own normal, and the result turns with the
        object. "sensor": along z, as the paper fits; z runs away from the sensor.
    fit
        "paraboloid": eq. (5), with the smallest spread, and a bias where the ball is not small against the
        radius of curvature (13 % on a sphere of 1.5 balls). "quadric": a general quadric with Taubin's
        normalisation, unbiased on spheres, cylinders, cones and ellipsoids of any size, wherever it stands
        out of the noise (a rise of some 15 noise deviations within the ball, and no patch that is
        one-sided); the paraboloid elsewhere. "auto": for each place what errs less. `Extraction.fit_used`
        says which; only "paraboloid" in the sensor's axes.
    at
        Where: numbers of points (m,), or places of their own (m, 3); every point by default.
    voxel
        In place of `at`: one point of each voxel of this size, the one nearest to the mean of the
        voxel's points.
    viewpoint
        Where the sensor stood, (3,), in the cloud's coordinates. It orients the normals, and with them
        the sign of curvature. By default, in this order: `normals`, the cloud's own normals (fields
        ``nx``, ``ny``, ``nz`` or ``normals``), its viewpoint, or its scans' viewpoints.
    normals
        Normals that somebody knows, one of each point of the cloud, (n, 3), of any length; only their
        side counts. Places that are no points of the cloud do not take part.
    robust
        Leave out points farther from the fitted surface than three standard deviations of the others, and
        fit again, until the choice stands; `count` is then the number of points that stay.
    threads
        Number of threads; all cores by default. The result is the same, bit for bit.
    progress
        Called with the number of places done and their total, some twenty times a second.

    Returns
    -------
    Extraction
        One struct of arrays, in the order of the places.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    """
    cloud = PointCloud.of(cloud)
    if radius is None and neighbors is None:
        raise InvalidInputError("give a radius, or neighbors, or both")
    size = None if radius is None else positive_length(radius, "radius")
    most = None if neighbors is None else whole_number(neighbors, "neighbors", MOST_NEIGHBORS)
    if axes not in ("surface", "sensor"):
        raise InvalidInputError(f"axes must be 'surface' or 'sensor', not {axes!r}")
    if fit not in ("paraboloid", "quadric", "auto"):
        raise InvalidInputError(f"fit must be 'paraboloid', 'quadric' or 'auto', not {fit!r}")
    if fit != "paraboloid" and axes == "sensor":
        raise InvalidInputError("only fit='paraboloid' is fitted in the sensor's axes")
    if at is not None and voxel is not None:
        raise InvalidInputError("at and voxel exclude each other")
    origin: Sequence[float] = cloud.origin.tolist()
    indices: NDArray[np.int64] | None
    query: NDArray[np.uint32] | NDArray[np.float64] | None
    if voxel is not None:
        query = _surfsig.voxel_representatives(
            cloud.offsets, origin=origin, voxel=positive_length(voxel, "voxel")
        )
        indices, points = query.astype(np.int64), cloud.points[query]
    elif at is None:
        query, points = None, cloud.points
        indices = np.arange(len(cloud))
    else:
        query, indices = query_places(at, len(cloud))
        points = query if indices is None else cloud.points[indices]
    sensor, directions = orientation(cloud, viewpoint, normals, indices)
    arrays: dict[str, Any] = _surfsig.extract(
        cloud.offsets,
        origin=origin,
        radius=size,
        axes=axes,
        fit=fit,
        neighbors=most,
        at=query,
        viewpoint=None if sensor is None else sensor.tolist(),
        directions=directions,
        robust=robust,
        threads=thread_count(threads),
        progress=progress,
    )
    return Extraction(
        radius=arrays.pop("radius", size),
        **arrays,
        axes=axes,
        oriented=sensor is not None or directions is not None,
        points=points,
        indices=indices,
    )
