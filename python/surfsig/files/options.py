"""What a caller may ask of any file: a part of it, and another unit."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.coordinate_system import SAME_UNIT, CoordinateSystem
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud

UNITS = {
    "mm": 0.001, "cm": 0.01, "m": 1.0, "km": 1000.0, "in": 0.0254, "ft": 0.3048, "us-ft": 1200 / 3937,
}  # fmt: skip
"""Metres per unit."""


def metres_per(unit: str) -> float:
    """Look up a unit of length; an `InvalidInputError` names those that there are."""
    if unit not in UNITS:
        raise InvalidInputError(f"unit must be one of {', '.join(UNITS)}, not {unit!r:.40}")
    return UNITS[unit]


LEFT_OUT = ("_", "-")
"""Names that leave a column out."""


def column_names(columns: str | Sequence[str]) -> tuple[str, ...]:
    """Check the names of a file's columns, "x,y,z,intensity" or a sequence, and return them one by one.

    Raises
    ------
    InvalidInputError
        If x, y or z is missing, or a name occurs twice.
    """
    given = columns.split(",") if isinstance(columns, str) else columns
    try:
        names = tuple(str(name).strip() for name in given)
    except TypeError:
        raise InvalidInputError(f'columns must be names such as "x,y,z", not {columns!r:.40}') from None
    # Coordinates are known in any case, and so are twice the same.
    lower = [name.lower() for name in names if name not in LEFT_OUT]
    if not all(lower) or len(set(lower)) < len(lower) or not {"x", "y", "z"} <= set(lower):
        raise InvalidInputError(
            "columns must be a name for each column, x, y, z among them and none twice (_ leaves one out), "
            f"not {','.join(names)[:80]!r}"
        )
    return names


def check_width(columns: Sequence[str], width: int, source: str) -> None:
    """Make sure that each of a file's `width` columns has a name; an `InvalidInputError` says how many."""
    if len(columns) != width:
        raise InvalidInputError(f"{source}: has {width} columns, and 'columns' names {len(columns)}")


def box_array(box: ArrayLike) -> NDArray[np.float64]:
    """Check a box, its lowest and its highest corner, and return it as (2, 3) float64."""
    try:
        corners = np.array(box, dtype=np.float64)
    except (TypeError, ValueError):
        corners = np.empty(0)
    if corners.shape != (2, 3) or np.isnan(corners).any() or (corners[0] > corners[1]).any():
        raise InvalidInputError("box must be two corners (2, 3), the lowest first")
    return corners


def inside(offsets: NDArray[Any], origin: NDArray[np.float64], box: NDArray[np.float64]) -> NDArray[np.bool_]:
    """Tell which points are in a box (both corners belong to it); points that are not finite are in none."""
    chosen = np.ones(len(offsets), np.bool_)
    with np.errstate(invalid="ignore"):
        for axis in range(3):
            values = origin[axis] + offsets[:, axis]
            chosen &= (values >= box[0, axis]) & (values <= box[1, axis])
    return chosen


def cropped(cloud: PointCloud, box: NDArray[np.float64]) -> PointCloud:
    """Keep the points in a box, as `inside` tells them."""
    chosen = inside(cloud.offsets, cloud.origin, box)
    return cloud if chosen.all() else cloud.at(np.flatnonzero(chosen))


def in_metres(cloud: PointCloud, metres: float) -> PointCloud:
    """Multiply coordinates, and the viewpoint, by the metres per unit; in float64, where 1 is none."""
    if metres == 1.0:
        return cloud
    viewpoint, viewpoints = (
        None if place is None else place * metres for place in (cloud.viewpoint, cloud.viewpoints)
    )
    return replace(
        cloud,
        offsets=cloud.offsets.astype(np.float64) * metres,
        origin=cloud.origin * metres,
        viewpoint=viewpoint,
        viewpoints=viewpoints,
        coordinate_system=None,
    )


def check_unit(system: CoordinateSystem | None, unit: str | None, source: str) -> None:
    """Warn where the unit of a file's coordinates is no length, is not the caller's, or is two units.

    Parameters
    ----------
    system
        What the file says.
    unit
        What the caller says, one of `UNITS`; None for nothing.
    source
        The file's name.
    """
    if system is None:
        return
    if system.is_geographic:
        warnings.warn(
            f"{source}: its coordinates are in {system.unit or 'degree'}s, which are no lengths: radius and "
            "curvature have no meaning; project them to a system in metres first",
            stacklevel=3,
        )
    if unit is not None and (
        system.is_geographic or (system.metres_per_unit is not None and unit_of(system) != unit)
    ):
        warnings.warn(
            f"{source}: its numbers were taken for {unit}, but its coordinate system says {system.unit}",
            stacklevel=3,
        )
    two = system.vertical_unit not in (None, system.unit)
    if two and not system.is_geographic and system.unit is not None:
        warnings.warn(
            f"{source}: its x and y are in the unit {system.unit}, its z in the unit "
            f"{system.vertical_unit}: shapes and curvature are distorted; bring them to one unit first",
            stacklevel=3,
        )


def unit_of(system: CoordinateSystem) -> str | None:
    """Give the name in `UNITS` of a system's horizontal unit; None if it has none there."""
    size = system.metres_per_unit
    return next(
        (
            unit
            for unit, metres in UNITS.items()
            if size is not None and abs(size - metres) <= SAME_UNIT * metres
        ),
        None,
    )
