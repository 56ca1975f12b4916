"""When each point of a scan was measured: from a field of the file, or the angle of a spinning sensor."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

TIME_FIELDS = ("t", "time", "timestamp", "timestamps", "time_stamp", "offset_time", "time_offset", "gps_time")
"""Fields of a point's time, in lower case: Ouster, Velodyne, Hesai and Robosense, Livox, LAS."""
_UNITS = (1.0, 1e-3, 1e-6, 1e-9)
"""Seconds: in which of them a scan's times are is seen by how long the scan then takes."""
_TYPICAL = 0.1
"""Seconds that a scan takes: lidars make 5 to 20 a second, and units are a thousand apart."""
_DURATIONS = (2e-3, 3.0)
"""Seconds that a scan may take; other fields of these names are no times of points."""
_FEWEST_TIMES = 8
"""Different times of a scan without which nothing is known about its motion."""
_SAME_CLOCK = 2.0
"""Seconds between a scan's timestamp and its points' times, at most, if these are on one clock."""


@dataclass(frozen=True, eq=False)
class PointTimes:
    """When the points of a scan were measured."""

    seconds: Array
    """(n,), from the reference on."""
    duration: float
    """Of the scan, in seconds."""
    reference: float | None
    """The reference on the clock of the points, in seconds; None if the times are offsets from it."""


def find_point_times(
    cloud: PointCloud, timestamp: float | None = None, spin_rate: float | None = None
) -> PointTimes | None:
    """Find the times of a scan's points; None if nothing tells them.

    Parameters
    ----------
    cloud
        The scan.
    timestamp
        When it was taken, in seconds; None where that is unknown.
    spin_rate
        Rotations a second of a spinning lidar, counter-clockwise about z; negative if it spins clockwise.
        The scan begins and ends behind, at -x, and the reference is its middle.

    Raises
    ------
    InvalidInputError
        If the rate is 0 or not finite.
    """
    if spin_rate is not None:
        return _times_by_angle(cloud, spin_rate)
    field = _time_field(cloud)
    if field is None:
        return None
    known = _surfsig.time_range(field, _FEWEST_TIMES)
    if known is None:
        return None
    low, high = known
    durations = {unit: unit * (high - low) for unit in _UNITS}
    possible = [unit for unit, span in durations.items() if _DURATIONS[0] <= span <= _DURATIONS[1]]
    if not possible:
        return None
    unit = min(possible, key=lambda unit: abs(np.log(durations[unit] / _TYPICAL)))
    # A field of offsets begins or ends near 0; the others are on a clock.
    is_offset = max(abs(low), abs(high)) <= 2.0 * (high - low)
    if is_offset:
        return PointTimes(unit * field, durations[unit], None)
    reference = 0.5 * (low + high)
    if timestamp is not None and abs(timestamp - unit * reference) <= _SAME_CLOCK:
        reference = timestamp / unit
    return PointTimes(unit * (field - reference), durations[unit], unit * reference)


def _times_by_angle(cloud: PointCloud, spin_rate: float) -> PointTimes:
    if not np.isfinite(spin_rate) or spin_rate == 0.0:
        raise InvalidInputError(f"spin_rate must be a finite number other than 0, not {spin_rate}")
    sensor = np.zeros(3) if cloud.viewpoint is None else cloud.viewpoint
    seconds = _surfsig.spin_times(
        cloud.offsets, origin=cloud.origin.tolist(), sensor=sensor.tolist(), spin_rate=spin_rate
    )
    return PointTimes(seconds, 1.0 / abs(spin_rate), None)


def _time_field(cloud: PointCloud) -> Array | None:
    by_name = {name.lower(): values for name, values in cloud.fields.items()}
    for name in TIME_FIELDS:
        values = by_name.get(name)
        if values is not None and values.ndim == 1 and values.dtype.kind in "fiu":
            return np.ascontiguousarray(values, np.float64)
    return None


def deskew(
    cloud: PointCloud,
    twist: ArrayLike,
    *,
    times: ArrayLike | None = None,
    timestamp: float | None = None,
    spin_rate: float | None = None,
) -> PointCloud:
    """Take the points of a scan to where they would have been measured at the time of its pose.

    Parameters
    ----------
    cloud
        The scan, in its own frame.
    twist
        (6,), of the sensor: rotation vector in radians and translation, each a second, in the scan's axes;
        `Odometry.twists` and `TrackedScan.twist` have those of the scans.
    times
        (n,), of the points, in seconds from that of the pose; where one is not finite, its point stays. By
        default as `estimate_odometry` finds them, by a field or by `spin_rate`.
    timestamp
        When the scan was taken, in seconds, if the field is on that clock.
    spin_rate
        As that of `estimate_odometry`.

    Returns
    -------
    PointCloud
        With the same fields and precision; the cloud itself where there are no times, or the twist is NaN.

    Raises
    ------
    InvalidInputError
        If the twist is no six numbers, or there are not as many times as points.
    """
    motion = np.asarray(twist, np.float64)
    if motion.shape != (6,):
        raise InvalidInputError(f"twist must be six numbers, not of shape {motion.shape}")
    if times is None:
        found = find_point_times(cloud, timestamp, spin_rate)
        if found is None:
            return cloud
        seconds = found.seconds
    else:
        seconds = np.asarray(times, np.float64)
        if seconds.shape != (len(cloud),):
            raise InvalidInputError(f"times must be ({len(cloud)},), not {seconds.shape}")
    if not np.isfinite(motion).all():
        return cloud
    moved = _surfsig.deskewed_points(
        cloud.offsets, np.ascontiguousarray(seconds), motion.tolist(), origin=cloud.origin.tolist()
    )
    return replace(cloud, offsets=moved.astype(cloud.offsets.dtype))
