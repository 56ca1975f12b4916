"""What is known of a shape before it is fitted, and how much each point counts."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length
from surfsig.errors import InvalidInputError
from surfsig.shapes.surface import ShapeKind

Array = NDArray[np.float64]
Chosen = NDArray[np.bool_] | NDArray[np.intp] | slice

ALL = slice(None)
"""All points."""


@dataclass(frozen=True, eq=False)
class Known:
    """The radius and the axis that a fit keeps, and the points' weights."""

    weights: Array | None = None
    """(n,), by how much the squared distance of each point counts; None: all alike."""
    radius: float | None = None
    axis: Array | None = None
    """(3,), a unit vector."""

    def of(self, chosen: Chosen) -> Known:
        """Give what is known of some of the points."""
        return Known(self._weights_of(chosen), self.radius, self.axis)

    def fit(
        self,
        kind: ShapeKind,
        points: Array,
        chosen: Chosen = ALL,
        start: _surfsig.Primitive | None = None,
    ) -> _surfsig.Primitive | None:
        """Fit a shape to the points that are chosen; None where they determine none."""
        some = np.ascontiguousarray(points[chosen])
        return _surfsig.fit_primitive(
            some, kind, start, self._weights_of(chosen), self.radius, self._axis_list
        )

    def uncertainty(
        self, primitive: _surfsig.Primitive, points: Array, chosen: Chosen = ALL
    ) -> tuple[Array, Array, float]:
        """Give the covariance, the directions across the axis, and the degrees of freedom."""
        some = np.ascontiguousarray(points[chosen])
        return primitive.uncertainty(some, self._weights_of(chosen), self.radius, self._axis_list)

    def unknowns(self, kind: ShapeKind) -> int:
        """Count the parameters that are fitted."""
        tilts = 0 if self.axis is None else 2
        return _surfsig.KIND_PARAMETERS[kind] - tilts - (self.radius is not None)

    @property
    def _axis_list(self) -> list[float] | None:
        return None if self.axis is None else [float(c) for c in self.axis]

    def _weights_of(self, chosen: Chosen) -> Array | None:
        return None if self.weights is None else np.ascontiguousarray(self.weights[chosen])


NOTHING_KNOWN = Known()


def known_of(
    weights: ArrayLike | None, radius: float | None, axis: ArrayLike | None, finite: NDArray[np.bool_]
) -> Known:
    """Check what a person knows of a shape in a cloud, some of whose points are finite."""
    return Known(
        None if weights is None else _weight_array(weights, finite),
        None if radius is None else positive_length(radius, "radius"),
        None if axis is None else _direction(axis),
    )


def _weight_array(weights: ArrayLike, finite: NDArray[np.bool_]) -> Array:
    try:
        values = np.asarray(weights, np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError("weights must be numbers, one for each point") from None
    if values.shape != finite.shape:
        raise InvalidInputError(
            f"weights must be one for each of the {len(finite)} points, not of shape {values.shape}"
        )
    values = values[finite]
    if not (np.isfinite(values) & (values >= 0)).all():
        raise InvalidInputError("weights must be finite and not below 0")
    largest = float(values.max(initial=0.0))
    if not largest > 0:
        raise InvalidInputError("one weight at least must be above 0")
    # Their common factor means nothing; of a small one the squares would leave the numbers that there are.
    return np.asarray(values / largest)


def _direction(axis: ArrayLike) -> Array:
    try:
        vector = np.asarray(axis, np.float64)
    except (TypeError, ValueError):
        raise InvalidInputError("axis must be three numbers") from None
    if vector.shape != (3,):
        raise InvalidInputError(f"axis must be three numbers, not of shape {vector.shape}")
    largest = float(np.abs(vector).max())
    if not (np.isfinite(largest) and largest > 0):
        raise InvalidInputError("axis must be finite, and longer than 0")
    vector = vector / largest
    unit: Array = vector / np.linalg.norm(vector)
    return unit
