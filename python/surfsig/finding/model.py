"""A model as it is looked for: places on its surface, and signatures."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.spatial import cKDTree

from surfsig.arguments import positive_length
from surfsig.cloud_transforms import about_zero
from surfsig.curvature import extract
from surfsig.errors import InvalidInputError
from surfsig.field import FieldSignatures, extract_field_signatures
from surfsig.one_sided_normals import one_sided_normals
from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud
from surfsig.spacing import point_spacing
from surfsig.visibility import seen_from

Array = NDArray[np.float64]

_PATCH = 0.4
"""Radius of the patches in units of the median distance of the model's points from their median."""
_VOXELS = 16.0
"""Voxels of a patch's radius between the places of a surface."""
SPACINGS = 8.0
"""Point spacings that a patch's radius has at least."""
NORMAL_BALL = 3.0
"""Voxels: the radius from which normals are taken."""
PLACES = 4.0
"""Places with a signature along a patch's radius."""
_SIDE_VOXELS = 10.0
"""Voxels of a patch's radius between places whose sides are told from each other's."""
_CLOSED = 0.2
"""Length of the mean normal below which a surface goes all around, and has an outer side."""
FEWEST = 50
"""Points without which there is nothing to find."""


@dataclass(frozen=True, eq=False)
class Model:
    """What `find_instances` looks for, prepared once; coordinates are from `middle`."""

    points: Array
    """(n, 3), all of them."""
    middle: Array
    """(3,), in the coordinates that the model came in."""
    spacing: float
    """Between its points."""
    radius: float
    """Of its patches."""
    places: Array
    """(m, 3), one per voxel."""
    normals: Array
    """(m, 3), unit, outwards."""
    signatures: FieldSignatures
    sided: bool
    """Whether somebody knew the surface's side; otherwise it may be the other one."""

    @property
    def voxel(self) -> float:
        """Between the places."""
        return self.radius / _VOXELS

    @property
    def closed(self) -> bool:
        """Whether the surface goes all around."""
        return float(np.linalg.norm(self.normals.mean(axis=0))) < _CLOSED

    @property
    def extent(self) -> float:
        """Largest distance of its surface from `middle`; stray points have none."""
        return float(np.linalg.norm(self.places, axis=1).max())

    def with_radius(self, radius: float, threads: int | None) -> Model:
        """Give the model with patches of another radius."""
        return described(self.points, self.middle, radius, self.spacing, self._sides(), self.sided, threads)

    def inside_out(self, threads: int | None) -> Model:
        """Give the model with its surface's other side out."""
        return described(
            self.points, self.middle, self.radius, self.spacing, -self._sides(), self.sided, threads
        )

    def _sides(self) -> Array:
        return np.asarray(self.normals[cKDTree(self.places).query(self.points)[1]])


def model_of(data: PointCloud | ArrayLike, radius: float | None = None, threads: int | None = None) -> Model:
    """Prepare a model; `radius` None for one by its size.

    Raises
    ------
    InvalidInputError
        If it has too few points, no extent, or no surface.
    """
    cloud = PointCloud.of(data)
    local, middle = about_zero(cloud)
    if len(local) < FEWEST:
        raise InvalidInputError(f"a model needs {FEWEST} finite points at least, not {len(local)}")
    points = local.offsets
    spacing = point_spacing(points)
    size = _PATCH * float(np.median(np.linalg.norm(points - np.median(points, axis=0), axis=1)))
    size = max(size, SPACINGS * spacing) if radius is None else positive_length(radius, "radius")
    if size == 0.0:
        raise InvalidInputError("a model's points must not all be at one place")
    normals, sided = sides_of(local, size, threads)
    # What goes all around has its volume inside.
    sided |= float(np.linalg.norm(normals.mean(axis=0))) < _CLOSED
    return described(points, middle, size, spacing, normals, sided, threads)


def described(
    points: Array,
    middle: Array,
    radius: float,
    spacing: float,
    normals: Array,
    sided: bool,
    threads: int | None = None,
) -> Model:
    """Describe points (n, 3) with normals (n, 3), of which the side counts."""
    places, facing, _ = surface_places(points, normals, max(radius / _VOXELS, spacing), threads)
    if not len(places):
        raise InvalidInputError("a model's points must lie on a surface: these have no normals")
    signatures = extract_field_signatures(
        points, radius, voxel=radius / PLACES, normals=normals, threads=threads
    )
    return Model(points, middle, spacing, radius, places, facing, signatures.take(signatures.ok), sided)


def surface_places(
    points: Array, normals: Array, voxel: float, threads: int | None
) -> tuple[Array, Array, float]:
    """Give a place of each voxel, (m, 3), normals there, (m, 3), on the side of given ones; and the noise."""
    found = extract(points, radius=NORMAL_BALL * voxel, voxel=voxel, normals=normals, threads=threads)
    known = np.isfinite(found.normals).all(axis=1)
    noise = found.noise[np.isfinite(found.noise)]
    return (
        found.points[known].astype(np.float64),
        found.normals[known].astype(np.float64),
        float(np.median(noise)) if len(noise) else 0.0,
    )


def sides_of(cloud: PointCloud, radius: float, threads: int | None) -> tuple[Array, bool]:
    """Give normals (n, 3) on one side of each piece of surface, and whether the cloud says which that is.

    Where it does not, all are turned so that most face away from the middle.
    """
    viewpoint, directions = orientation(cloud, None, None, np.arange(len(cloud)))
    if directions is not None:
        return directions.astype(np.float64), True
    if viewpoint is not None and seen_from(viewpoint, cloud.points, point_spacing(cloud.points)):
        return np.asarray(viewpoint - cloud.points), True
    unknown = replace(cloud, viewpoint=None, viewpoints=None, fields={})
    normals = one_sided_normals(unknown, radius / _SIDE_VOXELS, threads)
    # The sign that makes the volume within positive.
    outwards = np.einsum("ij,ij->i", cloud.points - cloud.points.mean(axis=0), normals).sum()
    return (normals if outwards >= 0.0 else -normals), False
