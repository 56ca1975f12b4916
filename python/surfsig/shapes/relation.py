"""Distances and angles between fitted surfaces, with standard errors from the covariances of both."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import TYPE_CHECKING, Any

import numpy as np

from surfsig.defaults import INTERVAL
from surfsig.digits import with_error
from surfsig.errors import InvalidInputError
from surfsig.shapes.geometry import Array
from surfsig.shapes.overlap import centroid, overlap_of_planes
from surfsig.shapes.propagation import Located, located, propagated

if TYPE_CHECKING:
    from surfsig.point_cloud import PointCloud
    from surfsig.shapes.surface import Surface

PARALLEL_LIMIT = math.radians(5.0)
"""Angle up to which planes and axes count as parallel, so that their distance is taken across both. Parts are
made parallel to far less; of lines that meet at a smaller angle the nearest points are beyond most pieces."""

_NOTHING = 1e-12
"""Length of a vector, in radians or in lengths of the scene, below which it is rounding."""

Ends = Callable[[Sequence[Located]], Array]
"""Gives the two points (2, 3) between which a distance is measured, of two surfaces."""


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceDistance:
    """How far two fitted surfaces are apart, in the points' unit: `Surface.distance_to`."""

    between: str
    """What is measured: "plane to plane", "plane to axis", "plane to center", "axis to axis", "axis to
    center" or "center to center"."""
    value: float
    """The distance, 0 or more."""
    std: float
    """Its standard error; NaN where a surface's points do not determine it."""
    degrees_of_freedom: float
    """Of the standard error, for Student's t (Welch and Satterthwaite)."""
    gap: float
    """The distance less the radii of spheres and cylinders: between the surfaces themselves; negative where
    one reaches into the other. NaN with a cone or torus, whose side is not one radius from its axis."""
    gap_std: float
    """Its standard error."""
    points: Array
    """(2, 3): the ends of the distance, on this plane, axis or center and on the other's."""
    parallelism: float
    """Of two planes, with the cloud: the largest gap less the smallest over the part of them that lies
    opposite, or over both where nothing does; NaN for others."""
    parallelism_std: float
    """Its standard error."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the value, from 0, by Student's t; too wide near 0, where noise adds to it."""
        return _interval(self.value, self.std, self.degrees_of_freedom, math.inf)

    def to_dict(self) -> dict[str, Any]:
        """Name all values, as JSON calls them.

        Returns
        -------
        dict
            between, value, std, interval, gap, gap_std, points, parallelism, parallelism_std,
            degrees_of_freedom; arrays as lists, without those that are NaN.
        """
        names = ("between", "value", "std", "interval", "gap", "gap_std", "points", "parallelism")
        return _named(self, (*names, "parallelism_std", "degrees_of_freedom"))

    def __repr__(self) -> str:
        return f"SurfaceDistance({self.between}: {with_error(self.value, self.std)})"


@dataclass(frozen=True, eq=False, repr=False)
class SurfaceAngle:
    """The angle between two fitted surfaces, in radians, and where they meet: `Surface.angle_to`."""

    between: str
    """What is measured: "plane to plane", "plane to axis" or "axis to axis"."""
    value: float
    """The angle, 0 to pi/2; of a plane and an axis 0 where they are parallel."""
    std: float
    """Its standard error; NaN where a surface's points do not determine it."""
    degrees_of_freedom: float
    """Of the standard error, for Student's t (Welch and Satterthwaite)."""
    point: Array
    """(3,): where they meet, in the points' coordinates: of two planes the point of their line nearest to the
    middle between their centers; of two axes the middle between their nearest points. NaN where they
    are exactly parallel."""
    point_std: Array
    """(3,), standard errors of `point`."""
    direction: Array
    """Unit vector (3,) of the line in which two planes meet; NaN for others."""

    @property
    def interval(self) -> tuple[float, float]:
        """The 95 % interval of the value, within 0 and pi/2, by Student's t."""
        return _interval(self.value, self.std, self.degrees_of_freedom, 0.5 * math.pi)

    def to_dict(self) -> dict[str, Any]:
        """Name all values, as JSON calls them.

        Returns
        -------
        dict
            between, value, std, interval, point, point_std, direction, degrees_of_freedom; arrays as lists,
            without those that are NaN.
        """
        names = ("between", "value", "std", "interval", "point", "point_std", "direction")
        return _named(self, (*names, "degrees_of_freedom"))

    def __repr__(self) -> str:
        degrees = with_error(math.degrees(self.value), math.degrees(self.std))
        return f"SurfaceAngle({self.between}: {degrees} degrees)"


