"""What each point belongs to: a surface, a saddle, an edge or a free form; decided by significance."""

from __future__ import annotations

import enum
from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig.curvature import extract
from surfsig.extraction import Extraction
from surfsig.point_cloud import PointCloud
from surfsig.shapes.surface import Surface
from surfsig.status import Status

NEIGHBORS = 24
"""Nearest points by which a point is judged that belongs to no surface."""

SIGNIFICANT = 2.576
"""Standard errors at which a curvature differs from 0: in 99 of 100 cases that is not by chance."""

FAR_ABOVE = 2.0
"""An edge's points stray so many times as much as noise: less than one of 10,000 does so by chance."""

BEND = 1 / 40
"""A smooth surface, whose curvature k changes by itself over its own radius, leaves a paraboloid the residual
(k r)^2 r / 40 in a ball of radius r; an edge leaves more."""

NEAR = 3.0
"""Standard deviations up to which points are a surface's."""

FLOOR = 1e-4
"""Distances that tell nothing, in those between points."""


class PointClass(enum.IntEnum):
    """What a point belongs to."""

    UNKNOWN = 0
    """Not known: not finite, or too few points around it."""
    PLANE = 1
    """A plane that was found."""
    CYLINDER = 2
    """A cylinder that was found."""
    SPHERE = 3
    """A sphere that was found."""
    CONE = 4
    """A cone that was found."""
    TORUS = 5
    """A torus that was found."""
    SADDLE = 6
    """No such surface; curved to both sides, significantly."""
    EDGE = 7
    """An edge, a corner, or a rim: no smooth surface at this resolution."""
    FREE_FORM = 8
    """None of these: a smooth surface of another form."""


def classify(
    cloud: PointCloud,
    labels: NDArray[np.int32],
    surfaces: Sequence[Surface],
    deviations: NDArray[np.float64],
    *,
    noise: float | None,
    threads: int | None,
) -> tuple[NDArray[np.uint8], NDArray[np.float32]]:
    """Give each point's `PointClass` as a number and its confidence; see `Surfaces.confidence`.

    The deviations are those of `deviations_of`.
    """
    classes = np.zeros(len(cloud), np.uint8)
    confidence = np.zeros(len(cloud), np.float32)
    rest = np.flatnonzero((labels < 0) & cloud.finite)
    around = extract(cloud, neighbors=NEIGHBORS, at=rest, threads=threads)
    for members, surface in zip(members_of(labels, len(surfaces)), surfaces, strict=True):
        classes[members] = PointClass[surface.kind.upper()]
        confidence[members] = belonging(surface, deviations[members])
    classes[rest], confidence[rest] = _without_surface(around, _typical_noise(around, surfaces, noise))
    return classes, confidence


def deviations_of(
    cloud: PointCloud, labels: NDArray[np.int32], surfaces: Sequence[Surface]
) -> NDArray[np.float64]:
    """Give each point's signed distance from its own surface, (n,); NaN where it has none."""
    deviations = np.full(len(cloud), np.nan)
    for members, surface in zip(members_of(labels, len(surfaces)), surfaces, strict=True):
        deviations[members] = surface.distances(cloud.offsets[members] + cloud.origin)
    return deviations


def members_of(labels: NDArray[np.int32], count: int) -> list[NDArray[np.intp]]:
    """Give the numbers of each surface's points, in their order."""
    order = np.argsort(labels, kind="stable")
    return np.split(order, np.searchsorted(labels[order], np.arange(count + 1)))[1:-1]


def belonging(surface: Surface, distances: NDArray[np.float64]) -> NDArray[np.float64]:
    """Give how sure it is that points are a surface's, by their distances; see `Surfaces.confidence`.

    That is the probability of normal noise against that of anything else, equally likely at `NEAR`.
    """
    from scipy.special import expit

    deviation = max(surface.deviation, FLOOR * np.sqrt(surface.area / surface.count))
    sure: NDArray[np.float64] = expit(0.5 * (NEAR**2 - (distances / deviation) ** 2)) * _evidence(surface)
    return sure


def _evidence(surface: Surface) -> float:
    """Give the probability that the surface is not of a simpler kind: that its radius is no chance."""
    from scipy.special import erf

    sizes = [(surface.fitted_radius, surface.radius_std), (surface.half_angle, surface.half_angle_std)]
    sizes.append((surface.major_radius, surface.major_radius_std))
    return float(
        np.prod([erf(abs(size) / (np.sqrt(2) * error)) for size, error in sizes if size and error > 0])
    )


def _typical_noise(around: Extraction, surfaces: Sequence[Surface], noise: float | None) -> float:
    """Give a point's noise: as known, of the surfaces' points, or what a quarter of all others stay below."""
    if noise is not None:
        return noise
    if surfaces:
        counts = np.array([surface.count for surface in surfaces])
        return float(np.sqrt(np.average([surface.deviation**2 for surface in surfaces], weights=counts)))
    known = around.noise[np.isfinite(around.noise)]
    return float(np.quantile(known, 0.25)) if len(known) else np.nan


def _without_surface(around: Extraction, typical: float) -> tuple[NDArray[np.uint8], NDArray[np.float64]]:
    """Tell saddles, edges and free forms by curvature, its standard errors, and the residual."""
    from scipy.special import erf

    k1, k2 = around.k1.astype(np.float64), around.k2.astype(np.float64)
    radius = np.broadcast_to(around.radius, k1.shape)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_one, to_other = k1 / around.k1_std, -k2 / around.k2_std
        unexplained = 1 - (typical / around.noise.astype(np.float64)) ** 2
        bend = np.fmax(abs(k1), abs(k2)) * radius
        strays = around.noise > np.maximum(FAR_ABOVE * typical, FLOOR * radius)
        saddle = (to_one > SIGNIFICANT) & (to_other > SIGNIFICANT)
        edge = strays & ((bend > 1) | (around.residual > BEND * bend**2 * radius))
    edge |= around.status == Status.NOT_CONVERGED
    both = np.where((to_one > 0) & (to_other > 0), erf(to_one / np.sqrt(2)) * erf(to_other / np.sqrt(2)), 0)
    unexplained = np.clip(np.nan_to_num(unexplained), 0, 1)
    known = np.isfinite(k1)
    choices = [~known, edge, saddle]
    classes = np.select(
        choices, [PointClass.UNKNOWN, PointClass.EDGE, PointClass.SADDLE], PointClass.FREE_FORM
    )
    confidence = np.select(choices, [0.0 * k1, unexplained, both], 1 - both)
    return classes.astype(np.uint8), np.nan_to_num(confidence)
