"""`extract_field_signatures`, and what it gives."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, progress_callback, thread_count
from surfsig.orientation import orientation
from surfsig.places import place_numbers, places
from surfsig.point_cloud import PointCloud
from surfsig.status import Status

FloatArray = NDArray[np.float32]


@dataclass(frozen=True, eq=False, repr=False)
class FieldSignatures:
    """What tells m places from others: one struct of arrays, with a status for each place.

    NaN stands where there is no value.
    """

    radius: float
    """Of the patches, in the cloud's own unit."""
    oriented: bool
    """Whether a known viewpoint, or normals that came with the cloud, oriented the normals; otherwise their
    side is a convention that does not turn with the object, and few signatures agree between scans."""
    points: NDArray[np.floating]
    """The places, (m, 3)."""
    indices: NDArray[np.int64] | None
    """Their numbers in the cloud, (m,); None for places of their own."""
    vectors: FloatArray
    """The signatures, (m, 256), each of length 1. Equal places have equal ones, wherever they are and however
    they are turned; compare by distance or by scalar product."""
    axes: FloatArray
    """Large-scale unit normals, (m, 3), about which the patches were pooled."""
    tangents: FloatArray
    """Unit vectors square to the axes, (m, 3), from which angles are counted, by the right-hand rule."""
    phases: NDArray[np.complex64]
    """Some coefficients of angular orders 1 to 7 with their phases, (m, 7, 8): a patch turned by t about its
    axis has those of order n multiplied by exp(i n t)."""
    count: NDArray[np.uint32]
    """Points in the patch, (m,), after dense parts were thinned."""
    status: NDArray[np.uint8]
    """`Status` as a number, (m,): OK, NOT_FINITE, TOO_FEW_POINTS or DEGENERATE."""

    def __len__(self) -> int:
        """Return the number of places."""
        return len(self.vectors)

    def __repr__(self) -> str:
        """Say how many there are, and how many have a value."""
        return f"FieldSignatures({len(self)} places, radius={self.radius:g}, ok: {int(self.ok.sum())})"

    @property
    def ok(self) -> NDArray[np.bool_]:
        """Whether a place has a signature, (m,)."""
        return np.asarray(self.status == Status.OK)

    def take(self, places: ArrayLike) -> FieldSignatures:
        """Return those of some places.

        Parameters
        ----------
        places
            Their numbers, (k,), of which negative ones count from the end, or a mask, (m,).

        Returns
        -------
        FieldSignatures
            In the order of the numbers.

        Raises
        ------
        InvalidInputError
            If a number is outside, or a mask has another length.
        """
        chosen = place_numbers(places, len(self))
        return FieldSignatures(
            radius=self.radius,
            oriented=self.oriented,
            points=self.points[chosen],
            indices=None if self.indices is None else self.indices[chosen],
            vectors=self.vectors[chosen],
            axes=self.axes[chosen],
            tangents=self.tangents[chosen],
            phases=self.phases[chosen],
            count=self.count[chosen],
            status=self.status[chosen],
        )


def extract_field_signatures(
    cloud: PointCloud | ArrayLike,
    radius: float,
    *,
    at: ArrayLike | None = None,
    voxel: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> FieldSignatures:
    """Describe places by the surface around them, to find them again in other scans.

    Normals and curvature within the radius are pooled on a cylindrical grid about the large-scale normal and
    seen in a frame that was learned from simulated scans (``scripts/learn_field_frame.py``). The result does
    not depend on unit, position or turn of the object, and little on the density of its points.

    Parameters
    ----------
    cloud
        A `PointCloud`, an array (n, 3) of numbers, or any other that `PointCloud.of` takes.
    radius
        Of the patch around each place, in the cloud's own unit: as large as the scans overlap around a place,
        and eight times their points' spacing at least. Finite and above 0.
    at
        Where: numbers of points (m,), or places of their own (m, 3); every point by default.
    voxel
        In place of `at`: one point of each voxel of this size.
    viewpoint
        Where the sensor stood, (3,), in the cloud's coordinates. By default, in this order: `normals`, the
        cloud's own normals, its viewpoint, or its scans' viewpoints. Signatures of scans whose viewpoints are
        not known seldom agree.
    normals
        Normals that somebody knows, one of each point of the cloud, (n, 3), of any length; only their side
        counts.
    threads
        Number of threads; all cores by default. The result is the same, bit for bit.
    progress
        Called with the number of places done and their total, some twenty times a second.

    Returns
    -------
    FieldSignatures
        One struct of arrays, in the order of the places.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    """
    size = positive_length(radius, "radius")
    cloud = PointCloud.of(cloud)
    query, indices, points = places(cloud, at, voxel)
    # The whole cloud's normals are oriented, not those of the places alone.
    sensor, directions = orientation(cloud, viewpoint, normals, np.arange(len(cloud)))
    found: dict[str, NDArray[Any]] = _surfsig.field_signatures(
        cloud.offsets,
        origin=cloud.origin.tolist(),
        radius=size,
        at=query,
        viewpoint=None if sensor is None else sensor.tolist(),
        directions=directions,
        threads=thread_count(threads),
        progress=progress_callback(progress),
    )
    return FieldSignatures(
        radius=size,
        oriented=sensor is not None or directions is not None,
        points=points,
        indices=indices,
        phases=found.pop("phases").view(np.complex64).reshape(len(points), 7, 8),
        **found,
    )
