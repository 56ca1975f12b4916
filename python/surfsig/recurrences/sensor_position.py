"""Where the sensor stood: as the cloud knows it, or as shadows tell; and its second viewpoint."""

from __future__ import annotations

import warnings
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud
from surfsig.recurrences.shadows import Region, direction_of_sensor, second_viewpoint

Array = NDArray[np.float64]

_FAR = 100.0
"""Of the extent of what was looked at, how far away a sensor is taken to be whose place is not known."""


class SensorPosition:
    """Where pieces were seen from; coordinates are those of the cloud's offsets."""

    def __init__(self, cloud: PointCloud, regions: Sequence[Region], spacing: float) -> None:
        """Look at a cloud, and at the regions around some of its pieces.

        Raises
        ------
        InvalidInputError
            If the cloud does not know its viewpoint, and there are no shadows that tell it.
        """
        self._cloud = cloud
        self.viewpoint: Array | None = None
        """For all pieces, (3,); None where the cloud has a viewpoint for each scan."""
        if cloud.viewpoints is None:
            known = cloud.viewpoint
            self.viewpoint = _guessed(regions, spacing) if known is None else np.asarray(known - cloud.origin)
        viewpoints = [self.viewpoint_of(region.piece) for region in regions]
        self.to_second = second_viewpoint(regions, viewpoints, spacing)
        """The translation (3,) to a second viewpoint, as of a camera beside a laser, or None."""

    def viewpoint_of(self, piece: NDArray[np.int64]) -> Array:
        """Give where the piece with these points was seen from: in a sweep, the mean of their viewpoints."""
        if self.viewpoint is not None:
            return self.viewpoint
        assert self._cloud.viewpoints is not None
        scans = self._cloud.fields["scan"][piece]
        return np.asarray(self._cloud.viewpoints[scans].mean(axis=0) - self._cloud.origin)


def _guessed(regions: Sequence[Region], spacing: float) -> Array:
    direction = direction_of_sensor(regions, spacing)
    if direction is None:
        raise InvalidInputError(
            "recurrences need to know where the sensor stood, and no shadows tell: set the cloud's viewpoint"
        )
    warnings.warn(
        "the cloud does not know its viewpoint: the sensor is taken to be far away, where shadows point to",
        stacklevel=5,
    )
    middles = np.array([region.points.mean(axis=0) for region in regions])
    extent = float(np.linalg.norm(np.ptp(np.concatenate([region.points for region in regions]), axis=0)))
    return np.asarray(middles.mean(axis=0) + _FAR * extent * direction)
