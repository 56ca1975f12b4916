"""What `register` gives."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from surfsig import cloud_transforms, geometry
from surfsig.alignment.free_directions import FreeDirection
from surfsig.digits import position_text
from surfsig.point_cloud import PointCloud, coordinate_array

Array = NDArray[np.float64]

_BLUE, _ORANGE = (31, 119, 180), (255, 127, 14)


@dataclass(frozen=True, eq=False, repr=False)
class Registration:
    """How a source lies in a target, and how sure that is.

    Where nothing was found, the pose and its covariance are NaN.
    """

    T_target_source: Array
    """(4, 4): a point p of the source is at R p + t of the target."""
    covariance: Array
    """(6, 6), of the small twist (rotation vector in radians, then translation) in the target's axes, about
    `center`, that takes the given transform to the true one: T_true = T(center) exp(twist) T(-center)
    T_target_source, where T(c) is the translation by c. Large in the free directions."""
    center: Array
    """Middle of what overlaps, (3,), in the target's coordinates."""
    free_directions: list[FreeDirection]
    """Motions of the source, in the target's coordinates, that the overlap does not determine."""
    matches: int
    """Keypoints that were matched; 0 where a start was given."""
    inliers: int
    """Those of them that agree with the transform."""
    overlap: float
    """Share of the source's surface that lies on the target's, 0 to 1."""
    rms: float
    """Root mean square of the distances there, in the clouds' own unit."""
    radius: float
    """Of the patches that were matched; with a start, of the same size."""
    trusted: bool
    """Whether the pose is right, by what was seen: of 100 wrong ones at most 5 are trusted, of 100 right ones
    at least 95. False where a direction is free, as any pose along it is as good."""

    def __repr__(self) -> str:
        """Say what was found."""
        word = "trusted" if self.trusted else "not trusted"
        free = "".join(f", {direction}" for direction in self.free_directions)
        return (
            f"Registration({word}: {self.inliers} of {self.matches} matches agree, "
            f"overlap {self.overlap:.2f}, rms {self.rms:.3g}{free})"
        )

    def transform_points(self, points: ArrayLike) -> Array:
        """Move points of the source into the target.

        Parameters
        ----------
        points
            (n, 3), in the source's coordinates.

        Returns
        -------
        (n, 3) in the target's; NaN where no pose is known.

        Raises
        ------
        InvalidInputError
            If they are no points.
        """
        return geometry.transform_points(
            self.T_target_source, coordinate_array(points, "points").astype(np.float64)
        )

    def transform_cloud(self, cloud: PointCloud) -> PointCloud:
        """Move a cloud of the source into the target, its viewpoint and normals with it.

        Parameters
        ----------
        cloud
            In the source's coordinates.

        Returns
        -------
        A cloud of its own, with all fields.
        """
        return cloud_transforms.transform_cloud(self.T_target_source, cloud)

    def rows(self) -> list[tuple[str, str]]:
        """Describe the result for people.

        Returns
        -------
        Names and values: the pose, standard deviations, overlap, matches, free directions, trusted.
        """
        if not np.isfinite(self.T_target_source).all():
            return [("pose", f"none found ({self.matches} places look alike)"), ("trusted", "no")]
        rows = [
            ("T_target_source" if not line else "", "  ".join(f"{value: .6f}" for value in row))
            for line, row in enumerate(self.T_target_source)
        ]
        deviations = np.sqrt(np.diag(self.covariance))
        turns, shifts = (
            ", ".join(f"{value:.6g}" for value in values)
            for values in (np.degrees(deviations[:3]), deviations[3:])
        )
        rows += [
            ("standard deviation", f"{turns} degrees about x, y, z"),
            ("", f"{shifts} along them, at {position_text(self.center)}"),
            ("overlap", f"{self.overlap:.0%} of the source, rms {self.rms:.6g}"),
        ]
        if self.matches:
            rows.append(("matches", f"{self.inliers:,} of {self.matches:,} agree"))
        rows += [("free", str(direction)) for direction in self.free_directions]
        return [*rows, ("trusted", "yes" if self.trusted else "no")]

    def write_report(
        self, path: str | Path, source: PointCloud, target: PointCloud, *, title: str = "Registration"
    ) -> None:
        """Write one HTML page: both clouds before and after, in a view that turns, and what was found.

        The page needs no network. Of many points 60,000 are drawn.

        Parameters
        ----------
        path
            Where to write.
        source, target
            The clouds that were registered.
        title
            The page's.

        Raises
        ------
        InvalidInputError
            If Plotly is not installed (`pip install surfsig[report]`).
        """
        from surfsig.page import Group, write_page

        moving, still = "source", "target"
        groups = [
            Group(still, target.points, _BLUE),
            Group(moving, source.points, _ORANGE, state="before"),
            Group(moving, self.transform_points(source.points), _ORANGE, state="after"),
        ]
        trusted = "trusted" if self.trusted else "not trusted"
        text = f"The source before and after it was moved into the target: {trusted}."
        write_page(path, title, text, groups, ("", ""), self.rows())

    def values(self) -> dict[str, Any]:
        """Give everything as plain numbers, for JSON; None for what is not known.

        Returns
        -------
        By the names of the attributes; matrices row by row.
        """
        known = bool(np.isfinite(self.T_target_source).all())
        return {
            "T_target_source": self.T_target_source.tolist() if known else None,
            "covariance": self.covariance.tolist() if np.isfinite(self.covariance).all() else None,
            "center": self.center.tolist() if known else None,
            "free_directions": [free.values() for free in self.free_directions],
            "matches": self.matches,
            "inliers": self.inliers,
            "overlap": self.overlap,
            "rms": self.rms if np.isfinite(self.rms) else None,
            "radius": self.radius,
            "trusted": self.trusted,
        }
