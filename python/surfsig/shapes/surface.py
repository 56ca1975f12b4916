"""A fitted surface: what it is, where, how large, and how sure that is."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.alignment.free_directions import FreeDirection, free_directions_of_surface
from surfsig.defaults import INTERVAL
from surfsig.digits import with_error
from surfsig.point_cloud import PointCloud
from surfsig.shapes.geometry import Array, Placement
from surfsig.shapes.patch import SurfacePatch, patch_of
from surfsig.shapes.relation import SurfaceAngle, SurfaceDistance, angle_between, distance_between

Kind = Literal["plane", "sphere", "cylinder", "cone", "torus"]
"""What a surface is."""

KINDS: tuple[Kind, ...] = get_args(Kind)
"""All kinds, the simplest first."""

CurveKind = Literal["circle", "line"]
"""What a curve in space is."""

ShapeKind = Literal["plane", "sphere", "cylinder", "cone", "torus", "circle", "line"]
"""What can be fitted: a surface, or a curve."""

CURVE_KINDS: tuple[CurveKind, ...] = get_args(CurveKind)
"""The curves."""

HEAP = 0.25
"""Points whose deviation is a larger part of the radius are a heap: the least squares are those of a wrong
circle. Of simulated arcs of 30 degrees with noise of 0.1 radii most have 0.35 to 0.5, and the interval of one
in five holds the radius; of whole circles with that noise it is 0.1."""

HIDDEN = 0.4
"""A deviation that is a larger part of the sagitta hides it: noise along the arc biases the radius by more
than its standard error. Below it 78 to 100 of 100 intervals of simulated arcs hold the radius; above it, in
arcs of 30 degrees with noise of 0.1 radii, 18 of 100."""

FLAT = 0.1
"""From intervals of the radius on whose half is a larger part of it, they are those of the curvature, whose
error is the more normal one; a curvature of 0 is a radius without an upper limit."""

_SHIFTS_AND_TILTS = ("shift_1", "shift_2", "tilt_1", "tilt_2")

PARAMETERS: dict[ShapeKind, tuple[str, ...]] = {
    "plane": ("shift", "tilt_1", "tilt_2"),
    "sphere": ("x", "y", "z", "radius"),
    "cylinder": (*_SHIFTS_AND_TILTS, "radius"),
    "cone": (*_SHIFTS_AND_TILTS, "radius", "half_angle"),
    "torus": (*_SHIFTS_AND_TILTS, "shift", "major_radius", "radius"),
    "circle": (*_SHIFTS_AND_TILTS, "shift", "radius"),
    "line": _SHIFTS_AND_TILTS,
}
"""The parameters of each kind, in the order of `Surface.covariance`: x, y, z of the point; `shift` along the
axis (of a plane, along its normal); `shift_1` and `shift_2` along the rows of `across`; `tilt_1` and
`tilt_2`, by which the end of the axis moves along these rows, in radians; and the sizes."""


@dataclass(frozen=True, eq=False, repr=False)
class Surface:
    """A plane, sphere, cylinder, cone, torus, circle or line that was fitted to points, with its errors.

    `surfsig.fit_sphere` and its like give one, `surfsig.find_surfaces` those of a scan. All lengths are in
    the points' own unit, all positions in their coordinates, all angles in radians. NaN stands for what a
    kind does not have.
    """

    kind: ShapeKind
    """"plane", "sphere", "cylinder", "cone", "torus", "circle" or "line"."""
    point: Array
    """(3,): the center of a sphere, torus or circle; of the others a point of the plane, the axis or the
    line, near the members. The covariance counts shifts there."""
    axis: Array
    """Unit vector (3,): a plane's normal; the axis, along which a cone widens; NaN for a sphere. But for a
    cone its sign tells nothing; `fit_cylinder` and `fit_plane` give it a positive z (else y, else x)."""
    radius: float
    """Of a sphere, cylinder or circle; of a cone at `point`; of a torus's tube; NaN for a plane or a line,
    and where `radius_determined` is false: `fitted_radius` is then the one with the least squares."""
    major_radius: float
    """Of a torus, from its axis to the middle of its tube; NaN for others."""
    half_angle: float
    """Of a cone, between its axis and its side; NaN for others."""
    covariance: Array
    """Of the `parameters`, (p, p): of a plane its shift along the normal and two tilts (p = 3); of a sphere
    its center and the radius (4); of the others two shifts of the axis at `point` and its two tilts, then of
    a cylinder the radius (5), of a cone the radius and the half angle (6), of a torus the shift along the
    axis, the major radius and the radius (7), of a circle the shift along the axis and the radius (6); of a
    line no more (4). What a fit was told to keep has no variance; a minimum zone has no covariance. Shifts
    and tilts are along `across`. From blocks of neighbouring points, as
    `surfsig.fit_sphere` says; NaN where the points do not determine it."""
    across: Array
    """The two unit vectors across the axis, as rows (2, 3), along which shifts and tilts are counted; NaN for
    a sphere."""
    degrees_of_freedom: float
    """Of the radius's standard error (a plane's: of its shift's), for Student's t."""
    center: Array
    """(3,): of a sphere or torus its center; of a cylinder or cone the middle of the piece of its axis beside
    the members; of a plane the mean of the members, on the plane."""
    length: float
    """Of a cylinder, cone or torus, along the axis; of a plane the longer side of the smallest rectangle
    around its members; NaN for a sphere."""
    width: float
    """Of a plane, the shorter side of that rectangle; NaN for others."""
    arc: float
    """Of a cylinder, cone or torus, how far the members go round the axis; of a sphere, how wide they are as
    seen from its center: 2 pi is all of it; NaN for a plane."""
    area: float
    """Of the part of it that has points, as an estimate."""
    members: NDArray[np.intp]
    """The numbers of the points that it was fitted to, (m,), ascending; of a surface of `find_surfaces` all
    of its points, also those at its borders, which it was not fitted to."""
    rms: float
    """Root mean square of the members' distances."""
    deviation: float
    """The same, corrected for the parameters: the standard deviation of a point's distance, with `weights`
    that of a point with the largest weight. Of a curve, of each of the two components of a distance. Of a
    surface of `find_surfaces`, that of the points that it was fitted to."""
    form_error: float
    """Peak to valley of the members' signed distances: flatness, roundness, cylindricity. Of a circle, of
    their distances from its axis; of a line twice the largest distance (straightness)."""
    fitted_radius: float
    """The radius that `distances` takes: `radius`, also where that is not determined."""

    @property
    def radius_determined(self) -> bool:
        """Whether the points tell the radius.

        Not so where a curvature of 0 is within its 95 % interval, nor where the points' deviation is above
        0.4 of the sagitta or 0.25 of the radius: noise then bends the surface. True for a plane and a line,
        which have none.
        """
        if math.isnan(self.fitted_radius):
            return True
        return self._radius_is_significant and not self._sagitta_is_hidden

    @property
    def count(self) -> int:
        """Number of members."""
        return len(self.members)

    @property
    def parameters(self) -> tuple[str, ...]:
        """Names of the covariance's rows: x, y, z, shift, shift_1, tilt_1, ..., radius, half_angle."""
        return PARAMETERS[self.kind]

    @property
    def radius_std(self) -> float:
        """Standard error of the radius; NaN for a plane."""
        return self._std("radius")

    @property
    def major_radius_std(self) -> float:
        """Standard error of the major radius; NaN where there is none."""
        return self._std("major_radius")

    @property
    def half_angle_std(self) -> float:
        """Standard error of the half angle; NaN where there is none."""
        return self._std("half_angle")

    @property
    def point_std(self) -> Array:
        """Standard errors of `point`, (3,): none along a plane, nor along the axis of a cylinder or cone."""
        return self._std_at(np.zeros(3))

    @property
    def center_std(self) -> Array:
        """Standard errors of `center`, (3,), there on the axis or the plane; see `point_std`."""
        return self._std_at(self.center - self.point)

    @property
    def axis_std(self) -> Array:
        """Standard errors of `axis`, (3,), which has none along itself; NaN for a sphere."""
        first, second = self.across
        return self._vector_std({"tilt_1": first, "tilt_2": second})

    @property
    def interval(self) -> tuple[float, float]:
        """The radius's 95 % interval by Student's t, as far as `surfsig.fit_sphere` says; NaN for a plane.

        Where the error is large, that of the curvature: without an upper end, infinity, where this may be 0,
        and from 0 to infinity where noise hides the sagitta (see `radius_determined`).
        """
        radius, half = self.fitted_radius, self._half_interval
        if self._sagitta_is_hidden:
            return 0.0, math.inf
        if not half > FLAT * radius:
            return radius - half, radius + half
        return radius / (1 + half / radius), radius / (1 - half / radius) if half < radius else math.inf

    @property
    def free_directions(self) -> list[FreeDirection]:
        """The motions that leave the surface as it is, were it without ends."""
        return free_directions_of_surface(self.kind, self.center, self.axis)

    def distances(self, points: PointCloud | ArrayLike) -> Array:
        """Measure how far points are from the surface.

        Parameters
        ----------
        points
            What `PointCloud.of` takes, in the coordinates of the points that the surface was fitted to.

        Returns
        -------
        numpy.ndarray
            Signed distances (m,): positive outside, or where a plane's normal points; NaN where a coordinate
            is not finite.
        """
        cloud = PointCloud.of(points)
        local = cloud.offsets.astype(np.float64) + (cloud.origin - self.point)
        with np.errstate(invalid="ignore"):
            return self._placement.distances(local)

    def distance_to(self, other: Surface, cloud: PointCloud | ArrayLike | None = None) -> SurfaceDistance:
        """Measure how far another surface is, with the standard error that both covariances give.

        Two planes, or a plane and the axis of a cylinder or cone, must be parallel within 5 degrees. The gap
        of planes is taken along the mean of their normals, in the middle between their centers, or, with the
        cloud, at the centroid of the part that lies opposite: there it is the mean gap. A plane and a
        cylinder are measured in the middle of the cylinder's axis. Axes that are parallel within 5 degrees
        are measured across, in the middle between their centers (how far they are from coaxial); others where
        they are nearest. A torus counts with its center against a plane, else with its axis; a sphere with
        its center.

        Parameters
        ----------
        other
            The other surface, in the same coordinates. Its errors are taken as independent of these.
        cloud
            What both surfaces were fitted to; of two planes it gives the mean gap and the parallelism.

        Returns
        -------
        SurfaceDistance
            In the points' unit.

        Raises
        ------
        InvalidInputError
            If planes, or a plane and an axis, are not parallel; or if the cloud is not the surfaces' own.
        """
        return distance_between(self, other, None if cloud is None else PointCloud.of(cloud))

    def angle_to(self, other: Surface) -> SurfaceAngle:
        """Measure the angle to another surface and where both meet, with standard errors.

        Parameters
        ----------
        other
            The other surface, in the same coordinates. Its errors are taken as independent of these.

        Returns
        -------
        SurfaceAngle
            Between two planes, a plane and an axis, or two axes, in radians from 0 to pi/2.

        Raises
        ------
        InvalidInputError
            If one is a sphere, which has no direction.
        """
        return angle_between(self, other)

    def patch(self, cloud: PointCloud | ArrayLike) -> SurfacePatch:
        """Make a mesh of the part of the surface that its members cover.

        On a map of the surface, cells are joined where they have points. They are as wide as it is far to 32
        neighbours, or up to four times that where points are in rows or clusters; holes and outlines are as
        fine as these cells. Where the radius is not determined, the patch has `fitted_radius`: within the
        points' noise it is the same.

        Parameters
        ----------
        cloud
            What the surface was fitted to.

        Returns
        -------
        SurfacePatch
            Vertices, all on the surface, and triangles.

        Raises
        ------
        InvalidInputError
            If the cloud has fewer points than the surface was fitted to, or it is a circle or a line.
        """
        return patch_of(self, PointCloud.of(cloud))

    def to_dict(self) -> dict[str, Any]:
        """Name all values, as JSON and tables call them, without those that the kind does not have.

        Returns
        -------
        dict
            kind, center, axis, radius, radius_std, interval, major_radius, ..., covariance,
            degrees_of_freedom by name, arrays as lists; the members are not in it.
        """
        names = ["kind", "center", "axis", "radius", "radius_std", "interval", "major_radius"]
        names += ["major_radius_std", "half_angle", "half_angle_std", "length", "width", "arc", "area"]
        names += ["count", "rms", "deviation", "form_error", "point", "across", "covariance"]
        names += ["degrees_of_freedom"]
        values = {name: getattr(self, name) for name in names}
        if not self.radius_determined:
            values["radius_determined"] = False
        return {
            name: value.tolist() if isinstance(value, np.ndarray) else value
            for name, value in values.items()
            if isinstance(value, str) or not np.isnan(np.asarray(value, np.float64)).all()
        }

    def __repr__(self) -> str:
        size = "" if math.isnan(self.radius) else f", radius={with_error(self.radius, self.radius_std)}"
        size = size if self.radius_determined else ", radius not determined"
        return f"Surface({self.kind}{size}, rms={self.rms:.3g}, {self.count} points)"

    @property
    def _placement(self) -> Placement:
        return Placement(self.kind, self.axis, self.fitted_radius, self.major_radius, self.half_angle)

    @property
    def _half_interval(self) -> float:
        """Give what the radius's interval has on either side, if its error is small."""
        from scipy.stats import t

        if self.radius_std == 0:
            return 0.0
        return self.radius_std * float(t.ppf(0.5 + 0.5 * INTERVAL, self.degrees_of_freedom))

    @property
    def _radius_is_significant(self) -> bool:
        return not self._half_interval >= self.fitted_radius

    @property
    def _sagitta_is_hidden(self) -> bool:
        """Whether noise is so large beside the arc of a sphere, cylinder or circle that it bends that."""
        if self.kind not in ("sphere", "cylinder", "circle") or self.radius_std == 0:
            return False
        sagitta = self.fitted_radius * (1 - math.cos(min(0.5 * self.arc, math.pi)))
        return self.deviation > min(HEAP * self.fitted_radius, HIDDEN * sagitta)

    def _std(self, name: str) -> float:
        if name not in self.parameters:
            return math.nan
        row = self.parameters.index(name)
        return math.sqrt(self.covariance[row, row])

    def _std_at(self, offset: Array) -> Array:
        """Give the standard errors of the surface at an offset from `point`, along the axis or the plane."""
        if self.kind == "sphere":
            return self._vector_std(dict(zip("xyz", np.eye(3), strict=True)))
        first, second = self.across
        if self.kind == "plane":
            # A tilt of the normal lowers the plane on the side that the normal leans to.
            tilts = {"tilt_1": -(offset @ first) * self.axis, "tilt_2": -(offset @ second) * self.axis}
        else:
            along = offset @ self.axis
            tilts = {"tilt_1": along * first, "tilt_2": along * second}
        return self._vector_std({"shift": self.axis, "shift_1": first, "shift_2": second, **tilts})

    def _vector_std(self, directions: Mapping[str, Array]) -> Array:
        """Give the standard errors of a vector that parameters move along directions."""
        named = [name for name in self.parameters if name in directions]
        if not named:
            return np.full(3, math.nan)
        rows = [self.parameters.index(name) for name in named]
        derivatives = np.stack([directions[name] for name in named])
        covariance = derivatives.T @ self.covariance[np.ix_(rows, rows)] @ derivatives
        # Rounding may leave a variance of 0 below 0.
        return np.asarray(np.sqrt(np.maximum(covariance.diagonal(), 0.0)))
