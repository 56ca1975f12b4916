"""Many scans of one place: all pairs, a pose graph, one consistent set of poses."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig._surfsig import RegistrationSettings
from surfsig.arguments import progress_callback
from surfsig.cloud_transforms import transform_cloud
from surfsig.digits import finite_rows
from surfsig.errors import InvalidInputError
from surfsig.files.joined import joined
from surfsig.point_cloud import PointCloud
from surfsig.registration.pair_selection import PairSelection
from surfsig.registration.registration import Registration
from surfsig.registration.search import free_space_share, register

Array = NDArray[np.float64]


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
    """Whether the poses of all scans rest on it: it is trusted, or closes a loop, and agrees with the
    others."""
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
    join, too, where they close a loop of at most four groups. A pose graph then makes one consistent set of
    poses of the largest group (robust least squares: SciPy). Left out are pairs that disagree with it, and
    those by which one sensor would have looked through what another one saw (Huber and Hebert, Fully
    automatic registration of multiple 3D data sets, 2003).

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
    limits = settings or RegistrationSettings()

    def free_space(source: int, target: int, pose: Array) -> float:
        return free_space_share(
            scans[source], scans[target], pose, radius=radius, settings=settings, threads=threads
        )

    # Within that many radii of a patch matches agree with a pose: poses that differ by less are the same.
    selection = PairSelection(
        scans, found, limits.consensus_max_distance, free_space, limits.doubted_free_space
    )
    solution, reference, used = selection.solved()
    pairs = [
        RegisteredPair(source, target, result, number in used, float(used.get(number, np.nan)))
        for number, (source, target, result) in enumerate(found)
    ]
    return MultiwayRegistration(labels, reference, solution.T_world_scan, solution.covariance, pairs)
