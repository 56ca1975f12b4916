"""Scans as the core looks for models in them: from where they can really have been seen."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud
from surfsig.spacing import point_spacing
from surfsig.visibility import seen_from

Array = NDArray[np.float64]
ScanArgument: TypeAlias = tuple[
    NDArray[np.floating], list[float], list[float] | None, NDArray[np.float32] | None
]
"""Offsets and origin, viewpoint, and in place of that vectors to the sensor's side."""


@dataclass(frozen=True, eq=False)
class Scan:
    """A cloud of finite points, and what is known of its sensor."""

    cloud: PointCloud
    spacing: float
    """Between its points."""
    viewpoint: Array | None
    """From where all points can have been seen, (3,); None where nobody knows."""
    directions: NDArray[np.float32] | None
    """Vectors (n, 3) to the outer side, where the cloud has normals or several viewpoints."""

    @classmethod
    def of_model(cls, cloud: PointCloud) -> Scan:
        """Take a model: its viewpoint counts where all of it can have been seen from there."""
        return cls._of(cloud.at(np.flatnonzero(cloud.finite)), is_in_sensor_axes=False)

    @classmethod
    def of_scene(cls, cloud: PointCloud) -> Scan:
        """Take a scene of finite points: most sensors are at the origin of their own coordinates."""
        return cls._of(cloud, is_in_sensor_axes=True)

    @classmethod
    def _of(cls, cloud: PointCloud, *, is_in_sensor_axes: bool) -> Scan:
        points = np.ascontiguousarray(cloud.points, np.float64)
        spacing = point_spacing(points)
        _, directions = orientation(cloud, None, None, np.arange(len(cloud)))
        viewpoint: Array | None = None
        if cloud.viewpoint is not None:
            viewpoint = cloud.viewpoint
        elif cloud.viewpoints is not None:
            # Of a sweep the mean.
            viewpoint = cloud.viewpoints[cloud.fields["scan"]].mean(axis=0)
        elif is_in_sensor_axes:
            viewpoint = np.zeros(3)
        if viewpoint is not None and not seen_from(viewpoint, points, spacing):
            viewpoint = None
        return cls(cloud, spacing, viewpoint, directions)


def scan_argument(scan: Scan) -> ScanArgument:
    """Give a scan as the core takes it."""
    viewpoint = scan.viewpoint if scan.directions is None else None
    return (
        scan.cloud.offsets,
        scan.cloud.origin.tolist(),
        None if viewpoint is None else viewpoint.tolist(),
        scan.directions,
    )
