"""Surfaces that are made and not fitted, for the tests of what is computed from them."""

import math
from typing import Any

import numpy as np
from surface_points import Array

from surfsig import Surface
from surfsig.geometry import axes_across
from surfsig.shapes.surface import PARAMETERS, Kind

NAN3 = np.full(3, math.nan)


def made(kind: Kind, point: Any, axis: Any = NAN3, radius: float = math.nan, **values: Any) -> Surface:
    """Give a surface of known place, with errors of 0.001 in each parameter."""
    direction = np.asarray(axis, np.float64) / np.linalg.norm(axis)
    position = np.asarray(point, np.float64)
    across = np.full((2, 3), math.nan)
    if kind != "sphere":
        across = np.stack(axes_across(direction))
    given: dict[str, Any] = {
        "kind": kind,
        "point": position,
        "axis": direction,
        "radius": radius,
        "major_radius": math.nan,
        "half_angle": math.nan,
        "covariance": 1e-6 * np.eye(len(PARAMETERS[kind])),
        "across": across,
        "degrees_of_freedom": 20.0,
        "center": position,
        "length": 2.0,
        "width": 1.0,
        "arc": 2 * math.pi,
        "area": 1.0,
        "members": np.arange(0),
        "rms": 0.001,
        "deviation": 0.001,
        "form_error": 0.004,
        "fitted_radius": radius,
    }
    return Surface(**{**given, **values})


def moved(surface: Surface, turn: Array, offset: Array) -> Surface:
    """Rotate a surface and translate it."""
    names = ("point", "center")
    values = {**vars(surface), **{name: turn @ getattr(surface, name) + offset for name in names}}
    values |= {"axis": turn @ surface.axis, "across": surface.across @ turn.T}
    return Surface(**values)
