"""Coordinates that are stored too coarsely for what is computed from them, as float32 at UTM."""

from __future__ import annotations

import math
import warnings

from surfsig import _surfsig
from surfsig.point_cloud import PointCloud
from surfsig.units import size_of


def number_step(cloud: PointCloud) -> float:
    """Give the largest distance between neighbouring float32 numbers among a cloud's coordinates.

    0 where the coordinates are finer than float32. They may be float32 numbers that are held as float64.
    """
    return _surfsig.coordinate_steps(cloud.offsets, origin=cloud.origin.tolist())[0]


def warn_if_too_coarse(cloud: PointCloud, length: float, what: str, stacklevel: int = 3) -> None:
    """Warn where float32 coordinates have steps that are too large for a length.

    Other steps may be a raster's columns, or a scanner's lines, and are not warned of.

    Parameters
    ----------
    cloud
        Whose coordinates they are.
    length
        Over which a surface is looked at, in the cloud's unit.
    what
        Which cloud's length that is, in the message: "source: patches".
    stacklevel
        Of the warning.
    """
    # Points that are all at one place have no patches.
    if length > 0 and number_step(cloud) > _surfsig.COARSEST_STEP * length:
        told = f"{step_text(cloud)}, too coarse for {what} of {length:.3g}"
        warnings.warn(told, stacklevel=stacklevel)


def warn_if_surface_is_lost(cloud: PointCloud, stacklevel: int = 3) -> None:
    """Warn where float32 coordinates have steps larger than points of a surface are apart.

    The distance between points is estimated by their number and extent, as of a surface: 2 s / sqrt(n), with
    s the median distance of the points from their median.
    """
    step = number_step(cloud)
    size = size_of(cloud) if step > 0.0 else 0.0
    if size > 0.0 and step > 2.0 * size / math.sqrt(len(cloud)):
        told = f"{step_text(cloud)}, larger than the distance between points: the surface is lost in them"
        warnings.warn(told, stacklevel=stacklevel)


def step_text(cloud: PointCloud) -> str:
    """Say in which steps a cloud's coordinates come, and why."""
    number, lattice = _surfsig.coordinate_steps(cloud.offsets, origin=cloud.origin.tolist())
    if number > lattice:
        return f"coordinates come in steps of {number:.3g} (float32 numbers at coordinates as large as these)"
    return f"coordinates come in steps of {max(number, lattice):.3g}"
