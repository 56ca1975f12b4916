"""Many scans of one place: all pairs, a pose graph, one consistent set of poses."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import geometry
from surfsig._surfsig import RegistrationSettings
from surfsig.arguments import progress_callback
from surfsig.cloud_transforms import transform_cloud
from surfsig.digits import finite_rows
from surfsig.errors import InvalidInputError
from surfsig.files.joined import joined
from surfsig.point_cloud import PointCloud
from surfsig.registration.pose_graph import Edge, Solution, solve, spanning_poses
from surfsig.registration.registration import Registration
from surfsig.registration.search import register

Array = NDArray[np.float64]

_BY_LOOPS = {"few_matches", "little_overlap", "free_directions"}
"""Doubts about a pair that a loop of three takes away: they say that little speaks for it, not that anything
speaks against it."""
_SAMPLE = 500
"""Points of a scan that tell by how much two poses differ."""


@dataclass(frozen=True, eq=False)
class RegisteredPair:
    """Two of the scans."""

    source: int
    """Number of the scan that was moved."""
    target: int
    """Number of the scan that it was moved into."""
    registration: Registration
    """What `register` found."""
    used: bool
    """Whether the poses of all scans rest on it: it is trusted, or closes a loop of three, and agrees with
    the others."""
    residual: float
    """Root of its squared residual over its covariance, a sixth of it, after all poses were fitted; NaN where
    it was not used."""


@dataclass(frozen=True, eq=False, repr=False)
class MultiwayRegistration:
    """Poses of all scans that belong together."""

    names: list[str]
    """Of the scans."""
    reference: int
    """The scan in whose coordinates the poses are: of the largest group, the one that most pairs join."""
    T_reference_scan: Array
    """(n, 4, 4): a point p of scan i is at R p + t of the reference; NaN where a scan does not belong."""
    covariance: Array
    """(n, 6, 6), of the twist (rotation vector in radians, then translation) of each scan about its own
    origin in its own axes; 0 for the reference, NaN where a scan does not belong, infinite in the entries of
    motions that no pair determines."""
    pairs: list[RegisteredPair]
    """All that were tried."""

    @property
    def belongs(self) -> NDArray[np.bool_]:
        """(n,), whether a scan has a pose."""
        return np.asarray(np.isfinite(self.T_reference_scan).all(axis=(1, 2)))

    def __repr__(self) -> str:
        """Say what was found."""
        used = sum(pair.used for pair in self.pairs)
        return (
            f"MultiwayRegistration({int(self.belongs.sum())} of {len(self.names)} scans belong together, "
            f"by {used} of {len(self.pairs)} pairs)"
        )

    def merged(self, clouds: Sequence[PointCloud | ArrayLike]) -> PointCloud:
        """Join the scans that belong together, in the reference's coordinates.

        Parameters
        ----------
        clouds
            The same scans in the same order.

        Returns
        -------
        PointCloud
            With the field ``file``, the number of each point's scan, the fields that all have, and the
            viewpoints if every scan has its own.

        Raises
        ------
        InvalidInputError
            If there is not one cloud for each pose.
        """
        if len(clouds) != len(self.names):
            raise InvalidInputError(f"there are {len(self.names)} scans, but {len(clouds)} clouds")
        numbers = np.flatnonzero(self.belongs)
        moved = [
            transform_cloud(self.T_reference_scan[number], PointCloud.of(clouds[number]))
            for number in numbers.tolist()
        ]
        cloud = joined(moved, "the scans that belong together")
        scan = numbers[cloud.fields["file"]] if len(moved) > 1 else np.full(len(cloud), numbers[0])
        return replace(cloud, fields={**cloud.fields, "file": scan.astype(np.uint16)})

    def rows(self) -> list[tuple[str, ...]]:
        """Describe each scan for people.

        Returns
        -------
        Name, place, standard deviation of the place, and how many pairs hold it, of each scan.
        """
        rows: list[tuple[str, ...]] = []
        for number, name in enumerate(self.names):
            held = sum(pair.used and number in (pair.source, pair.target) for pair in self.pairs)
            if not self.belongs[number]:
                rows.append((name, "does not belong", "", "0"))
                continue
            place = ", ".join(f"{value:.6g}" for value in self.T_reference_scan[number, :3, 3])
            deviation = np.sqrt(np.diag(self.covariance[number])[3:].max())
            rows.append(
                (name, place, "reference" if number == self.reference else f"{deviation:.2g}", str(held))
            )
        return rows

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON; None for what is not known.

        Returns
        -------
        The reference, of each scan its name, pose and covariance, and of each pair what was found.
        """
        scans = [
            {
                "name": name,
                "T_reference_scan": pose.tolist() if belongs else None,
                "covariance": finite_rows(covariance) if belongs else None,
            }
            for name, pose, covariance, belongs in zip(
                self.names, self.T_reference_scan, self.covariance, self.belongs, strict=True
            )
        ]
        pairs = [
            {
                "source": self.names[pair.source],
                "target": self.names[pair.target],
                "used": pair.used,
                "residual": pair.residual if np.isfinite(pair.residual) else None,
            }
            | pair.registration.values()
            for pair in self.pairs
        ]
        return {"reference": self.names[self.reference], "scans": scans, "pairs": pairs}


