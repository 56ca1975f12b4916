"""One surface that was found: what it is, where, how large, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.defaults import INTERVAL
from surfsig.surfaces.area import covered_area
from surfsig.surfaces.geometry import Array, Placement, covered_arc, in_plane

Kind = Literal["plane", "sphere", "cylinder", "cone", "torus"]
"""What a surface is."""

KINDS: tuple[Kind, ...] = get_args(Kind)
"""All kinds, the simplest first."""


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """A plane, sphere, cylinder, cone or torus that was found in a scan, with its errors.

    All lengths are in the points' own unit, all places in their coordinates, all angles in radians. NaN
    stands for what a kind does not have.
    """

    kind: Kind
    """"plane", "sphere", "cylinder", "cone" or "torus"."""
    point: Array
    """(3,): where a plane's normal or an axis is held, near the points; the center of a sphere or torus."""
    axis: Array
    """Unit vector (3,): a plane's normal; the axis, along which a cone widens; NaN for a sphere."""
    radius: float
    """Of a sphere or cylinder; of a cone at `point`; of a torus's tube; NaN for a plane."""
    major_radius: float
    """Of a torus, from its axis to the middle of its tube; NaN for others."""
    half_angle: float
    """Of a cone, between its axis and its side; NaN for others."""
    radius_std: float
    """Standard error of the radius."""
    major_radius_std: float
    """Standard error of the major radius."""
    half_angle_std: float
    """Standard error of the half angle."""
    freedom: float
    """Degrees of freedom of these errors, for Student's t."""
    covariance: Array
    """Of the parameters, (p, p): of a plane its shift and two tilts (p = 3); of a sphere its center and
    the radius (4); of the others two shifts of the axis at `point` and its two tilts, then of a cylinder the
    radius (5), of a cone the radius and the half angle (6), of a torus the shift along the axis, the major
    radius and the radius (7)."""
    across: Array
    """The two directions, as rows (2, 3), in which shifts and tilts are counted."""
    center: Array
    """(3,): of a sphere or torus its center; of a cylinder or cone the middle of the piece of its axis beside
    the points; of a plane the mean of its points."""
    length: float
    """Of a cylinder, cone or torus, along the axis; of a plane the longer side of the smallest rectangle
    around its points; NaN for a sphere."""
    width: float
    """Of a plane, the shorter side of that rectangle; NaN for others."""
    arc: float
    """Of a cylinder, cone or torus, how far the points go round the axis; of a sphere, how wide they are as
    seen from its center: 2 pi is all of it; NaN for a plane."""
    area: float
    """Of the part of it that has points, as an estimate."""
    count: int
    """Number of its points."""
    rms: float
    """Root mean square of their distances."""
    deviation: float
    """The same, corrected for the parameters: the standard deviation of a point's distance."""

    @property
    def interval(self) -> tuple[float, float]:
        """The radius's 95 % interval by Student's t; NaN for a plane."""
        from scipy.stats import t

        half = self.radius_std * float(t.ppf(0.5 + 0.5 * INTERVAL, self.freedom))
        return self.radius - half, self.radius + half

    def distances(self, points: NDArray[Any]) -> Array:
        """Measure how far points are from the surface.

        Parameters
        ----------
        points
            (m, 3), in the scan's coordinates.

        Returns
        -------
        numpy.ndarray
            Signed distances (m,): positive outside, or where a plane's normal points.
        """
        return self._placement.distances(np.asarray(points, np.float64) - self.point)

    @property
    def _placement(self) -> Placement:
        return Placement(self.kind, self.axis, self.radius, self.major_radius, self.half_angle)

    def values(self) -> dict[str, Any]:
        """Name all values, as JSON and tables call them, without those that the kind does not have.

        Returns
        -------
        kind, center, axis, radius, radius_std, interval, major_radius, ... by name.
        """
        names = ["kind", "center", "axis", "radius", "radius_std", "interval", "major_radius"]
        names += ["major_radius_std", "half_angle", "half_angle_std", "length", "width", "arc", "area"]
        names += ["count", "rms", "point", "across", "covariance", "freedom"]
        values = {name: getattr(self, name) for name in names}
        return {
            name: value
            for name, value in values.items()
            if isinstance(value, str) or not np.isnan(np.asarray(value, np.float64)).all()
        }

    def __repr__(self) -> str:
        size = "" if math.isnan(self.radius) else f", radius={self.radius:.6g}"
        error = "" if math.isnan(self.radius_std) else f" +- {self.radius_std:.2g}"
        return f"Surface({self.kind}{size}{error}, rms={self.rms:.3g}, {self.count} points)"


def described(entry: Mapping[str, Any], points: Array, origin: Array) -> Surface:
    """Describe what the core found.

    Parameters
    ----------
    entry
        The core's values.
    points
        The surface's points, (n, 3), less the origin.
    origin
        (3,).
    """
    kind: Kind = entry["kind"]
    placement = Placement(kind, entry["axis"], entry["radius"], entry["major_radius"], entry["half_angle"])
    local = points + (origin - entry["point"])
    distances = placement.distances(local)
    heights = placement.heights(local)
    center = entry["point"]
    length, width, arc = math.nan, math.nan, covered_arc(placement, local)
    if kind == "plane":
        length, width = in_plane(placement, local)
        center = center + placement.foot(local.mean(axis=0))
    elif kind != "sphere":
        length = float(np.ptp(heights))
    if kind in ("cylinder", "cone"):
        center = center + 0.5 * float(heights.min() + heights.max()) * placement.axis
    unknowns = _surfsig.KIND_PARAMETERS[kind]
    return Surface(
        kind=kind,
        point=entry["point"],
        axis=entry["axis"],
        radius=entry["radius"],
        major_radius=entry["major_radius"],
        half_angle=entry["half_angle"],
        radius_std=entry.get("radius_std", math.nan),
        major_radius_std=entry.get("major_radius_std", math.nan),
        half_angle_std=entry.get("half_angle_std", math.nan),
        freedom=entry.get("freedom", math.nan),
        covariance=entry.get("covariance", np.full((unknowns, unknowns), math.nan)),
        across=entry.get("across", np.full((2, 3), math.nan)),
        center=center,
        length=length,
        width=width,
        arc=arc,
        area=covered_area(placement, local),
        count=entry["count"],
        rms=float(np.sqrt((distances**2).mean())),
        deviation=entry["deviation"],
    )
