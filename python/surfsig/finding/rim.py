"""Where a model ends: there, the scene's surface must end as well."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from surfsig._surfsig import SurfacePlaces
from surfsig.finding.model import Model
from surfsig.finding.scene import Surroundings
from surfsig.geometry import axes_across, rotate, transform_points

Array = NDArray[np.float64]

_STEP, _CLEAR = 3.0, 1.5
"""Voxels along the surface from a place of the model to a place beside it, and from that to all of the model
at least."""
_DIRECTIONS = 8
"""In which a step is tried."""
_NEAR, _HEIGHT = 1.0, 0.75
"""Voxels from a place beside the model to the scene's next place, and of them over its tangential plane,
within which the scene goes on."""
_FACING = 0.5
"""Cosine to the mean normal of a view of an object, from which on its surface does not end because it was too
steep to be seen."""
_FEWEST = 8
"""Places beside the model without which its rim says nothing."""
_TOO_MUCH, _TOO_MUCH_OF_A_VIEW = 0.4, 0.8
"""Share of the rim where the scene goes on, from which on the model lies in a larger surface, as a box sunk
in a table. Of true poses of a whole model hardly any does, but a neighbour may be flush with it; a view also
ends where something was before it, and at its holes."""


class Rim:
    """Places beside a model, each a step along the surface from a place near its end."""

    def __init__(self, model: Model, places: Array, normals: Array, voxel: float) -> None:
        """Step from places (n, 3) with normals (n, 3), which are some of the model's."""
        turns = 2.0 * np.pi * np.arange(_DIRECTIONS) / _DIRECTIONS
        across, along = axes_across(normals)
        steps = np.cos(turns)[:, None, None] * across + np.sin(turns)[:, None, None] * along
        beside = (places + _STEP * voxel * steps).reshape(-1, 3)
        clear = cKDTree(model.points).query(beside, distance_upper_bound=_CLEAR * voxel)[0] > _CLEAR * voxel
        self._too_much = _TOO_MUCH if model.closed else _TOO_MUCH_OF_A_VIEW
        if not model.closed:
            mean = model.normals.mean(axis=0)
            clear &= np.tile(normals @ mean > _FACING * np.linalg.norm(mean), _DIRECTIONS)
        self._from = np.tile(np.arange(len(places)), _DIRECTIONS)[clear]
        self._places, self._normals = beside[clear], np.tile(normals, (_DIRECTIONS, 1))[clear]
        self._surface = SurfacePlaces(self._places.astype(np.float32), self._normals.astype(np.float32))

    def ends(
        self, pose: Array, touching: NDArray[np.bool_], around: Surroundings, free: NDArray[np.bool_]
    ) -> float:
        """Give 1 where the scene ends with the model in a pose, 0 where it goes on, or between.

        `touching` says which of the model's places (n,) are on the scene's surface: where the model is hidden
        its rim does not count. `free` are the scene's places (m,) that no other instance explains.
        """
        asked = touching[self._from]
        if asked.sum() < _FEWEST:
            return 1.0
        partners = around.index.partners(pose[None], self._surface, _NEAR * around.voxel)[0]
        on = np.flatnonzero(asked & (partners >= 0) & free[partners])
        places = transform_points(pose, self._places[on])
        normals = rotate(pose, self._normals[on])
        heights = np.einsum("ij,ij->i", around.places[partners[on]] - places, normals)
        share = float((np.abs(heights) < _HEIGHT * around.voxel).sum()) / float(asked.sum())
        return max(0.0, 1.0 - share / self._too_much)