def register_multiway(
    clouds: Sequence[PointCloud | ArrayLike],
    *,
    names: Sequence[str] | None = None,
    radius: float | None = None,
    settings: RegistrationSettings | None = None,
    threads: int | None = None,
    progress: Callable[[int, int], object] | None = None,
) -> MultiwayRegistration:
    """Find how many scans of one place lie to each other, without a parameter.

    All pairs are registered (`register`). Trusted ones join scans to groups; pairs that are not trusted
    join, too, where three of them close a loop. A pose graph then makes one
    consistent set of poses of the largest group (robust least squares: SciPy), and pairs that disagree with
    it are left out.

    Parameters
    ----------
    clouds
        At least two; `PointCloud`, arrays (n, 3), or any other that `PointCloud.of` takes; in one unit.
    names
        Of the scans, for people; by default their numbers.
    radius, settings, threads
        As for `register`.
    progress
        Called with the number of pairs done and their total.

    Returns
    -------
    MultiwayRegistration

    Raises
    ------
    InvalidInputError
        If an argument has no meaning.
    """
    scans = [PointCloud.of(cloud) for cloud in clouds]
    if len(scans) < 2:
        raise InvalidInputError(f"at least two scans are registered, and there are {len(scans)}")
    labels = [str(number) for number in range(len(scans))] if names is None else [str(name) for name in names]
    if len(labels) != len(scans):
        raise InvalidInputError(f"there are {len(scans)} scans, but {len(labels)} names")
    report = progress_callback(progress)
    numbers = list(itertools.combinations(range(len(scans)), 2))
    found: list[tuple[int, int, Registration]] = []
    for target, source in numbers:
        result = register(scans[source], scans[target], radius=radius, settings=settings, threads=threads)
        found.append((source, target, result))
        if report is not None:
            report(len(found), len(numbers))
    graph = _Graph(scans, found, settings or RegistrationSettings())
    solution, reference, used = graph.solved()
    pairs = [
        RegisteredPair(source, target, result, number in used, float(used.get(number, np.nan)))
        for number, (source, target, result) in enumerate(found)
    ]
    return MultiwayRegistration(labels, reference, solution.T_world_scan, solution.covariance, pairs)


class _Graph:
    """Scans and the poses between them."""

    def __init__(
        self,
        scans: list[PointCloud],
        found: list[tuple[int, int, Registration]],
        settings: RegistrationSettings,
    ) -> None:
        # Within that many radii of a patch matches agree with a pose: poses that differ by less are the same.
        self._agree = settings.consensus_max_distance
        self.count = len(scans)
        self.found = found
        rng = np.random.default_rng(1)
        self.samples = []
        for scan in scans:
            points = scan.points[np.isfinite(scan.points).all(axis=1)].astype(np.float64)
            chosen = rng.choice(len(points), min(_SAMPLE, len(points)), replace=False)
            self.samples.append(points[np.sort(chosen)])

    def solved(self) -> tuple[Solution, int, dict[int, float]]:
        """Give the poses, the reference, and of each pair that was used its residual."""
        used = {number for number, (*_, result) in enumerate(self.found) if result.trusted}
        refused: set[int] = set()
        while True:
            used |= self._confirmed(used, refused)
            reference = self._reference(used)
            numbers = sorted(used)
            solution = solve(self.count, reference, [self._edge(number) for number in numbers])
            off = {
                number: self._disagreement(number, solution.T_world_scan)
                for number in numbers
                if np.isfinite(solution.residuals[numbers.index(number)])
            }
            worst = max(off, key=lambda number: off[number], default=None)
            if worst is None or off[worst] <= 1.0:
                residuals = dict(zip(numbers, solution.residuals.tolist(), strict=True))
                return solution, reference, {n: r for n, r in residuals.items() if np.isfinite(r)}
            # One pair at a time: a wrong one pulls at right ones, too.
            used.discard(worst)
            refused.add(worst)

    def _edge(self, number: int) -> Edge:
        source, target, result = self.found[number]
        return Edge(
            source, target, result.T_target_source, result.information, result.center, result.explained
        )

    def _reference(self, used: set[int]) -> int:
        """Of the largest group the scan that most pairs join; of equal ones the first."""
        edges = [self._edge(number) for number in sorted(used)]
        groups = [
            np.isfinite(spanning_poses(self.count, scan, edges)).all(axis=(1, 2)).sum()
            for scan in range(self.count)
        ]
        pairs = [sum(scan in (edge.source, edge.target) for edge in edges) for scan in range(self.count)]
        return max(range(self.count), key=lambda scan: (groups[scan], pairs[scan], -scan))

    def _confirmed(self, used: set[int], refused: set[int]) -> set[int]:
        """Give pairs that are not trusted, but close a loop of three, and that nothing speaks against."""
        pairs = {}
        for number, (source, target, result) in enumerate(self.found):
            if number in used or (number not in refused and _BY_LOOPS.issuperset(result.doubts)):
                pairs[target, source] = number
        confirmed = set()
        for first, second, third in itertools.combinations(range(self.count), 3):
            corners = ((first, second), (second, third), (first, third))
            if not all(corner in pairs for corner in corners):
                continue
            one, two, both = (self.found[pairs[corner]][2] for corner in corners)
            chained = one.T_target_source @ two.T_target_source
            if not np.isfinite(chained @ both.T_target_source).all():
                continue
            radius = min(one.radius, two.radius, both.radius)
            if self._apart(third, chained, both.T_target_source) <= self._agree * radius:
                confirmed |= {pairs[corner] for corner in corners}
        return confirmed

    def _disagreement(self, number: int, poses: Array) -> float:
        """Say by how much a pair disagrees with the poses, 1 where it is left out."""
        source, target, result = self.found[number]
        implied = geometry.inverse(poses[target]) @ poses[source]
        return self._apart(source, implied, result.T_target_source) / (self._agree * result.radius)

    def _apart(self, scan: int, one: Array, other: Array) -> float:
        """Give the root mean square of the distances between a scan's points after either pose."""
        off = geometry.transform_points(one, self.samples[scan]) - geometry.transform_points(
            other, self.samples[scan]
        )
        return float(np.sqrt((off**2).sum(axis=1).mean()))
