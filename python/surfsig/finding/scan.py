"""Clouds as the core looks for models in them: from where they were seen."""

from __future__ import annotations

from typing import TypeAlias

import numpy as np
from numpy.typing import NDArray

from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud

ScanArgument: TypeAlias = tuple[
    NDArray[np.floating], list[float], list[float] | None, NDArray[np.float32] | None
]
"""Offsets and origin, viewpoint, and vectors to the outer side, which count before it."""


def scan_argument(cloud: PointCloud) -> ScanArgument:
    """Give a cloud of finite points as the core takes it, which tells whether its viewpoint can be true."""
    _, directions = orientation(cloud, None, None, np.arange(len(cloud)))
    viewpoint = cloud.viewpoint
    if viewpoint is None and cloud.viewpoints is not None:
        # Of a sweep the mean.
        viewpoint = cloud.viewpoints[cloud.fields["scan"]].mean(axis=0)
    return cloud.offsets, cloud.origin.tolist(), None if viewpoint is None else viewpoint.tolist(), directions
