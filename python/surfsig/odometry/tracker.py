"""A sensor that is followed scan by scan, as in a robot's loop: `Tracker`."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig._surfsig import OdometrySettings
from surfsig.alignment.free_directions import FreeDirection, free_direction
from surfsig.arguments import positive_length, thread_count
from surfsig.errors import InvalidInputError
from surfsig.missing_returns import missing_returns
from surfsig.odometry.loop_closing import LoopClosure, closed
from surfsig.odometry.point_times import PointTimes, find_point_times
from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_LONGEST = 20.0
"""Durations of a scan between two references, at most, if the second scan follows the first."""
_REACH = 30.0
"""Voxels by which a scan sees, about: by this length rotations count where loops close."""


@dataclass(frozen=True, eq=False)
class TrackedScan:
    """What is known of a scan when it has been pushed."""

    number: int
    """Of the scan, from 0."""
    status: ScanStatus
    """Why it has the pose that it has."""
    T_world_scan: Array
    """(4, 4); NaN where there is no pose."""
    covariance: Array
    """(6, 6), as `Odometry.covariances`."""
    overlap: float
    """Share of the scan's points that lie on the map."""
    segment: int
    """Number of the world that the pose is given in; -1 where there is no pose."""
    free_directions: list[FreeDirection]
    """Motions that the map does not determine."""
    twist: Array
    """(6,), of the sensor at the scan's reference, a second; NaN where the times of points are not known."""
    changed: list[int]
    """Numbers of the scans whose results are new, this one among them: a sensor that is found again gives its
    last scans poses, too, and one that is found elsewhere may take some back. `Tracker.result` has them."""

    @property
    def is_tracked(self) -> bool:
        """Whether there is a pose."""
        return self.segment >= 0


