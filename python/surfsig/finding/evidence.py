"""What speaks for a pose of a model: the part that the sensor saw, less what it saw through or missed."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree
from scipy.spatial.transform import Rotation

from surfsig._surfsig import SurfacePlaces
from surfsig.finding.model import Model
from surfsig.finding.scene import Surroundings

Array = NDArray[np.float64]

_STEEP = 0.42
"""Cosine to the line of sight from which on a surface is measured, as the core's depth images have it."""
_ALIKE = 0.8
"""Cosine between normals that face alike."""
_REACH = 1.2
"""Model's extents around its middle that are looked at."""
_SIGHTS = 100
"""Directions from which it is tried how much of a model can be seen at once."""
_CONTRADICTED, _MISSING = 5.0, 1.0
"""What a place that the sensor saw through, and one where it saw nothing, count in confirmed ones: of true
poses hardly any place is seen through, but sensors miss dark and shiny ones."""
_ROUND = 0.1
"""Spread of confirmed normals (1 less the largest eigenvalue of their second moments) from which on they are
more than a plane, which anything has."""
_BESIDE = (1.5, 4.0)
"""Voxels from a whole model within which the scene must not go on where the model ends: there, the model lies
in a larger surface, as a box sunk in a table."""
_CONTINUED = 4.0
"""What a place of the scene that does counts, in confirmed ones."""
_STEPS = 12
_REACHES = (4.0, 1.5)
"""Voxels between partners, in the first and the last step of settling."""
_ALL = 1 << 40


@dataclass(frozen=True, eq=False)
class Evidence:
    """What a scene says about a pose."""

    score: float
    """Confirmed less wrong places, over the most of the model that can be seen at once."""
    visible: float
    """Share of what faces the sensor that is seen, 0 to 1; of all where its place is not known."""


class Witness:
    """A model before the surface of a scene, seen from a place (3,), or from nobody knows where."""

    def __init__(self, model: Model, around: Surroundings, eye: Array | None, most: int | None) -> None:
        """Take at most so many of the model's places."""
        chosen = np.random.default_rng(0).permutation(len(model.places))[:most]
        self.places, self.normals = model.places[chosen], model.normals[chosen]
        self.surface = SurfacePlaces(self.places.astype(np.float32), self.normals.astype(np.float32))
        self._rim = cKDTree(model.places) if model.closed and most is None else None
        self._normals = model.normals
        self.around, self.eye, self.reach = around, eye, _REACH * model.extent
        sights = np.random.default_rng(0).normal(size=(_SIGHTS, 3))
        sights /= np.linalg.norm(sights, axis=1, keepdims=True)
        self.most_seen = float((self.normals @ sights.T > _STEEP).mean(axis=0).max())
        side = max(model.voxel, model.spacing) / around.voxel
        self._scene_places = len(model.places) * side**2
        """How many of the scene's would cover the model."""

    def settled(self, pose: Array) -> Array:
        """Fit a pose to the scene's surface near it, by point to plane; free directions are left alone."""
        for reach in np.geomspace(*_REACHES, _STEPS):
            near, partners = self._partners(pose, reach)
            places = self.places[near] @ pose[:3, :3].T + pose[:3, 3]
            foot, normals = self.around.places[partners], self.around.normals[partners]
            if len(places) < 12:
                break
            heights = np.einsum("ij,ij->i", foot - places, normals)
            middle = places.mean(axis=0)
            unit = float(np.sqrt(((places - middle) ** 2).sum(axis=1).mean())) or 1.0
            design = np.hstack([np.cross((places - middle) / unit, normals), normals])
            change = np.linalg.lstsq(design.T @ design, design.T @ heights, rcond=1e-3)[0]
            motion = np.eye(4)
            motion[:3, :3] = Rotation.from_rotvec(change[:3] / unit).as_matrix()
            motion[:3, 3] = middle - motion[:3, :3] @ middle + change[3:]
            pose = motion @ pose
        return pose

    def judged(self, pose: Array, free: NDArray[np.bool_]) -> Evidence:
        """Weigh a pose; `free` are the scene's places that no other instance explains, (m,)."""
        if self.eye is None:
            _, partners = self._partners(pose, 1.0)
            unexplained = partners[free[partners]]
            seen = len(unexplained) / len(self.places)
            spread = _spread(self.around.normals[unexplained])
            score = (seen - _CONTINUED * self._continued(pose)) / self.most_seen
            return Evidence(_flat(score, spread), min(seen, 1.0))
        facing = self.facing(pose)
        image = self.around.image(pose[:3, 3], self.reach, self.eye, free)
        local = pose.copy()
        local[:3, 3] = 0.0
        confirmed, contradicted, _, missing = (
            float(share) for share in image.judge(local[None], self.surface, _ALL, self.around.voxel)[0]
        )
        _, _, normals = image.correspondences(local, self.surface, _ALL, self.around.voxel)
        wrong = _CONTRADICTED * contradicted + _MISSING * missing + _CONTINUED * self._continued(pose)
        score = (confirmed - wrong) / self.most_seen
        visible = min(confirmed / max(float(facing.mean()), confirmed, 1e-9), 1.0)
        return Evidence(_flat(score, _spread(normals)), visible)

    def facing(self, pose: Array) -> NDArray[np.bool_]:
        """Tell which places face the sensor in a pose; all where its place is not known."""
        if self.eye is None:
            return np.ones(len(self.places), np.bool_)
        ways = self.eye - (self.places @ pose[:3, :3].T + pose[:3, 3])
        along = np.einsum("ij,ij->i", self.normals @ pose[:3, :3].T, ways)
        return np.asarray(along > _STEEP * np.linalg.norm(ways, axis=1))

    def _continued(self, pose: Array) -> float:
        """Give how much of the scene goes on where a whole model ends, as a share of the model's surface."""
        if self._rim is None:
            return 0.0
        near = self.around.tree.query_ball_point(pose[:3, 3], self.reach)
        places = (self.around.places[near] - pose[:3, 3]) @ pose[:3, :3]
        normals = self.around.normals[near] @ pose[:3, :3]
        low, high = (side * self.around.voxel for side in _BESIDE)
        distances, partners = self._rim.query(places, distance_upper_bound=high)
        beside = np.flatnonzero(np.isfinite(distances) & (distances > low))
        partners = partners[beside]
        facing = self._normals[partners]
        heights = np.einsum("ij,ij->i", places[beside] - self._rim.data[partners], facing)
        alike = np.einsum("ij,ij->i", normals[beside], facing) > _ALIKE
        return float((alike & (np.abs(heights) < 0.5 * low)).sum()) / self._scene_places

    def _partners(self, pose: Array, reach: float) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
        """Give places of the model with a partner in the scene that faces alike, and the partners."""
        places, normals = self.places @ pose[:3, :3].T + pose[:3, 3], self.normals @ pose[:3, :3].T
        limit = reach * self.around.voxel
        distances, partners = self.around.tree.query(places, distance_upper_bound=limit)
        near = np.flatnonzero(np.isfinite(distances))
        alike = np.einsum("ij,ij->i", normals[near], self.around.normals[partners[near]]) > _ALIKE
        near = near[alike]
        return near, partners[near]


def _spread(normals: Array) -> float:
    if not len(normals):
        return 0.0
    return 1.0 - float(np.linalg.eigvalsh(normals.T @ normals / len(normals))[-1])


def _flat(score: float, spread: float) -> float:
    """Weigh a score by how much more than a plane there is."""
    return score * min(spread / _ROUND, 1.0) if score > 0.0 else score