def distance_between(first: Surface, second: Surface, cloud: PointCloud | None) -> SurfaceDistance:
    """Measure the distance; see `Surface.distance_to`."""
    if _rank(first) > _rank(second):
        swapped = distance_between(second, first, cloud)
        return SurfaceDistance(**{**vars(swapped), "points": swapped.points[::-1]})
    origin = first.center
    corners = 0.5 * (second.center - origin)[None]
    if second.kind == "plane" and cloud is not None:
        corners = overlap_of_planes(first, second, cloud)
    ends = _ends(first, second, corners)
    surfaces = [first, second]
    has_gap = not {"cone", "torus"} & {first.kind, second.kind}

    def values(located: Sequence[Located]) -> Array:
        start, end = ends(located)
        radii = sum(surface.radius for surface in located if has_gap and surface.kind != "plane")
        return np.append(end - start, radii)

    found = propagated(surfaces, values, origin)
    along = found.direction(slice(0, 3), _NOTHING * float(np.linalg.norm(second.center - origin)))
    value = float(np.linalg.norm(found.value[:3]))
    gap_along = np.append(along[:3], -1.0)
    parallelism = parallelism_std = math.nan
    if len(corners) > 1:
        parallelism, parallelism_std = _parallelism(surfaces, corners, origin)
    return SurfaceDistance(
        between=_words(first, second),
        value=value,
        std=found.std_along(along),
        degrees_of_freedom=found.freedom_along(along),
        gap=value - float(found.value[3]) if has_gap else math.nan,
        gap_std=found.std_along(gap_along) if has_gap else math.nan,
        points=ends([located(surface, origin) for surface in surfaces]) + origin,
        parallelism=parallelism,
        parallelism_std=parallelism_std,
    )


def angle_between(first: Surface, second: Surface) -> SurfaceAngle:
    """Measure the angle; see `Surface.angle_to`."""
    for surface in (first, second):
        if surface.kind == "sphere":
            raise InvalidInputError("a sphere has no direction, so there is no angle to it")
    if _rank(first) > _rank(second):
        return angle_between(second, first)
    surfaces, origin = [first, second], first.center
    sign = 1.0 if first.axis @ second.axis >= 0.0 else -1.0

    def rotation(parts: Sequence[Located]) -> Array:
        return _rotation_between(parts[0].axis, sign * parts[1].axis)

    found = propagated(surfaces, rotation, origin)
    along = found.direction(slice(0, 3), _NOTHING)
    value = float(np.linalg.norm(found.value))
    is_mixed = first.kind == "plane" and second.kind != "plane"
    point = np.full((2, 3), math.nan)
    if abs(value - (0.5 * math.pi if is_mixed else 0.0)) > _NOTHING:
        meeting = propagated(surfaces, _meeting_point(first, second), origin)
        point = np.stack([meeting.value + origin, [meeting.std_along(unit) for unit in np.eye(3)]])
    direction = np.full(3, math.nan)
    if second.kind == "plane" and value > _NOTHING:
        direction = np.cross(first.axis, second.axis)
        direction /= np.linalg.norm(direction)
    return SurfaceAngle(
        between=_words(first, second),
        # A plane's direction is across its normal.
        value=0.5 * math.pi - value if is_mixed else value,
        std=found.std_along(along),
        degrees_of_freedom=found.freedom_along(along),
        point=point[0],
        point_std=point[1],
        direction=direction,
    )