class Tracker:
    """Follows a sensor: push scan after scan, and get the pose of each.

    >>> import numpy as np
    >>> import surfsig
    >>> from surfsig import simulate
    >>> room, lidar = simulate.room(1), simulate.Lidar(lines=16, steps=240)
    >>> tracker = surfsig.Tracker()
    >>> for step in range(3):
    ...     pose = simulate.upright_pose(0.1 * step, 0.0, 1.2, 0.0)
    ...     found = tracker.push(simulate.scan(room, lidar, pose, seed=step))
    >>> found.status.name, bool(abs(found.T_world_scan[0, 3] - 0.2) < 0.02)
    ('TRACKED', True)

    Parameters
    ----------
    voxel, distance, map_range, settings, threads
        As those of `estimate_odometry`.
    spin_rate
        Rotations a second of a lidar that spins while it moves, where points have no times: counter-clockwise
        about z, or negative if it spins clockwise. A scan begins and ends behind, at -x, and its pose is that
        at its middle.

    Raises
    ------
    InvalidInputError
        If an argument has no meaning.
    """

    def __init__(
        self,
        *,
        voxel: float | None = None,
        distance: float | None = None,
        map_range: float | None = None,
        spin_rate: float | None = None,
        settings: OdometrySettings | None = None,
        threads: int | None = None,
    ) -> None:
        def length(value: float | None, name: str) -> float | None:
            return None if value is None else positive_length(value, name)

        if spin_rate is not None and not (np.isfinite(spin_rate) and spin_rate != 0.0):
            raise InvalidInputError(f"spin_rate must be a finite number other than 0, not {spin_rate}")
        self._odometry = _surfsig.Odometry(
            voxel=length(voxel, "voxel"),
            max_correspondence_distance=length(distance, "distance"),
            map_range=length(map_range, "map_range"),
            settings=settings,
            threads=thread_count(threads),
        )
        self._spin_rate = spin_rate
        self._timestamps: list[float] = []
        self._intervals: list[float] = []
        self._reference: float | None = None
        self.missing_returns = 0
        """Points at (0, 0, 0) that were left out, where a lidar's missing returns are written."""

    def __len__(self) -> int:
        """Return the number of scans so far."""
        return len(self._timestamps)

    def push(
        self,
        scan: PointCloud | ArrayLike,
        *,
        timestamp: float | None = None,
        times: ArrayLike | None = None,
    ) -> TrackedScan:
        """Take the next scan.

        Parameters
        ----------
        scan
            In its sensor's frame: what `PointCloud.of` takes. Points at (0, 0, 0) are missing returns, and
            left out.
        timestamp
            In seconds; the scan's number by default.
        times
            (n,), of the points, in seconds from the timestamp on: the sensor's motion within the scan is then
            found with the pose. By default those of the fields `t`, `time`, `timestamp`, `offset_time` or
            `gps_time`, if the scan has one.

        Returns
        -------
        TrackedScan

        Raises
        ------
        InvalidInputError
            If there are not as many times as points.
        """
        cloud = PointCloud.of(scan)
        known = None if timestamp is None else float(timestamp)
        if times is None:
            found = find_point_times(cloud, known, self._spin_rate)
        else:
            seconds = np.asarray(times, np.float64)
            if seconds.shape != (len(cloud),):
                raise InvalidInputError(f"times must be ({len(cloud)},), not {seconds.shape}")
            finite = seconds[np.isfinite(seconds)]
            found = PointTimes(seconds, float(np.ptp(finite)) if len(finite) else 0.0, known)
        missing = missing_returns(cloud)
        kept = cloud.at(np.flatnonzero(~missing)) if missing.any() else cloud
        self.missing_returns += len(cloud) - len(kept)
        if found is not None:
            found = PointTimes(found.seconds[~missing], found.duration, found.reference)
        interval = self._interval(found, known)
        changed = self._odometry.push(
            kept.offsets,
            origin=kept.origin.tolist(),
            viewpoint=None if kept.viewpoint is None else kept.viewpoint.tolist(),
            times=None if found is None or not interval > 0.0 else found.seconds / interval,
        )
        number = len(self._timestamps)
        self._timestamps.append(float(number) if known is None else known)
        self._intervals.append(interval)
        last = self._odometry.arrays(last_only=True)
        return TrackedScan(
            number=number,
            status=ScanStatus(int(last["status"][0])),
            T_world_scan=last["poses"][0],
            covariance=last["covariances"][0],
            overlap=float(last["overlaps"][0]),
            segment=int(last["segments"][0]),
            free_directions=[free_direction(*one) for one in last["free_directions"][0]],
            twist=last["twists"][0] / interval,
            changed=list(changed),
        )

    def _interval(self, found: PointTimes | None, timestamp: float | None) -> float:
        """Give the seconds since the scan before, if points have times; a spinning sensor scans all along."""
        if found is None:
            return float("nan")
        reference = timestamp if found.reference is None else found.reference
        before, self._reference = self._reference, reference
        if before is not None and reference is not None:
            since = reference - before
            if 0.5 * found.duration <= since <= _LONGEST * found.duration:
                return since
        return found.duration

    def result(self, *, close_loops: bool = True) -> Odometry:
        """Give the trajectory so far.

        Parameters
        ----------
        close_loops
            Whether what the sensor had drifted by when it came back is distributed over the way between.
            Otherwise poses are those that `push` gave.

        Returns
        -------
        Odometry
        """
        loops = [
            LoopClosure(scan, earlier, np.array(by_earlier), np.array(before))
            for scan, earlier, by_earlier, before in self._odometry.loops()
        ]
        arrays = self._odometry.arrays()
        free = [[free_direction(*one) for one in every] for every in arrays.pop("free_directions")]
        twists = arrays.pop("twists") / np.array(self._intervals, np.float64).reshape(-1, 1)
        voxel = np.nan if self._odometry.voxel is None else self._odometry.voxel
        if close_loops and loops:
            # Voxels are such that a scan fills some thousand: it sees some thirty of them far.
            arrays["poses"], arrays["covariances"] = closed(
                arrays["poses"],
                arrays["covariances"],
                arrays["segments"],
                loops,
                _REACH * voxel,
                np.array([bool(one) for one in free], np.bool_),
            )
        return Odometry(
            **arrays,
            loops=loops,
            twists=twists,
            free_directions=free,
            timestamps=np.array(self._timestamps, np.float64),
            voxel=voxel,
        )
