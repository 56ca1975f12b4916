"""What all fits do: arguments checked, a shape found among points, and described with its errors."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any, Literal, get_args

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import _surfsig
from surfsig.arguments import positive_length, progress_callback, thread_count
from surfsig.clean import COORDINATE_LIMIT
from surfsig.digits import position_text
from surfsig.errors import InvalidInputError
from surfsig.point_cloud import PointCloud, position_array
from surfsig.progress import ProgressCallback
from surfsig.resolution import warn_if_surface_is_lost
from surfsig.shapes.growth import grown
from surfsig.shapes.known import ALL, Known, known_of
from surfsig.shapes.measured import measured_surface
from surfsig.shapes.minimum_zone import minimum_zone
from surfsig.shapes.robust import fitted_to_inliers, variance_factor
from surfsig.shapes.surface import CURVE_KINDS, ShapeKind, Surface

Array = NDArray[np.float64]

Criterion = Literal["least_squares", "minimum_zone"]
"""What is least: the sum of squared distances, or the largest distance."""


def fitted(
    kind: ShapeKind,
    data: PointCloud | ArrayLike,
    *,
    near: ArrayLike | None,
    radius: float | None,
    robust: bool,
    threads: int | None,
    progress: ProgressCallback | None,
    weights: ArrayLike | None = None,
    axis: ArrayLike | None = None,
    criterion: Criterion = "least_squares",
) -> Surface:
    """Fit a shape, as the public functions say."""
    workers, tell = thread_count(threads), progress_callback(progress)
    cloud = PointCloud.of(data)
    warn_if_surface_is_lost(cloud, stacklevel=4)
    _check_criterion(criterion, near, radius, weights, robust)
    finite = cloud.finite
    points = cloud.offsets[ALL if finite.all() else finite].astype(np.float64)
    if radius is not None and near is None and kind not in ("sphere", "cylinder", "circle"):
        raise InvalidInputError(
            f"radius is that of the ball around near: give near, too; a {kind} keeps none"
        )
    known = known_of(weights, radius if near is None else None, axis, finite)
    fewest = max(3, known.unknowns(kind) // components_of(kind) + 1)
    counted = len(points) if known.weights is None else int(np.count_nonzero(known.weights))
    if counted < fewest:
        raise InvalidInputError(f"a {kind} takes at least {fewest} points, not {counted}")
    if not (np.abs(points) <= COORDINATE_LIMIT).all():
        raise InvalidInputError(f"coordinates must be within {COORDINATE_LIMIT:g} for a fit")
    if near is None:
        found = fitted_to_inliers(kind, points, robust=robust, progress=tell, known=known)
    else:
        start = None if radius is None else positive_length(radius, "radius")
        position = position_array(near, "near")
        _check_near(points, position - cloud.origin, start, position)
        found = grown(kind, points, position - cloud.origin, start, workers, tell, known)
    if found is None:
        where = "" if near is None else " near that place"
        raise InvalidInputError(f"the points{where} determine no {kind}")
    primitive, chosen = found
    members = np.flatnonzero(finite)[chosen]
    if criterion == "minimum_zone":
        return _zone(kind, primitive, points, known, cloud.origin, members)
    trimmed = robust or near is not None
    return _described(kind, primitive, points, chosen, known, cloud.origin, members, trimmed=trimmed)


def components_of(kind: ShapeKind) -> int:
    """Count the components of a point's distance: two of a curve."""
    return 2 if kind in CURVE_KINDS else 1


def _described(
    kind: ShapeKind,
    primitive: _surfsig.Primitive,
    points: Array,
    chosen: NDArray[np.bool_],
    known: Known,
    origin: Array,
    members: NDArray[np.intp],
    *,
    trimmed: bool,
) -> Surface:
    """Describe a shape fitted to the points chosen, less the origin; `trimmed`: without those far from it."""
    # All of them need not be copied.
    some_of = ALL if chosen.all() else chosen
    covariance, across, freedom = known.uncertainty(primitive, points, some_of)
    some, weights = points[some_of], known.of(some_of).weights
    distances = primitive.distances(some)
    squares = distances**2
    # A point that does not count tells nothing of the deviation.
    counted = len(some) if weights is None else np.count_nonzero(weights)
    rest = counted * components_of(kind) - known.unknowns(kind)
    total = float(squares.sum() if weights is None else weights @ squares)
    values = _values(kind, primitive, origin) | {
        "deviation": math.sqrt(total / rest) if rest > 0 else math.nan,
        "covariance": covariance * (variance_factor(distances) if trimmed else 1.0),
        "across": across,
        "freedom": freedom,
        "checked": True,
    }
    return measured_surface(values, some, origin, members)


def _zone(
    kind: ShapeKind,
    primitive: _surfsig.Primitive,
    points: Array,
    known: Known,
    origin: Array,
    members: NDArray[np.intp],
) -> Surface:
    """Describe the shape whose largest distance is least, near that of least squares."""
    point, axis, radius = minimum_zone(kind, primitive, points, fixed_axis=known.axis is not None)
    values = _values(kind, primitive, origin) | {"point": point + origin, "axis": axis, "radius": radius}
    values["deviation"] = math.nan
    surface = measured_surface(values, points, origin, members)
    unknowns = known.unknowns(kind)
    deviation = surface.rms * math.sqrt(len(points) / (len(points) - unknowns / components_of(kind)))
    return replace(surface, deviation=deviation)


def _values(kind: ShapeKind, primitive: _surfsig.Primitive, origin: Array) -> dict[str, Any]:
    return {
        "kind": kind,
        "point": primitive.point + origin,
        "axis": np.full(3, np.nan) if kind == "sphere" else primitive.axis,
        "radius": primitive.radius,
        "major_radius": primitive.major_radius,
        "half_angle": primitive.half_angle,
    }


def _check_criterion(
    criterion: str,
    near: ArrayLike | None,
    radius: float | None,
    weights: ArrayLike | None,
    robust: bool,
) -> None:
    """Refuse what has no meaning for a minimum zone, which every point bounds."""
    if criterion not in get_args(Criterion):
        names = " or ".join(f'"{name}"' for name in get_args(Criterion))
        raise InvalidInputError(f"criterion must be {names}, not {criterion!r:.40}")
    if criterion == "minimum_zone" and (
        robust or near is not None or radius is not None or weights is not None
    ):
        raise InvalidInputError("a minimum zone takes neither near, radius, weights nor robust")


def _check_near(points: Array, place: Array, radius: float | None, given: Array) -> None:
    """Refuse a position that is farther from all points than a surface of them could reach."""
    nearest = float(np.linalg.norm(points - place, axis=1).min())
    extent = float(np.linalg.norm(np.ptp(points, axis=0)))
    if nearest > extent:
        raise InvalidInputError(
            f"near is {nearest:.4g} from the nearest point, farther than the cloud's extent of {extent:.4g}: "
            f"no surface reaches {position_text(given)}"
        )
    if radius is not None and nearest > radius:
        raise InvalidInputError(
            f"no point is within the radius {radius:.4g} of near: the nearest is {nearest:.4g} away"
        )
