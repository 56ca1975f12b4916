"""Scan by scan from files' units and frames to the tracker's, and back."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from surfsig.clean import COORDINATE_LIMIT
from surfsig.files.sequence import TimedScan
from surfsig.geometry import adjoint, from_translation, rotate
from surfsig.missing_returns import remove_missing_returns
from surfsig.odometry.alignment import Scan
from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.odometry.scale import FEWEST, Scale
from surfsig.odometry.tracker import Step, Tracker
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]
Placed = tuple[Array, Array, ScanStatus, float]
"""Pose, covariance, status and overlap of a scan."""

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
        self._is_placed = False
        self._first = 0
        """The first scan that has a pose."""
        self.missing_returns = 0
        """Points at (0, 0, 0) that were left out."""
        self._timestamps: list[float] = []
        self._sensors: list[Array] = []
        self._steps: list[Placed] = []

    def __len__(self) -> int:
        """Return the number of scans so far."""
        return len(self._steps)

    def add(self, scan: TimedScan) -> None:
        """Find the pose of the next scan."""
        cloud = remove_missing_returns(scan.cloud)
        self.missing_returns += len(scan.cloud) - len(cloud)
        points, sensor = self._about_sensor(cloud)
        self._timestamps.append(scan.timestamp)
        self._sensors.append(sensor)
        nothing = np.full((4, 4), np.nan), np.full((6, 6), np.nan)
        self._steps.append((*nothing, ScanStatus.TOO_FEW_POINTS, 0.0))
        usable = len(points) >= FEWEST and bool(np.ptp(points, axis=0).any())
        if usable and self._scale is None:
            self._begin(points)
        if self._scale is None:
            return
        places = Scan(points / self._scale.voxel, self._threads) if usable else None
        if places is None or len(places) < FEWEST:
            self._tracker.skip()
            return
        self._steps[-1] = (*nothing, ScanStatus.LOST, 0.0)
        for step in self._tracker.follow(places):
            number = self._first + step.number
            self._steps[number] = self._in_frames(step, self._sensors[number], self._scale.voxel)

    def _in_frames(self, step: Step, sensor: Array, voxel: float) -> Placed:
        """Take a step from places about the sensor, in voxels, to the scan's own frame and the world's."""
        pose = step.pose.copy()
        pose[:3, 3] = voxel * pose[:3, 3] + self._sensors[self._first] - rotate(pose, sensor)
        carried = adjoint(from_translation(sensor)) * np.repeat([1.0, voxel], 3)
        return pose, carried @ step.covariance @ carried.T, step.status, step.overlap

    def _about_sensor(self, cloud: PointCloud) -> tuple[Array, Array]:
        """Give a scan's points about its sensor, (n, 3), and where that is."""
        offsets = cloud.offsets.astype(np.float64)
        known = offsets[(np.abs(offsets) < COORDINATE_LIMIT).all(axis=1)]
        sensor = self._sensor(cloud.viewpoint, known, cloud.origin)
        return known + (cloud.origin - sensor), sensor

    def _sensor(self, viewpoint: Array | None, points: Array, origin: Array) -> Array:
        """Say where the sensor is in its scan's frame: at its viewpoint, or at 0.

        In the coordinates of a map that is far from all points (a PCD's viewpoint is 0 where nobody set it),
        and the middle of the first scan stands for it.
        """
        said = np.zeros(3) if viewpoint is None else viewpoint
        if not self._is_placed and len(points):
            middle = np.median(points, axis=0)
            spread = float(np.median(np.linalg.norm(points - middle, axis=1)))
            away = middle + (origin - said)
            self._middle = middle + origin if float(np.linalg.norm(away)) > _FAR * spread else None
            self._is_placed = True
        return said if self._middle is None else self._middle

    def _begin(self, points: Array) -> None:
        """Take the lengths from the first scan."""
        scale = Scale.of(points, self._voxel)
        self._scale, self._first = scale, len(self._steps) - 1
        self._tracker = Tracker(
            scale.reach / scale.voxel,
            scale.patch / scale.voxel,
            None if self._map_range is None else self._map_range / scale.voxel,
            None if self._distance is None else self._distance / scale.voxel,
            self._threads,
        )

    def result(self) -> Odometry:
        """Give the way so far."""
        poses, covariances, status, overlaps = zip(*self._steps, strict=True)
        return Odometry(
            poses=np.array(poses),
            covariances=np.array(covariances),
            status=np.array(status, np.uint8),
            overlaps=np.array(overlaps),
            timestamps=np.array(self._timestamps, np.float64),
            voxel=np.nan if self._scale is None else self._scale.voxel,
        )
