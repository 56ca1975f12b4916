"""Open3D's point clouds, legacy and tensor."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.convert.libraries import library
from surfsig.errors import InvalidInputError
from surfsig.files.colours import ALPHA, CHANNELS, with_colours
from surfsig.files.columns import output_columns
from surfsig.point_cloud import PointCloud

_NORMALS = ("nx", "ny", "nz")


def cloud_of(geometry: Any) -> PointCloud:
    """Make a cloud of an ``open3d.geometry.PointCloud`` or an ``open3d.t.geometry.PointCloud``.

    Raises
    ------
    InvalidInputError
        If it lies on a GPU.
    """
    if not hasattr(geometry, "point"):
        values = {"normals": np.asarray(geometry.normals), "colors": np.asarray(geometry.colors)}
        return PointCloud(
            np.asarray(geometry.points), fields=_fields({n: v for n, v in values.items() if len(v)})
        )
    if geometry.device.get_type().name != "CPU":
        raise InvalidInputError(f"the Open3D cloud lies on {geometry.device}: take cloud.cpu() first")
    attributes = {name: tensor.numpy() for name, tensor in geometry.point.items()}
    points = attributes.pop("positions", np.empty((0, 3), np.float32))
    return PointCloud(points, fields=_fields(attributes))


def point_cloud(cloud: PointCloud, *, tensor: bool) -> Any:
    """Make an Open3D cloud; see `PointCloud.to_open3d`."""
    o3d = library("open3d", "Open3D", "open3d")
    fields = output_columns(cloud, None, ("positions", "normals", "colors"))
    normals = _stack(fields, _NORMALS, "f")
    colours = _stack(fields, CHANNELS, "u")
    if not tensor:
        vectors = o3d.utility.Vector3dVector
        legacy = o3d.geometry.PointCloud(vectors(cloud.points.astype(np.float64, copy=False)))
        if normals is not None:
            legacy.normals = vectors(normals.astype(np.float64))
        if colours is not None:
            legacy.colors = vectors(colours / float(np.iinfo(colours.dtype).max))
        return legacy
    geometry = o3d.t.geometry.PointCloud(_tensor(o3d, cloud.points))
    for name, values in (("normals", normals), ("colors", colours)):
        if values is not None:
            geometry.point[name] = _tensor(o3d, values)
    for name, values in fields.items():
        # Open3D wants a second axis.
        geometry.point[name] = _tensor(o3d, values if values.ndim == 2 else values[:, None])
    return geometry


def _fields(attributes: dict[str, NDArray[Any]]) -> dict[str, NDArray[Any]]:
    fields: dict[str, NDArray[Any]] = {}
    for name, values in attributes.items():
        if values.ndim not in (1, 2):
            warnings.warn(f"left out the attribute '{name}' of the shape {values.shape}", stacklevel=4)
        elif name == "normals":
            fields.update(zip(_NORMALS, values.T, strict=True))
        elif name == "colors":
            fields.update(zip((*CHANNELS, ALPHA), values.T.copy(), strict=False))
        else:
            fields[name] = values[:, 0] if values.ndim == 2 and values.shape[1] == 1 else values
    return with_colours(fields)


def _stack(fields: dict[str, NDArray[Any]], names: tuple[str, str, str], kind: str) -> NDArray[Any] | None:
    """Take three fields out and give them as (n, 3); None, and nothing taken, where they are not there."""
    parts = [fields[name] for name in names if name in fields]
    if len(parts) < 3 or any(part.ndim != 1 or part.dtype.kind != kind for part in parts):
        return None
    if kind == "u" and {part.dtype for part in parts} not in ({np.dtype(np.uint8)}, {np.dtype(np.uint16)}):
        return None
    for name in names:
        del fields[name]
    return np.column_stack(parts)


def _tensor(o3d: Any, values: NDArray[Any]) -> Any:
    # Open3D knows no other widths of float, and writes into memory that is not to be written to.
    if values.dtype.kind == "f" and values.dtype.itemsize not in (4, 8):
        values = values.astype(np.float32 if values.dtype.itemsize < 4 else np.float64)
    return o3d.core.Tensor.from_numpy(np.require(values, requirements=["C", "W"]))
