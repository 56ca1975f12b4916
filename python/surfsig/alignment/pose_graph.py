"""Poses from measured poses between pairs: sparse robust least squares on a graph, with covariances.

Scans in one frame and the scans of a trajectory with its loops are the same problem. Derivatives are those of
Solà, Deray, Atchuthan: A micro Lie theory for state estimation in robotics (2018), in its sections II and IV.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import scipy
from numpy.typing import NDArray

from surfsig import geometry
from surfsig.alignment.spanning_tree import spanning_poses

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_UNDETERMINED = 1e-9
"""Of the largest eigenvalue of the normal matrix of all poses, below which no edge says anything."""
_NO_PART = 0.0025
"""Part of such a motion that a component of a scan's twist has, squared, below which it has none."""
_ROBUST = 3.0
"""Standard deviations beyond which a residual counts less than its square (`soft_l1` of SciPy)."""
_ITERATIONS = 200
"""Steps, at most: right edges need three to five, and one that is far off some tens."""
_CONVERGED = 1e-10
"""Of the reach, the largest component of a step, rotations as lengths, below which it is the last."""
_FIRST_DAMPING = 1e-6
"""Of the normal matrix's diagonal, what is added to it in the first step (Levenberg and Marquardt)."""
_MOST_DAMPING = 1e6
"""The same, beyond which no step makes the sum of squares less: it is the least but for rounding."""
_LEAST_DIAGONAL = 1e-12
"""Of the largest element of the normal matrix, what is always added: motions that no edge determines stay."""


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


