"""Analytic surfaces in their own axes: where a ray crosses them, their normals and their curvatures.

Every surface is a frozen dataclass in metres. Its own ``+z`` is up; normals point outwards (out of the solid,
or along ``+z`` for a sheet), and curvatures are taken with that normal, so that a bump is positive: a sphere
has k1 = k2 = 1/r. Seen from inside, both change sign (:class:`surfsig.simulate.Scene` does that).
"""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, fields

import numpy as np
import numpy.typing as npt

from ..errors import InvalidInputError
from .poses import Array
from .ray_crossings import coordinate_at, disc_crossing, level_crossing, round_crossings, slab_entry_exit


class Surface(ABC):
    """What a scene is made of. All arrays are float64, in metres, in the surface's own axes."""

    @abstractmethod
    def crossings(self, origins: Array, directions: Array) -> Array:
        """Where rays cross the surface.

        Parameters
        ----------
        origins, directions : (n, 3) ndarray
            Rays ``origin + t * direction``; directions of any length but zero.

        Returns
        -------
        (k, n) ndarray
            Parameters t, in no order, infinite where there is no crossing. Negative ones lie behind the
            origin.
        """

    @abstractmethod
    def implicit(self, points: Array) -> Array:
        """Evaluate a function of space that is zero on the surface, negative inside (below, for a sheet).

        Parameters
        ----------
        points : (n, 3) ndarray

        Returns
        -------
        (n,) ndarray
            Metres near the surface; a true distance only where the class says so.
        """

    @abstractmethod
    def normals(self, points: Array) -> Array:
        """Outward unit normals, (n, 3), at points on the surface, (n, 3)."""

    @abstractmethod
    def curvatures(self, points: Array) -> Array:
        """Principal curvatures k1 >= k2, (n, 2) per metre, at points on the surface, (n, 3)."""

    @property
    def extent(self) -> float:
        """Largest distance of its points from the origin, in metres; infinite where it is not known."""
        return np.inf

    def _check_lengths(self) -> None:
        """Refuse lengths that are not positive and finite."""
        for field in fields(self):  # type: ignore[arg-type]  # every concrete surface is a dataclass
            value = getattr(self, field.name)
            numbers = value if isinstance(value, tuple) else (value,)
            for number in numbers:
                if not isinstance(number, bool) and not (np.isfinite(number) and number > 0.0):
                    raise InvalidInputError(
                        f"{type(self).__name__}: {field.name} must be positive, got {value!r}"
                    )


def _radial(points: Array) -> tuple[Array, Array]:
    """Return unit vectors (n, 3) away from the z axis, and distances (n,) from it."""
    distance = np.hypot(points[:, 0], points[:, 1])
    out = np.zeros_like(points)
    out[:, :2] = points[:, :2] / np.maximum(distance, np.finfo(np.float64).tiny)[:, None]
    return out, distance


@dataclass(frozen=True)
class Plane(Surface):
    """The plane z = 0, without end; its solid is the half-space below it."""

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 1."""
        return level_crossing(origins, directions, 0.0)[None]

    def implicit(self, points: Array) -> Array:
        """Signed distance, positive above."""
        return np.array(points[:, 2])

    def normals(self, points: Array) -> Array:
        """Straight up."""
        return np.tile((0.0, 0.0, 1.0), (len(points), 1))

    def curvatures(self, points: Array) -> Array:
        """Zero."""
        return np.zeros((len(points), 2))


@dataclass(frozen=True)
class Rectangle(Plane):
    """A rectangle in the plane z = 0 about the origin: a sheet without thickness.

    Parameters
    ----------
    size : (float, float)
        Lengths of the sides along x and y, in metres.
    """

    size: tuple[float, float]

    def __post_init__(self) -> None:
        self._check_lengths()

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return float(np.hypot(*self.size)) / 2.0

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 1."""
        t = super().crossings(origins, directions)[0]
        inside = np.abs(coordinate_at(origins, directions, t, 0)) <= self.size[0] / 2
        inside &= np.abs(coordinate_at(origins, directions, t, 1)) <= self.size[1] / 2
        return np.where(inside, t, np.inf)[None]


