"""From points to surfaces: `find_surfaces`."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import MOST_NEIGHBORS, positive_length, progress_callback, thread_count, whole_number
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud
from surfsig.resolution import warn_if_surface_is_lost
from surfsig.shapes.measured import measured_surface
from surfsig.shapes.surface import KINDS, Kind
from surfsig.surfaces.classes import members_of
from surfsig.surfaces.found import Surfaces


def find_surfaces(
    cloud: PointCloud | ArrayLike,
    *,
    min_points: int | None = None,
    noise: float | None = None,
    kinds: Sequence[Kind] | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Surfaces:
    """Find the planes, spheres, cylinders, cones and tori of a scan, with their sizes and errors.

    Surfaces grow from the smoothest points on, over neighbouring points that are within the noise around
    them; the simplest kind that explains its points wins. Pieces that a shadow or a gap cuts are one surface
    where one fit explains them as well as two; two sheets are two from a separation of five times the noise
    on. Nothing needs to be set, and nothing is left to
    chance: the result is always the same.

    At last each surface is fitted again as `surfsig.fit_sphere` and its like do, without a strip along its
    borders with others: there points of both lie within the noise, and bend the surface by more than its
    standard error. Where noise hides the sagitta of an arc, the radius is not determined: it is NaN,
    `radius_determined` is false, and the interval has no upper end.

    Parameters
    ----------
    cloud
        A `PointCloud`, an array (n, 3) of numbers, or any other that `PointCloud.of` takes (Open3D, pandas,
        ...). Points that are not finite belong to no surface.
    min_points
        Fewest points of a surface. By default a five-hundredth of all, from 20 to 1,000; and fewer where a
        surface ends at edges, as none does that is part of a free form: from 20 (plane) to 36 (torus) that
        err each for itself, or 10 to 26 where there is no noise.
    noise
        Standard deviation of the points' distances from the surfaces, in the cloud's own unit; by default
        estimated around each point.
    kinds
        Which to look for: "plane", "sphere", "cylinder", "cone", "torus"; all by default.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of points that have a surface, and of all, some twenty times a second.

    Returns
    -------
    Surfaces
        The number of each point's surface (`labels`), and the list of surfaces.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.

    Warns
    -----
    UserWarning
        If coordinates come in steps that are larger than the distance between points.
    """
    scan = PointCloud.of(cloud)
    warn_if_surface_is_lost(scan)
    asked = asked_surfaces(min_points, noise, kinds)
    threads = thread_count(threads)
    return found_in(scan, asked, threads, progress_callback(progress)).surfaces(scan, asked, threads)


@dataclass(frozen=True)
class AskedSurfaces:
    """Which surfaces are looked for, as `find_surfaces` says."""

    min_points: int | None
    noise: float | None
    kinds: tuple[Kind, ...]


def asked_surfaces(
    min_points: int | None, noise: float | None, kinds: Sequence[Kind] | None
) -> AskedSurfaces:
    """Check what is asked for.

    Raises
    ------
    InvalidInputError
        If it has no meaning.
    """
    fewest = None if min_points is None else whole_number(min_points, "min_points", MOST_NEIGHBORS)
    return AskedSurfaces(fewest, None if noise is None else positive_length(noise, "noise"), _kinds(kinds))


@dataclass(frozen=True, eq=False)
class CoreSurfaces:
    """What the core found.

    Attributes
    ----------
    labels
        (n,), the number of each point's surface; -1 for none.
    entries
        The surfaces, as `measured_surface` takes them.
    measured
        (n,), whether each point is one that its surface was fitted to.
    rounding
        Distances below it tell nothing.
    """

    labels: NDArray[np.int32]
    entries: list[dict[str, Any]]
    measured: NDArray[np.bool_]
    rounding: float

    def surfaces(self, scan: PointCloud, asked: AskedSurfaces, threads: int | None) -> Surfaces:
        """Measure how much of each surface the points cover."""
        members = members_of(self.labels, len(self.entries))
        found = [
            measured_surface(
                {**entry, "checked": True}, scan.offsets[chosen].astype(np.float64), scan.origin, chosen
            )
            for entry, chosen in zip(self.entries, members, strict=True)
        ]
        return Surfaces(scan, self.labels, found, asked.noise, threads)


def found_in(
    scan: PointCloud,
    asked: AskedSurfaces,
    threads: int | None,
    progress: Callable[[int, int], object] | None = None,
) -> CoreSurfaces:
    """Find the surfaces of a scan."""
    return CoreSurfaces(
        *_surfsig.find_surfaces(
            scan.offsets,
            origin=scan.origin.tolist(),
            kinds=asked.kinds,
            min_points=asked.min_points,
            noise=asked.noise,
            threads=threads,
            progress=progress,
        )
    )


def _kinds(kinds: Sequence[Kind] | None) -> tuple[Kind, ...]:
    if kinds is None:
        return KINDS
    chosen: list[Kind] = [kinds] if isinstance(kinds, str) else list(kinds)  # type: ignore[list-item]
    wrong = next((kind for kind in chosen if kind not in KINDS), None)
    if wrong is not None:
        raise InvalidInputError(f"kinds must be of {', '.join(KINDS)}, not {wrong!r:.40}")
    if not chosen:
        raise InvalidInputError(f"kinds must be some of {', '.join(KINDS)}")
    return tuple(chosen)
