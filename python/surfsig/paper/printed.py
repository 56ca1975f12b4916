"""What the paper prints: its tables, in its own numbers."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Final

import numpy as np

from ..simulate.acquisitions import Kind
from ..simulate.poses import Array

#: Table I: surface, K and H as formulas of the radius r.
TABLE_I: Final = (("Plane", "0", "0"), ("Cylinder", "0", "1/2r"), ("Sphere", "1/r^2", "1/r"))

#: Table II: smallest and largest value of each parameter of eq. (5), in metres.
TABLE_II: Final = {
    "a": (-100.0, 100.0),
    "b": (-100.0, 100.0),
    "c": (-1.0, 1.0),
    "d": (-1.0, 1.0),
    "e": (-100.0, 100.0),
    "f": (-0.02, 0.02),
}


@dataclass(frozen=True)
class Object:
    """One row of table III.

    Attributes
    ----------
    kind : str
        "plane", "cylinder", "sphere" or "irregular".
    name : str
        Kind of surface, as printed.
    property : str
        Object property, as printed (in words where it is a vector or a symbol).
    radius : float
        Metres; infinite for a plane, NaN for the irregular surface.
    """

    kind: Kind
    name: str
    property: str
    radius: float


def _plane(name: str, text: str) -> Object:
    return Object("plane", name, text, np.inf)


def _round(kind: Kind, name: str, radius_mm: float) -> Object:
    return Object(kind, name, f"r = {radius_mm:g} mm", radius_mm / 1000)


#: Table III, acquisitions 1 to 20.
TABLE_III: Final = (
    _plane("Horizontal plane 1", "Plastic medium"),
    _plane("Horizontal plane 2", "Aluminum"),
    _plane("Horizontal plane 3", "Aluminum"),
    _plane("Tilted plane 1", "n = [0.781, -0.499, -0.375]"),
    _plane("Tilted plane 2", "n = [-0.507, -0.028, -0.862]"),
    _plane("Tilted plane 3", "n = [-0.381, -0.334, -0.862]"),
    _plane("Tilted plane 4", "n = [-0.435, 0.268, -0.860]"),
    _round("cylinder", "Cylinder 1", 24.27),
    _round("cylinder", "Cylinder 2", 38.27),
    _round("sphere", "Sphere 1", 18.85),
    _round("sphere", "Sphere 2", 34.42),
    _round("sphere", "Sphere 3", 29.70),
    _round("sphere", "Sphere 4", 27.25),
    _round("sphere", "Sphere 5", 14.15),
    _round("sphere", "Sphere 6", 20.5),
    _round("sphere", "Sphere 2", 34.42),
    _round("sphere", "Sphere 7", 35.12),
    _round("sphere", "Sphere 6", 20.5),
    _round("sphere", "Sphere 5", 14.15),
    Object("irregular", "Irregular surface", "-", np.nan),
)

#: Section II.B: side D of the patch and step of its grid, metres, and the smallest eigenvalue of F F^T.
SIDE: Final = 0.040
STEP: Final = 0.004
SMALLEST_EIGENVALUE: Final = 2.5e-4


@dataclass(frozen=True)
class SimilarityTable:
    """Zeta of one acquisition's signature with those of the nineteen others: tables IV to VI.

    Attributes
    ----------
    name : str
        "IV", "V" or "VI".
    reference : int
        The acquisition that all are compared with, 1 to 20.
    values : tuple of float or None
        As printed, for acquisitions 1 to 20; None for the reference itself.
    """

    name: str
    reference: int
    values: tuple[float | None, ...]

    @property
    def others(self) -> tuple[int, ...]:
        """Numbers of the nineteen acquisitions that are compared with the reference."""
        return tuple(n for n in range(1, len(self.values) + 1) if n != self.reference)

    @property
    def zeta(self) -> Array:
        """Printed values of the nineteen `others`, (19,)."""
        return np.array([self.values[n - 1] for n in self.others], dtype=np.float64)


# fmt: off
SIMILARITIES: Final = (
    SimilarityTable("IV", 5, (
        0.9996, 0.9996, 0.9996, 0.9667, None, 0.9997, 0.9945, 0.2615, 0.1036, 0.0795,
        0.1207, 0.1687, 0.0107, 0.0174, 0.0955, 0.1954, 0.1855, 0.0692, 0.0066, 0.2438,
    )),
    SimilarityTable("V", 8, (
        0.2710, 0.2727, 0.2727, 0.3062, 0.26154, 0.2719, 0.3052, None, 0.5951, 0.0005,
        0.0146, 0.0182, 0.0484, 0.0024, 0.0114, 0.0230, 0.0012, 0.0156, 0.0025, 0.0731,
    )),
    SimilarityTable("VI", 14, (
        0.0170, 0.0170, 0.0173, 0.0164, 0.0174, 0.0172, 0.0175, 0.0021, 0.0013, 0.2306,
        0.0308, 0.0012, 0.0478, None, 0.3034, 0.0003, 0.0011, 0.1959, 0.6935, 0.0391,
    )),
)
# fmt: on
