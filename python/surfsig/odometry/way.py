"""Scan by scan from files' units and frames to the tracker's, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.clean import COORDINATE_LIMIT
from surfsig.files.sequence import TimedScan
from surfsig.odometry.alignment import Scan
from surfsig.odometry.motion import adjoint
from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.odometry.scale import FEWEST, Scale
from surfsig.odometry.tracker import Step, Tracker
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_FAR = 30.0
"""Of a scan's median distance from its median: a sensor is not so far."""


class Way:
    """Scans in their own unit in, poses in that unit out; `Tracker` counts in voxels about the sensor."""

    def __init__(
        self, voxel: float | None, distance: float | None, map_range: float | None, threads: int
    ) -> None:
        self._voxel, self._distance, self._map_range, self._threads = voxel, distance, map_range, threads
        self._scale: Scale | None = None
        self._middle: Array | None = None
        self._steps: list[tuple[float, Array, Array, ScanStatus, float]] = []

    def __len__(self) -> int:
        """Return the number of scans so far."""
        return len(self._steps)

    def add(self, scan: TimedScan) -> None:
        """Find the pose of the next scan."""
        step, sensor = self._step(scan.cloud)
        if step is None:
            nothing = np.full((4, 4), np.nan), np.full((6, 6), np.nan)
            self._steps.append((scan.timestamp, *nothing, ScanStatus.TOO_FEW_POINTS, 0.0))
            return
        assert self._scale is not None
        # From places about the sensor, in voxels, to the scan's own frame and the world's.
        size = self._scale.voxel
        pose = step.pose.copy()
        pose[:3, 3] = size * pose[:3, 3] + self._first_sensor - pose[:3, :3] @ sensor
        to_sensor = np.eye(4)
        to_sensor[:3, 3] = sensor
        carried = adjoint(to_sensor) * np.repeat([1.0, size], 3)
        covariance = carried @ step.covariance @ carried.T
        self._steps.append((scan.timestamp, pose, covariance, step.status, step.overlap))

    def _step(self, cloud: PointCloud) -> tuple[Step | None, Array]:
        """Follow a scan's points about its sensor, and say where that is; None where they are too few."""
        offsets = cloud.offsets.astype(np.float64)
        known = offsets[(np.abs(offsets) < COORDINATE_LIMIT).all(axis=1)]
        sensor = self._sensor(cloud.viewpoint, known, cloud.origin)
        points = known + (cloud.origin - sensor)
        if len(points) >= FEWEST and np.ptp(points, axis=0).any():
            if self._scale is None:
                self._begin(points, sensor)
            assert self._scale is not None
            places = Scan(points / self._scale.voxel, self._threads)
            if len(places) >= FEWEST:
                return self._tracker.follow(places), sensor
        if self._scale is not None:
            self._tracker.skip()
        return None, sensor

    def _sensor(self, viewpoint: Array | None, points: Array, origin: Array) -> Array:
        """Say where the sensor is in its scan's frame.

        Where nobody does, it is at 0; in the coordinates of a map, 0 is far from all points, and the middle
        of the first scan stands for it.
        """
        if viewpoint is not None:
            return viewpoint
        if self._middle is None and len(points):
            middle = np.median(points, axis=0)
            spread = float(np.median(np.linalg.norm(points - middle, axis=1)))
            far = float(np.linalg.norm(middle + origin)) > _FAR * spread
            self._middle = middle + origin if far else np.zeros(3)
        return np.zeros(3) if self._middle is None else self._middle

    def _begin(self, points: Array, sensor: Array) -> None:
        """Take the lengths from the first scan."""
        scale = Scale.of(points, self._voxel)
        self._scale, self._first_sensor = scale, sensor
        self._tracker = Tracker(
            scale.reach / scale.voxel,
            scale.patch / scale.voxel,
            None if self._map_range is None else self._map_range / scale.voxel,
            None if self._distance is None else self._distance / scale.voxel,
            self._threads,
        )

    def result(self) -> Odometry:
        """Give the way so far."""
        timestamps, poses, covariances, status, overlaps = zip(*self._steps, strict=True)
        return Odometry(
            poses=np.array(poses),
            covariances=np.array(covariances),
            status=np.array(status, np.uint8),
            overlaps=np.array(overlaps),
            timestamps=np.array(timestamps, np.float64),
            voxel=np.nan if self._scale is None else self._scale.voxel,
        )
