"""Maps of many scans: scans joined by their poses, and trajectories closed where the sensor comes back."""

from surfsig.mapping.fusion import fuse_scans
from surfsig.mapping.loops import Loop, LoopClosure, close_loops

__all__ = ["Loop", "LoopClosure", "close_loops", "fuse_scans"]
