"""Where two surfaces lie on each other, the last steps of a pose, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surfsig.registration.blocks import blocks, clustered_covariance

Array = NDArray[np.float64]

_NEIGHBOURS = 20
"""Nearest places of the target that its surface is fitted to."""
_REACH = 3.0
"""Voxels within which the target has a surface at all."""
_INSIDE = 0.6
"""Part of the neighbours' spread within which the fit's middle is: beyond, the place is off a rim."""
_THICK = 0.35
"""Smallest over middle spread of neighbours that lie on a surface (standard deviations)."""
_STRAY = 4.0
"""Standard deviations within which a place lies on the surface."""
_FLOOR = 0.02
"""Voxels: a deviation below it is none."""
_STEPS = 6
_MOST_DRAWN = 4
"""Points in units of those that are wanted that are looked at."""
_SMALLEST = 1e-9
"""Of the largest area, what a point stands for at least."""
_AROUND = 10
"""Nearest points that tell the area around one."""
_LARGE = 4.0
"""Medians of the variance about the surface beyond which it is more than noise."""


@dataclass(frozen=True, eq=False)
class Contact:
    """The source's places that meet the target's surface, after the pose was fitted to them."""

    pose: Array
    """T_target_source."""
    covariance: Array
    """(6, 6), rotation and translation about `center`."""
    center: Array
    places: Array
    """(m, 3), in the target."""
    normals: Array
    overlap: float
    """Share of the source's places."""
    rms: float


@dataclass(frozen=True, eq=False)
class _Heights:
    height: Array
    normal: Array
    there: NDArray[np.bool_]
    """Where the target has a surface."""
    numbers: NDArray[np.int64]
    """The target's places that tell it, (n, k)."""
    weights: Array
    """What each adds to the height, per its own height, (n, k)."""
    noise: Array
    """Variance of these about the surface, (n,)."""


def spread(points: Array, count: int) -> Array:
    """Choose so many points, spread evenly over a surface however dense its parts are.

    Each by chance (always the same), with a probability of the area around it. Of voxels, one with its upper
    part above the surface would give those points only that noise has lifted there.
    """
    draws = np.random.default_rng(len(points))
    if len(points) > _MOST_DRAWN * count:
        points = points[np.sort(draws.choice(len(points), _MOST_DRAWN * count, replace=False))]
    if len(points) <= count:
        return points
    distances, _ = cKDTree(points).query(points, k=min(_AROUND, len(points)))
    # A key of u^(1 / weight), the largest ones: Efraimidis and Spirakis, Weighted random sampling (2006).
    area = distances[:, -1] ** 2
    area = np.maximum(area, _SMALLEST * area.max()) if area.max() > 0.0 else np.ones(len(points))
    keys = np.log(draws.random(len(points))) / area
    return np.asarray(points[np.sort(np.argpartition(-keys, count - 1)[:count])])


class Surface:
    """The target's points, whose surface is a paraboloid through the nearest ones."""

    def __init__(self, points: Array, voxel: float) -> None:
        self.points, self.tree, self.voxel = points, cKDTree(points), voxel

    def heights(self, places: Array) -> _Heights:
        """Measure how high places (n, 3) are above the surface, along its normal there."""
        count = min(_NEIGHBOURS, len(self.points))
        distances, numbers = self.tree.query(places, k=count)
        around = self.points[numbers] - places[:, None]
        middle = around.mean(axis=1)
        spread = around - middle[:, None]
        values, axes = np.linalg.eigh(np.einsum("nki,nkj->nij", spread, spread) / count)
        size = np.sqrt(np.maximum(values, 0.0))
        # z = f + d x + e y + (a x^2 + 2 b x y + c y^2) / 2 in axes along the points' spread.
        local = np.einsum("nki,nij->nkj", around, axes[:, :, ::-1])
        scale = np.maximum(size[:, 2], 1e-300)[:, None]
        x, y, z = (local[..., axis] / scale for axis in range(3))
        design = np.stack([np.ones_like(x), x, y, 0.5 * x * x, x * y, 0.5 * y * y], axis=2)
        normal_matrix = np.einsum("nki,nkj->nij", design, design) + 1e-9 * np.eye(6)
        share = np.linalg.solve(normal_matrix, design.transpose(0, 2, 1))
        fit = np.einsum("nik,nk->ni", share, z)
        left = z - np.einsum("nki,ni->nk", design, fit)
        slope = fit[:, 1:3]
        steep = 1.0 / np.sqrt(1.0 + (slope**2).sum(axis=1))
        # The place is at 0: the surface is f above it, measured along the normal.
        height = -fit[:, 0] * scale[:, 0] * steep
        tilted = np.einsum("nij,nj->ni", axes[:, :, ::-1], np.column_stack([-slope, np.ones(len(places))]))
        inside = np.linalg.norm(np.einsum("ni,nij->nj", middle, axes[:, :, 1:]), axis=1) < _INSIDE * (
            size[:, 1] + size[:, 2]
        )
        near = distances[:, 0] < _REACH * self.voxel
        thin = size[:, 0] < _THICK * size[:, 1]
        noise = (left**2).sum(axis=1) * (scale[:, 0] * steep) ** 2 / max(count - 6, 1)
        weights = -share[:, 0] * steep[:, None]
        return _Heights(height, tilted * steep[:, None], near & inside & thin, numbers, weights, noise)


