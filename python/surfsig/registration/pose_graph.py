"""Poses of many scans from poses of pairs: least squares on a graph, robust against a pair that is wrong."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares
from scipy.sparse import lil_matrix

from surfsig import geometry

Array = NDArray[np.float64]

_UNDETERMINED = 1e-9
"""Of the largest eigenvalue of the normal matrix of all poses, below which no edge says anything."""
_NO_PART = 0.0025
"""Part of such a motion that a component of a scan's twist has, squared, below which it has none."""
_ROBUST = 3.0
"""Standard deviations beyond which a residual counts less than its square (`soft_l1`)."""


@dataclass(frozen=True, eq=False)
class Edge:
    """A measured pose between two scans."""

    source: int
    target: int
    T_target_source: Array
    """(4, 4)."""
    information: Array
    """(6, 6), the inverse of the covariance of the twist about `center` in the target's axes, rotation
    first; 0 along motions that are not determined."""
    center: Array
    """(3,), in the target's coordinates."""
    weight: float
    """How much speaks for it; the tree that poses begin with takes the heaviest edges."""

    def square_root_information(self) -> Array:
        """Give W with W^T W the information, (6, 6)."""
        scale = np.sqrt(np.maximum(np.diag(self.information), np.finfo(float).tiny))
        values, vectors = np.linalg.eigh(self.information / np.outer(scale, scale))
        # Along motions that are not determined rounding may be below 0.
        return np.asarray((vectors * np.sqrt(np.maximum(values, 0.0))).T * scale)

    def twist(self, T_world_source: Array, T_world_target: Array) -> Array:
        """Give the twist, (6,), about `center`, from the measured pose to the one that two poses imply."""
        implied = geometry.inverse(T_world_target) @ T_world_source
        to_center = geometry.from_translation(self.center)
        off = geometry.inverse(to_center) @ implied @ geometry.inverse(self.T_target_source) @ to_center
        return geometry.log_pose(off)


@dataclass(frozen=True, eq=False)
class Solution:
    """Poses that agree best with all edges."""

    T_world_scan: Array
    """(n, 4, 4); NaN for scans that no edge joins to the first one."""
    covariance: Array
    """(n, 6, 6), of the twist of each scan about its own origin, in its own axes; 0 for the first one.
    Infinite in the entries of motions that no edge determines."""
    residuals: Array
    """(edges,), of each edge the root of its squared residual over its covariance, a sixth of it; NaN for an
    edge that is not joined to the first scan."""


def solve(count: int, first: int, edges: Sequence[Edge]) -> Solution:
    """Fit poses to edges, the first scan at the identity.

    Parameters
    ----------
    count
        Of scans.
    first
        The scan whose coordinates are the world's.
    edges
        Between numbers of scans.

    Returns
    -------
    Solution
    """
    poses = spanning_poses(count, first, edges)
    is_joined = np.asarray(np.isfinite(poses).all(axis=(1, 2)))
    used = [edge for edge in edges if is_joined[edge.source]]
    free = [scan for scan in np.flatnonzero(is_joined).tolist() if scan != first]
    covariance = np.full((count, 6, 6), np.nan)
    covariance[first] = 0.0
    residuals = np.full(len(edges), np.nan)
    if not free:
        return Solution(poses, covariance, residuals)
    # The unknowns are twists of each scan in its own axes, in units in which rotations move points as far as
    # translations do.
    reach = max(1e-12, float(np.median([np.linalg.norm(edge.center) for edge in used])))
    unit = np.array([1.0 / reach] * 3 + [1.0] * 3)
    column = {scan: 6 * number for number, scan in enumerate(free)}
    weights = [edge.square_root_information() for edge in used]

    def moved(unknowns: Array) -> Array:
        result = poses.copy()
        for scan, start in column.items():
            result[scan] = poses[scan] @ geometry.exp_twist(unit * unknowns[start : start + 6])
        return result

    def distances(unknowns: Array) -> Array:
        now = moved(unknowns)
        return np.concatenate(
            [
                weight @ edge.twist(now[edge.source], now[edge.target])
                for edge, weight in zip(used, weights, strict=True)
            ]
        )

    pattern = lil_matrix((6 * len(used), 6 * len(free)), dtype=np.int8)
    for row, edge in enumerate(used):
        for scan in (edge.source, edge.target):
            if scan != first:
                pattern[6 * row : 6 * row + 6, column[scan] : column[scan] + 6] = 1
    found = least_squares(
        distances,
        np.zeros(6 * len(free)),
        jac="3-point",
        jac_sparsity=pattern.tocsr(),
        x_scale="jac",
        loss="soft_l1",
        f_scale=_ROBUST,
    )
    poses = moved(found.x)
    for number, edge in enumerate(edges):
        if is_joined[edge.source]:
            off = edge.square_root_information() @ edge.twist(poses[edge.source], poses[edge.target])
            residuals[number] = np.sqrt(np.mean(off**2))
    # Loops that close worse than the edges say: their errors were too small, by so much.
    redundant = 6 * (len(used) - len(free))
    factor = 6.0 * float(np.nansum(residuals**2)) / redundant if redundant else 1.0
    jacobian = found.jac.toarray() if hasattr(found.jac, "toarray") else found.jac
    values, vectors = np.linalg.eigh(jacobian.T @ jacobian)
    is_open = values <= _UNDETERMINED * values.max()
    kept = vectors[:, ~is_open]
    inverse = (kept / values[~is_open]) @ kept.T
    unknown = vectors[:, is_open] @ vectors[:, is_open].T
    for scan, start in column.items():
        own = np.s_[start : start + 6, start : start + 6]
        block = max(1.0, factor) * inverse[own] * np.outer(unit, unit)
        covariance[scan] = np.where(np.abs(unknown[own]) < _NO_PART, block, np.copysign(np.inf, unknown[own]))
    return Solution(poses, covariance, residuals)


def spanning_poses(count: int, first: int, edges: Sequence[Edge]) -> Array:
    """Chain poses along the tree of the heaviest edges; (n, 4, 4), NaN where no edge leads."""
    poses = np.full((count, 4, 4), np.nan)
    poses[first] = np.eye(4)
    for number, is_forward in _spanning_tree(first, edges):
        edge = edges[number]
        if is_forward:
            poses[edge.source] = poses[edge.target] @ edge.T_target_source
        else:
            poses[edge.target] = poses[edge.source] @ geometry.inverse(edge.T_target_source)
    return poses


def edges_between(first: int, last: int, edges: Sequence[Edge]) -> list[int]:
    """Give the numbers of the edges that lead from a scan to another along the tree of the heaviest edges."""
    leading: dict[int, list[int]] = {first: []}
    for number, is_forward in _spanning_tree(first, edges):
        source, target = edges[number].source, edges[number].target
        begin, end = (target, source) if is_forward else (source, target)
        leading[end] = [*leading[begin], number]
    return leading.get(last, [])


def _spanning_tree(first: int, edges: Sequence[Edge]) -> Iterator[tuple[int, bool]]:
    """Give the numbers of the edges of the heaviest tree, each after those that lead to it (Prim).

    With each whether it is gone along from its target to its source.
    """
    reached = {first}
    while True:
        leading = [
            number
            for number, edge in enumerate(edges)
            if (edge.source in reached) != (edge.target in reached)
        ]
        if not leading:
            return
        number = max(leading, key=lambda number: edges[number].weight)
        yield number, edges[number].target in reached
        reached |= {edges[number].source, edges[number].target}
