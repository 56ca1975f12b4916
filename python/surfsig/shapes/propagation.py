"""Standard errors of what is computed from fitted surfaces: their covariances, propagated to first order."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from surfsig.shapes.geometry import Array

if TYPE_CHECKING:
    from surfsig.shapes.surface import Surface

_STEP = 1e-5
"""Step of the central differences, in radians and in lengths of the scene: the third derivative's part is
then some 1e-10 of a derivative, and rounding some 1e-11."""


@dataclass(frozen=True, eq=False)
class Located:
    """A surface in coordinates about a common origin, its parameters changed by a little."""

    kind: str
    point: Array
    """(3,), less the origin."""
    axis: Array
    """Unit vector (3,); NaN for a sphere."""
    radius: float
    major_radius: float


@dataclass(frozen=True, eq=False)
class Propagated:
    """A vector that was computed from surfaces, and what each surface's errors add to its covariance."""

    value: Array
    """(k,)."""
    covariances: list[Array]
    """(k, k) for each surface; the surfaces' errors are independent of each other."""
    degrees_of_freedom: list[float]
    """Of each surface's standard errors."""

    def std_along(self, direction: Array) -> float:
        """Give the standard error of the vector's component along a direction (k,); NaN where one is."""
        return float(np.sqrt(np.maximum(sum(self._variances(direction)), 0.0)))

    def freedom_along(self, direction: Array) -> float:
        """Give the degrees of freedom of that standard error (Welch and Satterthwaite)."""
        variances = self._variances(direction)
        total = sum(variances)
        if not total > 0.0:
            return math.nan
        parts = zip(variances, self.degrees_of_freedom, strict=True)
        return total**2 / sum(variance**2 / freedom for variance, freedom in parts if variance > 0.0)

    def direction(self, columns: slice, smallest: float) -> Array:
        """Give the unit vector (k,) of some of the values, 0 elsewhere.

        Where they are as good as 0 it is the direction of their largest standard error: their length is then
        at most as sure as that.
        """
        result = np.zeros_like(self.value)
        part = self.value[columns]
        length = float(np.linalg.norm(part))
        if length > smallest:
            result[columns] = part / length
            return result
        covariance = np.sum(self.covariances, axis=0)[columns, columns]
        known = np.isfinite(covariance).all()
        result[columns] = np.linalg.eigh(covariance)[1][:, -1] if known else np.eye(len(part))[0]
        return result

    def _variances(self, direction: Array) -> list[float]:
        return [float(direction @ covariance @ direction) for covariance in self.covariances]


def propagated(
    surfaces: Sequence[Surface], function: Callable[[Sequence[Located]], Array], origin: Array
) -> Propagated:
    """Compute a vector from surfaces, with its covariance.

    Parameters
    ----------
    surfaces
        The surfaces; each is moved by each of its `parameters`, both to and fro.
    function
        Takes the surfaces about the origin, and gives a vector (k,) that depends smoothly on them.
    origin
        (3,), near the surfaces, so that far coordinates lose no digits.

    Returns
    -------
    Propagated
    """
    nominal = [located(surface, origin) for surface in surfaces]
    value = np.asarray(function(nominal), np.float64)
    length = _STEP * _extent(surfaces, origin)
    covariances = []
    for number, surface in enumerate(surfaces):
        columns = []
        for name in surface.parameters:
            step = _STEP if name in ("tilt_1", "tilt_2", "half_angle") else length
            ends = []
            for change in (step, -step):
                changed = list(nominal)
                changed[number] = located(surface, origin, name, change)
                ends.append(np.asarray(function(changed), np.float64))
            columns.append((ends[0] - ends[1]) / (2.0 * step))
        jacobian = np.stack(columns, axis=1)
        covariances.append(jacobian @ surface.covariance @ jacobian.T)
    return Propagated(value, covariances, [surface.degrees_of_freedom for surface in surfaces])


def located(surface: Surface, origin: Array, name: str = "", change: float = 0.0) -> Located:
    """Give a surface less an origin, one of its parameters changed, as `PARAMETERS` says."""
    point, axis = surface.point - origin, surface.axis
    directions = dict(zip("xyz", np.eye(3), strict=True)) | {"shift": axis}
    directions |= dict(zip(("shift_1", "shift_2"), surface.across, strict=True))
    tilts = dict(zip(("tilt_1", "tilt_2"), surface.across, strict=True))
    if name in directions:
        point = point + change * directions[name]
    if name in tilts:
        axis = axis + change * tilts[name]
        axis = axis / np.linalg.norm(axis)
    return Located(
        surface.kind,
        point,
        axis,
        surface.radius + change * (name == "radius"),
        surface.major_radius + change * (name == "major_radius"),
    )


def _extent(surfaces: Sequence[Surface], origin: Array) -> float:
    """Give a length of the scene: how far the surfaces are from the origin and how large they are."""
    lengths = [
        [float(np.linalg.norm(surface.point - origin)), surface.radius, surface.length]
        for surface in surfaces
    ]
    return float(np.nanmax(np.array(lengths)))
