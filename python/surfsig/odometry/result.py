"""What `estimate_odometry` gives."""

from __future__ import annotations

import enum
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from surfsig.alignment.free_directions import FreeDirection
from surfsig.arguments import positive_length
from surfsig.errors import InvalidInputError
from surfsig.files.sequence import Scans, clock_time, timed_scans
from surfsig.fusion import fuse_scans
from surfsig.odometry.loop_closing import LoopClosure
from surfsig.odometry.point_times import deskew
from surfsig.odometry.report import report_html
from surfsig.page import notebook_html, write_page
from surfsig.point_cloud import PointCloud

Array = NDArray[np.float64]


class ScanStatus(enum.IntEnum):
    """Why a scan has the pose that it has."""

    TRACKED = 0
    """Found next to where it was expected."""
    RELOCALISED = 1
    """Found by the signatures of its keypoints, after tracking had failed."""
    LOST = 2
    """Not found: no pose."""
    TOO_FEW_POINTS = 3
    """It has hardly any points, or cannot be read: no pose."""


@dataclass(frozen=True, eq=False, repr=False)
class Odometry:
    """The trajectory of a sensor: one struct of arrays, with a status for each of n scans.

    The world is the frame of the first scan that has a pose; where a sensor stays lost, another one begins
    (`segments`). NaN stands where there is none.
    """

    poses: Array
    """T_world_scan, (n, 4, 4)."""
    covariances: Array
    """Of the twist m (rotation vector in radians, then translation) in the scan's own frame by which a pose
    is off, (n, 6, 6): T_true = T_world_scan exp(m). It grows as the map goes on from the first scan. Entries
    of motions that nothing has determined, since the first scan on, are infinite; the others are the limit
    as that variance grows."""
    status: NDArray[np.uint8]
    """`ScanStatus` as a number, (n,)."""
    overlaps: Array
    """Share of the scan's points that lie on the map, (n,); 0 where there is no pose."""
    free_directions: list[list[FreeDirection]]
    """Of each scan the motions, in its own coordinates, that the map does not determine, as along a smooth
    corridor: there the last motion goes on. Empty lists where there are none."""
    timestamps: Array
    """In seconds, (n,): from the recording, or the files' names where these are numbers; otherwise the scans'
    numbers."""
    voxel: float
    """Edge of the voxels in which scans and map were thinned, in the scans' unit; NaN if no scan had enough
    points."""
    segments: NDArray[np.int64]
    """Number of the world that each pose is given in, (n,): where a sensor stays lost, another map is begun,
    whose first scan is its world; -1 where there is no pose."""
    twists: Array
    """Of the sensor at each scan, (n, 6): rotation vector in radians and translation, each a second, in the
    scan's own axes. NaN where the times of points are not known, and where there is no pose."""
    loops: list[LoopClosure]
    """Scans that the sensor came back with to where it was: what it had drifted by is distributed over the
    way between, whose covariances become smaller by as much as those of a random walk would."""

    def __len__(self) -> int:
        """Return the number of scans."""
        return len(self.poses)

    def __repr__(self) -> str:
        """Say how many there are, and what became of them."""
        told = ", ".join(
            f"{count} {name.replace('_', ' ')}" for name, count in self.counts().items() if count
        )
        return f"Odometry({len(self)} scans: {told or 'none'})"

    def counts(self) -> dict[str, int]:
        """Count the scans of each status.

        Returns
        -------
        Numbers by the status's name in lower case.
        """
        return {status.name.lower(): int((self.status == status).sum()) for status in ScanStatus}

    def to_html(self, *, title: str = "Odometry") -> str:
        """Make a page that needs no network: the trajectory, with ellipsoids of its covariances.

        Parameters
        ----------
        title
            The page's.

        Returns
        -------
        The document, which needs no network.
        """
        return report_html(self, None, title)

    def _repr_html_(self) -> str:
        """Show the page in a notebook."""
        return notebook_html(self.to_html(), "Odometry")

    def write_report(
        self, path: str | Path, scans: Iterable[PointCloud] | None = None, *, title: str = "Odometry"
    ) -> None:
        """Write one HTML page: the trajectory with ellipsoids, and what the scans saw.

        The page needs no network. Of more than a million points a million are drawn.

        Parameters
        ----------
        path
            Where to write.
        scans
            The scans in their order, each in its own frame; None draws the trajectory alone.
        title
            The page's.
        """
        write_page(path, report_html(self, scans, title))

    def map(
        self,
        scans: Scans,
        *,
        voxel: float | None = None,
        spin_rate: float | None = None,
    ) -> PointCloud:
        """Fuse the scans of the longest segment into one cloud, of a point for each voxel.

        Parameters
        ----------
        scans
            In their order, each in its own frame, as they were followed; a motion within a scan is taken
            out by the times of its fields.
        voxel
            Edge of the voxels, in the scans' unit; by default that of the map.
        spin_rate
            As it was given to `estimate_odometry`.

        Returns
        -------
        PointCloud
            In the world: the mean of each voxel's points, with the fields nx, ny, nz, the unit normal on the
            side of the sensors (NaN where neighbours are too few), and scans, by how many scans it was seen.

        Raises
        ------
        InvalidInputError
            If the voxel is no length, or there is not one scan for each pose.
        """
        edge = positive_length(self.voxel if voxel is None else voxel, "voxel")
        straight = self.deskewed(scans, spin_rate=spin_rate)
        return fuse_scans(straight, self.poses_of(self.longest_segment), voxel=edge)

    def deskewed(self, scans: Scans, *, spin_rate: float | None = None) -> Iterator[PointCloud]:
        """Give the scans as they would be if the sensor had stood still at each, one by one.

        Parameters
        ----------
        scans
            In their order, each in its own frame, as they were followed.
        spin_rate
            As it was given to `estimate_odometry`.

        Yields
        ------
        PointCloud
            The scan itself where its points have no times, or it has no pose.

        Raises
        ------
        InvalidInputError
            If there is not one scan for each pose.
        """
        number = -1
        for number, scan in enumerate(timed_scans(scans)):
            if number == len(self):
                raise InvalidInputError(f"there are {len(self)} poses, but more scans")
            timestamp = clock_time(float(self.timestamps[number]), number)
            yield deskew(scan.cloud, self.twists[number], timestamp=timestamp, spin_rate=spin_rate)
        if number + 1 != len(self):
            raise InvalidInputError(f"there are {len(self)} poses, but {number + 1} scans")

    @property
    def length(self) -> float:
        """Length of the trajectory, in the scans' unit: straight lines between scans in one world."""
        known = np.flatnonzero(self.segments >= 0)
        steps = np.linalg.norm(np.diff(self.poses[known, :3, 3], axis=0), axis=1)
        return float(steps[np.diff(self.segments[known]) == 0].sum())

    @property
    def longest_segment(self) -> int:
        """Number of the segment with the most scans, the first of several; -1 where no scan has a pose."""
        numbers = self.segments[self.segments >= 0]
        return int(np.bincount(numbers).argmax()) if len(numbers) else -1

    def poses_of(self, segment: int) -> Array:
        """Give the poses in one world.

        Parameters
        ----------
        segment
            Its number.

        Returns
        -------
        numpy.ndarray
            T_world_scan, (n, 4, 4); NaN for scans that are in another one or have no pose.
        """
        return np.where((self.segments == segment)[:, None, None], self.poses, np.nan)