class PoseGraph:
    """Measured poses between numbered poses, of which one stays.

    Parameters
    ----------
    source, target
        (m,), numbers of poses.
    T_target_source
        (m, 4, 4).
    information
        (m, 6, 6), as of `Edge`.
    center
        (m, 3), as of `Edge`.
    first
        The pose that stays.
    robust
        Standard deviations beyond which a residual counts less than its square; None where all count.
    reach
        The length by which rotations move what is measured; by default the median distance of centres.
    """

    def __init__(
        self,
        source: Integers,
        target: Integers,
        T_target_source: Array,
        information: Array,
        center: Array,
        *,
        first: int,
        robust: float | None,
        reach: float | None = None,
    ) -> None:
        self.source, self.target = source, target
        self._first, self._robust = first, robust
        self._root = _square_root(information)
        about = np.tile(np.eye(4), (len(center), 1, 1))
        about[:, :3, 3] = center
        self._from_center = about
        self._to_center = geometry.inverse(about)
        self._measured = T_target_source
        self._inverse_measured = geometry.inverse(T_target_source)
        self._reach = max(1e-12, float(np.median(np.linalg.norm(center, axis=1)))) if reach is None else reach

    def residuals(self, poses: Array) -> Array:
        """Give the residuals in standard deviations, (m, 6)."""
        return np.asarray(np.einsum("mij,mj->mi", self._root, self._twists(poses)))

    def _twists(self, poses: Array) -> Array:
        """Give the twists about the centres from the measured poses to those that poses imply, (m, 6)."""
        implied = geometry.inverse(poses[self.target]) @ poses[self.source]
        off = self._to_center @ implied @ self._inverse_measured @ self._from_center
        return geometry.log_pose(off)

    def fit(self, poses: Array) -> Array:
        """Give the poses that agree best, from some that are near, (n, 4, 4)."""
        damping, cost = _FIRST_DAMPING, self._cost(poses)
        for _ in range(_ITERATIONS):
            jacobian, right = self._weighted(poses, is_curved=False)
            normal = (jacobian.T @ jacobian).tocsc()
            gradient = jacobian.T @ right
            while damping < _MOST_DAMPING:
                step = self._solved(normal, damping, gradient)
                moved = self._moved(poses, step)
                cost_there = self._cost(moved)
                if cost_there <= cost:
                    break
                damping *= 10.0
            else:
                return poses
            poses, cost, damping = moved, cost_there, 0.1 * damping
            if np.abs(step).max() < _CONVERGED * self._reach:
                return poses
        return poses

    def _cost(self, poses: Array) -> float:
        square = self.residuals(poses) ** 2
        if self._robust is None:
            return float(square.sum())
        # soft_l1: 2 ((1 + z)^1/2 - 1) with z = (r / s)^2.
        limit = self._robust**2
        return float(2.0 * limit * (np.sqrt(1.0 + square / limit) - 1.0).sum())

    def _solved(self, normal: scipy.sparse.csc_matrix, damping: float, gradient: Array) -> Array:
        diagonal = normal.diagonal()
        added = damping * diagonal + _LEAST_DIAGONAL * max(float(diagonal.max()), np.finfo(float).tiny)
        damped = (normal + scipy.sparse.diags(added)).tocsc()
        return np.asarray(-scipy.sparse.linalg.splu(damped).solve(gradient))

    def _moved(self, poses: Array, step: Array) -> Array:
        """Give poses after a step: twists of all but the first in their own axes, rotations as lengths."""
        twists = np.zeros((len(poses), 6))
        twists[self._free(len(poses))] = step.reshape(-1, 6) * self.unit
        return np.asarray(poses @ geometry.exp_twist(twists))

    def _free(self, count: int) -> Integers:
        return np.flatnonzero(np.arange(count) != self._first)

    @property
    def unit(self) -> Array:
        """What takes unknowns, in which rotations are lengths, to twists, (6,)."""
        return np.array([1.0 / self._reach] * 3 + [1.0] * 3)

    def _weighted(self, poses: Array, *, is_curved: bool) -> tuple[scipy.sparse.csc_matrix, Array]:
        """Give the weighted derivatives of the residuals by the unknowns, and the residuals.

        With a robust loss rho(z), weights are the root of rho', by which the gradient is exact, or that of
        rho' + 2 z rho'', with which their product is the Hessian's approximation (Triggs and others, Bundle
        adjustment: a modern synthesis, 2000).
        """
        twists = self._twists(poses)
        residual = np.einsum("mij,mj->mi", self._root, twists)
        # off = exp(-Ad(C^-1) dt) off exp(Ad(C^-1 M) ds), for twists dt and ds of target and source.
        by_source = _inverse_right_jacobian(twists) @ geometry.adjoint(self._to_center @ self._measured)
        by_target = -_inverse_right_jacobian(-twists) @ geometry.adjoint(self._to_center)
        weight = np.ones_like(residual)
        if self._robust is not None:
            z = (residual / self._robust) ** 2
            weight = (1.0 + z) ** (-0.75 if is_curved else -0.25)
        by_source = weight[:, :, None] * (self._root @ by_source) * self.unit
        by_target = weight[:, :, None] * (self._root @ by_target) * self.unit
        edges, count = len(self.source), len(poses)
        row = np.broadcast_to(np.arange(6 * edges).reshape(edges, 6, 1), (edges, 6, 6))
        inner = np.arange(6)
        columns = [
            np.broadcast_to(6 * end[:, None, None] + inner, (edges, 6, 6))
            for end in (self.source, self.target)
        ]
        jacobian = scipy.sparse.coo_matrix(
            (
                np.concatenate([by_source.ravel(), by_target.ravel()]),
                (np.tile(row.ravel(), 2), np.concatenate([column.ravel() for column in columns])),
            ),
            shape=(6 * edges, 6 * count),
        ).tocsc()
        kept = (6 * self._free(count)[:, None] + inner).ravel()
        return jacobian[:, kept], (weight * residual).ravel()

    def normal_matrix(self, poses: Array) -> scipy.sparse.csc_matrix:
        """Give the matrix of the normal equations of all but the first pose, rotations as lengths."""
        jacobian, _ = self._weighted(poses, is_curved=True)
        return (jacobian.T @ jacobian).tocsc()

    def covariances(self, poses: Array, numbers: Integers) -> Array:
        """Give the covariances of the twists of some poses, all motions of which are determined.

        Parameters
        ----------
        poses
            (n, 4, 4), fitted.
        numbers
            (k,), of the poses that are asked for.

        Returns
        -------
        (k, 6, 6), in each pose's own axes; 0 for the first pose.
        """
        factors = scipy.sparse.linalg.splu(self.normal_matrix(poses))
        result = np.zeros((len(numbers), 6, 6))
        for position, number in enumerate(numbers.tolist()):
            if number != self._first:
                start = 6 * (number - (number > self._first))
                right = np.zeros((6 * (len(poses) - 1), 6))
                right[start : start + 6] = np.diag(self.unit)
                result[position] = self.unit[:, None] * factors.solve(right)[start : start + 6]
        return result


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
    nodes = np.flatnonzero(is_joined)
    used = np.array([bool(is_joined[edge.source]) for edge in edges], np.bool_)
    covariance = np.full((count, 6, 6), np.nan)
    covariance[first] = 0.0
    residuals = np.full(len(edges), np.nan)
    if len(nodes) < 2:
        return Solution(poses, covariance, residuals)
    number = np.full(count, -1, np.int64)
    number[nodes] = np.arange(len(nodes))
    joined = [edge for edge, is_used in zip(edges, used, strict=True) if is_used]
    graph = PoseGraph(
        number[[edge.source for edge in joined]],
        number[[edge.target for edge in joined]],
        np.array([edge.T_target_source for edge in joined]),
        np.array([edge.information for edge in joined]),
        np.array([edge.center for edge in joined]),
        first=int(number[first]),
        robust=_ROBUST,
    )
    poses[nodes] = graph.fit(poses[nodes])
    residuals[used] = np.sqrt((graph.residuals(poses[nodes]) ** 2).mean(axis=1))
    # Loops that close worse than the edges say: their errors were too small, by so much.
    redundant = 6 * (len(joined) - len(nodes) + 1)
    factor = 6.0 * float(np.nansum(residuals**2)) / redundant if redundant else 1.0
    values, vectors = np.linalg.eigh(graph.normal_matrix(poses[nodes]).toarray())
    is_open = values <= _UNDETERMINED * values.max()
    kept = vectors[:, ~is_open]
    inverse = (kept / values[~is_open]) @ kept.T
    unknown = vectors[:, is_open] @ vectors[:, is_open].T
    for position, scan in enumerate(nodes[nodes != first].tolist()):
        own = np.s_[6 * position : 6 * position + 6, 6 * position : 6 * position + 6]
        block = max(1.0, factor) * inverse[own] * np.outer(graph.unit, graph.unit)
        covariance[scan] = np.where(np.abs(unknown[own]) < _NO_PART, block, np.copysign(np.inf, unknown[own]))
    return Solution(poses, covariance, residuals)


