"""Sequences of scans: files, folders and ROS bags, read one by one."""

from __future__ import annotations

import os
import warnings
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from surfsig.errors import FileFormatError, InvalidInputError
from surfsig.files.paths import Paths, files_of_folder, matches, natural
from surfsig.files.read_file import ReadOptions, read_file
from surfsig.files.ros_bag import BagTopic, bag_of
from surfsig.files.timestamps import times_of_names
from surfsig.point_cloud import PointCloud


@dataclass(frozen=True, eq=False)
class TimedScan:
    """A scan, and when it was taken.

    Attributes
    ----------
    timestamp
        In seconds.
    cloud
        The scan.
    """

    timestamp: float
    cloud: PointCloud


class ScanSequence:
    """Scans that are read one by one, as often as they are walked through.

    A file that cannot be read gives a warning and a scan without points; a bag that is broken in its middle
    gives one and ends there.

    `open_scan_sequence` makes it.
    """

    def __init__(self, parts: list[Path | BagTopic], reading: dict[str, Any]) -> None:
        self._parts, self._reading = parts, reading
        names = [part.stem for part in parts if isinstance(part, Path)]
        self._times = times_of_names(names) if len(names) == len(parts) else None

    def __len__(self) -> int:
        """Return the number of scans."""
        return sum(1 if isinstance(part, Path) else len(part) for part in self._parts)

    def __iter__(self) -> Iterator[TimedScan]:
        """Read scan by scan."""
        number = 0
        for part in self._parts:
            for stamp, cloud in self._scans_of(part):
                if self._times is not None:
                    stamp = self._times[number]
                yield TimedScan(float(number) if stamp is None else stamp, cloud)
                number += 1

    def _scans_of(self, part: Path | BagTopic) -> Iterator[tuple[float | None, PointCloud]]:
        if isinstance(part, Path):
            yield None, scan_or_empty(part, **self._reading)
            return
        try:
            yield from part
        except FileFormatError as error:
            warnings.warn(f"{error}; its scans end there", stacklevel=2)


def clock_time(timestamp: float, number: int) -> float | None:
    """Give the time of a scan, or None where it is the scan's number: that is no clock."""
    return None if timestamp == number else timestamp


Scans = (
    str
    | os.PathLike[str]
    | ScanSequence
    | Iterable[str | os.PathLike[str] | PointCloud | TimedScan | ArrayLike]
)
"""What is walked through scan by scan: a path for `open_scan_sequence`, or the scans and files themselves."""


def timed_scans(scans: Scans) -> Iterator[TimedScan]:
    """Give each scan with its time: its number, where nobody says."""
    walked: Any = open_scan_sequence(scans) if isinstance(scans, (str, os.PathLike)) else scans
    if isinstance(walked, PointCloud) or not isinstance(walked, Iterable):
        raise InvalidInputError("scans must be several clouds or files, a folder, or a bag")
    for number, scan in enumerate(walked):
        if isinstance(scan, TimedScan):
            yield TimedScan(float(scan.timestamp), PointCloud.of(scan.cloud))
        elif isinstance(scan, (str, os.PathLike)):
            # A wrong name is the caller's mistake, not a broken scan.
            Path(scan).stat()
            yield TimedScan(float(number), scan_or_empty(Path(scan)))
        else:
            yield TimedScan(float(number), PointCloud.of(scan))


def open_scan_sequence(paths: Paths, *, topic: str | None = None, **reading: Any) -> ScanSequence:
    """Find the scans of a sequence, to be read one by one.

    Parameters
    ----------
    paths
        A file that `surfsig.read` reads, a folder of such files, or a ROS bag (a ROS 1 file, or a ROS 2
        folder or file of it), a pattern that matches such (``"scan/*.ply"``), or several of them. Files of a
        folder are taken in the natural order of their names (2 before 10), and so are several paths; hidden
        files are left out, and those of another suffix than most have.
    topic
        Of bags: which topic's clouds (sensor_msgs/PointCloud2), where there are several.
    reading
        Of files: further keywords, `unit`, `box`, ... as `surfsig.read` takes them.

    Returns
    -------
    ScanSequence
        Gives a `TimedScan` each. A timestamp is that in a message's header; the number that the file's name
        is, in seconds, where all names are numbers that grow (whole ones of 13, 16 and 19 digits count
        milli-, micro- and nanoseconds), or that of a clock at its end (cloud_SEC_NSEC, SEC.NSEC); otherwise
        the scan's number.

    Raises
    ------
    OSError
        If a path is missing, or nothing matches a pattern.
    FileFormatError
        If a bag cannot be opened, or a folder holds no files.
    InvalidInputError
        If there is nothing to read, or the topic does not fit.

    Warns
    -----
    UserWarning
        If files of a folder are left out.
    """
    given = [paths] if isinstance(paths, (str, os.PathLike)) else list(paths)
    parts: list[Path | BagTopic] = []
    chosen = sorted((file for path in given for file in matches(Path(path)) or [Path(path)]), key=natural)
    for path in chosen:
        # Whatever is missing says so now, and not after hours.
        path.stat()
        bag = bag_of(path)
        if bag is not None:
            parts.append(BagTopic(bag, topic))
        elif path.is_dir():
            parts += files_of_folder(path)
        else:
            parts.append(path)
    if not parts:
        raise InvalidInputError("there are no scans")
    bags = [part for part in parts if isinstance(part, BagTopic)]
    if topic is not None and not bags:
        raise InvalidInputError(f"{chosen[0]}: is no ROS bag, and so has no topic '{topic}'")
    if reading and bags:
        raise InvalidInputError(f"{bags[0].path}: '{next(iter(reading))}' means nothing for a ROS bag")
    return ScanSequence(parts, reading)


def scan_or_empty(path: Path, **reading: Any) -> PointCloud:
    """Read a scan; one that cannot be read gives a warning and no points, so that the others can be used."""
    try:
        return read_file(path, ReadOptions(**reading), keep_default_viewpoint=True)
    except (FileFormatError, OSError) as error:
        told = str(error) if isinstance(error, FileFormatError) else f"{path}: {error.strerror or error}"
        warnings.warn(f"{told}; taken as a scan without points", stacklevel=2)
        return PointCloud(np.zeros((0, 3), np.float32))
