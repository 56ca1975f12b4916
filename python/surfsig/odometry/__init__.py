"""The trajectory of a sensor, from its scans: `estimate_odometry`."""

from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.odometry.search import estimate_odometry

__all__ = ["Odometry", "ScanStatus", "estimate_odometry"]
