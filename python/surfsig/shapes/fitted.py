"""What the fit of a shape gives."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.defaults import INTERVAL
from surfsig.digits import with_error
from surfsig.point_cloud import PointCloud
from surfsig.shapes.robust import Array, Kind


@dataclass(frozen=True, eq=False, repr=False)
class FittedShape:
    """A sphere, cylinder or plane that was fitted to points, with its errors.

    All lengths are in the points' own unit, all places in their coordinates.
    """

    kind: Kind
    """"sphere", "cylinder" or "plane"."""
    center: Array
    """(3,): of a sphere its center; of a cylinder and a plane the point of the axis or the plane next to
    the mean of the points that count."""
    axis: Array | None
    """Unit vector (3,): along a cylinder, or across a plane, with a positive z (else y, else x); None for a
    sphere."""
    radius: float
    """NaN for a plane."""
    covariance: Array
    """Of center x, y, z; axis x, y, z; radius, in this order and without what the shape does not have: (4, 4)
    of a sphere, (7, 7) of a cylinder, (6, 6) of a plane. A cylinder's center has no error along the axis, a
    plane's none within the plane, and an axis none along itself."""
    degrees_of_freedom: float
    """Of the radius's standard error; of a plane's shift along its normal."""
    rms: float
    """Root mean square of the distances of the points that count."""
    residuals: Array
    """Signed distance of each point, (n,), those that do not count included: positive outside, or where a
    plane's normal points; NaN where a coordinate is not finite."""
    inliers: NDArray[np.bool_]
    """Which points count, (n,)."""

    @property
    def count(self) -> int:
        """Number of points that count."""
        return int(self.inliers.sum())

    @property
    def radius_std(self) -> float:
        """Standard error of the radius; NaN for a plane."""
        return math.nan if self.kind == "plane" else math.sqrt(self.covariance[-1, -1])

    @property
    def interval(self) -> tuple[float, float]:
        """The radius's 95 % interval by Student's t, as far as `surfsig.fit_sphere` says; NaN for a plane."""
        from scipy.stats import t

        half = self.radius_std * float(t.ppf(0.5 + 0.5 * INTERVAL, self.degrees_of_freedom))
        return self.radius - half, self.radius + half

    def __repr__(self) -> str:
        size = "" if self.kind == "plane" else f", radius={with_error(self.radius, self.radius_std)}"
        return (
            f"FittedShape({self.kind}{size}, rms={self.rms:.3g}, {self.count} of {len(self.inliers)} points)"
        )


def fitted_shape(
    kind: Kind, surface: _surfsig.Primitive, cloud: PointCloud, inliers: NDArray[np.bool_]
) -> FittedShape:
    """Describe a surface, in the coordinates of a cloud's offsets, that was fitted to some of its points."""
    points = cloud.offsets.astype(np.float64)
    residuals = surface.distances(points)
    covariance, across, freedom = surface.uncertainty(points[inliers])
    embedding = _embedding(kind, surface.axis, across)
    return FittedShape(
        kind=kind,
        center=surface.point + cloud.origin,
        axis=None if kind == "sphere" else surface.axis,
        radius=surface.radius,
        covariance=embedding @ covariance @ embedding.T,
        degrees_of_freedom=freedom,
        rms=float(np.sqrt((residuals[inliers] ** 2).mean())),
        residuals=residuals,
        inliers=inliers,
    )


def _embedding(kind: Kind, axis: Array, across: Array) -> Array:
    """Give the derivatives of center, axis and radius, those that the shape has, by the core's parameters."""
    if kind == "sphere":
        return np.eye(4)
    if kind == "plane":
        # Shift along the normal, and its tilts.
        embedding = np.zeros((6, 3))
        embedding[:3, 0] = axis
        embedding[3:, 1:] = across.T
        return embedding
    # Shifts of the axis, its tilts, and the radius.
    embedding = np.zeros((7, 5))
    embedding[:3, :2] = embedding[3:6, 2:4] = across.T
    embedding[6, 4] = 1.0
    return embedding
