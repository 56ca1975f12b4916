"""The tree of a pose graph's heaviest edges: poses to begin with, and what joins two scans."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import TYPE_CHECKING

import numpy as np
from numpy.typing import NDArray

from surfsig import geometry

if TYPE_CHECKING:
    from surfsig.alignment.pose_graph import Edge

Array = NDArray[np.float64]


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
