"""Edges of a pose graph from odometry, and from its poses of submaps those of all scans."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from surfsig import geometry
from surfsig.mapping.submaps import Array, Submap, path_lengths
from surfsig.odometry import Odometry
from surfsig.registration.pose_graph import Edge, Solution

_SMALLEST = 1e-4
"""Of the largest eigenvalue of a covariance, with rotations in units of 1 / distance travelled: none is taken
to be smaller, for where two nearly equal covariances are subtracted, rounding is left."""
_OPEN = 0.1
"""Standard deviation along directions that the map left open, where the last motion went on, over the
distance travelled."""


def odometry_edge(odometry: Odometry, target: int, source: int, travelled: float) -> Edge:
    """Give the pose of one scan in an earlier one's frame as an edge of a pose graph."""
    relative = geometry.inverse(odometry.poses[target]) @ odometry.poses[source]
    covariance = relative_covariance(odometry, target, source, travelled)
    # T exp(m) = T(c) exp(R m) T(-c) T, where c is the translation of T, and R rotates both parts of m.
    rotation = np.kron(np.eye(2), relative[:3, :3])
    information = rotation @ np.linalg.inv(covariance) @ rotation.T
    # The tree that the graph's poses begin with is the trajectory.
    return Edge(source, target, relative, information, relative[:3, 3], np.inf)


def relative_covariance(odometry: Odometry, target: int, source: int, travelled: float) -> Array:
    """Give the covariance of m in T_target_source exp(m), (6, 6), of two scans of an odometry.

    Errors of odometry add up: what the earlier scan's covariance has is taken away from the later one's.
    Where the map left a direction open, which makes both infinite, it is a share of the distance travelled.
    """
    relative = geometry.inverse(odometry.poses[target]) @ odometry.poses[source]
    to_source = geometry.adjoint(geometry.inverse(relative))
    travelled = max(travelled, odometry.voxel)
    unit = np.array([travelled] * 3 + [1.0] * 3)
    with np.errstate(invalid="ignore"):
        grown = odometry.covariances[source] - to_source @ odometry.covariances[target] @ to_source.T
    is_known = np.isfinite(grown)
    grown = np.where(is_known, grown, 0.0) * np.outer(unit, unit)
    is_open = ~is_known.diagonal()
    grown[is_open] = grown[:, is_open] = 0.0
    grown[is_open, is_open] = (_OPEN * travelled) ** 2
    values, vectors = np.linalg.eigh(grown)
    least = max(_SMALLEST * values.max(), (_SMALLEST * odometry.voxel) ** 2)
    bounded = (vectors * np.maximum(values, least)) @ vectors.T
    return np.asarray(bounded / np.outer(unit, unit))


def corrected(odometry: Odometry, submaps: Sequence[Submap], solution: Solution) -> tuple[Array, Array]:
    """Move all scans with their submaps; between two submaps the correction is interpolated along the path.

    Returns
    -------
    Poses (n, 4, 4) and covariances (n, 6, 6).
    """
    path = path_lengths(odometry.poses)
    world = odometry.poses[submaps[0].first]
    nodes = world @ solution.T_world_scan
    moves = [
        node @ geometry.inverse(odometry.poses[submap.first])
        for node, submap in zip(nodes, submaps, strict=True)
    ]
    poses, covariances = odometry.poses.copy(), odometry.covariances.copy()
    begins = odometry.covariances[submaps[0].first]
    for number, submap in enumerate(submaps):
        is_last = number == len(submaps) - 1
        following = moves[number] if is_last else moves[number + 1]
        step = geometry.log_pose(geometry.inverse(moves[number]) @ following)
        between = 1.0 if is_last else max(submaps[number + 1].path - submap.path, np.finfo(float).tiny)
        for scan in range(submap.first, submap.end):
            if not np.isfinite(poses[scan]).all():
                continue
            share = min((path[scan] - submap.path) / between, 1.0)
            poses[scan] = moves[number] @ geometry.exp_twist(share * step) @ odometry.poses[scan]
            to_scan = geometry.adjoint(geometry.inverse(odometry.poses[scan]) @ odometry.poses[submap.first])
            from_first = geometry.adjoint(geometry.inverse(nodes[number]) @ world)
            covariances[scan] = (
                to_scan @ (solution.covariance[number] + from_first @ begins @ from_first.T) @ to_scan.T
            )
            if scan != submap.first:
                covariances[scan] += relative_covariance(
                    odometry, submap.first, scan, path[scan] - submap.path
                )
    return poses, covariances
