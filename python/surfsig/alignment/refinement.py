"""A pose near the right one, refined by distributions to distributions (GICP, by small_gicp)."""

from __future__ import annotations

from typing import Any

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


def gicp(
    target: Any,
    source: Any,
    tree: Any,
    pose: Array,
    reach: float,
    most_steps: int,
    settled: tuple[float, float],
) -> tuple[Array, int]:
    """Refine a pose by small_gicp; in one thread, as several would add up in an order of their own.

    Parameters
    ----------
    target, source, tree
        Its clouds with covariances, and the target's tree.
    pose
        T_target_source, (4, 4).
    reach
        Between partners, at most.
    most_steps, settled
        When to stop: the number of steps, and radians and a length that are none.

    Returns
    -------
    The pose, and the number of partners.
    """
    found = library("small_gicp", "small_gicp", "'surfsig[register]'").align(
        target,
        source,
        tree,
        init_T_target_source=pose,
        registration_type="GICP",
        max_correspondence_distance=reach,
        num_threads=1,
        max_iterations=most_steps,
        rotation_epsilon=settled[0],
        translation_epsilon=settled[1],
    )
    return np.array(found.T_target_source), int(found.num_inliers)


class Refiner:
    """Two clouds, thinned and prepared once.

    Lengths are counted in voxels, which small_gicp's limits suit.
    """

    def __init__(self, source: Array, target: Array, voxel: float) -> None:
        small_gicp = library("small_gicp", "small_gicp", "'surfsig[register]'")
        self.voxel = voxel
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
            scaled, partners = gicp(self.target, self.source, self.tree, scaled, reach, _MOST_STEPS, _SETTLED)
            if partners == 0:
                return pose
        scaled[:3, 3] *= self.voxel
        return scaled
