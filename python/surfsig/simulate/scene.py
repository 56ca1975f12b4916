"""Scenes: surfaces placed by poses, cut by one another, and asked what a ray meets first."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field, replace

import numpy as np
import numpy.typing as npt

from ..errors import InvalidInputError
from ..geometry import inverse, pose_array, rotate, transform_points
from .height_field import HeightField
from .poses import Array
from .surfaces import Surface

# Points within a nanometre of a cutting solid's surface belong to both sides, so that no ray slips through
# the seam between the two parts.
_SEAM = 1e-9


@dataclass(frozen=True, eq=False)
class Placed:
    """A surface in a scene.

    Parameters
    ----------
    surface : Surface
        In its own axes.
    pose : (4, 4) ndarray
        T_scene_object.
    name : str
        For people; the scene does not use it.
    inside, outside : tuple of Placed
        Solids that cut the surface, placed in the same scene: only what lies inside all of `inside` and
        outside all of `outside` exists. A hole is a plate with ``outside=(ball,)`` and the ball with
        ``inside=(plate,)``, then seen from within.
    """

    surface: Surface
    pose: Array = field(default_factory=lambda: np.eye(4))
    name: str = ""
    inside: tuple[Placed, ...] = ()
    outside: tuple[Placed, ...] = ()

    def __post_init__(self) -> None:
        object.__setattr__(self, "pose", pose_array(self.pose, "pose"))
        if isinstance(self.surface, HeightField) and (self.inside or self.outside):
            raise InvalidInputError(
                "a HeightField cannot be cut: only its first crossing with a ray is known"
            )

    def moved(self, motion: Array) -> Placed:
        """Return it moved rigidly, cuts included, by ``T_new_old`` (4, 4)."""
        return replace(
            self,
            pose=motion @ self.pose,
            inside=tuple(solid.moved(motion) for solid in self.inside),
            outside=tuple(solid.moved(motion) for solid in self.outside),
        )

    def implicit(self, points: Array) -> Array:
        """Evaluate the implicit function, (n,), at points of the scene, (n, 3); cuts do not change it."""
        return self.surface.implicit(transform_points(inverse(self.pose), points))

    def contains(self, points: Array) -> npt.NDArray[np.bool_]:
        """Tell which points of the scene, (n, 3), the cuts leave; to within a nanometre."""
        kept = np.ones(len(points), dtype=np.bool_)
        for solid in self.inside:
            kept &= solid.implicit(points) <= _SEAM
        for solid in self.outside:
            kept &= solid.implicit(points) >= -_SEAM
        return kept

    def near(self, origins: Array, directions: Array) -> npt.NDArray[np.intp]:
        """Numbers of the rays that pass the surface's sphere about its origin; the others cannot meet it."""
        if not np.isfinite(self.surface.extent):
            return np.arange(len(origins))
        to_center = self.pose[:3, 3] - origins
        along = np.einsum("ij,ij->i", to_center, directions)
        square = np.einsum("ij,ij->i", to_center, to_center)
        aside = square - along**2 / np.einsum("ij,ij->i", directions, directions)
        # What is lost to cancellation is far below a thousandth of the distance.
        return np.flatnonzero(aside <= (self.surface.extent * 1.001) ** 2 + 1e-6 * square)

    def crossings(self, origins: Array, directions: Array) -> Array:
        """Ray parameters (k, n) in the scene, infinite where there is none; see :meth:`Surface.crossings`."""
        to_object = inverse(self.pose)
        result = self.surface.crossings(transform_points(to_object, origins), rotate(to_object, directions))
        if self.inside or self.outside:
            for t in result:
                ray = np.flatnonzero(np.isfinite(t))
                kept = self.contains(origins[ray] + t[ray, None] * directions[ray])
                t[ray[~kept]] = np.inf
        return result


