"""Clouds in other coordinates, with what they know about themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import rotate, transform_points
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_NORMALS = (("nx", "ny", "nz"), ("normals",), ("normal",), ("normal_x", "normal_y", "normal_z"))
"""Fields that rotate with a cloud."""


def transform_cloud(pose: Array, cloud: PointCloud) -> PointCloud:
    """Take a cloud from the source to the target: its points, viewpoints and normals.

    Offsets stay in float32 where they were, about the transformed origin. The cloud is then in no coordinate
    system that is known.

    Parameters
    ----------
    pose
        T_target_source, (4, 4).
    cloud
        In the source.

    Returns
    -------
    A cloud of its own, with all fields.
    """
    fields = dict(cloud.fields)
    for names in _NORMALS:
        if all(name in fields for name in names):
            columns = [fields[name].reshape(len(cloud), -1) for name in names]
            together = np.hstack(columns)
            if together.shape[1] == 3:
                rotated = rotate(pose, together).astype(together.dtype)
                parts = [rotated] if len(names) == 1 else list(rotated.T)
                fields |= dict(zip(names, parts, strict=True))
    viewpoint, viewpoints = cloud.viewpoint, cloud.viewpoints
    return replace(
        cloud,
        offsets=rotate(pose, cloud.offsets.astype(np.float64)).astype(cloud.offsets.dtype),
        origin=transform_points(pose, cloud.origin),
        viewpoint=None if viewpoint is None else transform_points(pose, viewpoint),
        viewpoints=None if viewpoints is None else transform_points(pose, viewpoints),
        fields=fields,
        coordinate_system=None,
    )


def about_zero(cloud: PointCloud) -> tuple[PointCloud, Array]:
    """Give a cloud about the middle of its finite points, and that middle: all digits are kept.

    Parameters
    ----------
    cloud
        Any; what is not finite is left out.

    Returns
    -------
    The cloud in float64, and the median of its coordinates, (3,).
    """
    finite = cloud.offsets[cloud.finite].astype(np.float64)
    middle = np.median(finite, axis=0) if len(finite) else np.zeros(3)
    shift = cloud.origin + middle
    local = PointCloud(
        finite - middle,
        viewpoint=None if cloud.viewpoint is None else cloud.viewpoint - shift,
        viewpoints=None if cloud.viewpoints is None else cloud.viewpoints - shift,
        fields={name: values[cloud.finite] for name, values in cloud.fields.items()},
    )
    return local, shift
