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

_BROKEN_AROUND, _BROKEN_BESIDE = 0.25, 0.32
"""The same for the sum of the shares of hidden points and of depth steps, of points all around and of others:
rings, tubes and assemblies of parts have 0.28 to 1.2 and 0.33 to 0.6, real scans up to 0.13 and 0.3."""

_HIDDEN_IN_ROWS = 0.4
"""Share of hidden points up to which points in rows are a scan: a floor seen at a grazing angle has 0.3."""

_ROW_WIDTH, _ROW_SHARE = 1e-5, 0.02
"""Radians between neighbouring elevations of one row, at most (float32 moves them by 1e-7), and the same in
units of the mean distance of elevations: those of points in no rows differ more."""

_ROW_POINTS = 9
"""Points of a row at least: the faces of a box in a grid bring 8 points to the same elevation."""

_IN_ROWS = 0.8
"""Share of the points that are in rows from which on a sensor measured them: 0.84 and more in its frame."""

_UNEVEN_ROWS, _EVEN = 0.25, 1e-4
"""Share of points whose row has more than one distance, and how much these differ relatively: models of
revolution have rows of one distance, too."""

_NEAREST, _ON_SURFACE = 8, 6.0
"""Points nearest to a viewpoint, and their distance in units of that to their neighbours, below which (for
half of them) the viewpoint lies on the surface: it is 1 to 4 there, 14 and more for sensors."""

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

_DENSE = 500
"""Points from which on neighbours are near enough for their depths and distances to mean something."""

_SAMPLE = 4096
"""Points that tell whether a file's viewpoint can be true."""


def hidden_from(direction: Array, places: Array, points: Array, spacing: float) -> NDArray[np.bool_]:
    """Tell which places (m, 3) have points of a scan before them, seen from far away along a unit vector."""
    across = np.linalg.svd(direction[None])[2][1:]
    if not len(places):
        return np.zeros(0, np.bool_)
    of_points = _cells_across(points, across, _CELL * spacing)
    of_places = of_points if places is points else _cells_across(places, across, _CELL * spacing)
    cells = (of_points, of_places)
    low = np.minimum(cells[0].min(axis=0), cells[1].min(axis=0))
    width = int(max(cells[0][:, 1].max(), cells[1][:, 1].max()) - low[1] + 1)
    taken, asked = ((cell - low) @ [width, 1] for cell in cells)
    front = np.full(int(max(taken.max(), asked.max())) + 1, -np.inf)
    np.maximum.at(front, taken, points @ direction)
    return np.asarray(front[asked] > places @ direction + _MARGIN * spacing)


def _cells_across(points: Array, across: Array, edge: float) -> NDArray[np.int64]:
    """Give the squares (n, 2) of an edge that points (n, 3) are in, along two axes (2, 3)."""
    # Column by column: a product with so few columns takes ten times as long.
    x, y, z = points.T
    columns = [np.floor((x * axis[0] + y * axis[1] + z * axis[2]) / edge) for axis in across]
    return np.column_stack(columns).astype(np.int64)


def seen_from(viewpoint: Array, points: Array, spacing: float) -> bool:
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
    """
    rays = points - viewpoint
    distances = np.linalg.norm(rays, axis=1)
    if not len(points) or distances.min() == 0.0 or _is_far(rays, distances):
        return False
    return _hidden_share(rays, distances, spacing) < _HIDDEN and not _is_closed(rays, distances)


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
    if _measured_from_origin(points):
        return cloud
    warnings.warn(
        f"{source}: its viewpoint is (0, 0, 0), the default of many programs, and no sensor can have seen "
        "all points from there: it is taken as unknown; give the viewpoint if it is known",
        stacklevel=3,
    )
    return replace(cloud, viewpoint=None)


def _measured_from_origin(points: Array) -> bool:
    """Tell whether a sensor at the origin may have measured these points.

    Noise and steep surfaces hide more points of true scans than `seen_from` allows. On the other hand, points
    in the rows of a sensor are a scan, even one of an empty room.
    """
    distances = np.linalg.norm(points, axis=1)
    if _is_far(points, distances) or _is_on_surface(points, distances):
        return False
    hidden = _hidden_share(points, distances, point_spacing(points))
    if hidden < _HIDDEN_IN_ROWS and _are_in_rows(points, distances):
        return True
    if hidden >= _MOSTLY_HIDDEN or _is_closed(points, distances):
        return False
    if len(points) < _DENSE:
        return True
    broken = hidden + _step_share(points, distances)
    return broken < (_BROKEN_AROUND if _are_around(points, distances) else _BROKEN_BESIDE)


def _is_far(rays: Array, distances: Array) -> bool:
    spread = float(np.median(np.linalg.norm(rays - np.median(rays, axis=0), axis=1)))
    return float(np.median(distances)) > _FARTHEST * spread


def _is_on_surface(rays: Array, distances: Array) -> bool:
    """Tell whether the viewpoint is as near to points as these are to each other."""
    if len(rays) < _DENSE:
        return False
    nearest = np.argpartition(distances, _NEAREST)[:_NEAREST]
    apart = cKDTree(rays).query(rays[nearest], k=2)[0][:, 1]
    return float(np.median(distances[nearest] / apart)) < _ON_SURFACE


def _are_in_rows(rays: Array, distances: Array) -> bool:
    """Tell whether points share their elevations, as a lidar's do, or their lines of an image."""
    x, y, z = rays.T
    angles = [np.arcsin(np.clip(z / distances, -1.0, 1.0))]
    if (z > 0).all() or (z < 0).all():
        angles += [np.arctan(y / z), np.arctan(x / z)]
    for angle in angles:
        order = np.argsort(angle)
        width = min(_ROW_WIDTH, _ROW_SHARE * float(np.ptp(angle)) / len(rays))
        starts = np.flatnonzero(np.append(True, np.diff(angle[order]) > width))
        lengths = np.diff(np.append(starts, len(rays)))
        far = np.maximum.reduceat(distances[order], starts)
        uneven = far - np.minimum.reduceat(distances[order], starts) > _EVEN * far
        rows = lengths >= _ROW_POINTS
        if lengths[rows].sum() >= _IN_ROWS * len(rays) and lengths[rows & uneven].sum() >= _UNEVEN_ROWS * len(
            rays
        ):
            return True
    return False


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


def _are_around(rays: Array, distances: Array) -> bool:
    return float(np.linalg.norm((rays / distances[:, None]).mean(axis=0))) < _AMONG


def _is_closed(rays: Array, distances: Array) -> bool:
    return len(rays) >= 3 and _are_around(rays, distances) and _step_share(rays, distances) < _STEPS


def _step_share(rays: Array, distances: Array) -> float:
    """Give the share of points that stand before or behind that in the next direction."""
    chosen = np.random.default_rng(0).permutation(len(rays))[:_SAMPLE]
    directions, depths = rays[chosen] / distances[chosen, None], distances[chosen]
    first, second = depths[cKDTree(directions).query(directions, k=2)[1]].T
    steps = np.maximum(first, second) > _DEPTH_STEP * np.minimum(first, second)
    return float(steps.mean())
