"""Shapes by orthogonal distance, and how sure they are: a function for each kind."""

from __future__ import annotations

from numpy.typing import ArrayLike

from surfsig.point_cloud import PointCloud
from surfsig.progress import ProgressCallback
from surfsig.shapes.fitting import Criterion, fitted
from surfsig.shapes.surface import Surface


def fit_sphere(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    weights: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a sphere to points, or to the points of a scan that are on a sphere near a place.

    The sum of squared distances from the surface is least. Many starts are tried, so that a minimum beside
    the least one is no result. The standard errors do not rely on the number of points, which err alike where
    they are neighbours, but on what the residuals of 8 to 32 blocks of neighbouring points have in common.
    For independent noise 95 % of the intervals hold the radius, also of a ball grown from a place in a scan;
    on simulated lidar scans of a sphere, with errors along the ray that are correlated along each line, 80 to
    90 %. What a scanner errs over all of the surface is not in them (ray noise at the rim made those spheres
    0.3 % too small).

    Where noise hides the sagitta of an arc, the radius is not determined: it is NaN, `radius_determined` is
    false, and the interval has no upper end.

    Parameters
    ----------
    cloud
        What `PointCloud.of` takes. Points that are not finite do not count.
    near
        (3,), a place on the surface or near it, in the cloud's coordinates. The fit begins with the points
        around it, and grows to all points within 3 standard deviations of the surface that hang together, but
        for those at its border beside other things, which are near it on one side.
        Without it all points are fitted.
    radius
        In the cloud's unit. Without `near`: the radius that the shape has, where it is known; only the rest
        is fitted. With `near`: of the ball around it whose points are the start; half the object's own to all
        of it is a good one. By default 32, 64, ... of the nearest points, until two starts lead to one shape.
    weights
        (n,), one for each point of the cloud, finite and not below 0: by how much its squared distance
        counts, such as one over the variance of its noise. Their common factor means nothing.
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
    return fitted(
        "sphere",
        cloud,
        near=near,
        radius=radius,
        weights=weights,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_cylinder(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    criterion: Criterion = "least_squares",
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a cylinder without ends to points, or to those of a scan that are on a cylinder near a place.

    Parameters
    ----------
    cloud, near, radius, weights, robust, threads, progress
        As for `fit_sphere`.
    axis
        (3,), of any length: the axis that the cylinder has, where it is known; only the rest is fitted.
    criterion
        "least_squares", or "minimum_zone": the largest distance is least (Chebyshev),
        which gives the cylindricity. It begins from the least squares.
        It has no covariance, and takes neither `near`, `robust`, `weights` nor `radius`.

    Returns
    -------
    Surface
        With `axis`, `radius`, its standard error `radius_std` and its 95 % `interval`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "cylinder",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        criterion=criterion,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_plane(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    criterion: Criterion = "least_squares",
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a plane to points, or to those of a scan that are on a plane near a place.

    Parameters
    ----------
    cloud, near, weights, robust, threads, progress
        As for `fit_sphere`.
    radius
        With `near` only: of the ball around it whose points are the start, as for `fit_sphere`.
    axis
        (3,), of any length: the normal that the plane has, where it is known; only the rest is fitted.
    criterion
        "least_squares", or "minimum_zone": the largest distance is least (Chebyshev),
        which gives the flatness. It begins from the least squares.
        It has no covariance, and takes neither `near`, `robust`, `weights` nor `radius`.

    Returns
    -------
    Surface
        With the normal as `axis`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "plane",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        criterion=criterion,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_cone(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit one nappe of a cone to points, or to those of a scan that are on a cone near a place.

    Parameters
    ----------
    cloud, near, weights, robust, threads, progress
        As for `fit_sphere`.
    radius
        With `near` only: of the ball around it whose points are the start, as for `fit_sphere`.
    axis
        (3,), of any length: the axis that the cone has, where it is known; only the rest is fitted.

    Returns
    -------
    Surface
        With `axis`, along which the cone widens, `half_angle` and its standard error `half_angle_std`,
        and the `radius` at `point`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "cone",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_torus(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a torus to points, or to those of a scan that are on a torus near a place.

    Parameters
    ----------
    cloud, near, weights, robust, threads, progress
        As for `fit_sphere`.
    radius
        With `near` only: of the ball around it whose points are the start, as for `fit_sphere`.
    axis
        (3,), of any length: the axis that the torus has, where it is known; only the rest is fitted.

    Returns
    -------
    Surface
        With `axis`, `center`, `major_radius` and its standard error `major_radius_std`, and the
        tube's `radius`, `radius_std` and `interval`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "torus",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_circle(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    criterion: Criterion = "least_squares",
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a circle in space to points, or to those of a scan that are on a circle near a place.

    The sum of squared distances in space is least, those across the plane of the circle and those in it.

    Parameters
    ----------
    cloud, near, radius, weights, robust, threads, progress
        As for `fit_sphere`.
    axis
        (3,), of any length: the axis that the circle has, where it is known; only the rest is fitted.
    criterion
        "least_squares", or "minimum_zone": the largest distance is least (Chebyshev),
        which gives the roundness. Distances in the plane of the
        least squares count, from which it begins.
        It has no covariance, and takes neither `near`, `robust`, `weights` nor `radius`.

    Returns
    -------
    Surface
        With `center`, `axis`, across the circle's plane, `radius`, `radius_std` and `interval`.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "circle",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        criterion=criterion,
        robust=robust,
        threads=threads,
        progress=progress,
    )


def fit_line(
    cloud: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None = None,
    radius: float | None = None,
    axis: ArrayLike | None = None,
    weights: ArrayLike | None = None,
    robust: bool = False,
    threads: int | None = None,
    progress: ProgressCallback | None = None,
) -> Surface:
    """Fit a straight line in space to points, or to those of a scan that are on a line near a place.

    Parameters
    ----------
    cloud, near, weights, robust, threads, progress
        As for `fit_sphere`.
    radius
        With `near` only: of the ball around it whose points are the start, as for `fit_sphere`.
    axis
        (3,), of any length: the direction that the line has, where it is known; only the rest is fitted.

    Returns
    -------
    Surface
        With the direction as `axis`; `point` is beside the mean of the points.

    Raises
    ------
    InvalidInputError
        As `fit_sphere`.
    """
    return fitted(
        "line",
        cloud,
        near=near,
        radius=radius,
        axis=axis,
        weights=weights,
        robust=robust,
        threads=threads,
        progress=progress,
    )