@dataclass(frozen=True)
class Hits:
    """What rays meet first.

    Attributes
    ----------
    t : (n,) ndarray
        Ray parameters; infinite for a ray that meets nothing.
    surface : (n,) ndarray of int32
        Index of the surface in the scene, -1 for none.
    points : (n, 3) ndarray
        Metres, scene axes; NaN for none.
    normals : (n, 3) ndarray
        Unit normals against the ray (towards its origin); NaN for none.
    curvatures : (n, 2) ndarray
        Principal curvatures k1 >= k2, per metre, with that normal: a bump seen from the ray's origin is
        positive.
    """

    t: Array
    surface: npt.NDArray[np.int32]
    points: Array
    normals: Array
    curvatures: Array


@dataclass(frozen=True, eq=False)
class Scene:
    """Placed surfaces; a surface's index is its id.

    Parameters
    ----------
    objects : tuple of Placed
        May touch, overlap or stand inside one another; rays see what comes first.
    """

    objects: tuple[Placed, ...]

    def __init__(self, objects: Sequence[Placed]) -> None:
        if not objects:
            raise InvalidInputError("a scene needs at least one surface")
        object.__setattr__(self, "objects", tuple(objects))

    @property
    def names(self) -> tuple[str, ...]:
        """Names of the surfaces, in the order of their ids."""
        return tuple(placed.name for placed in self.objects)

    def moved(self, motion: Array) -> Scene:
        """Return the whole scene moved rigidly by ``T_new_old`` (4, 4): another view of it."""
        return Scene([placed.moved(motion) for placed in self.objects])

    def cast(self, origins: Array, directions: Array) -> Hits:
        """Follow rays to the first surface in front of their origins.

        Parameters
        ----------
        origins, directions : (n, 3) array_like
            Rays ``origin + t * direction`` with t > 0, in metres; directions of any length but zero.

        Returns
        -------
        Hits
        """
        origins, directions = _rays(origins, directions)
        nearest = np.full(len(origins), np.inf)
        surface = np.full(len(origins), -1, dtype=np.int32)
        for index, placed in enumerate(self.objects):
            ray = placed.near(origins, directions)
            for t in placed.crossings(origins[ray], directions[ray]):
                closer = (t > 0.0) & (t < nearest[ray])
                nearest[ray[closer]] = t[closer]
                surface[ray[closer]] = index
        points = np.full((len(origins), 3), np.nan)
        normals, curvatures = points.copy(), points[:, :2].copy()
        for index, placed in enumerate(self.objects):
            ray = np.flatnonzero(surface == index)
            points[ray] = origins[ray] + nearest[ray, None] * directions[ray]
            own = transform_points(inverse(placed.pose), points[ray])
            normals[ray] = rotate(placed.pose, placed.surface.normals(own))
            curvatures[ray] = placed.surface.curvatures(own)
        behind = np.einsum("ij,ij->i", normals, directions) > 0.0
        normals[behind] *= -1.0
        curvatures[behind] = 0.0 - curvatures[behind, ::-1]  # not -0.0
        return Hits(nearest, surface, points, normals, curvatures)

    def hidden(self, eye: Array, points: Array) -> npt.NDArray[np.bool_]:
        """Tell which points something stands in front of.

        Parameters
        ----------
        eye : (3,) or (n, 3) array_like
            Where they are looked at from, in metres.
        points : (n, 3) array_like
            Points on the scene's surfaces.

        Returns
        -------
        (n,) ndarray of bool
            True where the line of sight is cut more than a millionth of its length before the point.
        """
        points = np.asarray(points, dtype=np.float64)
        origins, directions = _rays(np.broadcast_to(eye, points.shape), points - eye)
        result = np.zeros(len(points), dtype=np.bool_)
        for placed in self.objects:
            ray = placed.near(origins, directions)
            for t in placed.crossings(origins[ray], directions[ray]):
                result[ray] |= (t > 0.0) & (t < 1.0 - 1e-6)
        return result


def _rays(origins: Array, directions: Array) -> tuple[Array, Array]:
    """Check rays and return them as float64."""
    origins = np.asarray(origins, dtype=np.float64)
    directions = np.asarray(directions, dtype=np.float64)
    if origins.ndim != 2 or origins.shape[1] != 3 or origins.shape != directions.shape:
        raise InvalidInputError(
            f"rays are two (n, 3) arrays, origins and directions; got {origins.shape} and {directions.shape}"
        )
    return origins, directions
