"""Points by which the core tells how finely a cloud is stored, and how far its neighbours are."""

from __future__ import annotations

from collections import defaultdict
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from surfsig import _surfsig
from surfsig.files.joined import joined
from surfsig.point_cloud import PointCloud, finite_rows
from surfsig.tiles.survey import Survey


@dataclass(frozen=True)
class WholeFacts:
    """What is known of the whole cloud.

    Attributes
    ----------
    count, finite
        All points, and those whose coordinates are finite.
    bounds
        (2, 3), the lowest and the highest finite coordinates.
    single_precision, lattice
        In which steps coordinates come (`surfsig.curvature.WholeCloud`).
    places
        (m, 3), where it is looked how far neighbours are.
    """

    count: int
    finite: int
    bounds: NDArray[np.float64]
    single_precision: bool
    lattice: tuple[float, float, float]
    places: NDArray[np.float64]

    @property
    def largest(self) -> float:
        """The largest coordinate, without its sign."""
        return float(np.abs(self.bounds).max()) if self.finite else 0.0

    def without_rim(self, box: NDArray[np.float64]) -> NDArray[np.float64]:
        """Give a box (2, 3) that reaches to infinity where it ends beyond all points."""
        opened = box.copy()
        opened[0, box[0] <= self.bounds[0]] = -np.inf
        opened[1, box[1] >= self.bounds[1]] = np.inf
        return opened

    def to_json(self) -> dict[str, Any]:
        """Give everything as lists and numbers."""
        return {
            "count": self.count,
            "finite": self.finite,
            "bounds": self.bounds.tolist() if self.finite else None,
            "single_precision": self.single_precision,
            "lattice": list(self.lattice),
            "places": self.places.tolist(),
        }

    @classmethod
    def from_json(cls, values: dict[str, Any]) -> WholeFacts:
        """Take it back."""
        bounds = np.array(values["bounds"] or [[np.inf] * 3, [-np.inf] * 3])
        x, y, z = values["lattice"]
        places = np.array(values["places"], np.float64).reshape(-1, 3)
        return cls(values["count"], values["finite"], bounds, values["single_precision"], (x, y, z), places)


class Sampling:
    """Takes points from blocks, by their numbers, as the core takes them from a whole cloud.

    Parameters
    ----------
    count, finite
        Points of the whole cloud, and those whose coordinates are finite.
    """

    def __init__(self, count: int, finite: int) -> None:
        self._numbers = np.arange(0, count, max(-(-count // _surfsig.RESOLUTION_SAMPLES), 1))
        self._wanted = np.array(_surfsig.sampled_numbers(finite), np.int64)
        self._sorted = np.unique(self._wanted)
        self._offsets: defaultdict[int, list[NDArray[Any]]] = defaultdict(list)
        self._places: list[NDArray[np.float64]] = [np.empty((0, 3))]

    def wants(self, first: int, last: int) -> bool:
        """Tell whether any of the points with these numbers is taken, where all are finite."""
        return any(
            np.searchsorted(numbers, first) < np.searchsorted(numbers, last)
            for numbers in (self._numbers, self._sorted)
        )

    def take(
        self, file: int, cloud: PointCloud, points: NDArray[np.float64], first: int, first_finite: int
    ) -> int:
        """Look at a block, and count its finite points.

        Parameters
        ----------
        file
            Its file.
        cloud, points
            Its points, and their true coordinates. Blocks come in the order of the input.
        first, first_finite
            Points before it, and those with finite coordinates.
        """
        start, stop = np.searchsorted(self._numbers, [first, first + len(cloud)])
        self._offsets[file].append(cloud.offsets[self._numbers[start:stop] - first])
        finite = finite_rows(points)
        count = int(finite.sum())
        start, stop = np.searchsorted(self._sorted, [first_finite, first_finite + count])
        if start < stop:
            there = points if count == len(points) else points[finite]
            self._places.append(there[self._sorted[start:stop] - first_finite])
        return count

    def facts(self, survey: Survey) -> WholeFacts:
        """Give what follows from all blocks, once `survey` has the heads of all files."""
        clouds = [
            PointCloud(np.concatenate([head.sample.offsets[:0], *self._offsets[file]]), head.sample.origin)
            for file, head in enumerate(survey.heads)
        ]
        whole = joined(clouds, "")
        single, lattice = _surfsig.coordinate_resolution(whole.offsets, origin=whole.origin.tolist())
        candidates = np.concatenate(self._places)[np.searchsorted(self._sorted, self._wanted)]
        places = _surfsig.different_places(np.ascontiguousarray(candidates))
        return WholeFacts(
            survey.count,
            survey.finite,
            np.array([survey.lowest, survey.highest]),
            single,
            (lattice[0], lattice[1], lattice[2]),
            np.array(places, np.float64).reshape(-1, 3),
        )
