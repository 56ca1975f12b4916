"""Shapes by orthogonal distance, and how sure they are: `fit_sphere`, `fit_cylinder`, `fit_plane`."""

from __future__ import annotations

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, progress_callback, thread_count
from surfsig.clean import COORDINATE_LIMIT
from surfsig.digits import position_text
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud, position_array
from surfsig.progress import ProgressCallback
from surfsig.resolution import warn_if_surface_is_lost
from surfsig.shapes.form_error import FormError
from surfsig.shapes.growth import grown
from surfsig.shapes.patch import SurfacePatch
from surfsig.shapes.relation import SurfaceAngle, SurfaceDistance
from surfsig.shapes.robust import fitted_to_inliers
from surfsig.shapes.surface import KINDS, Kind, Surface, measured_surface

Array = NDArray[np.float64]

__all__ = [
    "KINDS",
    "FormError",
    "Kind",
    "Surface",
    "SurfaceAngle",
    "SurfaceDistance",
    "SurfacePatch",
    "fit_cylinder",
    "fit_plane",
    "fit_sphere",
]


def fit_sphere(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a sphere to points, or to the points of a scan that are on a sphere near a place.

    The sum of squared distances from the surface is least. The standard errors do not rely on the number of
    points, which err alike where they are neighbours, but on what the residuals of 8 to 32 blocks of
    neighbouring points have in common. For independent noise 95 % of the intervals hold the radius; on
    simulated lidar scans of a sphere, with errors along the ray that are correlated along each line, 80 to
    90 %. What a scanner errs over all of the surface is not in them (ray noise at the rim made those
    spheres 0.3 % too small), nor which points were taken for the surface's.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes. Points that are not finite do not count.
    near
        (3,), a place on the surface or near it, in the cloud's coordinates. The fit begins with the points
        around it, and grows to all points within 3 standard deviations of the surface that hang together.
        Without it all points are fitted.
    radius
        With `near`: of the ball around it whose points are the start, in the cloud's unit; half the object's
        own to all of it is a good one. By default 32, 64, ... of the nearest points, until two starts lead
        to the same shape.
    robust
        Whether to leave out points farther than 3 standard deviations from the surface, judged by the median,
        and fit again until none is left; with `near` this is always done.
    threads
        Number of threads; all cores by default. Two starts are grown at a time; a single fit takes one
        thread. The result is the same.
    progress
        Called with the number of steps done, and how many there are at most: starts with `near` (the last
        ones are seldom needed), else fits.

    Returns
    -------
    Surface
        With `radius`, its standard error `radius_std` and its 95 % `interval`.

    Raises
    ------
    InvalidInputError
        If the points are too few, or determine no sphere; or an argument has no meaning.
    """
    return _fit("sphere", cloud, near, radius, robust, threads, progress)


def fit_cylinder(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a cylinder without ends to points, or to those of a scan that are on a cylinder near a place.

    Parameters
    ----------
    cloud, near, radius, robust, threads, progress
        As for `fit_sphere`.

    Returns
    -------
    Surface
        With `axis`, `radius`, its standard error `radius_std` and its 95 % `interval`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return _fit("cylinder", cloud, near, radius, robust, threads, progress)


def fit_plane(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a plane to points, or to those of a scan that are on a plane near a place.

    Parameters
    ----------
    cloud, near, radius, robust, threads, progress
        As for `fit_sphere`.

    Returns
    -------
    Surface
        With the normal as `axis`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return _fit("plane", cloud, near, radius, robust, threads, progress)


def _fit(
    kind: Kind,
    data: PointCloud | ArrayLike,
    place: ArrayLike | None,
    radius: float | None,
    robust: bool,
    threads: int | None,
    progress: ProgressCallback | None,
) -> Surface:
    workers, tell = thread_count(threads), progress_callback(progress)
    cloud = PointCloud.of(data)
    warn_if_surface_is_lost(cloud, stacklevel=4)
    finite = cloud.finite
    points = cloud.offsets[finite].astype(np.float64)
    unknowns = _surfsig.KIND_PARAMETERS[kind]
    if len(points) <= unknowns:
        raise InvalidInputError(f"a {kind} takes at least {unknowns + 1} points, not {len(points)}")
    if not (np.abs(points) <= COORDINATE_LIMIT).all():
        raise InvalidInputError(f"coordinates must be within {COORDINATE_LIMIT:g} for a fit")
    if radius is not None and place is None:
        raise InvalidInputError("radius is that of the ball around near: give near, too")
    if place is None:
        found = fitted_to_inliers(kind, points, robust=robust, progress=tell)
    else:
        start = None if radius is None else positive_length(radius, "radius")
        position = position_array(place, "near")
        _check_near(points, position - cloud.origin, start, position)
        found = grown(kind, points, position - cloud.origin, start, workers, tell)
    if found is None:
        where = "" if place is None else " near that place"
        raise InvalidInputError(f"the points{where} determine no {kind}")
    primitive, chosen = found
    return _described(kind, primitive, points[chosen], cloud.origin, np.flatnonzero(finite)[chosen])


def _described(
    kind: Kind, primitive: _surfsig.Primitive, points: Array, origin: Array, members: NDArray[np.intp]
) -> Surface:
    """Describe a surface that was fitted to points, both less the origin."""
    covariance, across, freedom = primitive.uncertainty(points)
    squares = float((primitive.distances(points) ** 2).sum())
    fitted = {
        "kind": kind,
        "point": primitive.point + origin,
        "axis": np.full(3, np.nan) if kind == "sphere" else primitive.axis,
        "radius": primitive.radius,
        "major_radius": np.nan,
        "half_angle": np.nan,
        "deviation": np.sqrt(squares / (len(points) - _surfsig.KIND_PARAMETERS[kind])),
        "covariance": covariance,
        "across": across,
        "freedom": freedom,
    }
    return measured_surface(fitted, points, origin, members)


def _check_near(points: Array, place: Array, radius: float | None, given: Array) -> None:
    """Refuse a position that is farther from all points than a surface of them could reach."""
    nearest = float(np.linalg.norm(points - place, axis=1).min())
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    if nearest > extent:
        raise InvalidInputError(
            f"near is {nearest:.4g} from the nearest point, farther than the cloud's extent of {extent:.4g}: "
            f"no surface reaches {position_text(given)}"
        )
    if radius is not None and nearest > radius:
        raise InvalidInputError(
            f"no point is within the radius {radius:.4g} of near: the nearest is {nearest:.4g} away"
        )
