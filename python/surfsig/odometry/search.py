"""`estimate_odometry`: from scans to the trajectory of their sensor."""

from __future__ import annotations

import os
import warnings
from collections.abc import Callable, Sized

from surfsig._surfsig import OdometrySettings
from surfsig.arguments import progress_callback
from surfsig.errors import InvalidInputError
from surfsig.files.sequence import Scans, clock_time, open_scan_sequence, timed_scans
from surfsig.odometry.result import Odometry
from surfsig.odometry.tracker import Tracker


def estimate_odometry(
    scans: Scans,
    *,
    voxel: float | None = None,
    distance: float | None = None,
    map_range: float | None = None,
    spin_rate: float | None = None,
    close_loops: bool = True,
    settings: OdometrySettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> Odometry:
    """Estimate the trajectory of a sensor from its scans.

    Each scan is aligned with a map of the surroundings that earlier scans have seen, from the pose to which
    the last motion leads. Where it lies there worse than scans did of late, it is searched among keyframes by
    the signatures of its keypoints; a pose that is found so counts only if the map explains all of the scan,
    or the next scans follow it. Where the map leaves a motion open, as along a smooth corridor, that is named
    (`Odometry.free_directions`), its variance is infinite, and the last motion goes on in it. Where the
    sensor stays lost, another map is begun (`Odometry.segments`). Where points have times (fields `t`,
    `time`, `timestamp`, `offset_time`, `gps_time`, or `spin_rate`), the motion within each scan is found with
    its pose, and taken out. Nothing needs to be set, and the result is always the same. `Tracker` takes the
    scans one by one.

    Parameters
    ----------
    scans
        In the order of time: what `open_scan_sequence` gives or takes as one path (a folder, a ROS bag), or
        an iterable of clouds, `TimedScan` or files; they are read one by one. Each is in its sensor's frame,
        and taken from its viewpoint, where it has one, or from (0, 0, 0); where that is far from all points,
        as in the coordinates of a map, the median of the first scan stands for it.
    voxel
        Edge of the voxels in which scans and map are thinned, in the scans' unit; by default such that the
        first scan fills 4,000.
    distance
        Largest distance between points that correspond, in the scans' unit; by default three root mean
        squares of the errors of earlier predictions.
    map_range
        Distance from the sensor up to which the map is kept, in the scans' unit; by default 1.2 times the
        distance within which 99 in 100 points of a scan are.
    spin_rate
        Rotations a second of a lidar that spins while it moves, where its points have no times:
        counter-clockwise about z, or negative if it spins clockwise. A scan begins and ends behind, at -x,
        and its pose is that at its middle.
    close_loops
        Whether what the sensor has drifted by when it comes back to where it was is distributed over the way
        between (`Odometry.loops`).
    settings
        For experts; `OdometrySettings` describes what may be changed.
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
        If an argument has no meaning, or there are no scans.
    FileFormatError
        If a bag cannot be opened.

    Warns
    -----
    UserWarning
        If a file cannot be read, which then counts as a scan without points, a bag ends too early, or missing
        returns at (0, 0, 0) are left out.
    """
    tracker = Tracker(
        voxel=voxel,
        distance=distance,
        map_range=map_range,
        spin_rate=spin_rate,
        settings=settings,
        threads=threads,
    )
    tell = progress_callback(progress)
    if isinstance(scans, (str, os.PathLike)):
        scans = open_scan_sequence(scans)
    total = len(scans) if isinstance(scans, Sized) else None
    for number, scan in enumerate(timed_scans(scans)):
        tracker.push(scan.cloud, timestamp=clock_time(scan.timestamp, number))
        if tell is not None:
            tell(number + 1, number + 1 if total is None else total)
    if not len(tracker):
        raise InvalidInputError("there are no scans")
    if tracker.missing_returns:
        warnings.warn(
            f"{tracker.missing_returns} points of {len(tracker)} scans are at (0, 0, 0), where a lidar's "
            "missing returns are written; they are left out",
            stacklevel=2,
        )
    return tracker.result(close_loops=close_loops)
