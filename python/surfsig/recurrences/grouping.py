"""From the scores of pairs to groups."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def groups_of(
    scores: Array, least: float, agree: Callable[[list[int], list[int], tuple[int, int]], bool]
) -> list[list[int]]:
    """Group what matches, the best matches first.

    Two views of an object need not show any surface in common, so a group hangs together by single matches;
    that a false one does not join two kinds is what `agree` is for.

    Parameters
    ----------
    scores
        (n, n), symmetric, 1 for certain and 0 for no match.
    least
        Score of a match.
    agree
        Given the members of two groups and the match between them, whether all members agree with it.

    Returns
    -------
    Members ascending, groups by their first ones; single ones are groups, too.
    """
    group_of = {number: [number] for number in range(len(scores))}
    rows, columns = np.triu_indices(len(scores), 1)
    for at in np.argsort(-scores[rows, columns], kind="stable"):
        i, j = int(rows[at]), int(columns[at])
        if scores[i, j] < least:
            break
        if group_of[i] is not group_of[j] and agree(group_of[i], group_of[j], (i, j)):
            together = sorted(group_of[i] + group_of[j])
            group_of |= dict.fromkeys(together, together)
    return [members for number, members in sorted(group_of.items()) if members[0] == number]


def best_match_tree(members: list[int], scores: Array) -> list[tuple[int, int]]:
    """Give the maximum spanning tree of members by their scores (Prim): its edges (from, to).

    The first member is the root; edges are in the order in which they reach new members.
    """
    edges: list[tuple[int, int]] = []
    reached = [members[0]]
    while len(reached) < len(members):
        left = [member for member in members if member not in reached]
        table = scores[np.ix_(reached, left)]
        row, column = np.unravel_index(int(table.argmax()), table.shape)
        edges.append((reached[int(row)], left[int(column)]))
        reached.append(left[int(column)])
    return edges
