"""Pictures of point clouds: shaded points, coloured by what is known of them.

Needs matplotlib (`pip install surfsig[plot]`).
"""

from __future__ import annotations

from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.colors import symmetric_limit
from surfsig.errors import InvalidInputError

if TYPE_CHECKING:
    from matplotlib.axes import Axes
    from matplotlib.cm import ScalarMappable

MISSING = (0.72, 0.72, 0.72)
"""Grey, for points without a value."""


def view_axes(azimuth: float, elevation: float) -> NDArray[np.float64]:
    """Return the axes of a view from a direction, with z upwards.

    Parameters
    ----------
    azimuth, elevation
        Of the viewer, in degrees about z from x, and above the plane of x and y.

    Returns
    -------
    Right, up and towards the viewer, as rows (3, 3).
    """
    azimuth, elevation = np.radians(azimuth), np.radians(elevation)
    towards = np.array(
        [np.cos(elevation) * np.cos(azimuth), np.cos(elevation) * np.sin(azimuth), np.sin(elevation)]
    )
    right = np.array([-np.sin(azimuth), np.cos(azimuth), 0.0])
    return np.stack([right, np.cross(towards, right), towards])


def draw_points(
    ax: Axes,
    points: ArrayLike,
    values: ArrayLike,
    *,
    normals: ArrayLike | None = None,
    limits: tuple[float, float] | None = None,
    colormap: str = "coolwarm",
    view: ArrayLike | None = None,
    size: float = 1.0,
) -> ScalarMappable:
    """Draw points without perspective, the nearest in front, coloured by a value.

    Parameters
    ----------
    ax
        Where to draw; its frame is taken away and its scale made equal.
    points
        (n, 3); points that are not finite are left out.
    values
        (n,); NaN is drawn grey.
    normals
        (n, 3) unit normals, of either side, to shade by; none by default.
    limits
        Values at the ends of the colour map; by default symmetric about 0, wide enough for 95 % of
        the points.
    colormap
        A name of matplotlib's.
    view
        (3, 3): right, up and towards the viewer as rows, as of `view_axes`; by default from above,
        with x to the right.
    size
        Area of a point, in square typographic points.

    Returns
    -------
    The mapping from values to colours, for a colour bar.

    Raises
    ------
    InvalidInputError
        If the arrays' lengths differ.
    """
    from matplotlib.cm import ScalarMappable
    from matplotlib.colors import Normalize

    xyz, value = np.asarray(points, np.float64), np.asarray(values, np.float64)
    if value.shape != xyz.shape[:1]:
        raise InvalidInputError(f"{xyz.shape[0]} points have {value.shape} values")
    axes = np.eye(3) if view is None else np.asarray(view, np.float64)
    if limits is None:
        end = symmetric_limit(value)
        limits = (-end, end)
    mapping = ScalarMappable(Normalize(*limits), colormap)
    colors = mapping.to_rgba(value)[:, :3]
    colors[~np.isfinite(value)] = MISSING
    if normals is not None:
        # A light at the viewer's left shoulder, the same for both sides of a surface.
        light = axes.T @ np.array([-0.35, 0.45, 0.82])
        lit = np.abs(np.asarray(normals, np.float64) @ (light / np.linalg.norm(light)))
        colors *= (0.45 + 0.55 * np.nan_to_num(lit, nan=0.5))[:, None]
    finite = np.isfinite(xyz).all(axis=1)
    seen = (xyz[finite] - xyz[finite].mean(axis=0)) @ axes.T if finite.any() else xyz[:0]
    order = np.argsort(seen[:, 2], kind="stable")
    ax.scatter(seen[order, 0], seen[order, 1], s=size, c=colors[finite][order], linewidths=0, rasterized=True)
    ax.set_aspect("equal")
    ax.set_axis_off()
    return mapping
