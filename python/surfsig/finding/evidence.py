"""What speaks for a pose of a model: the part that the sensor saw, less what it saw through or missed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from surfsig._surfsig import SurfacePlaces
from surfsig.finding.model import Model
from surfsig.finding.rim import Rim
from surfsig.finding.scene import Surroundings
from surfsig.geometry import rotate, transform_points

Array = NDArray[np.float64]

_STEEP = 0.42
"""Cosine to the line of sight from which on a surface is measured, as the core's depth images have it."""
_REACH = 1.2
"""Model's extents around its middle that are looked at."""
_CELL = 0.5
"""Of this, the size of cells whose poses are judged by one depth image."""
_SIGHTS = 100
"""Directions from which it is tried how much of a model can be seen at once."""
_CONTRADICTED, _MISSING = 5.0, 1.0
"""What a place that the sensor saw through, and one where it saw nothing, count in confirmed ones: of true
poses hardly any place is seen through, but sensors miss dark and shiny ones."""
_FREE_SPACE_UNKNOWN = 0.6
"""What a confirmed place counts where nobody knows what the sensor saw through, and clutter reaches more."""
_ROUND = 0.1
"""Spread of confirmed normals (1 less the largest eigenvalue of their second moments) from which on they are
more than a plane, which anything has."""
_TOUCHING = 1.0
"""Voxels from the scene's next place within which a place of the model lies on the scene."""
_ALIKE = 0.8
"""Cosine between normals from which on they count as alike, as the core has it."""
_BY_CHANCE = (0.5, 0.75)
"""Mean agreement in height and normal, of 1, that another shape reaches where it touches by chance (0.4 to
0.6), and that equal surfaces reach (0.76 to 0.97, on simulated and real scans)."""
_ALL = 1 << 40


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a scene says about a pose."""

    score: float
    """Confirmed less wrong places, over the most of the model that can be seen at once."""
    visible: float
    """Share of what faces the sensor that is seen, 0 to 1; of all where its place is not known."""
    overlap: float
    """Share of the model's surface that lies on the scene's, 0 to 1."""


class Witness:
    """A model before the surface of a scene, seen from a place (3,), or from nobody knows where."""

    def __init__(self, model: Model, around: Surroundings, eye: Array | None, most: int | None) -> None:
        """Take at most so many of the model's places."""
        chosen = np.random.default_rng(0).permutation(len(model.places))[:most]
        self.places, self.normals = model.places[chosen], model.normals[chosen]
        self.surface = SurfacePlaces(self.places.astype(np.float32), self.normals.astype(np.float32))
        self.tree = cKDTree(model.places)
        """All places of the model."""
        self.around, self.eye, self.reach = around, eye, _REACH * model.extent
        self._rim = Rim(model, self.places, self.normals, around.voxel)
        sights = np.random.default_rng(0).normal(size=(_SIGHTS, 3))
        sights /= np.linalg.norm(sights, axis=1, keepdims=True)
        self.most_seen = float((self.normals @ sights.T > _STEEP).mean(axis=0).max())

    def settled(self, poses: Array, reaches: Array, threads: int | None) -> Array:
        """Fit poses (n, 4, 4) to the scene's surface near them, by point to plane; `reaches` in voxels.

        Free directions are left alone.
        """
        steps = (reaches * self.around.voxel).astype(np.float32)
        return self.around.index.settle(np.ascontiguousarray(poses), self.surface, steps, threads)

    def judged(self, poses: Array, free: NDArray[np.bool_]) -> list[Evidence]:
        """Weigh poses (n, 4, 4); `free` are the scene's places that no other instance explains, (m,)."""
        partners = self.around.index.partners(poses, self.surface, _TOUCHING * self.around.voxel)
        touched = (partners >= 0) & free[partners]
        wrong = np.zeros(len(poses))
        if self.eye is None:
            confirmed = touched.mean(axis=1)
            seen = confirmed
        else:
            confirmed, contradicted, missing = self._shares(poses, free)
            wrong = _CONTRADICTED * contradicted + _MISSING * missing
            facing = np.array([self.facing(pose).mean() for pose in poses])
            seen = confirmed / np.maximum(facing, np.maximum(confirmed, 1e-9))
        scores = (confirmed - wrong) / self.most_seen
        if self.eye is None:
            scores *= _FREE_SPACE_UNKNOWN
        for number, (pose, touching) in enumerate(zip(poses, touched, strict=True)):
            if scores[number] <= 0.0:
                continue
            scores[number] *= min(_spread(self.normals[touching]) / _ROUND, 1.0)
            scores[number] *= self._rim.ends(pose, touching, self.around, free)
            scores[number] *= self._fits(pose, touching, partners[number])
        overlaps = (partners >= 0).mean(axis=1)
        return [Evidence(*map(float, row)) for row in zip(scores, seen, overlaps, strict=True)]

    def facing(self, pose: Array) -> NDArray[np.bool_]:
        """Tell which places face the sensor in a pose; all where its place is not known."""
        if self.eye is None:
            return np.ones(len(self.places), np.bool_)
        ways = self.eye - transform_points(pose, self.places)
        along = np.einsum("ij,ij->i", rotate(pose, self.normals), ways)
        return np.asarray(along > _STEEP * np.linalg.norm(ways, axis=1))

    def _fits(self, pose: Array, touching: NDArray[np.bool_], partners: NDArray[np.int64]) -> float:
        """Give 1 where the places that touch the scene lie as close to it as those of the same surface do."""
        on = np.flatnonzero(touching)
        if not len(on):
            return 0.0
        others = self.around.places[partners[on]], self.around.normals[partners[on]]
        ways = others[0] - transform_points(pose, self.places[on])
        heights = np.einsum("ij,ij->i", ways, others[1]) / (_TOUCHING * self.around.voxel)
        cosines = np.einsum("ij,ij->i", rotate(pose, self.normals[on]), others[1])
        alike = np.maximum(1.0 - heights**2, 0.0) * np.maximum((cosines - _ALIKE) / (1.0 - _ALIKE), 0.0)
        low, high = _BY_CHANCE
        return float(np.clip((alike.mean() - low) / (high - low), 0.0, 1.0))

    def _shares(self, poses: Array, free: NDArray[np.bool_]) -> tuple[Array, Array, Array]:
        """Give what of the model is confirmed, contradicted, and missing in each pose, by depth images."""
        assert self.eye is not None
        size = _CELL * self.reach
        cells, which = np.unique(np.round(poses[:, :3, 3] / size), axis=0, return_inverse=True)
        shares = np.empty((len(poses), 4))
        for number, cell in enumerate(cells):
            own = np.flatnonzero(which.ravel() == number)
            middle = size * cell
            # A pose's middle is up to half a cell's diagonal from that of the cell.
            image = self.around.image(middle, self.reach + 0.87 * size, self.eye, free)
            local = poses[own].copy()
            local[:, :3, 3] -= middle
            shares[own] = image.judge(local, self.surface, _ALL, self.around.voxel)
        return shares[:, 0], shares[:, 1], shares[:, 3]


def _spread(normals: Array) -> float:
    if not len(normals):
        return 0.0
    return 1.0 - float(np.linalg.eigvalsh(normals.T @ normals / len(normals))[-1])
