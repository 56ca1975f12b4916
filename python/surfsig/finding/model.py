"""A model as it is looked for: points, samples of its surface, and places with signatures."""

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import thread_count
from surfsig.field import FieldSignatures
from surfsig.finding.scan import scan_argument
from surfsig.point_cloud import PointCloud
from surfsig.status import Status

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class Model:
    """What `find_instances` looks for, prepared once; coordinates are about `center`."""

    points: Array
    """(n, 3), all of them."""
    center: Array
    """(3,), in the coordinates that the model came in."""
    spacing: float
    """Between its points."""
    radius: float
    """Of its patches."""
    samples: Array
    """(m, 3), points of the surface, one per voxel."""
    normals: Array
    """(m, 3), unit, outwards."""
    signatures: FieldSignatures
    """Of places all over it."""
    larger_signatures: tuple[FieldSignatures, ...]
    """The same of larger patches, the smaller first."""
    is_sided: bool
    """Whether it is known which side of the surface is the outer one."""

    def brief(self) -> Model:
        """Give what tells whether it may be in a scene: the places of the largest patches, and samples."""
        return _model(_surfsig.brief_model(self.argument()))

    def argument(self) -> tuple[Any, ...]:
        """Give the model as the core takes it."""
        return (
            np.ascontiguousarray(self.points, np.float64),
            np.asarray(self.center, np.float64).tolist(),
            float(self.spacing),
            float(self.radius),
            np.ascontiguousarray(self.samples, np.float64),
            np.ascontiguousarray(self.normals, np.float64),
            _places_argument(self.signatures),
            [(float(larger.radius), _places_argument(larger)) for larger in self.larger_signatures],
            bool(self.is_sided),
        )


def _places_argument(places: FieldSignatures) -> tuple[NDArray[Any], ...]:
    # A flat model has no places, and a reshape to -1 columns needs a row.
    phases = np.ascontiguousarray(places.phases, np.complex64).view(np.float32)
    return (
        np.ascontiguousarray(places.points, np.float64),
        np.ascontiguousarray(places.vectors, np.float32),
        np.ascontiguousarray(places.axes, np.float32),
        np.ascontiguousarray(places.tangents, np.float32),
        phases.reshape(len(places), math.prod(phases.shape[1:])),
    )


def model_of(data: PointCloud | ArrayLike, threads: int | None = None) -> Model:
    """Prepare a model.

    Raises
    ------
    InvalidInputError
        If it has too few points, no extent, or no surface.
    """
    cloud = PointCloud.of(data)
    scan = scan_argument(cloud.at(np.flatnonzero(cloud.finite)))
    return _model(_surfsig.prepare_model(scan, threads=thread_count(threads)))


def _model(found: dict[str, Any]) -> Model:
    signatures = _signatures(found.pop("places"))
    larger = tuple(_signatures(places) for places in found.pop("larger_places"))
    return Model(signatures=signatures, larger_signatures=larger, **found)


def _signatures(places: dict[str, Any]) -> FieldSignatures:
    count = len(places["points"])
    return FieldSignatures(
        oriented=True,
        indices=None,
        status=np.full(count, Status.OK, np.uint8),
        phases=places.pop("phases").view(np.complex64).reshape(count, 7, 8),
        **places,
    )
