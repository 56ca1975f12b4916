"""Loops that close: what a way around has drifted by is distributed over its scans.

A pose graph of all scans in a chain, of thousands of poses: so the normal equations are sparse, and
derivatives are written down, other than in the registration of some scans in one frame.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.sparse import coo_matrix
from scipy.sparse.linalg import spsolve
from scipy.spatial.transform import Rotation

from surfsig import geometry

Array = NDArray[np.float64]
Integers = NDArray[np.int64]

_ITERATIONS = 10
"""Steps of Gauss and Newton, at most: drift is small, and two or three do."""
_CONVERGED = 1e-9
"""Of the trajectory's extent, below which the largest step has converged."""
_STANDING = 0.01
"""Part of the range by which the error of a scan grows that has not moved."""


@dataclass(frozen=True, eq=False)
class LoopClosure:
    """A scan that lies on what an earlier one saw, after a way around."""

    scan: int
    """Its number."""
    earlier: int
    """That of the earlier one."""
    T_earlier_scan: Array
    """(4, 4)."""
    T_world_scan_before: Array
    """(4, 4), the scan's pose by the way around; its difference to that by the earlier scan is the drift."""


def closed(poses: Array, segments: Integers, loops: Sequence[LoopClosure], reach: float) -> Array:
    """Fit poses to the motions from scan to scan and to the loops.

    Parameters
    ----------
    poses
        (n, 4, 4), each in the world of its segment; NaN where there is none.
    segments
        (n,), -1 where there is no pose.
    loops
        Of any segment.
    reach
        The length by which a rotation moves what is seen.

    Returns
    -------
    numpy.ndarray
        (n, 4, 4). The first pose of each segment stays, and so do segments without a loop.
    """
    poses = poses.copy()
    for segment in sorted({int(segments[loop.scan]) for loop in loops} - {-1}):
        nodes = np.flatnonzero(segments == segment)
        number = {int(scan): k for k, scan in enumerate(nodes)}
        own = [loop for loop in loops if loop.scan in number and loop.earlier in number]
        if own and len(nodes) > 1:
            poses[nodes] = _closed_chain(poses[nodes], own, number, reach)
    return poses


def _closed_chain(poses: Array, loops: list[LoopClosure], number: dict[int, int], reach: float) -> Array:
    """Close the loops of one segment, whose scans have numbers 0, 1, ... in it."""
    count = len(poses)
    arrived = poses.copy()
    for loop in loops:
        arrived[number[loop.scan]] = loop.T_world_scan_before
    steps = geometry.inverse(poses[:-1]) @ arrived[1:]
    source = np.concatenate([np.arange(count - 1), [number[loop.earlier] for loop in loops]])
    target = np.concatenate([np.arange(1, count), [number[loop.scan] for loop in loops]])
    measured = np.concatenate([steps, [loop.T_earlier_scan for loop in loops]])
    # A random walk: the variance of a step is as its length, and a loop counts as one step of the usual
    # length does.
    moved = _log(steps)
    length = np.linalg.norm(moved[:, 3:], axis=1) + reach * np.linalg.norm(moved[:, :3], axis=1)
    variance = length + _STANDING * reach
    weight = 1.0 / np.concatenate([variance, np.full(len(loops), np.median(variance))])
    # Rotations count by how far they move what is seen.
    scale = np.array([reach, reach, reach, 1.0, 1.0, 1.0])
    extent = reach + float(np.ptp(poses[:, :3, 3], axis=0).max())
    inverse = geometry.inverse(measured)
    for _ in range(_ITERATIONS):
        between = geometry.inverse(poses[source]) @ poses[target]
        residual = _log(inverse @ between)
        # Of the twists d of T exp(d): d residual / d target = 1, and d residual / d source =
        # -Ad(T_target^-1 T_source), but for terms of the residual's own size.
        backward = -_adjoint(geometry.inverse(between)) * scale[:, None] / scale
        step = _solve(source, target, backward, residual * scale, weight, count) / scale
        poses = poses @ np.array([geometry.exp_twist(twist) for twist in step])
        if np.abs(step * scale).max() < _CONVERGED * extent:
            break
    return poses


def _solve(
    source: Integers, target: Integers, backward: Array, residual: Array, weight: Array, count: int
) -> Array:
    """Solve the normal equations of all poses but the first, which stays; (count, 6)."""
    edges = len(source)
    row = np.repeat(np.arange(6 * edges), 6).reshape(edges, 6, 6)
    across = np.tile(np.arange(6), (edges, 6, 1))
    forward = np.tile(np.eye(6), (edges, 1, 1))
    jacobian = coo_matrix(
        (
            np.concatenate([forward.ravel(), backward.ravel()]),
            (
                np.concatenate([row.ravel(), row.ravel()]),
                np.concatenate(
                    [
                        (6 * target[:, None, None] + across).ravel(),
                        (6 * source[:, None, None] + across).ravel(),
                    ]
                ),
            ),
        ),
        shape=(6 * edges, 6 * count),
    ).tocsc()[:, 6:]
    weights = np.repeat(weight, 6)
    normal = jacobian.T @ jacobian.multiply(weights[:, None]).tocsc()
    step = np.zeros((count, 6))
    step[1:] = spsolve(normal.tocsc(), -(jacobian.T @ (weights * residual.ravel()))).reshape(-1, 6)
    return step


def _log(poses: Array) -> Array:
    """Give the twists of poses, (n, 6), to the second order of their rotation."""
    vector = Rotation.from_matrix(poses[:, :3, :3]).as_rotvec()
    translation = poses[:, :3, 3]
    return np.concatenate([vector, translation - 0.5 * np.cross(vector, translation)], axis=1)


def _adjoint(poses: Array) -> Array:
    """Give the matrices (n, 6, 6) that take twists, rotation first, to other axes."""
    rotation, translation = poses[:, :3, :3], poses[:, :3, 3]
    result = np.zeros((len(poses), 6, 6))
    result[:, :3, :3] = result[:, 3:, 3:] = rotation
    # [t]x R: each column of R is crossed.
    result[:, 3:, :3] = np.cross(translation[:, :, None], rotation, axisa=1, axisb=1, axisc=1)
    return result
