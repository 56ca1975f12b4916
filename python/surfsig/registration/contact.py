"""Where two surfaces lie on each other, the last steps of a pose, and how sure it is."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

Array = NDArray[np.float64]

_NEIGHBOURS = 20
"""Nearest places of the target that its surface is fitted to."""
_REACH = 3.0
"""Voxels within which the target has a surface at all."""
_INSIDE = 0.6
"""Part of the neighbours' spread within which the fit's middle is: beyond, the place is off a rim."""
_THICK = 0.35
"""Smallest over middle spread of neighbours that lie on a surface (standard deviations)."""
_STRAY = 3.0
"""Standard deviations within which a place lies on the surface."""
_FLOOR = 0.02
"""Voxels: a deviation below it is none."""
_STEPS = 4
_BLOCKS = 12.0
"""Blocks along the overlap: what errs alike within one counts once."""


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
        right = np.einsum("nki,nk->ni", design, z)
        fit = np.linalg.solve(normal_matrix, right[..., None])[..., 0]
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
        return _Heights(height, tilted * steep[:, None], near & inside & thin)


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
        spread = 1.4826 * float(np.median(np.abs(found.height[found.there])))
        on = found.there & (np.abs(found.height) < _STRAY * max(spread, _FLOOR * voxel))
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
    covariance = _covariance(design, heights, places)
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


def _covariance(design: Array, heights: Array, places: Array) -> Array:
    """Take what heights have in common within blocks of neighbours as one error (cluster-robust)."""
    inverse = np.linalg.pinv(design.T @ design, rcond=1e-12, hermitian=True)
    independent = (heights**2).sum() / max(len(heights) - 6, 1) * inverse
    size = float(np.ptp(places, axis=0).max()) / _BLOCKS
    _, block = np.unique(np.floor(places / size).astype(np.int64), axis=0, return_inverse=True)
    gradients = np.zeros((int(block.max()) + 1, 6))
    np.add.at(gradients, block.ravel(), design * heights[:, None])
    count = len(gradients)
    if count <= 12:
        return np.asarray(independent)
    alike = inverse @ (gradients.T @ gradients) @ inverse * count / (count - 6)
    # Never surer than independent errors would make it.
    ratio = max(float(np.trace(alike @ design.T @ design) / np.trace(independent @ design.T @ design)), 1.0)
    return np.asarray(ratio * independent)