@dataclass(frozen=True)
class Sphere(Surface):
    """A sphere about the origin.

    Parameters
    ----------
    radius : float
        Metres.
    """

    radius: float

    def __post_init__(self) -> None:
        self._check_lengths()

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return self.radius

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 2."""
        return round_crossings(origins, directions, self.radius)

    def implicit(self, points: Array) -> Array:
        """Signed distance."""
        return np.asarray(np.linalg.norm(points, axis=1) - self.radius)

    def normals(self, points: Array) -> Array:
        """Away from the centre."""
        return np.asarray(points / np.linalg.norm(points, axis=1, keepdims=True))

    def curvatures(self, points: Array) -> Array:
        """1/radius, twice."""
        return np.full((len(points), 2), 1.0 / self.radius)


@dataclass(frozen=True)
class Cylinder(Surface):
    """A cylinder about the z axis, its middle at the origin.

    Parameters
    ----------
    radius, length : float
        Metres; it reaches from z = -length/2 to length/2.
    capped : bool
        Closed by discs (a rod), or open (a thin-walled tube, seen from inside as well).
    """

    radius: float
    length: float
    capped: bool = True

    def __post_init__(self) -> None:
        self._check_lengths()

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return float(np.hypot(self.radius, self.length / 2.0))

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 4, or 2 when open."""
        half = self.length / 2
        side = round_crossings(origins[:, :2], directions[:, :2], self.radius)
        rows = [np.where(np.abs(coordinate_at(origins, directions, t, 2)) <= half, t, np.inf) for t in side]
        if self.capped:
            rows += [disc_crossing(origins, directions, level, self.radius) for level in (-half, half)]
        return np.stack(rows)

    def implicit(self, points: Array) -> Array:
        """Signed distance to side or caps, whichever is larger."""
        return np.asarray(np.maximum(_radial(points)[1] - self.radius, self._beyond_caps(points)))

    def _beyond_caps(self, points: Array) -> Array:
        return np.asarray(np.abs(points[:, 2]) - self.length / 2)

    def _on_cap(self, points: Array) -> npt.NDArray[np.bool_]:
        side = np.abs(_radial(points)[1] - self.radius)
        return np.asarray(self.capped & (np.abs(self._beyond_caps(points)) < side))

    def normals(self, points: Array) -> Array:
        """Away from the axis; along it on a cap."""
        cap = np.zeros_like(points)
        cap[:, 2] = np.sign(points[:, 2])
        return np.where(self._on_cap(points)[:, None], cap, _radial(points)[0])

    def curvatures(self, points: Array) -> Array:
        """1/radius and 0; zero on a cap."""
        result = np.zeros((len(points), 2))
        result[~self._on_cap(points), 0] = 1.0 / self.radius
        return result


