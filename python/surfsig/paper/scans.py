"""Table III's acquisitions, scanned by the simulated scanner and fitted: numbers, no clouds."""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from ..curvature import extract
from ..defaults import Axes
from ..point_cloud import PointCloud
from ..simulate import Hits, Jitter, Scanner, Scene, paper_acquisition
from ..simulate.acquisitions import Acquisition, Poses
from ..simulate.poses import Array
from .printed import SIDE, TABLE_III


@dataclass(frozen=True)
class Fit:
    """How to fit: the axes, and the radius of the ball in metres.

    The ball and the frame's patch are two things. The paper ties them (the ball's diameter is the patch's
    side); a smaller ball keeps the paraboloid's bias small on a sphere that is not large against the patch.
    """

    axes: Axes
    radius: float = SIDE / 2

    @property
    def label(self) -> str:
        """For headings."""
        return f"{self.axes}'s axes, {self.radius * 1000:.0f} mm ball"


#: The paper's way; the same ball in the surface's own axes; and half of it.
PAPER = Fit("sensor")
OWN = Fit("surface")
OWN_HALF = Fit("surface", SIDE / 4)


@dataclass(frozen=True, eq=False)
class Fits:
    """Fits of one kind at the patches of many scans: s draws of the twenty acquisitions.

    Attributes
    ----------
    surfaces : (s, 20, 6) ndarray
        a, b, c, d, e, f of eq. (5) in metres about the patch's centre. In the surface's own axes, the
        paraboloid of k1 and k2: a = k1 / 2, b = k2 / 2, and the rest 0.
    k1, k2 : (s, 20) ndarray
        Principal curvatures at the patch's centre, per metre.
    count : (s, 20) ndarray
        Points in the ball.
    status : (s, 20) ndarray of int
        `Status` of the fit.
    """

    surfaces: Array
    k1: Array
    k2: Array
    count: npt.NDArray[np.int64]
    status: npt.NDArray[np.int64]


def scan_and_fit(
    fits: Sequence[Fit],
    seeds: Sequence[int],
    *,
    poses: Poses,
    jitter: Jitter | None = None,
    done: Callable[[], object] = lambda: None,
) -> dict[Fit, Fits]:
    """Scan the twenty acquisitions once per seed, and fit each patch in every way asked for.

    Parameters
    ----------
    fits
        How to fit.
    seeds
        Of noise and poses; see :func:`surfsig.simulate.paper_acquisition`.
    poses, jitter
        As there.
    done
        Called after each scan.

    Returns
    -------
    dict
        For each of `fits`, the fits of len(seeds) x 20 patches.
    """
    numbers = range(1, len(TABLE_III) + 1)
    scanners = {number: _StillScanner() if poses == "stated" else Scanner() for number in numbers}

    def one(job: tuple[int, int]) -> list[Array]:
        seed, number = job
        scanned = paper_acquisition(number, seed, poses=poses, jitter=jitter, scanner=scanners[number])
        rows = fit_rows(scanned, fits)
        done()
        return rows

    jobs = [(seed, number) for seed in seeds for number in numbers]
    # NumPy works outside Python's lock, so threads share the scans well.
    with ThreadPoolExecutor(os.cpu_count()) as pool:
        rows = np.array(list(pool.map(one, jobs))).reshape(len(seeds), len(TABLE_III), len(fits), -1)
    return {
        fit: Fits(
            surfaces=rows[:, :, i, :6],
            k1=rows[:, :, i, 6],
            k2=rows[:, :, i, 7],
            count=rows[:, :, i, 8].astype(np.int64),
            status=rows[:, :, i, 9].astype(np.int64),
        )
        for i, fit in enumerate(fits)
    }


class _StillScanner(Scanner):
    """Looks at one scene only, and remembers what it sees: repeated scans then differ by noise alone."""

    def lit_and_seen(self, scene: Scene) -> tuple[Array, Hits]:
        seen: tuple[Array, Hits] | None = self.__dict__.get("seen")
        if seen is None:
            seen = super().lit_and_seen(scene)
            self.__dict__["seen"] = seen
        return seen


def patch_cloud(acquisition: Acquisition) -> PointCloud:
    """Return the points about the patch that any fit may need: far fewer than the scan has."""
    cloud = acquisition.cloud
    near = np.abs(cloud.points - acquisition.center).max(axis=1) <= 0.51 * SIDE
    return PointCloud(np.ascontiguousarray(cloud.offsets[near]), viewpoint=cloud.viewpoint)


def fit_rows(acquisition: Acquisition, fits: Sequence[Fit]) -> list[Array]:
    """Fit one patch in several ways: for each a, b, c, d, e, f, k1, k2, count and status, (10,)."""
    cloud, rows = patch_cloud(acquisition), []
    for fit in fits:
        s = extract(cloud, fit.radius, axes=fit.axes, at=acquisition.center[None], threads=1)
        k1, k2 = float(s.k1[0]), float(s.k2[0])
        own = [k1 / 2, k2 / 2, 0.0, 0.0, 0.0, 0.0]
        surface = own if s.coefficients is None else s.coefficients[0].tolist()
        rows.append(np.array([*surface, k1, k2, s.count[0], s.status[0]], dtype=np.float64))
    return rows
