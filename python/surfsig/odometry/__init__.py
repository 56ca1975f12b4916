"""The way of a sensor through its scans: `odometry`."""

from surfsig.odometry.result import Odometry, ScanStatus
from surfsig.odometry.search import odometry

__all__ = ["Odometry", "ScanStatus", "odometry"]
