"""One self-contained page about a trajectory: its line, its ellipsoids, and what the scans saw."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfsig.page import Layer, Trajectory, page_html
from surfsig.page.packing import MOST_POINTS
from surfsig.point_cloud import PointCloud

if TYPE_CHECKING:
    from surfsig.odometry.result import Odometry

Array = NDArray[np.float64]


def report_html(
    found: Odometry, scans: Iterable[PointCloud] | None, title: str, most_points: int = MOST_POINTS
) -> str:
    """Make the page.

    Parameters
    ----------
    found
        The trajectory.
    scans
        The scans in their order, each in its own frame; None draws the trajectory alone.
    title
        The page's.
    most_points
        Points that the page holds, of all scans together.
    """
    # Worlds whose relation nobody knows are not drawn into one.
    known = np.asarray(found.segments == found.longest_segment) & (found.segments >= 0)
    positions = np.where(known[:, None], found.poses[:, :3, 3], np.nan)
    rotations = found.poses[:, :3, :3]
    # The covariance is in the scan's own frame; its translations turn with the scan.
    # Where a motion is free, infinities give no ellipsoid.
    with np.errstate(invalid="ignore"):
        covariances = rotations @ found.covariances[:, 3:, 3:] @ np.swapaxes(rotations, 1, 2)
    layers = [] if scans is None else [_map(found.poses, known, scans, most_points)]
    if not layers:
        layers = [Layer("positions", positions, columns={"scan": np.arange(len(positions))})]
    told = ", ".join(f"{count} {name.replace('_', ' ')}" for name, count in found.counts().items() if count)
    others = int((found.segments >= 0).sum() - known.sum())
    if others:
        told += f" ({others} in other maps, which are not drawn)"
    text = (
        f"{len(found)} scans: {told or 'none'}; {found.length:.4g} long. "
        "Ellipsoids are of three standard deviations of the position."
    )
    return page_html(
        title,
        text,
        layers,
        quantity="column:scan",
        trajectory=Trajectory(positions, covariances),
        most_points=most_points,
    )


def _map(poses: Array, known: NDArray[np.bool_], scans: Iterable[PointCloud], most_points: int) -> Layer:
    """Put an even share of each scan's points where the pose says they are."""
    each = max(1, most_points // max(1, int(known.sum())))
    places: list[Array] = [np.empty((0, 3))]
    numbers: list[NDArray[np.intp]] = [np.empty(0, np.intp)]
    for number, (pose, is_known, scan) in enumerate(zip(poses, known, scans, strict=False)):
        if not is_known:
            continue
        finite = scan.points[scan.finite]
        some = finite[:: max(1, -(-len(finite) // each))]
        places.append(some @ pose[:3, :3].T + pose[:3, 3])
        numbers.append(np.full(len(some), number))
    return Layer("map", np.concatenate(places), columns={"scan": np.concatenate(numbers)})
