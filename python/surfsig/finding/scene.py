"""A scene as models are looked for in it: places, and what its sensor saw."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from surfsig._surfsig import DepthImage, SurfaceIndex, SurfacePlaces
from surfsig.cloud_transforms import about_zero
from surfsig.field import FieldSignatures, extract_field_signatures
from surfsig.finding.model import PLACES, sides_of, surface_places
from surfsig.missing_returns import missing_returns
from surfsig.point_cloud import PointCloud
from surfsig.spacing import point_spacing
from surfsig.visibility import seen_from

Array = NDArray[np.float64]

_CELL = 4.0
"""Voxels of a cell of the surface's index."""


class Surroundings:
    """The surface of a scene, one place per voxel, and which of them no instance explains yet."""

    def __init__(self, places: Array, normals: Array, noise: float, voxel: float) -> None:
        self.places, self.normals, self.noise, self.voxel = places, normals, noise, voxel
        self.tree = cKDTree(places)
        surface = SurfacePlaces(places.astype(np.float32), normals.astype(np.float32))
        self.index = SurfaceIndex(surface, _CELL * voxel)
        self.all_free = np.ones(len(places), np.bool_)
        self.free = self.all_free.copy()

    def image(self, middle: Array, reach: float, eye: Array, own: NDArray[np.bool_]) -> DepthImage:
        """Give what the sensor saw around a place, about that place; `own` are places that may confirm."""
        near = np.array(self.tree.query_ball_point(middle, 2.0 * reach), np.int64)
        surface = SurfacePlaces(
            (self.places[near] - middle).astype(np.float32), self.normals[near].astype(np.float32)
        )
        nothing = np.empty((0, 3), np.float32)
        return DepthImage(
            surface,
            own[near],
            eye=(eye - middle).tolist(),
            spacing=self.voxel,
            reach=reach,
            floors=SurfacePlaces(nothing, nothing),
        )


class Scene:
    """A cloud, prepared for models; coordinates are from `middle`. What is made once is kept."""

    def __init__(self, cloud: PointCloud, radius: float, threads: int | None) -> None:
        """Take a cloud; `radius` is of patches over which its surface's side is told."""
        self.given = cloud
        self.numbers = np.flatnonzero(cloud.finite & ~missing_returns(cloud))
        """Of the points in the cloud that was given."""
        self._cloud, self.middle = about_zero(cloud.at(self.numbers))
        self.points: Array = self._cloud.offsets
        self.spacing = point_spacing(self.points)
        self.threads = threads
        origin = cloud.origin - self.middle
        if cloud.viewpoint is None and cloud.viewpoints is None and self._seen_from(origin):
            # Most sensors are at the origin of their own coordinates.
            self._cloud = replace(self._cloud, viewpoint=origin)
        self._normals, self.sided = sides_of(self._cloud, radius, threads)
        self._parts: dict[float, Surroundings] = {}
        self._signatures: dict[float, FieldSignatures] = {}

    def signatures(self, radius: float) -> FieldSignatures:
        """Describe its places."""
        if radius not in self._signatures:
            found = extract_field_signatures(
                self.points, radius, voxel=radius / PLACES, normals=self._normals, threads=self.threads
            )
            self._signatures[radius] = found.take(found.ok)
        return self._signatures[radius]

    def surroundings(self, voxel: float) -> Surroundings:
        """Give its surface with one place per voxel."""
        if voxel not in self._parts:
            self._parts[voxel] = Surroundings(
                *surface_places(self.points, self._normals, voxel, self.threads), voxel
            )
        return self._parts[voxel]

    def parts(self) -> Iterable[Surroundings]:
        """Give all surfaces that were asked for."""
        return self._parts.values()

    def eye(self) -> Array | None:
        """Give where all was seen from, (3,); of a sweep, the mean. None where no one place saw all."""
        eye = self._cloud.viewpoint
        if self._cloud.viewpoints is not None:
            eye = self._cloud.viewpoints[self._cloud.fields["scan"]].mean(axis=0)
        return eye if eye is not None and self._seen_from(eye) else None

    def _seen_from(self, eye: Array) -> bool:
        return seen_from(eye, self.points, self.spacing)
