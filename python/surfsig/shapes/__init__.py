"""Shapes by orthogonal distance, and how sure they are: `fit_sphere`, `fit_cylinder`, `fit_plane`, ..."""

from surfsig.shapes.fits import fit_circle, fit_cone, fit_cylinder, fit_line, fit_plane, fit_sphere, fit_torus
from surfsig.shapes.fitting import Criterion
from surfsig.shapes.patch import SurfacePatch
from surfsig.shapes.relation import SurfaceAngle, SurfaceDistance
from surfsig.shapes.surface import CURVE_KINDS, KINDS, CurveKind, Kind, ShapeKind, Surface

__all__ = [
    "CURVE_KINDS",
    "KINDS",
    "Criterion",
    "CurveKind",
    "Kind",
    "ShapeKind",
    "Surface",
    "SurfaceAngle",
    "SurfaceDistance",
    "SurfacePatch",
    "fit_circle",
    "fit_cone",
    "fit_cylinder",
    "fit_line",
    "fit_plane",
    "fit_sphere",
    "fit_torus",
]