def angle_of_axes(first: Array, second: Array) -> float:
    """Give the angle between two unit vectors of either sign, 0 to pi/2."""
    return math.atan2(float(np.linalg.norm(np.cross(first, second))), abs(float(first @ second)))


def _ends(first: Surface, second: Surface, corners: Array) -> Ends:
    """Choose between which points the distance of two kinds is measured; the corners are less the origin."""
    if first.kind == "plane":
        if second.kind == "plane":
            _check_parallel(angle_of_axes(first.axis, second.axis), "the planes meet")
            return _across_planes(first, second, centroid(corners, first.axis))
        if second.kind in ("cylinder", "cone"):
            slope = 0.5 * math.pi - angle_of_axes(first.axis, second.axis)
            _check_parallel(slope, f"the {second.kind}'s axis meets the plane")
        return _foot_on_plane(second)
    if second.kind != "sphere":
        if angle_of_axes(first.axis, second.axis) < PARALLEL_LIMIT:
            return _across_parallel_axes(first, second, corners[0])
        return _nearest_of_axes
    return _centers if first.kind == "sphere" else _foot_on_axis


def _across_planes(first: Surface, second: Surface, position: Array) -> Ends:
    """Measure at a position, along the mean of both normals."""
    normal = first.axis + math.copysign(1.0, first.axis @ second.axis) * second.axis
    normal = normal / np.linalg.norm(normal)
    return lambda parts: np.stack([_on_plane(part, position, normal) for part in parts])


def _on_plane(plane: Located, position: Array, direction: Array) -> Array:
    """Follow a direction from a position to a plane."""
    return position + ((plane.point - position) @ plane.axis) / (direction @ plane.axis) * direction


def _foot_on_plane(second: Surface) -> Ends:
    """Measure from the plane to a center, or to the middle of the piece of an axis."""
    height = _height_of_center(second)

    def ends(parts: Sequence[Located]) -> Array:
        plane, other = parts
        position = other.point + (height * other.axis if height else 0.0)
        return np.stack([position - ((position - plane.point) @ plane.axis) * plane.axis, position])

    return ends


def _foot_on_axis(parts: Sequence[Located]) -> Array:
    """Measure from an axis to a center."""
    line, center = parts[0], parts[1].point
    return np.stack([line.point + ((center - line.point) @ line.axis) * line.axis, center])


def _centers(parts: Sequence[Located]) -> Array:
    return np.stack([part.point for part in parts])


def _across_parallel_axes(first: Surface, second: Surface, position: Array) -> Ends:
    """Measure where both axes pass a position, across the mean of their directions."""
    along = first.axis + math.copysign(1.0, first.axis @ second.axis) * second.axis
    along = along / np.linalg.norm(along)

    def ends(parts: Sequence[Located]) -> Array:
        feet = [
            part.point + ((position - part.point) @ along) / (part.axis @ along) * part.axis for part in parts
        ]
        return np.stack(feet)

    return ends


def nearest_of_axes(first_point: Array, first_axis: Array, second_point: Array, second_axis: Array) -> Array:
    """Give the points at which two lines are nearest to each other.

    Parameters
    ----------
    first_point, first_axis, second_point, second_axis
        (3,): of each a point and its direction, a unit vector. The lines are not parallel.

    Returns
    -------
    (2, 3): on the first and on the second.
    """
    between = second_point - first_point
    cosine = float(first_axis @ second_axis)
    sine_squared = float(np.sum(np.cross(first_axis, second_axis) ** 2))
    ours, theirs = float(between @ first_axis), float(between @ second_axis)
    return np.stack(
        [
            first_point + (ours - cosine * theirs) / sine_squared * first_axis,
            second_point + (cosine * ours - theirs) / sine_squared * second_axis,
        ]
    )


