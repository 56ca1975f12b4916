"""In which directions a surface can be rotated or translated without a change.

Gelfand, Guibas: Shape segmentation using local slippage analysis (SGP 2004).
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.geometry import axes_across

Array = NDArray[np.float64]

Motion = Literal["rotation", "translation"]


@dataclass(frozen=True, eq=False)
class FreeDirection:
    """A motion that does not change a surface: its pose is not determined in that direction."""

    motion: Motion
    """"rotation" or "translation"."""
    axis: Array
    """Unit vector (3,), of the translation or of the rotation; NaN for rotations about all axes through
    `point`."""
    point: Array
    """A point on the rotation's axis, (3,); NaN for a translation."""

    def __str__(self) -> str:
        if np.isnan(self.axis).any():
            return f"rotates about {_text(self.point)}"
        if self.motion == "rotation":
            return f"rotates about the axis {_text(self.axis)} through {_text(self.point)}"
        return f"slides along {_text(self.axis)}"

    def values(self) -> dict[str, Any]:
        """Give motion, axis and point as plain numbers, for JSON.

        Returns
        -------
        By the names of the attributes; without axis or point where there is none.
        """
        known = {"axis": self.axis, "point": self.point}
        return {"motion": self.motion} | {
            name: vector.tolist() for name, vector in known.items() if not np.isnan(vector).any()
        }


def free_direction(
    motion: Motion, axis: Sequence[float] | None, point: Sequence[float] | None
) -> FreeDirection:
    """Make a direction of what the core says of it."""
    known = [np.full(3, np.nan) if vector is None else np.array(vector) for vector in (axis, point)]
    return FreeDirection(motion, *known)


def free_directions_of_surface(kind: str, point: Array, axis: Array) -> list[FreeDirection]:
    """Give the free directions of a plane, sphere, cylinder, cone, torus, circle or line without ends."""
    none = np.full(3, np.nan)
    if kind == "sphere":
        return [FreeDirection("rotation", none, point)]
    rotation = FreeDirection("rotation", axis, point)
    if kind == "plane":
        return [rotation, *(FreeDirection("translation", along, none) for along in axes_across(axis))]
    return (
        [rotation, FreeDirection("translation", axis, none)] if kind in ("cylinder", "line") else [rotation]
    )


def free_directions(points: Array, normals: Array) -> list[FreeDirection]:
    """Find the motions along which points slide over their own surface; the rims do not count.

    Parameters
    ----------
    points, normals
        (n, 3) points and unit normals.
    """
    found = _surfsig.free_directions(*(np.ascontiguousarray(rows, np.float64) for rows in (points, normals)))
    return [free_direction(*direction) for direction in found]


def _text(vector: Array) -> str:
    return "(" + ", ".join(f"{value:.4g}" for value in vector) + ")"
