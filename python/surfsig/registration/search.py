"""`register`: from two scans to a pose."""

from __future__ import annotations

import warnings

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig.alignment.consensus import Pairs, agreed_pose
from surfsig.alignment.contact import Contact, Surface, contact, spread
from surfsig.alignment.free_directions import free_directions
from surfsig.alignment.refinement import Refiner
from surfsig.arguments import positive_length, thread_count, whole_number
from surfsig.cloud_transforms import about_zero
from surfsig.defaults import REGISTRATION_KEYPOINTS
from surfsig.field import FieldSignatures, find_keypoints, match_fields
from surfsig.geometry import from_translation, pose_array
from surfsig.missing_returns import without_missing_returns
from surfsig.one_sided_normals import one_sided_normals
from surfsig.orientation import orientation
from surfsig.point_cloud import PointCloud
from surfsig.registration.registration import Registration
from surfsig.resolution import warn_if_too_coarse
from surfsig.units import unit_mismatch

Array = NDArray[np.float64]

_PATCH = 0.4
"""Radius of the patches in units of the median distance of a scan's points from their median."""
_VOXELS = 16.0
"""Voxels of a patch's radius, in which clouds are thinned for the refinement."""
_SIDE_VOXELS = 10.0
"""Voxels of a patch's radius between places whose sides are told from each other's."""
_PLACES = 6000
"""Places of the source that the last steps look at."""
_FEWEST = 50
"""Points without which there is nothing to register."""
_FEWEST_VOXELS = 16
"""Voxels of each scan without which there are no distributions to refine by."""
_SURE, _OVERLAPPING = 24, 0.04
"""Matches that agree, and overlap, from which on a pose is trusted."""
_STARTED_OVERLAP = 0.3
"""Overlap from which on a pose is trusted that was given roughly."""


def register(
    source: PointCloud | ArrayLike,
    target: PointCloud | ArrayLike,
    *,
    init: ArrayLike | None = None,
    radius: float | None = None,
    count: int = REGISTRATION_KEYPOINTS,
    threads: int | None = None,
) -> Registration:
    """Find how a scan lies in another, from any start, without a parameter.

    Keypoints of both are matched by their field signatures; each match proposes a whole pose, and the one
    that most agree with is refined, first by distributions (GICP), then by point to surface, which says how
    sure it is. Where a scan's viewpoint is not known, both sides of its surface are tried. The result is
    always the same.

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
        Keypoints of each scan.
    threads
        Number of threads; all cores by default. The result is the same.

    Returns
    -------
    Registration
        The pose, its covariance, what is free, and whether to trust it.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning, or small_gicp is not installed; its text says which.

    Warns
    -----
    UserWarning
        If missing returns are left out, coordinates are too coarse, or no trusted pose is found and the
        clouds seem to be in different units (`unit_mismatch`).
    """
    clouds = [
        without_missing_returns(PointCloud.of(cloud), name)
        for cloud, name in ((source, "source"), (target, "target"))
    ]
    start = None if init is None else pose_array(init, "init")
    most = whole_number(count, "count", 2**32 - 1)
    if radius is not None:
        radius = positive_length(radius, "radius")
    found = _registered(clouds[0], clouds[1], start, radius, most, thread_count(threads))
    for cloud, name in zip(clouds, ("source", "target"), strict=True):
        warn_if_too_coarse(cloud, found.radius, f"{name}: patches")
    hint = None if found.trusted else unit_mismatch(clouds[0], clouds[1], ("source", "target"))
    if hint is not None:
        warnings.warn(hint, stacklevel=2)
    return found


def _registered(
    source: PointCloud,
    target: PointCloud,
    start: Array | None,
    radius: float | None,
    most: int,
    threads: int | None,
) -> Registration:
    (ours, from_ours), (theirs, from_theirs) = (about_zero(cloud) for cloud in (source, target))
    sizes = [
        float(np.median(np.linalg.norm(cloud.offsets, axis=1))) for cloud in (ours, theirs) if len(cloud)
    ]
    size = _PATCH * min(sizes, default=0.0) if radius is None else radius
    if min(len(ours), len(theirs)) < _FEWEST or size == 0.0:
        return _nothing(size)
    pairs = None
    if start is not None:
        pose = from_translation(-from_theirs) @ start @ from_translation(from_ours)
    else:
        pairs = _matched(ours, theirs, size, most, threads)
        if len(pairs) < 3:
            return _nothing(size, len(pairs))
        pose = agreed_pose(pairs)
    voxel = size / _VOXELS
    refiner = Refiner(ours.offsets, theirs.offsets, voxel)
    if min(refiner.source_voxels, refiner.target_voxels) < _FEWEST_VOXELS:
        return _nothing(size, 0 if pairs is None else len(pairs))
    pose = refiner.refined(pose)
    places = spread(ours.offsets, min(refiner.source_voxels, _PLACES), threads)
    surface = Surface(spread(theirs.offsets, refiner.target_voxels, threads), voxel, threads)
    found = contact(places, surface, pose, voxel)
    if found is None:
        return _nothing(size, 0 if pairs is None else len(pairs))
    free = free_directions(found.places + from_theirs, found.normals)
    inliers = 0 if pairs is None else int(pairs.agreeing(found.pose).sum())
    return Registration(
        T_target_source=from_translation(from_theirs) @ found.pose @ from_translation(-from_ours),
        covariance=found.covariance,
        center=found.center + from_theirs,
        free_directions=free,
        matches=0 if pairs is None else len(pairs),
        inliers=inliers,
        overlap=found.overlap,
        rms=found.rms,
        radius=size,
        trusted=not free and _is_right(found, inliers, pairs is None),
    )


def _is_right(found: Contact, inliers: int, started: bool) -> bool:
    if started:
        return found.overlap >= _STARTED_OVERLAP
    return inliers >= _SURE and found.overlap >= _OVERLAPPING


def _matched(source: PointCloud, target: PointCloud, radius: float, count: int, threads: int | None) -> Pairs:
    """Match keypoints; where the side of one scan's surface is not known, both sides of the source."""

    def described(cloud: PointCloud, normals: Array | None) -> FieldSignatures:
        return find_keypoints(cloud, radius, count=count, normals=normals, threads=threads)

    def one_sided(cloud: PointCloud) -> Array:
        return one_sided_normals(cloud, radius / _SIDE_VOXELS, threads)

    known = [_knows_its_side(cloud) for cloud in (source, target)]
    theirs = described(target, None if known[1] else one_sided(target))
    sides: list[Array | None] = [None]
    if not all(known):
        normals = one_sided(source)
        sides = [normals, -normals]
    fields = [described(source, side) for side in sides]
    return Pairs.joined([Pairs.of(match_fields(ours, theirs), ours, theirs) for ours in fields])


def _knows_its_side(cloud: PointCloud) -> bool:
    viewpoint, normals = orientation(cloud, None, None, np.arange(0))
    return viewpoint is not None or normals is not None


def _nothing(radius: float, matches: int = 0) -> Registration:
    """Say that no pose was found."""
    nan = np.nan
    return Registration(
        np.full((4, 4), nan), np.full((6, 6), nan), np.full(3, nan), [], matches, 0, 0.0, nan, radius, False
    )
