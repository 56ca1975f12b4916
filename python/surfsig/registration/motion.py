"""Clouds that are moved, with what they know about themselves."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_NORMALS = (("nx", "ny", "nz"), ("normals",), ("normal",), ("normal_x", "normal_y", "normal_z"))
"""Fields that turn with a cloud."""


def moved(cloud: PointCloud, pose: Array) -> PointCloud:
    """Move a cloud by T_target_source (4, 4): its points, viewpoints and normals.

    Offsets stay in float32 where they were, about the moved origin. The moved cloud is in no coordinate
    system that is known.
    """
    rotation, shift = pose[:3, :3], pose[:3, 3]

    def place(points: NDArray[np.floating]) -> Array:
        return np.asarray(points @ rotation.T + shift)

    fields = dict(cloud.fields)
    for names in _NORMALS:
        if all(name in fields for name in names):
            columns = [fields[name].reshape(len(cloud), -1) for name in names]
            together = np.hstack(columns)
            if together.shape[1] == 3:
                turned = (together @ rotation.T).astype(together.dtype)
                parts = [turned] if len(names) == 1 else list(turned.T)
                fields |= dict(zip(names, parts, strict=True))
    return replace(
        cloud,
        offsets=(cloud.offsets.astype(np.float64) @ rotation.T).astype(cloud.offsets.dtype),
        origin=place(cloud.origin),
        viewpoint=None if cloud.viewpoint is None else place(cloud.viewpoint),
        viewpoints=None if cloud.viewpoints is None else place(cloud.viewpoints),
        fields=fields,
        coordinate_system=None,
    )


def about_zero(cloud: PointCloud) -> tuple[PointCloud, Array]:
    """Give a cloud about the middle of its finite points, and that middle: all digits are kept."""
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


def shifted(vector: Array) -> Array:
    """Give the pose that shifts by a vector."""
    pose = np.eye(4)
    pose[:3, 3] = vector
    return pose
