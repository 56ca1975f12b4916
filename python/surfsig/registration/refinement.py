"""A pose near the right one, refined by distributions to distributions (GICP, by small_gicp)."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.convert.libraries import library

Array = NDArray[np.float64]

_REACHES = (4.0, 2.0)
"""Voxels between partners, in the rounds."""
_NEIGHBOURS = 20
_MOST_STEPS = 20
_SETTLED = 3e-4, 1e-2
"""Radians, and voxels: a step that is none. What follows takes smaller ones."""


class Refiner:
    """Two clouds, thinned and prepared once.

    Lengths are counted in voxels, which small_gicp's limits suit. One thread: several would add up in an
    order of their own.
    """

    def __init__(self, source: Array, target: Array, voxel: float) -> None:
        small_gicp = library("small_gicp", "small_gicp", "'surfsig[register]'")
        self.voxel, self._align = voxel, small_gicp.align
        self.source, _ = small_gicp.preprocess_points(source / voxel, 1.0, _NEIGHBOURS, 1)
        self.target, self.tree = small_gicp.preprocess_points(target / voxel, 1.0, _NEIGHBOURS, 1)

    @property
    def source_voxels(self) -> int:
        """Number of voxels with points of the source."""
        return int(self.source.size())

    @property
    def target_voxels(self) -> int:
        """Number of voxels with points of the target."""
        return int(self.target.size())

    def refined(self, pose: Array) -> Array:
        """Refine T_target_source, (4, 4)."""
        scaled = pose.copy()
        scaled[:3, 3] /= self.voxel
        for reach in _REACHES:
            found = self._align(
                self.target,
                self.source,
                self.tree,
                init_T_target_source=scaled,
                registration_type="GICP",
                max_correspondence_distance=reach,
                num_threads=1,
                max_iterations=_MOST_STEPS,
                rotation_epsilon=_SETTLED[0],
                translation_epsilon=_SETTLED[1],
            )
            if found.num_inliers == 0:
                return pose
            scaled = np.array(found.T_target_source)
        scaled[:3, 3] *= self.voxel
        return scaled
