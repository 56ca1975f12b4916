"""From the scores of pairs to groups."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray
from scipy.cluster.hierarchy import fcluster, linkage
from scipy.spatial.distance import squareform

Array = NDArray[np.float64]


def groups_of(scores: Array, least: float) -> list[list[int]]:
    """Group what matches: average linkage, so that one false match does not join two kinds.

    Parameters
    ----------
    scores
        (n, n), symmetric, 1 for certain and 0 for no match.
    least
        Average score between the members of a group.

    Returns
    -------
    Members ascending, groups by their first ones; single ones are groups, too.
    """
    count = len(scores)
    if count < 2:
        return [[number] for number in range(count)]
    distances = 1.0 - scores
    np.fill_diagonal(distances, 0.0)
    tree = linkage(squareform(distances, checks=False), method="average")
    label = fcluster(tree, 1.0 - least, criterion="distance")
    groups = [np.flatnonzero(label == value).tolist() for value in np.unique(label)]
    return sorted(groups, key=lambda members: int(members[0]))


def ways_from_first(members: list[int], scores: Array) -> list[tuple[int, int]]:
    """Give the steps (from, to) that reach all members from the first over the best matches.

    A maximum spanning tree, in the order in which members are reached.
    """
    steps: list[tuple[int, int]] = []
    reached = [members[0]]
    while len(reached) < len(members):
        left = [member for member in members if member not in reached]
        table = scores[np.ix_(reached, left)]
        row, column = np.unravel_index(int(table.argmax()), table.shape)
        steps.append((reached[int(row)], left[int(column)]))
        reached.append(left[int(column)])
    return steps
