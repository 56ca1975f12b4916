"""How space is cut into tiles: half-open boxes of about equally many points, leaves of a tree of cuts."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig.tiles.cell_counts import CellCounts

Node = int | tuple[int, float, Any, Any]
"""A tile's number; or an axis, where it is cut, and the nodes below the cut and from it on."""

_TAIL = 0.01
"""Share of the points at either end that the length of a tile does not count: outliers would decide it."""


@dataclass(frozen=True)
class Plan:
    """All of space, cut into tiles.

    A point belongs below a cut where its coordinate is less than it, and else above. So each point of space
    belongs to one tile, those on faces, edges and corners included; one with a coordinate that is no number,
    too.

    Attributes
    ----------
    root
        The tree.
    boxes
        (t, 2, 3) the lowest and the highest corner of each tile; the highest does not belong to it. Tiles at
        the rim reach to infinity.
    """

    root: Node
    boxes: NDArray[np.float64] = field(init=False)

    def __post_init__(self) -> None:
        found: dict[int, NDArray[np.float64]] = {}
        _collect(self.root, np.array([[-np.inf] * 3, [np.inf] * 3]), found)
        object.__setattr__(self, "boxes", np.array([found[tile] for tile in range(len(found))]))

    def __len__(self) -> int:
        """Count the tiles."""
        return len(self.boxes)

    def owners(self, points: NDArray[np.floating]) -> NDArray[np.int32]:
        """Tell which tile each of the points (n, 3) belongs to."""
        owners = np.empty(len(points), np.int32)
        _own(self.root, np.asarray(points), np.arange(len(points)), owners)
        return owners

    def touching(self, box: NDArray[np.float64]) -> list[int]:
        """Give the tiles that have space in common with a box (2, 3), both of whose corners belong to it."""
        meets = (self.boxes[:, 0] <= box[1]) & (self.boxes[:, 1] > box[0])
        # What is infinitely far away belongs to the tiles at the rim.
        return [int(tile) for tile in np.flatnonzero(meets.all(axis=1))]

    def to_json(self) -> Any:
        """Give the tree as nested lists."""
        return _listed(self.root)

    @classmethod
    def from_json(cls, nodes: Any) -> Plan:
        """Take it back."""
        return cls(_from_lists(nodes))


def planned(counts: CellCounts, most_points: int, tiles: int | None = None) -> Plan:
    """Cut space into tiles of about equally many points.

    Parameters
    ----------
    counts
        Where the points are.
    most_points
        Points of a tile; some tiles have a few percent more, as cuts lie between cells, and places that are
        denser than a cell can tell may have many more.
    tiles
        At least so many tiles.
    """
    wanted = max(-(-counts.total // max(most_points, 1)), tiles or 1, 1)
    numbers = iter(range(wanted))
    # These settle the exponent.
    keys, points = counts.keys, counts.counts
    if counts.exponent is None:
        return Plan(0)
    return Plan(_cut(keys, points, counts.exponent, int(wanted), numbers))


def _cut(keys: NDArray[np.int64], counts: NDArray[np.int64], exponent: int, tiles: int, numbers: Any) -> Node:
    """Cut the longest side so that both parts have points for whole numbers of tiles."""
    if tiles > 1:
        below = tiles // 2
        for axis in _longest_first(keys, counts):
            at = _place_of_cut(keys[:, axis], counts, below / tiles)
            if at is not None:
                low = keys[:, axis] < at
                left = _cut(keys[low], counts[low], exponent, below, numbers)
                right = _cut(keys[~low], counts[~low], exponent, tiles - below, numbers)
                return axis, float(np.ldexp(float(at), exponent)), left, right
    return int(next(numbers))


def _longest_first(keys: NDArray[np.int64], counts: NDArray[np.int64]) -> list[int]:
    lengths = []
    for axis in range(3):
        order = np.argsort(keys[:, axis], kind="stable")
        share = np.cumsum(counts[order]) / max(counts.sum(), 1)
        low, high = np.searchsorted(share, [_TAIL, 1 - _TAIL])
        values = keys[order, axis]
        lengths.append(int(values[min(high, len(values) - 1)] - values[low]) if len(values) else 0)
    return sorted(range(3), key=lambda axis: -lengths[axis])


def _place_of_cut(keys: NDArray[np.int64], counts: NDArray[np.int64], share: float) -> int | None:
    """Give the first cell above the cut that leaves about a share of the points below; None for one cell."""
    cells, which = np.unique(keys, return_inverse=True)
    if len(cells) < 2:
        return None
    below = np.cumsum(np.bincount(which.ravel(), weights=counts))[:-1]
    return int(cells[1 + int(np.argmin(np.abs(below - share * counts.sum())))])


def _collect(node: Node, box: NDArray[np.float64], found: dict[int, NDArray[np.float64]]) -> None:
    if isinstance(node, int):
        found[node] = box
        return
    axis, at, left, right = node
    for corner, child in ((1, left), (0, right)):
        part = box.copy()
        part[corner, axis] = at
        _collect(child, part, found)


def _own(
    node: Node, points: NDArray[np.floating], numbers: NDArray[np.int64], owners: NDArray[np.int32]
) -> None:
    if isinstance(node, int):
        owners[numbers] = node
        return
    if not len(numbers):
        return
    axis, at, left, right = node
    below = points[numbers, axis] < at
    _own(left, points, numbers[below], owners)
    _own(right, points, numbers[~below], owners)


def _listed(node: Node) -> Any:
    return node if isinstance(node, int) else [node[0], node[1], _listed(node[2]), _listed(node[3])]


def _from_lists(nodes: int | Sequence[Any]) -> Node:
    if isinstance(nodes, int):
        return nodes
    axis, at, left, right = nodes
    return int(axis), float(at), _from_lists(left), _from_lists(right)
