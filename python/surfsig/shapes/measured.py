"""What was fitted as a `Surface`: how much of it the points cover, and whether they tell its radius."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.shapes.area import covered_area
from surfsig.shapes.geometry import Array, Placement, covered_arc, in_plane
from surfsig.shapes.surface import CURVE_KINDS, PARAMETERS, ShapeKind, Surface


def measured_surface(
    fitted: Mapping[str, Any], points: Array, origin: Array, members: NDArray[np.intp]
) -> Surface:
    """Describe what the core fitted, and measure how much of it the points cover.

    Parameters
    ----------
    fitted
        The core's values: kind, point, axis, radius, major_radius, half_angle, deviation; and, where the
        points determine them, covariance, across, freedom; and `checked`, whether a radius that they do not
        determine is to be NaN. The point is in the cloud's coordinates.
    points
        The surface's points, (m, 3), less the origin.
    origin
        (3,), the cloud's.
    members
        (m,), the points' numbers in the cloud, ascending.
    """
    kind: ShapeKind = fitted["kind"]
    placement = Placement(
        kind, fitted["axis"], fitted["radius"], fitted["major_radius"], fitted["half_angle"]
    )
    local = points + (origin - fitted["point"])
    distances = placement.distances(local)
    heights = placement.heights(local)
    center = fitted["point"]
    length, width, arc = math.nan, math.nan, covered_arc(placement, local)
    if kind == "plane":
        length, width = in_plane(placement, local)
        center = center + placement.foot(local.mean(axis=0))
    elif kind not in ("sphere", "circle"):
        length = float(np.ptp(heights))
    if kind in ("cylinder", "cone", "line"):
        center = center + 0.5 * float(heights.min() + heights.max()) * placement.axis
    unknowns = len(PARAMETERS[kind])
    covariance = np.asarray(fitted.get("covariance", ()))
    across = np.asarray(fitted.get("across", ()))
    surface = Surface(
        kind=kind,
        point=fitted["point"],
        axis=fitted["axis"],
        radius=fitted["radius"],
        major_radius=fitted["major_radius"],
        half_angle=fitted["half_angle"],
        covariance=covariance if covariance.size else np.full((unknowns, unknowns), math.nan),
        across=across if across.size and kind != "sphere" else np.full((2, 3), math.nan),
        degrees_of_freedom=fitted.get("freedom", math.nan),
        center=center,
        length=length,
        width=width,
        arc=arc,
        area=math.nan if kind in CURVE_KINDS else covered_area(placement, local),
        members=members,
        rms=float(np.sqrt((distances**2).mean())),
        deviation=fitted["deviation"],
        form_error=placement.form_error(local),
        fitted_radius=fitted["radius"],
    )
    if fitted.get("checked", False) and not surface.radius_determined:
        return replace(surface, radius=math.nan)
    return surface
