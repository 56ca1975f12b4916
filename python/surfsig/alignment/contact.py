"""Where two surfaces lie on each other, the last steps of a pose, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_array
from scipy.spatial import cKDTree

from surfsig.alignment.blocks import blocks, clustered_covariance
from surfsig.geometry import about, transform_points

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
    """Of the k places that are where the target has a surface."""

    which: NDArray[np.int64]
    """Their numbers, (k,)."""
    height: Array
    normal: Array
    numbers: NDArray[np.int64]
    """The target's places that tell the height, (k, 20)."""
    weights: Array
    """What each adds to the height, per its own height, (k, 20)."""
    noise: Array
    """Variance of these about the surface, (k,)."""


def spread(points: Array, count: int, threads: int | None) -> Array:
    """Choose so many points, spread evenly over a surface however dense its parts are.

    Each by chance (always the same), with a probability of the area around it. Of voxels, one with its upper
    part above the surface would give those points only that noise has lifted there.
    """
    draws = np.random.default_rng(len(points))
    if len(points) > _MOST_DRAWN * count:
        points = points[np.sort(draws.choice(len(points), _MOST_DRAWN * count, replace=False))]
    if len(points) <= count:
        return points
    around = min(_AROUND, len(points))
    distances, _ = cKDTree(points).query(points, k=around, workers=_workers(threads))
    # A key of u^(1 / weight), the largest ones: Efraimidis and Spirakis, Weighted random sampling (2006).
    area = distances[:, -1] ** 2
    area = np.maximum(area, _SMALLEST * area.max()) if area.max() > 0.0 else np.ones(len(points))
    keys = np.log(draws.random(len(points))) / area
    return np.asarray(points[np.sort(np.argpartition(-keys, count - 1)[:count])])


def _workers(threads: int | None) -> int:
    """Give SciPy's word for a number of threads."""
    return -1 if threads is None else threads


class Surface:
    """The target's points, whose surface is a paraboloid through the nearest ones."""

    def __init__(self, points: Array, voxel: float, threads: int | None = 1) -> None:
        self.points, self.tree, self.voxel = points, cKDTree(points), voxel
        self.workers = _workers(threads)

    def heights(self, places: Array) -> _Heights:
        """Measure how high places (n, 3) are above the surface, along its normal there."""
        count = min(_NEIGHBOURS, len(self.points))
        distances, numbers = self.tree.query(places, k=count, workers=self.workers)
        around = self.points[numbers] - places[:, None]
        middle = around.mean(axis=1)
        apart = around - middle[:, None]
        values, axes = np.linalg.eigh(apart.transpose(0, 2, 1) @ apart / count)
        size = np.sqrt(np.maximum(values, 0.0))
        inside = np.linalg.norm(np.einsum("ni,nij->nj", middle, axes[:, :, 1:]), axis=1) < _INSIDE * (
            size[:, 1] + size[:, 2]
        )
        near = distances[:, 0] < _REACH * self.voxel
        thin = size[:, 0] < _THICK * size[:, 1]
        which = np.flatnonzero(near & inside & thin)
        # z = f + d x + e y + (a x^2 + 2 b x y + c y^2) / 2 in axes along the points' spread.
        axes = axes[which][:, :, ::-1]
        scale = np.maximum(size[which, 2], 1e-300)
        x, y, z = np.moveaxis(around[which] @ axes / scale[:, None, None], 2, 0)
        design = np.stack([np.ones_like(x), x, y, 0.5 * x * x, x * y, 0.5 * y * y], axis=2)
        transposed = design.transpose(0, 2, 1)
        # The coefficients, and what f takes from each neighbour's height.
        right = np.zeros((len(which), 6, 2))
        right[:, :, :1] = transposed @ z[:, :, None]
        right[:, 0, 1] = 1.0
        solved = np.linalg.solve(transposed @ design + 1e-9 * np.eye(6), right)
        fitted, share = np.moveaxis(design @ solved, 2, 0)
        slope = solved[:, 1:3, 0]
        steep = 1.0 / np.sqrt(1.0 + (slope**2).sum(axis=1))
        # The place is at 0: the surface is f above it, measured along the normal.
        height = -solved[:, 0, 0] * scale * steep
        tilted = np.einsum("nij,nj->ni", axes, np.column_stack([-slope, np.ones(len(which))]))
        noise = ((z - fitted) ** 2).sum(axis=1) * (scale * steep) ** 2 / max(count - 6, 1)
        return _Heights(
            which, height, tilted * steep[:, None], numbers[which], -share * steep[:, None], noise
        )


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
        moved = transform_points(pose, source)
        found = surface.heights(moved)
        if len(found.which) < 12:
            return None
        strays = 1.4826 * float(np.median(np.abs(found.height)))
        # Where the target's own points stray more than elsewhere, there is an edge.
        smooth = found.noise <= _LARGE * np.median(found.noise)
        on = smooth & (np.abs(found.height) < _STRAY * max(strays, _FLOOR * voxel))
        places, normals, heights = moved[found.which[on]], found.normal[on], found.height[on]
        center = places.mean(axis=0)
        unit = float(np.sqrt(((places - center) ** 2).sum(axis=1).mean())) or 1.0
        design = np.hstack([np.cross((places - center) / unit, normals), normals])
        information = design.T @ design
        if step == _STEPS:
            break
        change = -np.linalg.lstsq(information, design.T @ heights, rcond=1e-8)[0]
        pose = about(center, change[:3] / unit, change[3:]) @ pose
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
    rows = np.repeat(np.arange(len(numbers)), numbers.shape[1])
    of_place = coo_array((weights.ravel(), (numbers.ravel(), rows))).tocsr()
    together = (of_place @ parts.reshape(-1, 18)).reshape(-1, 6)
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
    expected = float(np.trace(independent @ information))
    # Without any noise nothing varies.
    return max(float(np.trace(alike @ information)) / expected, 1.0) if expected > 0.0 else 1.0
