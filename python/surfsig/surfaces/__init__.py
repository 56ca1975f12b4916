"""Which parts of a scan are planes, spheres, cylinders, cones and tori, how large, and how sure that is.

`surfsig.find_surfaces` finds them; `Surfaces` is what it gives.
"""

from surfsig.shapes.surface import KINDS, Kind, Surface
from surfsig.surfaces.classes import PointClass
from surfsig.surfaces.found import Surfaces
from surfsig.surfaces.pipe_runs import PipeJoint, PipeRun, PipeSegment
from surfsig.surfaces.search import find_surfaces

__all__ = [
    "KINDS",
    "Kind",
    "PipeJoint",
    "PipeRun",
    "PipeSegment",
    "PointClass",
    "Surface",
    "Surfaces",
    "find_surfaces",
]
