"""From points to curvature: `extract`, and `extract_radii` for several radii at once."""

from __future__ import annotations

import warnings
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import (
    MOST_NEIGHBORS,
    positive_length,
    progress_callback,
    thread_count,
    whole_number,
)
from surfsig.defaults import AXES, FIT, Axes, Fit
from surfsig.errors import InvalidInputError
from surfsig.extraction import Extraction
from surfsig.orientation import orientation
from surfsig.places import places
from surfsig.point_cloud import PointCloud
from surfsig.resolution import step_text
from surfsig.status import Status


def extract(
    cloud: PointCloud | ArrayLike,
    radius: float | Literal["auto"] | None = None,
    *,
    neighbors: int | None = None,
    axes: Axes = AXES,
    fit: Fit = FIT,
    at: ArrayLike | None = None,
    voxel: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Extraction:
    """Extract curvature from the points around each place: eq. (5), and from it k1, k2, K and H.

    Parameters
    ----------
    cloud
        A `PointCloud`, an array (n, 3) of numbers, or any other that `PointCloud.of` takes (Open3D, pandas,
        ...). Points that are not finite belong to no ball.
    radius
        Radius of the ball around each place, in the cloud's own unit; half the side D of the paper's
        patch. Finite and above 0. May be left out where `neighbors` is given. "auto": for each place the
        largest of the radii 2^(i/2), i a whole number, that the fit still explains: from the smallest ball
        with 16 points on, as long as no points farther from the surface come, the one whose mean curvature
        errs least, by its standard error and by a bias that shows against the next smaller ball; a step
        less where a larger one was rejected. `Extraction.radius` says which; only points near to a place
        count. In the surface's axes only.
    neighbors
        That many nearest points, the place itself included where it is a point of the cloud; together
        with `radius` at most that many of the points within it (a hybrid search).
    axes
        "surface": the paraboloid's height runs along its own normal, and the result turns with the
        object. "sensor": along z, as the paper fits; z runs away from the sensor.
    fit
        "paraboloid": eq. (5), with the smallest spread, and a bias where the ball is not small against the
        radius of curvature (13 % on a sphere of 1.5 balls). "quadric": a general quadric with Taubin's
        normalisation, unbiased on spheres, cylinders, cones and ellipsoids of any size, wherever it stands
        out of the noise (a rise of some 15 noise deviations within the ball, and no patch that is
        one-sided); the paraboloid elsewhere. "auto": for each place what errs less. `Extraction.fit_used`
        says which; only "paraboloid" in the sensor's axes.
    at
        Where: numbers of points (m,), or places of their own (m, 3); every point by default.
    voxel
        In place of `at`: one point of each voxel of this size, the one nearest to the mean of the
        voxel's points.
    viewpoint
        Where the sensor stood, (3,), in the cloud's coordinates. It orients the normals, and with them
        the sign of curvature. By default, in this order: `normals`, the cloud's own normals (fields
        ``nx``, ``ny``, ``nz`` or ``normals``), its viewpoint, or its scans' viewpoints.
    normals
        Normals that somebody knows, one of each point of the cloud, (n, 3), of any length; only their
        side counts. Places that are no points of the cloud do not take part.
    robust
        Leave out points farther from the fitted surface than three standard deviations of the others, and
        fit again, until the choice stands; `count` is then the number of points that stay.
    threads
        Number of threads; all cores by default. The result is the same, bit for bit.
    progress
        Called with the number of places done and their total, some twenty times a second.

    Returns
    -------
    Extraction
        One struct of arrays, in the order of the places.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.

    Warns
    -----
    UserWarning
        If coordinates come in steps that are too large for the radius; the places that suffer have the status
        ``TOO_COARSE``, and no curvature.
    """
    size, most = neighborhood(radius, neighbors, axes)
    job = _Job(axes, fit, at, voxel, viewpoint, normals, robust, threads, progress)
    return job.run(PointCloud.of(cloud), size, most)[0]


def neighborhood(
    radius: float | Literal["auto"] | None, neighbors: int | None, axes: Axes
) -> tuple[float | Literal["auto"] | None, int | None]:
    """Check what `extract` takes as the size of its neighbourhoods, and return radius and number.

    Raises
    ------
    InvalidInputError
        If they have no meaning, or none together.
    """
    if radius is None and neighbors is None:
        raise InvalidInputError("give a radius, or neighbors, or both")
    if isinstance(radius, str):
        if radius != "auto":
            raise InvalidInputError(f"radius must be a number or 'auto', not {radius!r:.40}")
        if neighbors is not None:
            raise InvalidInputError("radius='auto' and neighbors exclude each other")
        if axes == "sensor":
            raise InvalidInputError("radius='auto' chooses by standard errors, which axes='sensor' has not")
    size = radius if radius is None or isinstance(radius, str) else positive_length(radius, "radius")
    return size, None if neighbors is None else whole_number(neighbors, "neighbors", MOST_NEIGHBORS)


@dataclass(frozen=True)
class WholeCloud:
    """What an extraction of a part of a cloud takes from the whole, so that both give the same bits.

    Attributes
    ----------
    single_precision, lattice
        Of the whole cloud's coordinates, as ``_surfsig.coordinate_resolution`` finds them.
    distances
        From a few places of the whole cloud to their nearest points, ascending; empty where the
        neighbourhoods are balls of one radius.
    largest
        The largest of the whole cloud's coordinates, without its sign.
    complete
        (2, 3), the lowest and the highest corner of the box in which the part has all of its points.
    """

    single_precision: bool
    lattice: Sequence[float]
    distances: Sequence[float]
    largest: float
    complete: NDArray[np.float64]

    def arguments(self) -> tuple[bool, list[float], list[float], float, list[list[float]]]:
        """Give what the core takes."""
        box: list[list[float]] = self.complete.tolist()
        return self.single_precision, list(self.lattice), list(self.distances), self.largest, box


def extract_part(
    cloud: PointCloud,
    whole: WholeCloud,
    radius: float | Literal["auto"] | None = None,
    *,
    neighbors: int | None = None,
    axes: Axes = AXES,
    fit: Fit = FIT,
    at: ArrayLike | None = None,
    viewpoint: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> tuple[Extraction, NDArray[np.uint32]]:
    """Extract curvature at places of a part of a cloud, as `extract` does at those of the whole.

    Parameters
    ----------
    cloud
        The part: points of the whole cloud in the whole cloud's order.
    whole
        What it takes from the whole.
    radius, neighbors, axes, fit, at, viewpoint, robust, threads, progress
        As in `extract`.

    Returns
    -------
    Extraction
        With the whole cloud's bits, but at those places:
    numpy.ndarray
        (k,) uint32, the numbers of the places whose neighbourhoods reach beyond what the part has of the
        whole.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    """
    size, most = neighborhood(radius, neighbors, axes)
    job = _Job(axes, fit, at, None, viewpoint, None, robust, threads, progress)
    (found,), beyond = job.results(cloud, size, most, whole)
    assert beyond is not None
    return found, beyond


def extract_radii(
    cloud: PointCloud | ArrayLike,
    radii: Sequence[float],
    *,
    axes: Axes = AXES,
    fit: Fit = FIT,
    at: ArrayLike | None = None,
    voxel: float | None = None,
    viewpoint: ArrayLike | None = None,
    normals: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> list[Extraction]:
    """Extract curvature from balls of several radii around each place, in one pass over the points.

    Values differ from those of `extract` with one radius by rounding only: |dk| <= 1e-5 max(|k|, 1 / radius);
    a point whose distance is the radius, within rounding, may count in one of them only.

    Parameters
    ----------
    cloud, axes, fit, at, voxel, viewpoint, normals, robust, threads
        As in `extract`.
    radii
        Radii of the balls, in the cloud's own unit.
    progress
        Called with the number of balls done and their total.

    Returns
    -------
    list of Extraction
        One for each radius, in their order.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.
    """
    if isinstance(radii, str) or not np.iterable(radii):
        raise InvalidInputError(f"radii must be some numbers, not {radii!r:.40}")
    sizes = [positive_length(radius, "radius") for radius in radii]
    job = _Job(axes, fit, at, voxel, viewpoint, normals, robust, threads, progress)
    return job.run(PointCloud.of(cloud), sizes, None)


def _each_its_own(radius: float | str | None, count: int) -> float | NDArray[np.float32]:
    """Give the radius of all balls, or NaN for each place where none has its own (no point is finite)."""
    return radius if isinstance(radius, float) else np.full(count, np.nan, np.float32)


FEW_TOO_COARSE = 0.01
"""Share of places up to which nothing is said of coarse coordinates beside their status: lines of a scanner,
as far apart as a fifth of the radius, are steps of those few faces that they run along."""


@dataclass(frozen=True)
class _Job:
    """How curvature is extracted, whatever the neighbourhoods are."""

    axes: Axes
    fit: Fit
    at: ArrayLike | None
    voxel: float | None
    viewpoint: ArrayLike | None
    normals: ArrayLike | None
    robust: bool
    threads: int | None
    progress: Callable[[int, int], object] | None

    def run(
        self, cloud: PointCloud, radius: float | Sequence[float] | str | None, neighbors: int | None
    ) -> list[Extraction]:
        """Extract, once for each radius; warn where coordinates are too coarse for it."""
        extractions, _ = self.results(cloud, radius, neighbors)
        counts = [int((found.status == Status.TOO_COARSE).sum()) for found in extractions]
        too_coarse, places = max(counts, default=0), len(extractions[0]) if extractions else 0
        if too_coarse > FEW_TOO_COARSE * places:
            warnings.warn(
                f"{step_text(cloud)}, too coarse for the radius: {too_coarse} of "
                f"{places} places have no curvature (status too_coarse)",
                stacklevel=3,
            )
        return extractions

    def results(
        self,
        cloud: PointCloud,
        radius: float | Sequence[float] | str | None,
        neighbors: int | None,
        whole: WholeCloud | None = None,
    ) -> tuple[list[Extraction], NDArray[np.uint32] | None]:
        """Extract, once for each radius; of a part of a cloud, tell which places looked beyond it."""
        self._check()
        origin: Sequence[float] = cloud.origin.tolist()
        query, indices, points = places(cloud, self.at, self.voxel)
        sensor, directions = orientation(cloud, self.viewpoint, self.normals, indices)
        found: list[dict[str, Any]] = _surfsig.extract(
            cloud.offsets,
            origin=origin,
            radius=radius,
            axes=self.axes,
            fit=self.fit,
            neighbors=neighbors,
            at=query,
            viewpoint=None if sensor is None else sensor.tolist(),
            directions=directions,
            robust=self.robust,
            threads=thread_count(self.threads),
            progress=progress_callback(self.progress),
            whole=None if whole is None else whole.arguments(),
        )
        sizes = radius if isinstance(radius, Sequence) and not isinstance(radius, str) else [radius]
        beyond = found[0].pop("beyond") if whole is not None else None
        extractions = [
            Extraction(
                radius=arrays.pop("radius", _each_its_own(size, len(points))),
                **arrays,
                axes=self.axes,
                oriented=sensor is not None or directions is not None,
                points=points,
                indices=indices,
            )
            for size, arrays in zip(sizes, found, strict=True)
        ]
        return extractions, beyond

    def _check(self) -> None:
        if self.axes not in ("surface", "sensor"):
            raise InvalidInputError(f"axes must be 'surface' or 'sensor', not {self.axes!r}")
        if self.fit not in ("paraboloid", "quadric", "auto"):
            raise InvalidInputError(f"fit must be 'paraboloid', 'quadric' or 'auto', not {self.fit!r}")
        if self.fit != "paraboloid" and self.axes == "sensor":
            raise InvalidInputError("only fit='paraboloid' is fitted in the sensor's axes")
