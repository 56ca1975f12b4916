"""What can have been seen from where: whether a cloud's viewpoint can be true."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from surfsig.geometry import axes_across
from surfsig.point_cloud import PointCloud
from surfsig.spacing import point_spacing

Array = NDArray[np.float64]

_HIDDEN = 0.1
"""Share of hidden points from which on nobody saw all from there: noise hides few (0.3 to 9 % on real scans
from one viewpoint), a closed surface half, and an eighth at least of scans from several viewpoints."""

_MOSTLY_HIDDEN = 0.25
"""Share of hidden points from which on a default viewpoint is none: closed surfaces hide a quarter to a half,
the side of one that is seen, evenly sampled to its rim, up to a fifth."""

_FINEST = 1000.0
"""Lines of sight per median distance, at most: they must be few enough to be held."""

_FARTHEST = 1000.0
"""Distance of a viewpoint in units of the points' spread, beyond which it is none: a map's origin."""

_MARGIN, _CELL = 4.0, 1.5
"""Point spacings in front of a point from which on something hides it; between lines of sight."""

_AMONG = 0.6
"""Length of the mean direction to the points below which they are all around; it is 0.5 for half a ball."""

_DEPTH_STEP = 1.3
"""Ratio of the distances in two neighbouring directions from which on one point stands before the other."""

_STEPS = 0.002
"""Share of depth steps between neighbouring directions that every real scan has; a closed surface seen from
within has none, a lidar scan of a room or a street 0.007 to 0.06."""

_SAMPLE = 4096
"""Points that tell whether a file's viewpoint can be true."""


def hidden_from(direction: Array, places: Array, points: Array, spacing: float) -> NDArray[np.bool_]:
    """Tell which places (m, 3) have points of a scan before them, seen from far away along a unit vector."""
    across = np.linalg.svd(direction[None])[2][1:]
    if not len(places):
        return np.zeros(0, np.bool_)
    cells = [np.floor(part @ across.T / (_CELL * spacing)).astype(np.int64) for part in (points, places)]
    low = np.minimum(cells[0].min(axis=0), cells[1].min(axis=0))
    width = int(max(cells[0][:, 1].max(), cells[1][:, 1].max()) - low[1] + 1)
    taken, asked = ((cell - low) @ [width, 1] for cell in cells)
    front = np.full(int(max(taken.max(), asked.max())) + 1, -np.inf)
    np.maximum.at(front, taken, points @ direction)
    return np.asarray(front[asked] > places @ direction + _MARGIN * spacing)


def seen_from(viewpoint: Array, points: Array, spacing: float, most_hidden: float = _HIDDEN) -> bool:
    """Tell whether points (n, 3) can all have been seen from a viewpoint (3,).

    They cannot where many hide others, or from a thousand times as far away as they are wide. Nor does a
    sensor stand amid points that are all around in one closed surface, of which nothing stands before
    anything else: such clouds are models of whole objects. A file's viewpoint often is a default, and a model
    has none.

    Parameters
    ----------
    viewpoint
        In the points' coordinates.
    points
        Finite.
    spacing
        Between neighbouring points.
    most_hidden
        Share of the points that others may hide: noise and steep surfaces do so, too.
    """
    rays = points - viewpoint
    distances = np.linalg.norm(rays, axis=1)
    if not len(points) or distances.min() == 0.0:
        return False
    spread = float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))
    if float(np.median(distances)) > _FARTHEST * spread:
        return False
    return _hidden_share(rays, distances, spacing) < most_hidden and not _is_closed(rays, distances)


def without_false_viewpoint(cloud: PointCloud, source: str) -> PointCloud:
    """Take away a viewpoint at (0, 0, 0), as programs write it who know none, where it cannot be true.

    Parameters
    ----------
    cloud
        As it was read.
    source
        The file's name, for the warning.

    Warns
    -----
    UserWarning
        If the viewpoint is taken away.
    """
    if cloud.viewpoint is None or cloud.viewpoint.any():
        return cloud
    points = cloud.origin + cloud.offsets[:: max(1, len(cloud) // _SAMPLE)].astype(np.float64)
    points = np.unique(points[np.isfinite(points).all(axis=1) & points.any(axis=1)], axis=0)
    if len(points) < 3:
        return cloud
    if seen_from(cloud.viewpoint, points, point_spacing(points), _MOSTLY_HIDDEN):
        return cloud
    warnings.warn(
        f"{source}: its viewpoint is (0, 0, 0), the default of many programs, and no sensor can have seen "
        "all points from there: it is taken as unknown; give the viewpoint if it is known",
        stacklevel=3,
    )
    return replace(cloud, viewpoint=None)


def _hidden_share(rays: Array, distances: Array, spacing: float) -> float:
    # Angles about an axis square to the mean ray, as lengths at the median distance: parallel lines of sight.
    mean = rays.mean(axis=0)
    length = float(np.linalg.norm(mean))
    if length == 0.0:
        # The viewpoint is the very centre of the points: that of a model, not a sensor's.
        return 1.0
    ahead = mean / length
    pole, across = axes_across(ahead)
    middle = float(np.median(distances))
    angles = (
        np.arctan2(rays @ -across, rays @ ahead),
        np.arcsin(np.clip(rays @ pole / distances, -1.0, 1.0)),
    )
    # Of the distance the logarithm, as spacing and noise grow with it.
    depth = middle * np.log(distances / middle)
    spacing = max(spacing, middle / _FINEST)
    sights = np.column_stack([middle * angles[0], middle * angles[1], -depth])
    return float(hidden_from(np.array([0.0, 0.0, 1.0]), sights, sights, spacing).mean())


def _is_closed(rays: Array, distances: Array) -> bool:
    directions = rays / distances[:, None]
    if float(np.linalg.norm(directions.mean(axis=0))) >= _AMONG or len(rays) < 3:
        return False
    chosen = np.random.default_rng(0).permutation(len(rays))[:_SAMPLE]
    _, neighbors = cKDTree(directions[chosen]).query(directions[chosen], k=2)
    first, second = (distances[chosen][neighbors[:, column]] for column in (0, 1))
    steps = np.maximum(first, second) > _DEPTH_STEP * np.minimum(first, second)
    return float(steps.mean()) < _STEPS
