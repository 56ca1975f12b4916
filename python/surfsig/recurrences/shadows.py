"""From where a scan was seen, told by the shadows on what carries its pieces.

What a sensor measured was seen from its place, and what it missed of a support was hidden from there. A
triangulation scanner needs two free lines of sight, the laser's and the camera's; files know one place.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace

import numpy as np
import scipy
from numpy.typing import NDArray

from surfsig.visibility import hidden_from

Array = NDArray[np.float64]

_STEP, _STEEPEST = 10.0, 60.0
"""Degrees between the first directions that are tried, and from the support's normal or the known place."""
_REFINED = (5.0, 2.5)
"""Degrees of the later steps."""
_LINK = 2.0
"""Point spacings to the next point from which on nothing was measured."""
_AGAINST = 5.0
"""What the share of hidden points counts against the share of explained shadows: no point is hidden."""
_EXPLAINED = 0.3
"""Share of the shadows less what counts against, from which on a direction is believed."""
_FEWEST = 50
"""Places in shadows that say something."""


@dataclass(frozen=True, eq=False)
class Region:
    """What is around a piece."""

    piece: NDArray[np.int64]
    """The numbers of the piece's points in the cloud."""
    points: Array
    """(n, 3), of the scan around it."""
    empty: Array
    """Places on its support where nothing was measured, (m, 3)."""
    normal: Array
    """The support's, to the piece's side."""


def places_without_points(support: Array, spacing: float) -> Array:
    """Give places on a support, between its points (n, 3), where nothing was measured, (m, 3)."""
    if len(support) < _FEWEST:
        return np.empty((0, 3))
    middle = support.mean(axis=0)
    axes = np.linalg.svd(support - middle, full_matrices=False)[2][:2]
    flat = (support - middle) @ axes.T
    x, y = (np.arange(*ends, 2.0 * spacing) for ends in zip(flat.min(axis=0), flat.max(axis=0), strict=True))
    grid = np.stack(np.meshgrid(x, y, indexing="ij"), axis=-1).reshape(-1, 2)
    gap, _ = scipy.spatial.cKDTree(flat).query(grid, distance_upper_bound=_LINK * spacing)
    inside = scipy.spatial.Delaunay(flat[scipy.spatial.ConvexHull(flat).vertices]).find_simplex(grid) >= 0
    return np.asarray(middle + grid[np.isinf(gap) & inside] @ axes)


def second_viewpoint(regions: Sequence[Region], viewpoints: Sequence[Array], spacing: float) -> Array | None:
    """Find from where else points had to be seen to be measured.

    Parameters
    ----------
    regions, viewpoints
        Around several pieces, and where the sensor stood, (3,) each.
    spacing
        Between points.

    Returns
    -------
    The translation (3,) from the sensor's viewpoint to the other; None where there is no sign of one.
    """
    directions = [_towards(viewpoint, region) for viewpoint, region in zip(viewpoints, regions, strict=True)]
    left = [
        replace(region, empty=region.empty[~hidden_from(direction, region.empty, region.points, spacing)])
        for direction, region in zip(directions, regions, strict=True)
    ]
    if sum(len(region.empty) for region in left) < _FEWEST:
        return None
    distance = float(np.linalg.norm(viewpoints[0] - left[0].points.mean(axis=0)))

    def translated(to_sensor: Array) -> list[Array]:
        translation = distance * (to_sensor - directions[0])
        return [
            _towards(viewpoint + translation, region)
            for viewpoint, region in zip(viewpoints, left, strict=True)
        ]

    best, worth = _best_direction(
        directions[0], lambda direction: _worth(translated(direction), left, spacing)
    )
    return distance * (best - directions[0]) if worth >= _EXPLAINED else None


def direction_of_sensor(regions: Sequence[Region], spacing: float) -> Array | None:
    """Find the direction (3,) in which a sensor was far away that shadows around pieces come from.

    None where there are no shadows, or none that one direction explains.
    """
    if sum(len(region.empty) for region in regions) < _FEWEST:
        return None
    best, worth = _best_direction(
        regions[0].normal, lambda direction: _worth([direction] * len(regions), regions, spacing)
    )
    return best if worth >= _EXPLAINED else None


def _worth(directions: Sequence[Array], regions: Sequence[Region], spacing: float) -> float:
    """Give the share of empty places that are hidden, less what points that are hidden count against it."""
    parts = list(zip(directions, regions, strict=True))
    empty = np.concatenate(
        [hidden_from(direction, region.empty, region.points, spacing) for direction, region in parts]
    )
    points = np.concatenate(
        [hidden_from(direction, region.points, region.points, spacing) for direction, region in parts]
    )
    return float(empty.mean() - _AGAINST * points.mean())


def _best_direction(around: Array, worth: Callable[[Array], float]) -> tuple[Array, float]:
    """Search the directions around a unit vector for the one that is worth most."""
    sides = np.linalg.svd(around[None])[2][1:]

    def tilted(angles: Array) -> Array:
        angle = max(float(np.hypot(*angles)), np.finfo(float).tiny)
        radians = np.radians(angle)
        return np.asarray(np.cos(radians) * around + np.sin(radians) * (angles / angle) @ sides)

    steps = np.arange(-_STEEPEST, _STEEPEST + 1.0, _STEP)
    tried = np.stack(np.meshgrid(steps, steps), axis=-1).reshape(-1, 2)
    tried = tried[np.hypot(*tried.T) <= _STEEPEST]
    for step in (*_REFINED, 0.0):
        values = [worth(tilted(angles)) for angles in tried]
        best = int(np.argmax(values))
        around_best = np.stack(np.meshgrid([-step, 0.0, step], [-step, 0.0, step]), axis=-1).reshape(-1, 2)
        found, value = tried[best], float(values[best])
        tried = found + around_best
    return tilted(found), value


def _towards(viewpoint: Array, region: Region) -> Array:
    direction = viewpoint - region.points.mean(axis=0)
    return np.asarray(direction / np.linalg.norm(direction))
