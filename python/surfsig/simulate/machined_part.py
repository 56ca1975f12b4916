"""A simulated machined part with surfaces of known curvature, for demonstrations and tests."""

from __future__ import annotations

from typing import NamedTuple

import numpy as np

from ..point_cloud import PointCloud
from .poses import Array, pose, turn
from .scanner import Scanner, Seed
from .scene import Placed, Scene
from .surfaces import Box, Cone, Cylinder, Sphere, Surface

#: Closer sampling and a longer reach than the default: the part is 220 mm long.
PART_SCANNER = Scanner(
    baseline=0.25,
    column_step=4,
    sheet_step=4e-4,
    field_width=0.236,
    scan_length=0.158,
    depth_range=(-0.08, 0.02),
    noise=5e-5,
    outlier_rate=0.0005,
)


class _Piece(NamedTuple):
    """One piece of the part; lengths in millimetres, heights *up* from the plate's top."""

    name: str
    surface: Surface
    position: tuple[float, float, float]  # of the object's origin
    heading: float | None = None  # degrees from x of a lying axis; None: the object stands upright


def _box(x: float, y: float, z: float) -> Surface:
    return Box((x / 1000, y / 1000, z / 1000))


def _rod(radius: float, length: float) -> Surface:
    return Cylinder(radius / 1000, length / 1000)


def _ball(radius: float) -> Surface:
    return Sphere(radius / 1000)


# Balls and rods sink into the plate by as much as their origin lies below their radius.
# fmt: off
_PIECES = (
    #       name                  surface             origin, mm       heading, degrees
    _Piece("plate",               _box(220, 140, 12), (   0,   0,  -6)),
    _Piece("step",                _box( 60, 140,  8), ( -80,   0,   4)),
    _Piece("pipe, r 10 mm",       _rod(10, 84),       (   2, -52,   7),  0),
    _Piece("pipe, r 6 mm",        _rod(6, 70),        ( -25,   8,   5), 60),
    _Piece("pipe, r 8 mm",        _rod(8, 80),        ( -95, -10,  13), 90),
    _Piece("dome, r 30 mm",       _ball(30),          (  22,  38, -16)),
    _Piece("dome, r 15 mm",       _ball(15),          (  91,  42,  -3)),
    _Piece("dome, r 12 mm",       _ball(12),          ( -70,  42,   4)),
    _Piece("ball, r 10 mm",       _ball(10),          (  92, -48,   4)),
    _Piece("block",               _box(24, 16, 10),   ( -68, -45,  13), 25),
    _Piece("frustum, r 16-6 mm",  Cone(0.016, 0.009, 0.006), (92, -5, 0)),
)
# Cut into the plate's top, and seen from inside.
_CUTS = (
    _Piece("groove, r -12 mm",    _rod(12, 160),      (  62,   0,   5), 90),
    _Piece("dimple, r -25 mm",    _ball(25),          (  28, -14,  17)),
)
# fmt: on


def part_scene() -> Scene:
    """Build the part as a scene in the scanner's axes, the plate's top at z = 0.

    Its names give the radii, negative for what is hollow. A plate of 220 x 140 mm with a step, pipes, domes,
    a ball, a block, a frustum, a cylindrical groove and a spherical dimple.

    Returns
    -------
    Scene
    """
    plate, *others = (_placed(piece) for piece in _PIECES)
    cuts = tuple(_placed(piece) for piece in _CUTS)
    hollow = [
        Placed(cut.surface, cut.pose, cut.name, inside=(plate,), outside=cuts[:i] + cuts[i + 1 :])
        for i, cut in enumerate(cuts)
    ]
    drilled = Placed(plate.surface, plate.pose, plate.name, outside=cuts)
    return Scene([drilled, *others, *hollow])


def _placed(piece: _Piece) -> Placed:
    """Place a piece in scanner axes: half a turn about x makes upward heights negative."""
    if piece.heading is None:
        rotation: Array = np.eye(3)
    else:
        rotation = turn((0.0, 0.0, 1.0), np.radians(piece.heading))
        if isinstance(piece.surface, Cylinder):
            rotation = rotation @ turn((0.0, 1.0, 0.0), np.pi / 2)
    flip = pose((0.0, 0.0, 0.0), np.diag([1.0, -1.0, -1.0]))
    return Placed(piece.surface, flip @ pose(np.array(piece.position) / 1000.0, rotation), piece.name)


def part(seed: Seed = 0, *, scanner: Scanner = PART_SCANNER, truth: bool = False) -> PointCloud:
    """Scan the machined part.

    Parameters
    ----------
    seed : int, sequence of int, SeedSequence or Generator
        Of noise and outliers.
    scanner : Scanner
        By default :data:`PART_SCANNER`: points every 0.4 mm, noise of 0.05 mm.
    truth : bool
        Add true normals and curvatures; see :meth:`Scanner.scan`.

    Returns
    -------
    PointCloud
        About 185,000 points; field `surface` indexes ``part_scene().names``.
    """
    return scanner.scan(part_scene(), seed, truth=truth)
