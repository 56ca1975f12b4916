"""Whether two pieces can be equal by the surface that most of each is."""

from __future__ import annotations

import numpy as np

from surfsig.recurrences.result import Piece
from surfsig.surfaces import Surface, Surfaces

_MOST = 0.5
"""Share of a piece's points on its main surface."""
_DEVIATIONS = 5.0
"""Standard errors of a difference in size that tell two surfaces apart, if it is more than this, too:"""
_RELATIVE, _ANGLE = 0.1, np.radians(3.0)
"""Of the larger radius, and of half angles: what is seen in part errs by more than its standard error."""


def main_surface(piece: Piece, found: Surfaces) -> Surface | None:
    """Give the surface that most of a piece is; None where there is none."""
    on_surface = found.labels[piece.points]
    on_surface = on_surface[on_surface >= 0]
    if not len(on_surface):
        return None
    counts = np.bincount(on_surface)
    number = int(counts.argmax())
    return found[number] if counts[number] >= _MOST * len(piece.points) else None


def may_be_equal(a: Surface | None, b: Surface | None) -> bool:
    """Tell whether main surfaces do not differ in what both have: a half angle, or a radius of one kind.

    A cylinder is a cone with the half angle 0. Whatever else differs is left to geometry.
    """
    if a is None or b is None:
        return True
    if a.kind != b.kind:
        if {a.kind, b.kind} != {"cone", "cylinder"}:
            return True
        cone = a if a.kind == "cone" else b
        return not _apart(cone.half_angle, cone.half_angle_std, _ANGLE)
    if a.kind == "cone":
        error = float(np.hypot(a.half_angle_std, b.half_angle_std))
        return not _apart(a.half_angle - b.half_angle, error, _ANGLE)
    if a.kind in ("sphere", "cylinder"):
        error = float(np.hypot(a.radius_std, b.radius_std))
        return not _apart(a.radius - b.radius, error, _RELATIVE * max(a.radius, b.radius))
    return True


def _apart(difference: float, error: float, most: float) -> bool:
    return abs(difference) > max(most, _DEVIATIONS * error)
