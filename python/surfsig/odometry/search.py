"""`estimate_odometry`: from scans to the way of their sensor."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Iterable, Iterator, Sized
from pathlib import Path
from typing import Any

from numpy.typing import ArrayLike

from surfsig.arguments import positive_length, thread_count
from surfsig.convert.libraries import library
from surfsig.errors import InvalidInputError
from surfsig.files.sequence import ScanSequence, TimedScan, open_scan_sequence, scan_or_empty
from surfsig.odometry.result import Odometry
from surfsig.point_cloud import PointCloud

Scans = (
    str
    | os.PathLike[str]
    | ScanSequence
    | Iterable[str | os.PathLike[str] | PointCloud | TimedScan | ArrayLike]
)


def estimate_odometry(
    scans: Scans,
    *,
    voxel: float | None = None,
    distance: float | None = None,
    map_range: float | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Odometry:
    """Find the way of a sensor through its scans.

    Each scan is put onto a map of the places around that earlier scans have seen, from where the motion so
    far lets it be expected. Where it does not lie there as well as scans usually do, it is searched among
    scans that were kept (keyframes), by the signatures of its keypoints; what is found so counts only if the
    scan alone is sure, or the next ones agree. Nothing needs to be set, and the result is always the same.

    Parameters
    ----------
    scans
        In the order of time: what `open_scan_sequence` gives or takes as one path (a folder, a ROS bag), or
        an iterable of clouds, `TimedScan` or files; they are read one by one. Each is in its sensor's frame,
        and taken from its viewpoint, where it has one, or from (0, 0, 0); where that is far from all points,
        as in the coordinates of a map, the middle of the first scan stands for it.
    voxel
        In which scans and map are thinned, in the scans' unit; by default such that the first scan fills
        4,000.
    distance
        To partners in the map, at most, in the scans' unit; by default three deviations of what was expected
        before from what was found.
    map_range
        Of the map about the sensor, in the scans' unit; by default 1.2 times the distance within which 99 in
        100 points of a scan are.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of scans done and their total, or the former twice where nobody knows that.

    Returns
    -------
    Odometry
        Poses, covariances and a status for each scan.

    Raises
    ------
    OSError
        If a file is missing.
    InvalidInputError
        If an argument has no meaning, there are no scans, or small_gicp is not installed.
    FileFormatError
        If a bag cannot be opened.

    Warns
    -----
    UserWarning
        If a file cannot be read, which then counts as a scan without points, a bag ends too early, or missing
        returns at (0, 0, 0) are left out.
    """
    edge, partners, around = (
        None if value is None else positive_length(value, name)
        for value, name in ((voxel, "voxel"), (distance, "distance"), (map_range, "map_range"))
    )
    workers = thread_count(threads) or os.cpu_count() or 1
    # What needs it is imported where it is there only.
    library("small_gicp", "small_gicp", "'surfsig[register]'")
    from surfsig.odometry.way import Way

    way = Way(edge, partners, around, workers)
    if isinstance(scans, (str, os.PathLike)):
        scans = open_scan_sequence(scans)
    total = len(scans) if isinstance(scans, Sized) else None
    for number, scan in enumerate(_timed(scans)):
        way.add(scan)
        if progress is not None:
            progress(number + 1, number + 1 if total is None else total)
    if not len(way):
        raise InvalidInputError("there are no scans")
    if way.missing_returns:
        warnings.warn(
            f"{way.missing_returns} points of {len(way)} scans are at (0, 0, 0), where a lidar's missing "
            "returns are written; they are left out",
            stacklevel=2,
        )
    return way.result()


def _timed(scans: Any) -> Iterator[TimedScan]:
    """Give each scan with its time: its number, where nobody says."""
    if isinstance(scans, PointCloud) or not isinstance(scans, Iterable):
        raise InvalidInputError("scans must be several clouds or files, a folder, or a bag")
    for number, scan in enumerate(scans):
        if isinstance(scan, TimedScan):
            yield TimedScan(float(scan.timestamp), PointCloud.of(scan.cloud))
        elif isinstance(scan, (str, os.PathLike)):
            # A wrong name is the caller's mistake, not a broken scan.
            Path(scan).stat()
            yield TimedScan(float(number), scan_or_empty(Path(scan)))
        else:
            yield TimedScan(float(number), PointCloud.of(scan))
