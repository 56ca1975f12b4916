"""What the fits ask of a surface."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, ClassVar, Literal

import numpy as np
from numpy.typing import NDArray

if TYPE_CHECKING:
    from typing_extensions import Self

Array = NDArray[np.float64]

Kind = Literal["sphere", "cylinder", "plane"]


class Surface(ABC):
    """A surface in the middle of a fit, which moves by steps of its own unknowns."""

    kind: ClassVar[Kind]
    unknowns: ClassVar[int]

    center: Array
    """A point of its middle, its axis, or itself, next to 0; (3,)."""
    axis: Array | None
    """Unit vector along a cylinder, across a plane, (3,); a sphere has none."""
    radius: float
    """NaN where it has none."""

    @classmethod
    @abstractmethod
    def through(cls, points: Array) -> Self | None:
        """Give the algebraic surface through points (n, 3) about 0; None where they determine none."""

    @abstractmethod
    def moved(self, step: Array) -> Self:
        """Give the surface after a step (p,) of its unknowns."""

    @abstractmethod
    def placed(self, unit: float, origin: Array) -> Self:
        """Give the surface where x is unit * x + origin, with a positive z (else y, else x) of its axis."""

    @abstractmethod
    def distances(self, points: Array) -> Array:
        """Give the points' signed distances, (n,): positive outside, or where a plane's normal points."""

    @abstractmethod
    def jacobian(self, points: Array, step: Array) -> Array:
        """Give the derivatives (n, p) of ``moved(step).distances(points)`` by the step."""

    @abstractmethod
    def embedding(self) -> Array:
        """Give the derivatives (m, p) of center, axis and radius, those that it has, by the step at 0."""


def across(axis: Array) -> tuple[Array, Array]:
    """Give two unit vectors at right angles to a third and to each other."""
    u = np.cross(axis, np.eye(3)[np.abs(axis).argmin()])
    u /= np.linalg.norm(u)
    return u, np.cross(axis, u)


def upward(axis: Array) -> Array:
    """Give the vector or its opposite: that with a positive z, else y, else x."""
    return axis if tuple(axis[::-1]) > (0.0, 0.0, 0.0) else -axis
