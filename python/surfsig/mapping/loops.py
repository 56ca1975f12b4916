"""`close_loops`: places that were seen before take the drift out of a trajectory.

Short parts of the trajectory become submaps. Submaps that lie near each other, but far apart along the path,
are registered as any two scans are (`surfsig.register`); a pose that is trusted is an edge of a pose graph,
beside those between neighbours, which are the odometry's own.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any

import numpy as np

from surfsig._surfsig import RegistrationSettings
from surfsig.arguments import progress_callback
from surfsig.errors import InvalidInputError
from surfsig.mapping.correction import corrected, odometry_edge
from surfsig.mapping.fusion import Scans, clouds_of
from surfsig.mapping.submaps import Array, Submap, submaps_of
from surfsig.odometry import Odometry
from surfsig.registration import Registration, register
from surfsig.registration.pose_graph import Edge, Solution, solve

_DRIFT = 0.03
"""Error of position over the distance travelled up to which submaps are taken to see the same place: odometry
with a badly calibrated sensor drifts by 0.5 to 1 %."""
_APART = 3.0
"""Lengths of a submap, along the path, within which nothing is a loop: such submaps see the same anyway."""
_NEAREST = 2
"""Earlier submaps that each is registered with, at most."""
_LARGEST_RESIDUAL = 5.0
"""Root of a loop's squared residual over its covariance, a sixth of it, above which it is left out."""


@dataclass(frozen=True, eq=False)
class Loop:
    """A place that the sensor saw twice."""

    earlier: int
    """Number of a scan when it was there first."""
    later: int
    """Number of a scan when it was there again."""
    T_earlier_later: Array
    """(4, 4): the later scan's pose in the earlier one's frame, as registered."""
    used: bool
    """Whether the poses rest on it: it is trusted, and agrees with the others."""
    residual: float
    """Root of its squared residual over its covariance, a sixth of it, after all poses were fitted; NaN where
    it was not used."""
    registration: Registration
    """What `register` found of the surroundings of both."""

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON; None for what is not known.

        Returns
        -------
        The scans' numbers, whether it is used, its residual, and by their names what was found.
        """
        residual = self.residual if np.isfinite(self.residual) else None
        scans = {"earlier": self.earlier, "later": self.later, "used": self.used, "residual": residual}
        return scans | self.registration.values()


@dataclass(frozen=True, eq=False, repr=False)
class LoopClosure:
    """A trajectory that was corrected where it comes back."""

    odometry: Odometry
    """The same scans with corrected poses and covariances."""
    loops: list[Loop]
    """All that were tried."""

    def __repr__(self) -> str:
        """Say what was found."""
        return f"LoopClosure({len(self.odometry)} scans, {self.used} of {len(self.loops)} loops used)"

    @property
    def used(self) -> int:
        """Number of the loops on which the poses rest."""
        return sum(loop.used for loop in self.loops)


def close_loops(
    scans: Scans,
    odometry: Odometry,
    *,
    settings: RegistrationSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> LoopClosure:
    """Correct a trajectory by places that the sensor saw before.

    Parameters
    ----------
    scans
        Those of which the odometry is, in the same order; they are read once more.
    odometry
        What `estimate_odometry` gives.
    settings
        Of the registration of two places, for experts.
    threads
        Number of threads; all cores by default. The result is the same.
    progress
        Called with the number of loops tried and their total.

    Returns
    -------
    LoopClosure
        Corrected poses; those of the odometry where no loop is found.

    Raises
    ------
    InvalidInputError
        If there is not one scan for each pose, or the scans can be walked through only once.
    """
    if isinstance(scans, Iterator):
        raise InvalidInputError("scans must be a list, a folder or a sequence, for they are read again")
    known = np.flatnonzero(np.isfinite(odometry.poses).all(axis=(1, 2)))
    if len(known) < 2:
        return LoopClosure(odometry, [])
    submaps = submaps_of(clouds_of(scans), odometry.poses, odometry.voxel)
    pairs = list(_candidates(submaps, odometry.poses))
    tell = progress_callback(progress)
    tried = []
    for number, (earlier, later) in enumerate(pairs):
        found = register(submaps[later].cloud, submaps[earlier].cloud, settings=settings, threads=threads)
        tried.append((earlier, later, found))
        if tell is not None:
            tell(number + 1, len(pairs))
    solution, residuals = _solved(submaps, odometry, tried)
    loops = [
        Loop(
            submaps[earlier].first,
            submaps[later].first,
            found.T_target_source,
            number in residuals,
            residuals.get(number, float("nan")),
            found,
        )
        for number, (earlier, later, found) in enumerate(tried)
    ]
    if not residuals:
        return LoopClosure(odometry, loops)
    poses, covariances = corrected(odometry, submaps, solution)
    return LoopClosure(replace(odometry, poses=poses, covariances=covariances), loops)


def _candidates(submaps: Sequence[Submap], poses: Array) -> Iterator[tuple[int, int]]:
    """Give pairs of submaps, the earlier one first, that may have seen the same at different times."""
    places = np.array([poses[submap.first, :3, 3] for submap in submaps])
    for later, submap in enumerate(submaps):
        near = []
        for earlier, other in enumerate(submaps[:later]):
            length, travelled = max(submap.length, other.length), submap.path - other.path
            distance = float(np.linalg.norm(places[later] - places[earlier]))
            if travelled > _APART * length and distance < length + _DRIFT * travelled:
                near.append((distance, earlier))
        for _, earlier in sorted(near)[:_NEAREST]:
            yield earlier, later


def _solved(
    submaps: Sequence[Submap], odometry: Odometry, tried: Sequence[tuple[int, int, Registration]]
) -> tuple[Solution, dict[int, float]]:
    """Fit the submaps' poses to the odometry and to the loops that agree; of these the residuals."""
    along = [
        replace(
            odometry_edge(odometry, one.first, next_.first, next_.path - one.path), source=n + 1, target=n
        )
        for n, (one, next_) in enumerate(pairwise(submaps))
    ]
    used = [number for number, (*_, found) in enumerate(tried) if found.trusted]
    while True:
        closing = [
            Edge(later, earlier, found.T_target_source, found.information, found.center, 0.0)
            for earlier, later, found in (tried[number] for number in used)
        ]
        solution = solve(len(submaps), 0, along + closing)
        residuals = dict(zip(used, solution.residuals[len(along) :].tolist(), strict=True))
        worst = max(used, key=lambda number: residuals[number], default=None)
        if worst is None or residuals[worst] <= _LARGEST_RESIDUAL:
            return solution, residuals
        # One at a time: a wrong one pulls at right ones, too.
        used.remove(worst)
