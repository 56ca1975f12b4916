"""Where rays meet boxes, levels, discs and round shapes about the origin."""

from __future__ import annotations

import numpy as np

from .poses import Array


def slab_entry_exit(origins: Array, directions: Array, half: Array) -> tuple[Array, Array]:
    """Parameters (n,), (n,) where rays enter and leave a box |p| <= half; infinite if they miss it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        one = (-half - origins) / directions
        other = (half - origins) / directions
    # 0 / 0: the ray runs inside a face, which limits nothing.
    lower = np.where(np.isnan(one) | np.isnan(other), -np.inf, np.minimum(one, other))
    upper = np.where(np.isnan(one) | np.isnan(other), np.inf, np.maximum(one, other))
    enter, leave = lower.max(axis=1), upper.min(axis=1)
    missed = enter > leave
    return np.where(missed, np.inf, enter), np.where(missed, np.inf, leave)


def coordinate_at(origins: Array, directions: Array, t: Array, axis: int) -> Array:
    """One coordinate of the points at t; NaN where t is infinite, so that comparisons fail."""
    with np.errstate(invalid="ignore"):
        return np.asarray(origins[:, axis] + np.where(np.isfinite(t), t, np.nan) * directions[:, axis])


def level_crossing(origins: Array, directions: Array, level: float) -> Array:
    """Parameter (n,) at which rays reach z = level; infinite for rays that run along it."""
    with np.errstate(divide="ignore", invalid="ignore"):
        t = (level - origins[:, 2]) / directions[:, 2]
    return np.where(np.isfinite(t), t, np.inf)


def disc_crossing(origins: Array, directions: Array, level: float, radius: float) -> Array:
    """Like a level crossing, but only within a distance of the z axis."""
    t = level_crossing(origins, directions, level)
    distance = np.hypot(coordinate_at(origins, directions, t, 0), coordinate_at(origins, directions, t, 1))
    return np.where(distance <= radius, t, np.inf)


def round_crossings(origins: Array, directions: Array, radius: float) -> Array:
    """Crossings (2, n) with |p| = radius, in as many dimensions as the arrays have columns.

    Taken from the point of closest approach: the textbook discriminant loses half its digits on a ray that
    starts many radii away.
    """
    square = np.einsum("ij,ij->i", directions, directions)
    with np.errstate(divide="ignore", invalid="ignore"):
        closest = -np.einsum("ij,ij->i", origins, directions) / square
        foot = origins + closest[:, None] * directions
        half = np.sqrt((radius**2 - np.einsum("ij,ij->i", foot, foot)) / square)
    t = np.stack([closest - half, closest + half])
    return np.where(np.isfinite(t), t, np.inf)
