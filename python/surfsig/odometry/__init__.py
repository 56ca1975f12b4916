"""The trajectory of a sensor, from its scans: `estimate_odometry`, or scan by scan `Tracker`."""

from surfsig.odometry.loop_closing import LoopClosure
from surfsig.odometry.point_times import deskew
from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.odometry.search import estimate_odometry
from surfsig.odometry.tracker import TrackedScan, Tracker

__all__ = [
    "LoopClosure",
    "Odometry",
    "ScanStatus",
    "TrackedScan",
    "Tracker",
    "deskew",
    "estimate_odometry",
]
