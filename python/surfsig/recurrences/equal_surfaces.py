"""Surfaces that are equal: of one kind, and of one size within their errors."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import scipy
from numpy.typing import NDArray

from surfsig.alignment.free_directions import FreeDirection
from surfsig.geometry import axes_across, from_rotation_vector, transform_points

if TYPE_CHECKING:
    from surfsig.surfaces import Surface, Surfaces

Array = NDArray[np.float64]

_SIZES = {
    "sphere": ("radius",),
    "cylinder": ("radius",),
    "cone": ("half_angle",),
    "torus": ("major_radius", "radius"),
}
"""What makes the size of each kind. A plane has none, and a cone's radius depends on where it is measured."""


@dataclass(frozen=True, eq=False, repr=False)
class EqualSurfaces:
    """Surfaces of one kind whose sizes differ by no more than their errors explain."""

    kind: str
    """"sphere", "cylinder", "cone" or "torus"; a plane has no size."""
    size: dict[str, float]
    """Their mean, weighted by their errors: radius, major_radius, half_angle; what the kind has."""
    size_std: dict[str, float]
    """Its standard errors."""
    members: list[tuple[int, int]]
    """(scan, number of the surface in it), the first ones first."""
    poses: Array
    """T_member_first, (m, 4, 4): the least motion that brings the first one onto each."""
    free_directions: list[FreeDirection]
    """Motions that do not change the first one; poses are not determined in these directions."""

    def __len__(self) -> int:
        """Return the number of members."""
        return len(self.members)

    def __repr__(self) -> str:
        size = ", ".join(
            f"{name}={value:.6g} +- {self.size_std[name]:.2g}" for name, value in self.size.items()
        )
        return f"EqualSurfaces({len(self)} x {self.kind}, {size})"


def equal_surfaces(found: Sequence[Surfaces], confidence: float) -> list[EqualSurfaces]:
    """Group surfaces of equal size, within a scan and between scans.

    The two groups that differ least are joined while the difference of their means, and that of each member
    from the new mean, is insignificant at their standard errors: a chain does not join its ends.

    Parameters
    ----------
    found
        The surfaces of one scan or several.
    confidence
        Of the chi-square tests.

    Returns
    -------
    Groups of at least two, by their first members.
    """
    groups: list[EqualSurfaces] = []
    for kind, names in _SIZES.items():
        keys = [
            (scan, number)
            for scan, surfaces in enumerate(found)
            for number, surface in enumerate(surfaces.surfaces)
            if surface.kind == kind and _known(surface, names)
        ]
        members = [found[scan].surfaces[number] for scan, number in keys]
        sizes = np.array([[getattr(surface, name) for name in names] for surface in members])
        errors = np.array([[getattr(surface, f"{name}_std") for name in names] for surface in members])
        limit = float(scipy.stats.chi2.ppf(confidence, len(names)))
        for rows in _joined(sizes, errors, limit):
            if len(rows) > 1:
                pooled = _pooled(sizes[rows], errors[rows])
                mean, error = (dict(zip(names, values.tolist(), strict=True)) for values in pooled)
                first = members[rows[0]]
                poses = np.stack([_motion(first, members[row]) for row in rows])
                numbers = [keys[row] for row in rows]
                groups.append(EqualSurfaces(kind, mean, error, numbers, poses, first.free_directions))
    return sorted(groups, key=lambda group: group.members[0])


def _known(surface: Surface, names: Sequence[str]) -> bool:
    """Tell whether a surface's size has errors that it can be compared by."""
    return all(0.0 < getattr(surface, f"{name}_std") < np.inf for name in names)


def _joined(sizes: Array, errors: Array, limit: float) -> list[list[int]]:
    groups = [[row] for row in range(len(sizes))]
    while len(groups) > 1:
        pooled = [_pooled(sizes[rows], errors[rows]) for rows in groups]
        means, stds = (np.stack(column) for column in zip(*pooled, strict=True))
        gap = ((means[:, None] - means) ** 2 / (stds[:, None] ** 2 + stds**2)).sum(axis=2)
        gap[np.tril_indices(len(groups))] = np.inf
        for pair in np.argsort(gap, axis=None, kind="stable"):
            a, b = np.unravel_index(int(pair), gap.shape)
            if gap[a, b] > limit:
                return groups
            rows = sorted(groups[a] + groups[b])
            mean, _ = _pooled(sizes[rows], errors[rows])
            if (((sizes[rows] - mean) / errors[rows]) ** 2).sum(axis=1).max() <= limit:
                groups = [group for number, group in enumerate(groups) if number not in (a, b)] + [rows]
                break
        else:
            return groups
    return groups


def _pooled(sizes: Array, errors: Array) -> tuple[Array, Array]:
    """Give the weighted mean of sizes (m, k), and its standard error, (k,) each."""
    weights = 1.0 / errors**2
    total = weights.sum(axis=0)
    return np.asarray((weights * sizes).sum(axis=0) / total), np.asarray(1.0 / np.sqrt(total))


def _motion(first: Surface, other: Surface) -> Array:
    """Give T_other_first: centre to centre, axis to axis by the smallest rotation."""
    pose = np.eye(4)
    if first.kind != "sphere":
        # A cone's axis has a direction; the others' do not.
        sign = 1.0 if first.kind == "cone" or float(first.axis @ other.axis) >= 0.0 else -1.0
        target = sign * other.axis
        angle = float(np.arccos(np.clip(first.axis @ target, -1.0, 1.0)))
        rotation_axis = np.cross(first.axis, target)
        size = float(np.linalg.norm(rotation_axis))
        rotation_axis = rotation_axis / size if size > 0.0 else axes_across(first.axis)[0]
        pose = from_rotation_vector(angle * rotation_axis, np.zeros(3))
    pose[:3, 3] = _place(other) - transform_points(pose, _place(first))
    return pose


def _place(surface: Surface) -> Array:
    """Give the centre; of a cone its apex, which does not depend on what was seen of it."""
    if surface.kind != "cone":
        return np.asarray(surface.center, np.float64)
    return np.asarray(surface.point - surface.radius / np.tan(surface.half_angle) * surface.axis, np.float64)
