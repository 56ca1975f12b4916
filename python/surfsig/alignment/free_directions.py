"""In which directions a piece can be turned or slid without a change.

Gelfand, Guibas: Shape segmentation using local slippage analysis (SGP 2004).
"""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from surfsig.geometry import axes_across, skew

Array = NDArray[np.float64]

_SLIPS = 0.04
"""Largest root mean square of heights that a free motion makes, over that of its points' ways."""
_TURN_PART = 0.3
"""Part of a motion that is a turn below which it is a slide."""

Motion = Literal["turn", "slide"]


@dataclass(frozen=True, eq=False)
class FreeDirection:
    """A motion that does not change a surface: its pose is not determined in that direction."""

    motion: Motion
    """"turn" or "slide"."""
    axis: Array
    """Unit vector (3,), of the slide or of the turn; NaN for turns about all axes through `point`."""
    point: Array
    """A place on the turn's axis, (3,); NaN for a slide."""

    def __str__(self) -> str:
        if np.isnan(self.axis).any():
            return f"turns about {_text(self.point)}"
        if self.motion == "turn":
            return f"turns about the axis {_text(self.axis)} through {_text(self.point)}"
        return f"slides along {_text(self.axis)}"

    def values(self) -> dict[str, Any]:
        """Give motion, axis and point as plain words and numbers, as JSON takes them.

        Returns
        -------
        dict
            motion, axis, point; without axis or point where there is none.
        """
        known = {"axis": self.axis, "point": self.point}
        return {"motion": self.motion} | {
            name: vector.tolist() for name, vector in known.items() if not np.isnan(vector).any()
        }


def free_directions_of_surface(kind: str, point: Array, axis: Array) -> list[FreeDirection]:
    """Give the free directions of a plane, sphere, cylinder, cone or torus without ends."""
    none = np.full(3, np.nan)
    if kind == "sphere":
        return [FreeDirection("turn", none, point)]
    turn = FreeDirection("turn", axis, point)
    if kind == "plane":
        return [turn, *(FreeDirection("slide", along, none) for along in axes_across(axis))]
    return [turn, FreeDirection("slide", axis, none)] if kind == "cylinder" else [turn]


def free_directions(points: Array, normals: Array) -> list[FreeDirection]:
    """Find the motions along which points slip over their own surface; the rims do not count.

    Parameters
    ----------
    points, normals
        (n, 3) places and unit normals.
    """
    if not len(points):
        return []
    middle = points.mean(axis=0)
    local = points - middle
    unit = float(np.sqrt((local**2).sum(axis=1).mean())) or 1.0
    heights = np.hstack([np.cross(local / unit, normals), normals])
    values, motions = np.linalg.eigh(heights.T @ heights / len(points))
    free = motions[:, values <= _SLIPS**2].T
    if not len(free):
        return []
    # The turns among the free motions: the largest rotational parts.
    left, sizes, _ = np.linalg.svd(free[:, :3])
    turns = int((sizes > _TURN_PART).sum())
    none = np.full(3, np.nan)
    mixed = left.T @ free
    found: list[FreeDirection] = []
    if turns == 3:
        # v = w x (p - c) for all w: the centre is where every turn's axis passes.
        design = np.concatenate([skew(motion[:3]) for motion in mixed[:3]])
        centre, *_ = np.linalg.lstsq(design, -mixed[:3, 3:].ravel(), rcond=None)
        found.append(FreeDirection("turn", none, middle + unit * centre))
    else:
        for motion in mixed[:turns]:
            rate = float(np.linalg.norm(motion[:3]))
            axis = motion[:3] / rate
            centre = np.cross(axis, motion[3:]) / rate
            found.append(FreeDirection("turn", axis, middle + unit * centre))
    for motion in mixed[turns:]:
        found.append(FreeDirection("slide", motion[3:] / np.linalg.norm(motion[3:]), none))
    return found


def _text(vector: Array) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in vector) + ")"
