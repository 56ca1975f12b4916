"""Which pairs of scans the poses of all rest on: those that are trusted, or agree around loops."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Iterator, Sequence

import numpy as np
from numpy.typing import NDArray

from surfsig import geometry
from surfsig.alignment.pose_graph import Edge, Solution, solve
from surfsig.alignment.spanning_tree import edges_between, spanning_poses
from surfsig.point_cloud import PointCloud
from surfsig.registration.registration import Registration

Array = NDArray[np.float64]

_BY_LOOPS = {"few_matches", "little_overlap", "free_directions"}
"""Doubts about a pair that a loop takes away: they say that little speaks for it, not that anything speaks
against it."""
_LONGEST_LOOP = 4
"""Groups of scans that a loop joins, at most: rooms around a pillar or a wall are four. Chance closes longer
ones more often, and errors add up."""
_SAMPLE = 500
"""Points of a scan that tell by how much two poses differ."""
_SAME = 0.1
"""Part of the distance up to which two poses agree by which a pose may change before free space is measured
again: it takes seconds, and of most pairs the poses stay as they are when a pair elsewhere is left out."""


class PairSelection:
    """Scans and the poses between them.

    Parameters
    ----------
    scans
        All.
    found
        Of each pair the number of the source, that of the target, and what `register` found.
    agree
        Radii of a patch by which two poses move a scan's points apart, at most, to be the same.
    free_space
        Gives the share of points in free space, for the numbers of a source and a target and a pose.
    doubted_share
        Of them, from which on two scans cannot lie so.
    """

    def __init__(
        self,
        scans: Sequence[PointCloud],
        found: Sequence[tuple[int, int, Registration]],
        agree: float,
        free_space: Callable[[int, int, Array], float],
        doubted_share: float,
    ) -> None:
        self._agree = agree
        self._count = len(scans)
        self._found = found
        self._free_space = free_space
        self._doubted_share = doubted_share
        # What a pose may move a scan's points by before free space is measured again.
        self._same = _SAME * agree * min((result.radius for *_, result in found), default=0.0)
        # Of each source and target the pose at which free space was measured last, and its share.
        self._measured: dict[tuple[int, int], tuple[Array, float]] = {}
        rng = np.random.default_rng(1)
        self._samples = []
        for scan in scans:
            points = scan.points[np.isfinite(scan.points).all(axis=1)].astype(np.float64)
            chosen = rng.choice(len(points), min(_SAMPLE, len(points)), replace=False)
            self._samples.append(points[np.sort(chosen)])

    def solved(self) -> tuple[Solution, int, dict[int, float]]:
        """Give the poses, the reference, and of each pair that was used its residual."""
        used = {number for number, (*_, result) in enumerate(self._found) if result.trusted}
        refused: set[int] = set()
        while True:
            while confirmed := self._confirmed(used, refused):
                used |= confirmed
            reference = self._reference(used)
            numbers = sorted(used)
            solution = solve(self._count, reference, [self._edge(number) for number in numbers])
            # One pair at a time: a wrong one pulls at right ones, too.
            worst = self._most_off(numbers, solution)
            if worst is None:
                worst = self._most_refuted(numbers, solution)
            if worst is None:
                residuals = dict(zip(numbers, solution.residuals.tolist(), strict=True))
                return solution, reference, {n: r for n, r in residuals.items() if np.isfinite(r)}
            used.discard(worst)
            refused.add(worst)

    def _edge(self, number: int) -> Edge:
        source, target, result = self._found[number]
        return Edge(
            source, target, result.T_target_source, result.information, result.center, result.explained
        )

    def _reference(self, used: set[int]) -> int:
        """Of the largest group the scan that most pairs join; of equal ones the first."""
        edges = [self._edge(number) for number in sorted(used)]
        groups = [
            np.isfinite(spanning_poses(self._count, scan, edges)).all(axis=(1, 2)).sum()
            for scan in range(self._count)
        ]
        pairs = [sum(scan in (edge.source, edge.target) for edge in edges) for scan in range(self._count)]
        return max(range(self._count), key=lambda scan: (groups[scan], pairs[scan], -scan))

    def _most_off(self, numbers: list[int], solution: Solution) -> int | None:
        """Give the pair that disagrees most with the poses, if one does."""
        off = {
            number: self._disagreement(number, solution.T_world_scan)
            for number, residual in zip(numbers, solution.residuals, strict=True)
            if np.isfinite(residual)
        }
        worst = max(off, key=lambda number: off[number], default=None)
        return worst if worst is not None and off[worst] > 1.0 else None

    def _most_refuted(self, numbers: list[int], solution: Solution) -> int | None:
        """Give the pair that joins most scans of which one sensor looked through what the other saw.

        That is the one without which fewest of them are joined; of equal ones that on most chains between
        them, one that is not trusted first, and that of which less is explained.
        """
        edges = [self._edge(number) for number in numbers]
        conflicts = self._conflicts(edges, solution.T_world_scan)
        if not conflicts:
            return None
        chains = [edges_between(source, target, edges) for source, target in conflicts]

        def weight(position: int) -> tuple[int, int, bool, float]:
            others = [edge for number, edge in enumerate(edges) if number != position]
            parted = sum(not edges_between(source, target, others) for source, target in conflicts)
            result = self._found[numbers[position]][2]
            led = sum(position in chain for chain in chains)
            return parted, led, not result.trusted, -result.explained

        return numbers[max(sorted({position for chain in chains for position in chain}), key=weight)]

    def _conflicts(self, edges: list[Edge], poses: Array) -> list[tuple[int, int]]:
        """Give scans that no pair joins of which one sensor would have looked through what the other saw."""
        joined = np.flatnonzero(np.isfinite(poses).all(axis=(1, 2))).tolist()
        measured = {frozenset((edge.source, edge.target)) for edge in edges}
        found = []
        for target, source in itertools.combinations(joined, 2):
            implied = geometry.inverse(poses[target]) @ poses[source]
            is_measured = frozenset((source, target)) in measured
            if not is_measured and self._share(source, target, implied) > self._doubted_share:
                found.append((source, target))
        return found

    def _share(self, source: int, target: int, pose: Array) -> float:
        """Give the share of points in free space at a pose, or at one that is nearly the same."""
        last = self._measured.get((source, target))
        if last is None or self._apart(source, pose, last[0]) > self._same:
            last = pose, self._free_space(source, target, pose)
            self._measured[source, target] = last
        return last[1]

    def _confirmed(self, used: set[int], refused: set[int]) -> set[int]:
        """Give pairs that are not trusted, but close a loop, and that nothing speaks against."""
        edges = [self._edge(number) for number in sorted(used)]
        group, poses = self._groups(edges)
        # From group to group, and the pair's number; T_one_other.
        steps: dict[int, list[tuple[int, int, Array]]] = {}
        for number, (source, target, result) in enumerate(self._found):
            is_plausible = _BY_LOOPS.issuperset(result.doubts) and np.isfinite(result.T_target_source).all()
            if number in used or number in refused or not is_plausible:
                continue
            between = poses[target] @ result.T_target_source @ geometry.inverse(poses[source])
            steps.setdefault(group[target], []).append((group[source], number, between))
            steps.setdefault(group[source], []).append((group[target], number, geometry.inverse(between)))
        loops = [loop for first in steps for loop in self._loops(first, first, [], np.eye(4), steps, poses)]
        # The shortest first: what it joins, others must agree with.
        return set(min(loops, key=lambda loop: (len(loop), sorted(loop)), default=()))

    def _loops(
        self,
        first: int,
        last: int,
        numbers: list[int],
        chained: Array,
        steps: dict[int, list[tuple[int, int, Array]]],
        poses: Array,
    ) -> Iterator[list[int]]:
        """Go on from group to group, and give the pairs of chains that come back to where they began."""
        for other, number, between in steps[last]:
            if number in numbers or other < first or other == last != first:
                continue
            chain, pose = [*numbers, number], chained @ between
            if other == first:
                if self._closes(chain, pose, first, poses):
                    yield chain
            elif len(chain) < _LONGEST_LOOP:
                yield from self._loops(first, other, chain, pose, steps, poses)

    def _closes(self, chain: list[int], pose: Array, scan: int, poses: Array) -> bool:
        """Say whether a chain gives a pose of a group to itself that is as good as none, by one scan."""
        radius = min(self._found[number][2].radius for number in chain)
        return self._apart(scan, pose @ poses[scan], poses[scan]) <= self._agree * radius

    def _groups(self, edges: list[Edge]) -> tuple[list[int], Array]:
        """Give of each scan the first one of its group, and its pose there."""
        group, poses = [-1] * self._count, np.tile(np.eye(4), (self._count, 1, 1))
        for first in range(self._count):
            if group[first] < 0:
                chained = spanning_poses(self._count, first, edges)
                for scan in np.flatnonzero(np.isfinite(chained).all(axis=(1, 2))).tolist():
                    group[scan], poses[scan] = first, chained[scan]
        return group, poses

    def _disagreement(self, number: int, poses: Array) -> float:
        """Say by how much a pair disagrees with the poses, 1 where it is left out."""
        source, target, result = self._found[number]
        implied = geometry.inverse(poses[target]) @ poses[source]
        return self._apart(source, implied, result.T_target_source) / (self._agree * result.radius)

    def _apart(self, scan: int, one: Array, other: Array) -> float:
        """Give the root mean square of the distances between a scan's points after either pose."""
        off = geometry.transform_points(one, self._samples[scan]) - geometry.transform_points(
            other, self._samples[scan]
        )
        return float(np.sqrt((off**2).sum(axis=1).mean()))