def contact(source: Array, surface: Surface, pose: Array, voxel: float) -> Contact | None:
    """Fit the last steps of a pose by point to surface, and say how sure it is; None where nothing touches.

    Parameters
    ----------
    source
        Places, (n, 3), evenly spread.
    surface
        The target's.
    pose
        T_target_source, (4, 4), near the right one.
    voxel
        Between the places.
    """
    for step in range(_STEPS + 1):
        moved = source @ pose[:3, :3].T + pose[:3, 3]
        found = surface.heights(moved)
        if found.there.sum() < 12:
            return None
        strays = 1.4826 * float(np.median(np.abs(found.height[found.there])))
        # Where the target's own points stray more than elsewhere, there is an edge.
        smooth = found.noise <= _LARGE * np.median(found.noise[found.there])
        on = found.there & smooth & (np.abs(found.height) < _STRAY * max(strays, _FLOOR * voxel))
        places, normals, heights = moved[on], found.normal[on], found.height[on]
        center = places.mean(axis=0)
        unit = float(np.sqrt(((places - center) ** 2).sum(axis=1).mean())) or 1.0
        design = np.hstack([np.cross((places - center) / unit, normals), normals])
        information = design.T @ design
        if step == _STEPS:
            break
        change = -np.linalg.lstsq(information, design.T @ heights, rcond=1e-8)[0]
        motion = np.eye(4)
        motion[:3, :3] = Rotation.from_rotvec(change[:3] / unit).as_matrix()
        motion[:3, 3] = center - motion[:3, :3] @ center + change[3:]
        pose = motion @ pose
    independent = _independent(design, heights, found, on)
    covariance = independent * _alike(design, heights, places, independent)
    # The turns were counted in ways of the places.
    scale = np.diag([1.0 / unit] * 3 + [1.0] * 3)
    return Contact(
        pose,
        scale @ covariance @ scale,
        center,
        places,
        normals,
        float(on.sum() / len(source)),
        float(np.sqrt((heights**2).mean())),
    )


def _independent(design: Array, heights: Array, found: _Heights, on: NDArray[np.bool_]) -> Array:
    """Give the covariance of the motion, (6, 6), if the places of both err independently.

    A place of the target has a part in the heights of many of the source's: its error, a vector, is in all of
    them, along the normal of each.
    """
    weights, numbers = found.weights[on], found.numbers[on]
    of_target = float(found.noise[on].mean())
    of_source = max(float((heights**2).mean()) - of_target * float((weights**2).sum(axis=1).mean()), 0.0)
    parts = design[:, None, :] * design[:, 3:, None]
    together = np.zeros((int(numbers.max()) + 1, 18))
    np.add.at(together, numbers.ravel(), (weights[:, :, None] * parts.reshape(-1, 1, 18)).reshape(-1, 18))
    together = together.reshape(-1, 6)
    inverse = np.linalg.pinv(design.T @ design, rcond=1e-12, hermitian=True)
    middle = of_source * design.T @ design + of_target * together.T @ together
    return np.asarray(inverse @ middle @ inverse)


def _alike(design: Array, heights: Array, places: Array, independent: Array) -> float:
    """Say how much more the sums over blocks of neighbours vary than independent errors', 1 at least."""
    block = blocks(places)
    if block is None:
        return 1.0
    information = design.T @ design
    alike = clustered_covariance(design, heights, block)
    return max(float(np.trace(alike @ information) / np.trace(independent @ information)), 1.0)
