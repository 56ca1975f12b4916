"""Scans that are kept, to find the way back to where the sensor was before."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig.alignment.consensus import Pairs, agreed_pose
from surfsig.field import FieldSignatures, find_keypoints, match_fields
from surfsig.geometry import inverse, rotation_angle, transform_points
from surfsig.odometry.alignment import Alignment, Scan, align
from surfsig.odometry.local_map import LocalMap
from surfsig.odometry.panorama import Panorama
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]

_APART = 0.3
"""Of the median distance that scans see, between keyframes."""
_TURNED = np.radians(30.0)
"""Between keyframes from one place."""
_SEARCHED = 50
"""Keyframes that are searched, the latest first."""
_TRIED = 3
"""Poses that are tried on the map, those first that most matches agree with."""
_AGREE = 24
"""Matches that agree with a pose that is tried, at least."""
_WITNESSES = 4
"""Keyframes next to a pose that say what they should have seen."""
_REACH = 4.0
"""Voxels between partners: so far off may a pose be that matches propose."""


@dataclass(eq=False)
class Keyframe:
    """A scan that is kept; lengths are in voxels."""

    number: int
    pose: Array
    """T_map_scan."""
    points: NDArray[np.float32]
    """Its places."""
    detail: NDArray[np.float32]
    """More of them, for the signatures."""
    panorama: Panorama
    fields: FieldSignatures | None = None


class Keyframes:
    """The keyframes of a sequence, one for each place and direction from where it was seen."""

    def __init__(self, reach: float, patch: float, threads: int) -> None:
        self._reach, self._patch, self._threads = reach, patch, threads
        self._kept: list[Keyframe] = []

    def offer(self, scan: Scan, pose: Array, number: int) -> None:
        """Keep a scan, unless one is there from a place nearby."""
        to_scan = inverse(pose)
        for other in reversed(self._kept):
            between = to_scan @ other.pose
            near = float(np.linalg.norm(between[:3, 3])) < _APART * self._reach
            if near and rotation_angle(between) < _TURNED:
                return
        points, detail = scan.points.astype(np.float32), scan.detail().astype(np.float32)
        self._kept.append(Keyframe(number, pose, points, detail, scan.panorama))

    def submap(self, center: Array, distance: float) -> LocalMap:
        """Make a map of the keyframes that were taken within a distance of a place."""
        result = LocalMap(self._threads)
        for keyframe in self._kept:
            if np.linalg.norm(keyframe.pose[:3, 3] - center) <= distance:
                result.add(
                    transform_points(keyframe.pose, keyframe.points.astype(np.float64)), keyframe.number
                )
        result.keep_within(center, distance)
        return result

    def should_know(self, pose: Array, points: Array) -> NDArray[np.bool_]:
        """Tell which places of a scan the keyframes next to it must have seen, if they were there then.

        Parameters
        ----------
        pose
            T_map_scan, (4, 4).
        points
            The places, (n, 3).
        """
        near = sorted(self._kept, key=lambda other: float(np.linalg.norm(other.pose[:3, 3] - pose[:3, 3])))
        known = np.zeros(len(points), bool)
        for keyframe in near[:_WITNESSES]:
            known |= keyframe.panorama.covers(transform_points(inverse(keyframe.pose) @ pose, points))
        return known

    def find(
        self, scan: Scan, distance: float, is_believed: Callable[[Alignment], bool]
    ) -> tuple[Alignment, LocalMap] | None:
        """Find where a scan was taken, by its signatures; None where nothing fits.

        Parameters
        ----------
        scan
            The scan.
        distance
            From the sensor to the farthest places of a map.
        is_believed
            Whether a pose lies well enough.

        Returns
        -------
        Of the poses that matches propose the one that lies best on the keyframes' map, and that map.
        """
        ours = self._described(scan.detail())
        proposals: list[tuple[int, Array]] = []
        for keyframe in self._kept[: -_SEARCHED - 1 : -1]:
            if keyframe.fields is None:
                keyframe.fields = self._described(keyframe.detail)
            pairs = Pairs.of(match_fields(ours, keyframe.fields), ours, keyframe.fields)
            pose = agreed_pose(pairs)
            agree = int(pairs.agreeing(pose).sum())
            if agree >= _AGREE:
                proposals.append((agree, keyframe.pose @ pose))
        proposals.sort(key=lambda proposal: -proposal[0])
        best: tuple[Alignment, LocalMap] | None = None
        for _, pose in proposals[:_TRIED]:
            around = self.submap(pose[:3, 3], distance)
            found = align(scan, around, pose, _REACH, self.should_know)
            if found is None or not is_believed(found):
                continue
            if best is None or found.overlap > best[0].overlap:
                best = found, around
        return best

    def _described(self, points: NDArray[np.floating]) -> FieldSignatures:
        """Describe a scan's keypoints, as seen from its sensor."""
        cloud = PointCloud(points, viewpoint=np.zeros(3))
        return find_keypoints(cloud, self._patch, threads=self._threads)
