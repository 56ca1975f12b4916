"""Which parts of a scan are planes, spheres, cylinders, cones and tori, how large, and how sure that is.

`surfsig.surfaces` finds them; `Surfaces` is what it gives.
"""

from surfsig.surfaces.classes import PointClass
from surfsig.surfaces.found import Surfaces
from surfsig.surfaces.search import surfaces
from surfsig.surfaces.surface import KINDS, Kind, Surface

__all__ = ["KINDS", "Kind", "PointClass", "Surface", "Surfaces", "surfaces"]
