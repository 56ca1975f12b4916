"""The way of a sensor through its scans: `odometry`."""

from surfsig.odometry.result import Odometry, ScanStatus

__all__ = ["Odometry", "ScanStatus"]