def _nearest_of_axes(parts: Sequence[Located]) -> Array:
    first, second = parts
    return nearest_of_axes(first.point, first.axis, second.point, second.axis)


def _meeting_point(first: Surface, second: Surface) -> Callable[[Sequence[Located]], Array]:
    """Choose where surfaces meet: on the line of two planes, on the plane, or between two axes."""
    if second.kind == "plane":
        return partial(_on_both_planes, 0.5 * (second.center - first.center))
    if first.kind == "plane":
        return lambda parts: _on_plane(parts[0], parts[1].point, parts[1].axis)
    return lambda parts: np.asarray(_nearest_of_axes(parts).mean(axis=0))


def _on_both_planes(position: Array, parts: Sequence[Located]) -> Array:
    """Give the point of two planes' line that is nearest to a position."""
    normals = np.stack([part.axis for part in parts])
    beside = np.array([(part.point - position) @ part.axis for part in parts])
    return np.asarray(position + normals.T @ np.linalg.solve(normals @ normals.T, beside))


def _rotation_between(first: Array, second: Array) -> Array:
    """Give the rotation vector between two directions: as long as their angle, and smooth at 0."""
    across = np.cross(first, second)
    sine = float(np.linalg.norm(across))
    return across * (math.atan2(sine, float(first @ second)) / sine if sine > _NOTHING else 1.0)


def _parallelism(surfaces: Sequence[Surface], corners: Array, origin: Array) -> tuple[float, float]:
    """Give the largest gap of two planes less the smallest over a polygon's corners, with its error."""
    first, second = surfaces
    nominal = [located(surface, origin) for surface in surfaces]
    ends_at = [_across_planes(first, second, corner)(nominal) for corner in corners]
    gaps = [(end - start) @ first.axis for start, end in ends_at]
    positions = corners[[int(np.argmin(gaps)), int(np.argmax(gaps))]]
    measured = [_across_planes(first, second, position) for position in positions]

    def difference(parts: Sequence[Located]) -> Array:
        low, high = (np.subtract(*ends(parts)[::-1]) for ends in measured)
        return np.array([(high - low) @ first.axis])

    found = propagated(surfaces, difference, origin)
    return float(found.value[0]), found.std_along(np.ones(1))


def _check_parallel(angle: float, what: str) -> None:
    if angle > PARALLEL_LIMIT:
        raise InvalidInputError(
            f"{what} at {math.degrees(angle):.3g} degrees, so they have no distance: angle_to says where"
        )


def _rank(surface: Surface) -> int:
    return {"plane": 0, "sphere": 2}.get(surface.kind, 1)


def _words(first: Surface, second: Surface) -> str:
    names = ["plane" if surface.kind == "plane" else "axis" for surface in (first, second)]
    if second.kind == "sphere" or (first.kind == "plane" and second.kind == "torus"):
        names[1] = "center"
    if first.kind == "sphere":
        names[0] = "center"
    return " to ".join(names)


def _height_of_center(surface: Surface) -> float:
    """Give how far along the axis the center is from the point at which shifts are counted."""
    return 0.0 if surface.kind == "sphere" else float((surface.center - surface.point) @ surface.axis)


def _interval(value: float, std: float, degrees_of_freedom: float, most: float) -> tuple[float, float]:
    from scipy.stats import t

    half = std * float(t.ppf(0.5 + 0.5 * INTERVAL, degrees_of_freedom))
    # Not Python's own, which would take a bound for NaN.
    return float(np.maximum(0.0, value - half)), float(np.minimum(most, value + half))


def _named(result: object, names: Sequence[str]) -> dict[str, Any]:
    values = {name: getattr(result, name) for name in names}
    return {
        name: value.tolist() if isinstance(value, np.ndarray) else value
        for name, value in values.items()
        if isinstance(value, str) or not np.isnan(np.asarray(value, np.float64)).all()
    }
