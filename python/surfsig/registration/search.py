"""`register`: from two scans to a transform."""

from __future__ import annotations

import warnings
from collections.abc import Callable

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig._surfsig import RegistrationSettings
from surfsig.alignment.alternative import Alternative
from surfsig.alignment.free_directions import free_direction
from surfsig.arguments import positive_length, progress_callback, thread_count, whole_number
from surfsig.geometry import pose_array
from surfsig.missing_returns import without_missing_returns
from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud
from surfsig.registration.registration import Registration
from surfsig.resolution import warn_if_too_coarse
from surfsig.units import unit_mismatch

_Scan = tuple[NDArray[np.floating], list[float], list[float] | None, NDArray[np.float32] | None]
"""Offsets and origin, viewpoint, and in place of that vectors to the sensor's side."""


def register(
    source: PointCloud | ArrayLike,
    target: PointCloud | ArrayLike,
    *,
    init: ArrayLike | None = None,
    radius: float | None = None,
    count: int | None = None,
    settings: RegistrationSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Registration:
    """Find how a scan lies in another, from any start, without a parameter.

    Keypoints of both are matched by their field signatures; each match proposes a whole transform, and the
    one that most agree with is refined, first by distributions (generalised ICP: Segal and others, 2009),
    then by the distances of points from the surface, which tell how sure it is. Where a viewpoint is not
    known, it is told by the density of the points (`estimate_viewpoint`), or both sides of the surface are
    tried.

    Parameters
    ----------
    source, target
        `PointCloud`, arrays (n, 3) of numbers, or any other that `PointCloud.of` takes; in one unit. Missing
        returns at (0, 0, 0) are left out.
    init
        T_target_source, (4, 4), roughly, where somebody knows it: it is refined, and nothing is searched.
    radius
        Of the patches that are matched, in the clouds' unit; by default 0.4 times the median distance of the
        points from their median, of the smaller scan.
    count
        Keypoints of each scan; 1,000 by default.
    settings
        For experts; `RegistrationSettings` describes what may be changed.
    threads
        Number of threads; all cores by default. The result is the same, bit for bit.
    progress
        Called with the number of steps done and their total, some twenty times a second.

    Returns
    -------
    Registration
        The transform, its covariance, what is not determined, and whether to trust it.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning; its text says which.

    Warns
    -----
    UserWarning
        If missing returns are left out, coordinates are too coarse, or no trusted transform is found and the
        clouds seem to be in different units (`unit_mismatch`).
    """
    clouds = [
        without_missing_returns(PointCloud.of(cloud), name)
        for cloud, name in ((source, "source"), (target, "target"))
    ]
    start = None if init is None else pose_array(init, "init")
    found = _surfsig.register(
        *(_scan(cloud) for cloud in clouds),
        start=None if start is None else start.tolist(),
        radius=None if radius is None else positive_length(radius, "radius"),
        keypoints=None if count is None else whole_number(count, "count", 2**32 - 1),
        settings=settings,
        threads=thread_count(threads),
        progress=progress_callback(progress),
    )
    transform = found.pop("T_target_source")
    directions = [free_direction(*direction) for direction in found.pop("free_directions")]
    alternatives = [
        Alternative(np.array(matrix), explained, free_space)
        for matrix, explained, free_space in found.pop("alternatives")
    ]
    result = Registration(
        T_target_source=np.full((4, 4), np.nan) if transform is None else np.array(transform),
        free_directions=directions,
        alternatives=alternatives,
        **found,
    )
    for cloud, name in zip(clouds, ("source", "target"), strict=True):
        warn_if_too_coarse(cloud, result.radius, f"{name}: patches")
    hint = None if result.trusted else unit_mismatch(clouds[0], clouds[1], ("source", "target"))
    if hint is not None:
        warnings.warn(hint, stacklevel=2)
    return result


def free_space_share(
    source: PointCloud,
    target: PointCloud,
    T_target_source: NDArray[np.float64],
    *,
    radius: float | None,
    settings: RegistrationSettings | None,
    threads: int | None,
) -> float:
    """Give the larger share of one scan's points in the other sensor's free space, as `Registration` does.

    NaN where no viewpoint is known from which all was seen, or nothing is in sight.
    """
    return _surfsig.free_space_share(
        _scan(source),
        _scan(target),
        T_target_source.tolist(),
        radius=radius,
        settings=settings,
        threads=thread_count(threads),
    )


def _scan(cloud: PointCloud) -> _Scan:
    """Give a cloud as the core takes it, with what says on which side the sensor was."""
    viewpoint, directions = orientation(cloud, None, None, np.arange(len(cloud)))
    return (
        cloud.offsets,
        cloud.origin.tolist(),
        None if viewpoint is None else viewpoint.tolist(),
        directions,
    )