@dataclass(frozen=True)
class Cone(Surface):
    """A cone or a frustum about the z axis, standing on z = 0.

    Parameters
    ----------
    radius : float
        At the foot, z = 0, in metres.
    height : float
        Metres.
    top_radius : float
        At z = height; 0 (the default) makes a pointed cone.
    capped : bool
        Closed by discs, or open.
    """

    radius: float
    height: float
    top_radius: float = 0.0
    capped: bool = True

    def __post_init__(self) -> None:
        if not (self.radius > 0.0 and self.height > 0.0 and 0.0 <= self.top_radius < np.inf):
            raise InvalidInputError("Cone: radius and height must be positive, top_radius not negative")

    @property
    def _slope(self) -> float:
        """Change of the radius per metre of height."""
        return (self.top_radius - self.radius) / self.height

    def _side_excess(self, points: Array) -> Array:
        """Distance (n,) from the side, positive outside."""
        excess = _radial(points)[1] - (self.radius + self._slope * points[:, 2])
        return np.asarray(excess / np.hypot(1.0, self._slope))

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return float(max(self.radius, np.hypot(self.top_radius, self.height)))

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 4, or 2 when open."""
        slope = self._slope
        here = self.radius + slope * origins[:, 2]
        a = directions[:, 0] ** 2 + directions[:, 1] ** 2 - (slope * directions[:, 2]) ** 2
        b = (
            origins[:, 0] * directions[:, 0]
            + origins[:, 1] * directions[:, 1]
            - slope * here * directions[:, 2]
        )
        c = origins[:, 0] ** 2 + origins[:, 1] ** 2 - here**2
        with np.errstate(divide="ignore", invalid="ignore"):
            # The root that does not cancel first; the other from the product of both.
            q = -(b + np.copysign(np.sqrt(b**2 - a * c), b))
            roots = np.stack([q / a, c / q])
        rows = []
        for t in roots:
            z = coordinate_at(origins, directions, t, 2)
            # The quadratic also describes the mirror image of the cone beyond its apex.
            real = (z >= 0.0) & (z <= self.height) & (self.radius + slope * z >= 0.0)
            rows.append(np.where(real, t, np.inf))
        if self.capped:
            rows.append(disc_crossing(origins, directions, 0.0, self.radius))
            rows.append(disc_crossing(origins, directions, self.height, self.top_radius))
        return np.stack(rows)

    def implicit(self, points: Array) -> Array:
        """Signed distance to side, foot or top, whichever is larger."""
        ends = np.maximum(-points[:, 2], points[:, 2] - self.height)
        return np.asarray(np.maximum(self._side_excess(points), ends))

    def _on_cap(self, points: Array) -> npt.NDArray[np.bool_]:
        ends = np.minimum(np.abs(points[:, 2]), np.abs(points[:, 2] - self.height))
        return np.asarray(self.capped & (ends < np.abs(self._side_excess(points))))

    def normals(self, points: Array) -> Array:
        """Square to the side; along the axis on a cap."""
        cap = np.zeros_like(points)
        cap[:, 2] = np.where(points[:, 2] > self.height / 2, 1.0, -1.0)
        side = _radial(points)[0]
        side[:, 2] = -self._slope
        side /= np.hypot(1.0, self._slope)
        return np.where(self._on_cap(points)[:, None], cap, side)

    def curvatures(self, points: Array) -> Array:
        """Curvature of the circle at this height times the cosine to its plane, and 0; zero on a cap."""
        result = np.zeros((len(points), 2))
        side = ~self._on_cap(points)
        with np.errstate(divide="ignore"):
            result[side, 0] = 1.0 / (_radial(points[side])[1] * np.hypot(1.0, self._slope))
        return result


@dataclass(frozen=True)
class Box(Surface):
    """A solid box about the origin.

    Parameters
    ----------
    size : (float, float, float)
        Lengths of the edges along x, y and z, in metres.
    """

    size: tuple[float, float, float]

    def __post_init__(self) -> None:
        self._check_lengths()

    @property
    def extent(self) -> float:
        """See :attr:`Surface.extent`."""
        return float(np.linalg.norm(self.size)) / 2.0

    def crossings(self, origins: Array, directions: Array) -> Array:
        """See :meth:`Surface.crossings`; k = 2."""
        return np.stack(slab_entry_exit(origins, directions, np.array(self.size) / 2))

    def implicit(self, points: Array) -> Array:
        """Signed distance to the nearest face's plane."""
        return np.asarray((np.abs(points) - np.array(self.size) / 2).max(axis=1))

    def normals(self, points: Array) -> Array:
        """Of the face that the point lies on."""
        face = (np.abs(points) - np.array(self.size) / 2).argmax(axis=1)
        rows = np.arange(len(points))
        result = np.zeros_like(points)
        result[rows, face] = np.sign(points[rows, face])
        return result

    def curvatures(self, points: Array) -> Array:
        """Zero."""
        return np.zeros((len(points), 2))