def _square_root(information: Array) -> Array:
    """Give W with W^T W the information, (m, 6, 6)."""
    diagonal = np.einsum("mii->mi", information)
    scale = np.sqrt(np.maximum(diagonal, np.finfo(float).tiny))
    values, vectors = np.linalg.eigh(information / (scale[:, :, None] * scale[:, None, :]))
    # Along motions that are not determined rounding may be below 0.
    root = np.sqrt(np.maximum(values, 0.0))
    return np.asarray(np.swapaxes(vectors * root[:, None, :], 1, 2) * scale[:, None, :])


def _inverse_right_jacobian(twists: Array) -> Array:
    """Give J with log(exp(a) exp(d)) = a + J d for small d, (m, 6, 6); that of -a is the left one.

    The series of B_k (-ad)^k / k! with Bernoulli's numbers converges below a rotation of 2 pi.
    """
    small = np.zeros((len(twists), 6, 6))
    rotation, translation = geometry.skew(twists[:, :3]), geometry.skew(twists[:, 3:])
    small[:, :3, :3] = small[:, 3:, 3:] = rotation
    small[:, 3:, :3] = translation
    square = small @ small
    result = np.eye(6) + 0.5 * small
    power = square
    for coefficient in (1 / 12, -1 / 720, 1 / 30_240, -1 / 1_209_600, 1 / 47_900_160):
        result = result + coefficient * power
        power = power @ square
    return np.asarray(result)
